"""Sensors, meters and terminals that are wrong: the true building, told wrongly, against the model that knows how."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pandas as pd
import pytest
from numpy.typing import NDArray

from thermal import Case, Simulator, SymbolicModel, Telemetry, build_network, free_runs, replay_inputs, spin_up
from thermal.effects.catalogue import chosen
from thermal.effects.effect import ALIKE
from thermal.inputs.provider import InputProvider, telemetry_inputs
from thermal.inputs.signals import signal_values
from thermal.model.modal_runs import ModalRuns
from thermal.model.reduce import reduced_model
from thermal.model.step import EXACT
from thermal.units import AIR_HEAT_CAPACITY, air_density

FloatArray = NDArray[np.float64]
CaseOf = Callable[[str], Case]

AIR = air_density(690.0) * 1006.0  # J/m3/K
KINDS = ("plan", "table")


def true_building(case: Case, bias: dict[str, float]) -> Case:
    """What a building reports whose every physics is the model's, and whose sensors are off by a bias [K].

    Supply air and its heat are true; the zone sensors read too much, and so does whatever is reckoned from them.
    """
    drivers, inputs = telemetry_inputs(case), replay_inputs(case, build_network(case.building))
    plant = Simulator(case.building, step_seconds=case.step)
    flow, discharge = drivers.supply_flow, _discharge(case)
    zones = [plant.reset(inputs.zone[0], inputs.boundary[0])]
    power = drivers.heat - drivers.supply_heat
    for k in range(1, len(inputs)):
        # the metered heat is reckoned with the mean over the step, which it itself moves: a few rounds settle it
        saved, zone = plant.save_state(), zones[-1]
        for _ in range(60):
            plant.restore_state(saved)
            heat = power[k] + AIR_HEAT_CAPACITY * flow[k] * (discharge[k] - zone)
            zone, before = plant.step(heat, inputs.boundary[k], inputs.airflow[k]), zone
            if np.abs(zone - before).max() < 1e-13:
                break
        zones.append(zone)
    frame = case.telemetry.frame.copy()
    for k, name in enumerate(case.building.zone_names):
        frame[f"{name}/zone_air_temperature_sensor"] = np.array(zones)[:, k] + bias.get(name, 0.0)
    return replace(case, telemetry=Telemetry.from_frame(frame), judged=None)


def _discharge(case: Case) -> FloatArray:
    frame = case.telemetry.frame
    missing = pd.Series(0.0, index=frame.index)
    names = [f"VAV_{z}/discharge_air_temperature_sensor" for z in case.building.zone_names]
    return np.column_stack([frame.get(name, missing) for name in names])


@pytest.mark.parametrize("kind", KINDS)
def test_a_replay_with_biased_sensors_is_that_of_right_ones(lively_case: CaseOf, kind: str) -> None:
    # spin-up and free runs, of what right sensors say and of what biased ones do
    case, bias = lively_case(kind), {"A": 0.8, "B": -0.4}
    at, steps, runs = np.array([216, 300]), 72, []
    for off, ids in (({}, ()), (bias, ("sensor_bias",)), (bias, ())):
        told = true_building(case, off)
        network = build_network(told.building, effects=chosen(ids))
        values = {f"sensor_bias@{z}": b for z, b in off.items()} if ids else {}
        inputs, matrices = replay_inputs(told, network), SymbolicModel(network).matrices(network.values(values))
        states, _ = spin_up(matrices, inputs, 0, at)
        means, _ = free_runs(matrices, inputs, at, steps, states)
        runs.append(means - np.array([off.get(z, 0.0) for z in network.zones]))
    assert np.abs(runs[1] - runs[0]).max() < 8e-3  # all that differs is the uniform state before a spin-up
    assert np.abs(runs[2] - runs[0]).max() > 0.05


@pytest.mark.parametrize("kind", KINDS)
def test_a_step_with_a_biased_sensor_is_the_shifted_true_step(lively_case: CaseOf, kind: str) -> None:
    # states of the model are what sensors would say in the biased zones, and true elsewhere: no approximation at all
    case, bias = lively_case(kind), {"A": 0.8, "B": -0.4}
    told = true_building(case, bias)
    network = build_network(told.building, effects=chosen(["sensor_bias"]))
    inputs = replay_inputs(told, network)
    signals = signal_values(network.signals, telemetry_inputs(told))
    values = {f"sensor_bias@{z}": b for z, b in bias.items()}
    model = Simulator(told.building, values, step_seconds=told.step, effects=chosen(["sensor_bias"]))
    truth = Simulator(told.building, step_seconds=told.step)
    true_zone = inputs.zone - np.array([bias.get(z, 0.0) for z in network.zones])
    truth.reset(true_zone[0], inputs.boundary[0, : len(network.boundaries)])
    model.reset(inputs.zone[0], inputs.boundary[0, : len(network.boundaries)], signals[0])
    state = truth.save_state()
    shift = np.zeros(network.n_node)
    for zone, b in bias.items():
        shift[(network.zone == network.zones.index(zone)) & np.isin(network.kind, ["air", "mixing"])] = b
    state["states"] = state["states"] + shift
    model.restore_state(state)
    for k in range(1, 200):
        said = model.step(inputs.heat[k], inputs.boundary[k, : len(network.boundaries)], inputs.airflow[k], signals[k])
        assert np.abs(said - inputs.zone[k]).max() < 1e-9


def test_a_lagging_sensor_is_a_first_order_filter(lively_case: CaseOf) -> None:
    # T_s' = (T - T_s) / τ over the model's own air temperature, at fine steps
    case, minutes = lively_case("table"), 10.0
    plant = Simulator(
        case.building, {"sensor_lag": minutes}, step_seconds=5.0, scheme="tr_bdf2", effects=chosen({"sensor_lag": ALIKE})
    )
    plant.reset(np.array([293.15, 292.15]), np.array([273.15, 280.15]))
    sensor, air = [], []
    for k in range(720):
        plant.step(np.array([2000.0 if k < 360 else 0.0, 300.0]), np.array([273.15, 280.15]))
        sensor.append(plant.zone_temperatures)
        air.append(plant.network.observation @ plant.states)
    filtered, held = [], np.array(sensor[0])
    for before, after in pairwise(air):  # exact for an air temperature that is straight in a step
        left, slope, tau = np.exp(-5.0 / (60.0 * minutes)), (after - before) / 5.0, 60.0 * minutes
        held = after - slope * tau + (held - before + slope * tau) * left
        filtered.append(held)
    assert np.ptp(np.array(air)[:, 0]) > 1.0
    assert np.abs(np.array(filtered) - np.array(sensor)[1:]).max() < 2e-4
    # so little heat is in the sensor that the air does not feel it
    plain = Simulator(case.building, step_seconds=5.0, scheme="tr_bdf2")
    plain.reset(np.array([293.15, 292.15]), np.array([273.15, 280.15]))
    for k in range(720):
        plain.step(np.array([2000.0 if k < 360 else 0.0, 300.0]), np.array([273.15, 280.15]))
    assert np.abs(plain.zone_temperatures - air[-1]).max() < 2e-3


def test_hidden_mass_is_a_second_node(lively_case: CaseOf) -> None:
    # from the model's own air temperature: C_m T_m' = h A (T - T_m), to the second order of the scheme
    case = lively_case("table")
    values = {"hidden_heat_capacity@A": 5e4, "hidden_coupling": 3.0}
    plant = Simulator(case.building, values, step_seconds=20.0, scheme="tr_bdf2", effects=chosen(["hidden_mass"]))
    plant.reset(np.array([293.15, 293.15]), np.array([273.15, 280.15]))
    (node,) = np.flatnonzero((plant.network.kind == "hidden_mass") & (plant.network.zone == 0))
    mass, air = [plant.states[node]], [plant.zone_temperatures[0]]
    for _ in range(720):
        plant.step(np.array([1500.0, 0.0]), np.array([273.15, 280.15]))
        mass.append(plant.states[node])
        air.append(plant.zone_temperatures[0])
    tau, expected = 5e4 / 3.0, [mass[0]]
    for before, after in pairwise(air):
        slope = (after - before) / 20.0
        expected.append(after - slope * tau + (expected[-1] - before + slope * tau) * np.exp(-20.0 / tau))
    assert mass[-1] - mass[0] > 0.5
    assert np.abs(np.array(expected) - np.array(mass)).max() < 1e-4
    stored = 5e4 * 20.0  # J/K: capacity per floor area times 20 m2 of floor
    network = plant.network
    capacity = SymbolicModel(network).matrices(network.values(values)).capacity.diagonal()
    assert capacity[node] == pytest.approx(stored)


def signal_heat(
    case: Case, effect: str, zone: str, drivers: InputProvider | None = None, **values: float
) -> FloatArray:
    """Heat that an effect of signals alone brings to a zone at every stamp [W]."""
    network = build_network(case.building, effects=chosen([effect]))
    flow = SymbolicModel(network).matrices(network.values(values)).flow
    zero = SymbolicModel(network).matrices(network.start()).flow
    brought = -np.asarray((flow - zero)[:, network.n_node + len(network.boundaries) :].todense())
    mine = network.zone == network.zones.index(zone)
    signals = signal_values(network.signals, drivers or telemetry_inputs(case))
    return np.asarray(brought[mine].sum(axis=0)).ravel() @ signals.T


def test_a_window_that_is_seen_open(lively_case: CaseOf) -> None:
    # ρ c A ½ (0.001 v² + 0.0035 h |ΔT| + 0.01)^½ (T_out - T), h = 1 m, while it stands open
    case = lively_case("plan")
    drivers = telemetry_inputs(case)
    drivers.openings = np.zeros((len(case.stamps), len(drivers.zones)))
    drivers.openings[70:90, drivers.zones.index("A")] = 1.0
    difference = drivers.outdoor - drivers.usual[:, drivers.zones.index("A")]
    speed = 0.5 * np.sqrt(0.001 * drivers.wind**2 + 0.0035 * np.abs(difference) + 0.01)
    expected = air_density(690.0) * AIR_HEAT_CAPACITY * 0.7 * speed * difference
    expected[:70] = expected[90:] = 0.0
    areas = {"opened_window_area@A": 0.7, "opened_window_area@B": 0.7}
    assert signal_heat(case, "window_opening", "A", drivers, **areas) == pytest.approx(expected)
    assert signal_heat(case, "window_opening", "B", drivers, **areas) == pytest.approx(0.0 * expected)


def test_windows_that_people_open_on_mild_days(lively_case: CaseOf) -> None:
    # ρ c V n occ(t) m(T_out) (T_out - T), m from 0 at 12 to 1 at 22 degC; shut ones do nothing, wherever zones are
    case = lively_case("plan")
    network, rate = build_network(case.building, effects=chosen(["window_opening"])), {"window_opening_rate": 3.0}
    opened, shut = (SymbolicModel(network).matrices(v).flow for v in (network.values(rate), network.start()))
    assert not np.any((opened - shut)[:, : network.n_node + len(network.boundaries)].todense())
    drivers = telemetry_inputs(case)
    drivers.outdoor = np.linspace(280.0, 300.0, len(case.stamps))
    drivers.occupancy = np.arange(len(case.stamps)) % 7 / 6.0
    mild = np.clip((drivers.outdoor - 285.15) / 10.0, 0.0, 1.0)
    volume = network.anatomy.rooms["A"].volume
    difference = drivers.outdoor - drivers.usual[:, drivers.zones.index("A")]
    expected = air_density(690.0) * AIR_HEAT_CAPACITY * volume * 3.0 / 3600.0 * drivers.occupancy * mild * difference
    assert np.abs(expected).max() > 100.0
    assert signal_heat(case, "window_opening", "A", drivers, **rate) == pytest.approx(expected)


def test_a_heat_meter_that_reads_low(lively_case: CaseOf) -> None:
    case = lively_case("plan")
    heat = case.zone_heat()["B"].to_numpy()
    assert signal_heat(case, "flow_gain", "B", **{"flow_gain@B": 0.2}) == pytest.approx(0.2 * heat)
    assert signal_heat(case, "flow_gain", "A", **{"flow_gain@B": 0.2}) == pytest.approx(0.0 * heat)


def test_a_duct_loses_what_its_ntu_says(lively_case: CaseOf) -> None:
    # (1 - e^-NTU) of the heat above the room's own, of two laws: NTU constant, and growing as the flow falls. Exact at 0.1
    case = lively_case("plan")
    flow = case.telemetry.frame["VAV_B/supply_air_flowrate_sensor"].to_numpy()
    heat = case.zone_heat()["B"].to_numpy()
    for ntu, most in ((0.1, 1e-12), (0.3, 0.2)):
        local = ntu * np.quantile(flow, 0.99) / np.where(flow > 0.0, flow, np.inf)
        constant = np.where(flow > 0.0, ntu, 0.0)
        by_flow = 0.4
        exact = -(1.0 - by_flow) * (1.0 - np.exp(-constant)) * heat - by_flow * (1.0 - np.exp(-local)) * heat
        found = signal_heat(case, "duct_loss", "B", **{"duct_ntu@B": ntu, "duct_flow_dependence": by_flow})
        assert np.abs(found - exact).max() <= most * np.abs(exact).max() + 1e-9
    assert found.min() < -50.0


def test_an_electric_heater_has_no_duct(lively_case: CaseOf) -> None:
    assert (signal_heat(lively_case("table"), "duct_loss", "B", **{"duct_ntu@B": 0.2}) == 0.0).all()


def test_a_terminal_with_a_limit(lively_case: CaseOf) -> None:
    # exact at the knots, and between them the straight line from knot to knot
    case = lively_case("plan")
    heat = case.zone_heat()["A"].to_numpy()
    largest = np.quantile(np.abs(heat), 0.99)

    def limited(lost: float) -> FloatArray:
        return np.sign(heat) * np.minimum(np.abs(heat), (1.0 - lost) * largest) - heat

    whole = limited(0.0)  # the one percent of steps above what counts as the capacity stay as they are
    for lost in (0.1, 0.2, 0.5, 0.7):
        found = signal_heat(case, "capacity_limit", "A", **{"capacity_lost@A": lost})
        assert found == pytest.approx(limited(lost), abs=1e-9)
    between = signal_heat(case, "capacity_limit", "A", **{"capacity_lost@A": 0.3})
    assert between == pytest.approx((limited(0.2) + 2.0 * limited(0.35)) / 3.0, abs=1e-9)
    assert np.abs(between - limited(0.3)).max() < 0.06 * largest
    assert np.abs(whole).max() < 0.1 * largest


def test_a_valve_that_leaks_warms_the_air_that_flows(lively_case: CaseOf) -> None:
    case = lively_case("plan")
    flow = case.telemetry.frame["VAV_A/supply_air_flowrate_sensor"].to_numpy()
    expected = 8.0 * 10.5 * (flow > 0.02 * flow.max())
    assert 0.0 < np.count_nonzero(expected) < len(flow)
    assert signal_heat(case, "valve_leak", "A", **{"valve_leak@A": 8.0}) == pytest.approx(expected)


def test_clocks_that_are_off_move_heat_and_weather(lively_case: CaseOf) -> None:
    # the first order of q(t - τ): halving τ leaves a quarter of what it misses of a smooth signal
    case = lively_case("table")
    heat = case.zone_heat()["B"].to_numpy()
    hour = np.arange(len(heat)) * case.step / 3600.0
    misses = []
    for shift in (0.2, 0.1):
        exact = 400.0 * (np.sin(0.8 * (hour - shift)) - np.sin(0.8 * hour))
        found = signal_heat(case, "clock_shift", "B", heat_clock_shift=shift)
        misses.append(np.abs(found - exact)[6:-6].max())
    assert misses[0] < 0.1 * 400.0 * 0.8 * 0.2
    assert misses[0] / misses[1] > 1.9


@pytest.mark.parametrize("kind", KINDS)
def test_a_weather_clock_that_is_off_moves_all_that_outdoor_air_touches(lively_case: CaseOf, kind: str) -> None:
    case = lively_case(kind)
    ids = ("clock_shift", "infiltration", "thermal_bridge")
    network = build_network(case.building, effects=chosen(ids))
    theta = network.values({"weather_clock_shift": 0.5, "infiltration_rate": 0.3, "thermal_bridge_u_value": 0.2})
    flow = SymbolicModel(network).matrices(theta).flow.tocsc()
    column = (
        network.n_node
        + len(network.boundaries)
        + [s.name for s in network.signals].index("change of outdoor temperature")
    )
    assert np.abs((flow[:, column] + 0.5 * flow[:, network.n_node]).toarray()).max() < 1e-9


@pytest.mark.parametrize("kind", KINDS)
def test_a_station_elsewhere_reads_too_high_for_all_that_outdoor_air_touches(lively_case: CaseOf, kind: str) -> None:
    case = lively_case(kind)
    ids = ("wrong_station", "infiltration", "thermal_bridge")
    network = build_network(case.building, effects=chosen(ids))
    theta = network.values({
        "station_offset": 1.5, "station_swing": -0.2, "infiltration_rate": 0.3, "thermal_bridge_u_value": 0.2,
    })  # fmt: skip
    flow = SymbolicModel(network).matrices(theta).flow.tocsc()
    first, names = network.n_node + len(network.boundaries), [s.name for s in network.signals]
    for name, factor in (("constant", 1.5), ("outdoor temperature about its day's mean", -0.2)):
        column = first + names.index(name)
        assert np.abs((flow[:, column] + factor * flow[:, network.n_node]).toarray()).max() < 1e-9
    daily = next(s for s in network.signals if s.name == "outdoor temperature about its day's mean")
    drivers = telemetry_inputs(case)
    drivers.outdoor = 280.0 + 4.0 * np.sin(2.0 * np.pi * np.arange(len(case.stamps)) * case.step / 86400.0)
    day = round(86400.0 / case.step)
    inner = slice(day, len(case.stamps) - day)
    assert np.abs(daily.of(drivers)[inner] - (drivers.outdoor - 280.0)[inner]).max() < 0.05


def test_each_sensor_lags_by_its_own_time(lively_case: CaseOf) -> None:
    case = lively_case("table")
    network = build_network(case.building, effects=chosen(["sensor_lag"]))
    names = [p.name for p in network.parameters if p.effect]
    assert names == [f"sensor_lag@{zone}" for zone in case.building.zone_names] and len(names) == 2
    grid, inputs = SymbolicModel(network), replay_inputs(case, network)
    runs = []
    for lag in ({}, {names[0]: 9.0}, {names[1]: 9.0}):
        matrices = grid.matrices(network.values(dict.fromkeys(names, 0.0) | lag))
        states, _ = spin_up(matrices, inputs, 0, np.array([220]))
        runs.append(free_runs(matrices, inputs, np.array([220]), 24, states)[0].reshape(-1, 2))
    for late in (0, 1):
        moved = np.abs(runs[late + 1] - runs[0]).max(axis=0)
        assert moved[late] > 0.05 and moved[1 - late] < 1e-3 * moved[late]


def test_the_modes_read_the_sensor(lively_case: CaseOf) -> None:
    # heated from rest, the first minute hardly shows in a sensor of eight minutes, and shows in the air
    network = build_network(lively_case("table").building, effects=chosen({"sensor_lag": ALIKE}))
    grid = SymbolicModel(network)
    boundary, heat, read = np.zeros((50, network.n_boundary, 1)), np.full((50, 2, 1), 500.0), []
    for minutes in (8.0, 0.0):
        theta = network.values({"sensor_lag": minutes})
        matrices = reduced_model(grid, [theta]).matrices(theta)
        read.append(
            ModalRuns(matrices).run(np.zeros((matrices.n, 1)), boundary, heat, np.arange(1, 51), 60.0, EXACT)[0]
        )
    assert (np.diff(read[0][0], axis=0) > 0.0).all()
    assert (read[0][0, 0] < 0.1 * read[1][0, 0]).all()
    assert (read[0][0, -1] > 0.7 * read[1][0, -1]).all()
