"""Replay: bridged gaps, spin-up with held zones, free runs, and what they owe to θ."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pandas as pd
import pytest
from numpy.typing import NDArray

from thermal import (
    Building,
    Case,
    FloorPlan,
    FloorPlans,
    Inputs,
    SymbolicModel,
    Telemetry,
    ZoneTable,
    build_network,
    free_runs,
    load_bundled_case,
    reduced_model,
    replay_inputs,
    spin_up,
)
from thermal.case.building import Airflow, Layer, Location, Surface, ZoneEntry
from thermal.errors import ModelError
from thermal.model.case_replay import SUDDEN
from thermal.model.step import IMPLICIT_EULER, SCHEMES, Stepper

FloatArray = NDArray[np.float64]

SITE = Location(latitude=48.0, longitude=12.0, elevation=690.0, timezone="Etc/GMT-1")


@cache
def model_of(name: str) -> SymbolicModel:
    if name == "plan":
        rows = ("######", "#A+BB#", "#A+BB#", "######")
        floor = FloorPlan("F1", 3.0, np.array([list(row) for row in rows]))
        return SymbolicModel(
            build_network(Building("plan", SITE, 0.0, FloorPlans(1.0, (floor,), {"A": {"south": 1.0}})))
        )
    layers = (Layer(thickness=0.2, conductivity=0.5, density=1200.0, heat_capacity=1000.0),)
    surfaces = (
        Surface(name="W", kind="wall", zone="room", other="outdoor", area=12.0, azimuth=180.0, construction="wall"),
        Surface(name="I", kind="wall", zone="room", other="hall", area=8.0, construction="wall"),
        Surface(name="C", kind="ceiling", zone="hall", other="attic", area=10.0, construction="wall"),
        Surface(name="O", kind="opening", zone="room", other="hall", area=0.3),
    )
    zones = (ZoneEntry(name="room", volume=50.0, floor_area=20.0), ZoneEntry(name="hall", volume=26.0, floor_area=10.0))
    flows = (Airflow(source="room", target="hall", device="fan", fraction=0.5),)
    return SymbolicModel(
        build_network(Building("table", SITE, 0.0, ZoneTable(zones, surfaces, {"wall": layers}), airflows=flows))
    )


def inputs_of(name: str, n_time: int = 400, step: float = 300.0) -> Inputs:
    """Made-up telemetry without gaps: smooth zones, moving weather, pulses of heat."""
    network = model_of(name).network
    rng = np.random.default_rng(3)
    hours = np.arange(n_time) * step / 3600.0
    zone = 293.15 + np.column_stack(
        [np.sin(0.4 * hours + z) + 0.3 * np.cos(1.7 * hours) for z in range(len(network.zones))]
    )
    boundary = 280.0 + 4.0 * np.sin(0.26 * hours)[:, None] + np.arange(network.n_boundary)
    return Inputs(
        stamps=pd.date_range("2023-03-01T00:05:00+01:00", periods=n_time, freq=pd.Timedelta(step, unit="s")),
        step=step,
        heat=np.repeat(1500.0 * rng.random((n_time // 4 + 1, len(network.zones))), 4, axis=0)[:n_time],
        boundary=boundary,
        airflow=0.05 * rng.random((n_time, len(network.airflows))),
        zone=zone,
        bridged=zone,
        held=zone,
        complete=np.ones(n_time, dtype=bool),
    )


def theta_of(name: str) -> FloatArray:
    rng = np.random.default_rng(17)
    parameters = model_of(name).network.parameters
    return np.array(
        [p.inverse(p.transform(p.start) + 0.4 * p.prior_deviation * rng.standard_normal()) for p in parameters]
    )


def central(function: Callable[[FloatArray], FloatArray], theta: FloatArray, j: int) -> FloatArray:
    """Five-point difference times θ_j: the effect of a relative change."""
    step = 2e-3 * theta[j] * np.eye(theta.size)[j]
    near = function(theta + step) - function(theta - step)
    far = function(theta + 2 * step) - function(theta - 2 * step)
    return (8.0 * near - far) / (12.0 * 2e-3)


# Spin-up


@pytest.mark.parametrize("name", ["plan", "table"])
def test_zones_are_matched_at_every_start(name: str) -> None:
    model, inputs, at = model_of(name), inputs_of(name), np.array([150, 200, 390])
    states, slopes = spin_up(model.matrices(theta_of(name)), inputs, 0, at)
    assert slopes is None
    assert np.abs(model.network.observation @ states - inputs.zone[at].T).max() < 1e-9


@pytest.mark.parametrize("name", ["plan", "table"])
def test_spin_up_is_holding_the_zones_step_by_step(name: str) -> None:
    """From the steady state of the first day's means; the same temperatures in kelvin, without a reference."""
    model, inputs, theta = model_of(name), inputs_of(name), theta_of(name)
    matrices = model.matrices(theta)
    day = slice(0, 288)
    zone, boundary = inputs.zone[day].mean(axis=0), inputs.boundary[day].mean(axis=0)
    states = np.full((matrices.n, 1), zone.mean())
    states = Stepper(matrices, 10 * 86400.0).hold(states, boundary[:, None], zone[:, None])[0]
    stepper = Stepper(matrices, inputs.step)
    for k in range(301):
        states = stepper.hold(states, inputs.boundary[k][:, None], inputs.zone[k][:, None])[0]
    found, _ = spin_up(matrices, inputs, 0, np.array([300]))
    np.testing.assert_allclose(found, states, rtol=0, atol=1e-8)


def test_states_at_several_starts_are_those_of_spin_ups_apart() -> None:
    model, inputs, theta = model_of("plan"), inputs_of("plan"), theta_of("plan")
    matrices = model.matrices(theta, sensitivities=True)
    both, both_slopes = spin_up(matrices, inputs, 5, np.array([300, 390]))
    for k, at in enumerate((300, 390)):
        alone, slopes = spin_up(matrices, inputs, 5, np.array([at]))
        np.testing.assert_allclose(both[:, [k]], alone, rtol=0, atol=1e-10)
        np.testing.assert_allclose(both_slopes[:, k::2] * theta, slopes * theta, rtol=0, atol=1e-9)  # type: ignore[index]


@pytest.mark.parametrize("at", [150, 390])
def test_state_at_a_start_knows_nothing_of_what_comes_after(at: int) -> None:
    """Held-out targets stay out: telemetry after t0 may not change the state at t0, however short the spin-up."""
    model, inputs = model_of("plan"), inputs_of("plan")
    matrices = model.matrices(theta_of("plan"))
    later = {}
    for field in ("held", "zone", "bridged", "boundary"):
        later[field] = getattr(inputs, field).copy()
        later[field][at + 1 :] += 5.0
    states = [spin_up(matrices, i, 0, np.array([at]))[0] for i in (inputs, replace(inputs, **later))]
    np.testing.assert_allclose(states[0], states[1], rtol=0, atol=1e-9)


def test_longer_spin_up_forgets_its_start() -> None:
    """Two starts of the spin-up end in states that differ less the longer it has run."""
    model, inputs = model_of("plan"), inputs_of("plan", 2000)
    matrices = model.matrices(theta_of("plan"))
    differences = []
    for length in (150, 600, 1800):
        a, b = (spin_up(matrices, inputs, 1999 - length - d, np.array([1999]))[0] for d in (0, 100))
        differences.append(float(np.abs(a - b).max()))
    assert differences[0] > differences[1] > differences[2]
    assert differences[2] < 0.05


@pytest.mark.parametrize("name", ["plan", "table"])
@pytest.mark.parametrize("dense", [False, True])
def test_slopes_of_a_spin_up_are_those_of_finite_differences(name: str, dense: bool) -> None:
    model, inputs, theta, at = model_of(name), inputs_of(name), theta_of(name), np.array([150, 220])
    if dense:
        model = SymbolicModel(model.network, np.eye(model.network.n_node))
    _, slopes = spin_up(model.matrices(theta, sensitivities=True), inputs, 0, at)
    assert slopes is not None
    slopes = slopes.reshape(model.network.n_node, theta.size, at.size)
    for j in range(theta.size):
        wanted = central(lambda t: spin_up(model.matrices(t), inputs, 0, at)[0], theta, j)
        assert np.abs(slopes[:, j] * theta[j] - wanted).max() < 1e-6 * max(np.abs(wanted).max(), 1e-3)


def test_unmeasured_zone_is_free_in_the_spin_up() -> None:
    model, inputs = model_of("plan"), inputs_of("plan")
    held = inputs.held.copy()
    held[:, 1] = np.nan
    heat = inputs.heat.copy()
    heat[:, 1] = 0.0
    matrices = model.matrices(theta_of("plan"))
    states, _ = spin_up(matrices, replace(inputs, held=held, heat=heat), 0, np.array([300]))
    zone = model.network.observation @ states
    assert zone[0, 0] == pytest.approx(inputs.zone[300, 0], abs=1e-9)
    # between what it is coupled to: outdoor and the held zone
    assert inputs.boundary[:301].min() < zone[1, 0] < inputs.zone[:301, 0].max()
    # its metered heat is not lost on it, on the grid or reduced
    heat[:, 1] = 200.0
    warmer = [
        m.observation @ spin_up(m, replace(inputs, held=held, heat=heat), 0, np.array([300]))[0]
        for m in (matrices, reduced_model(model, [theta_of("plan")]).matrices(theta_of("plan")))
    ]
    assert warmer[0][1, 0] > zone[1, 0] + 1.0
    np.testing.assert_allclose(warmer[0], warmer[1], atol=0.01)


# Free runs


@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize("name", ["plan", "table"])
def test_free_runs_are_steps_driven_by_the_rows_after_their_start(name: str, scheme: str) -> None:
    model, inputs = model_of(name), inputs_of(name)
    matrices = model.matrices(theta_of(name))
    starts, steps, keep = np.array([150, 163, 300]), 30, np.array([1, 12, 30])
    states, _ = spin_up(matrices, inputs, 0, starts)
    found, slopes = free_runs(matrices, inputs, starts, keep, states, scheme=SCHEMES[scheme])
    assert slopes is None
    assert found.shape == (3, 3, 2)
    whole, _ = free_runs(matrices, inputs, starts, steps, states, scheme=SCHEMES[scheme])
    np.testing.assert_array_equal(whole[:, keep - 1], found)
    stepper = Stepper(matrices, inputs.step, SCHEMES[scheme])
    for run, start in enumerate(starts):
        now = states[:, [run]]
        for k in range(1, steps + 1):
            row = start + k
            now, mean, _, _ = stepper.advance(
                now, inputs.boundary[[row]].T, inputs.heat[[row]].T, inputs.airflow[[row]].T
            )
            np.testing.assert_allclose(whole[run, k - 1], mean[:, 0], rtol=0, atol=1e-9)


@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize("name", ["plan", "table"])
def test_slopes_of_spin_up_and_free_run_are_those_of_finite_differences(name: str, scheme: str) -> None:
    """What calibration differentiates: from the spin-up through the last step, to 1e-6 of each parameter's effect."""
    model, inputs, theta = model_of(name), inputs_of(name), theta_of(name)
    starts, keep = np.array([150, 190]), np.array([6, 24])

    def means(t: FloatArray) -> FloatArray:
        matrices = model.matrices(t)
        states, _ = spin_up(matrices, inputs, 0, starts)
        return free_runs(matrices, inputs, starts, keep, states, scheme=SCHEMES[scheme])[0]

    matrices = model.matrices(theta, sensitivities=True)
    states, moved = spin_up(matrices, inputs, 0, starts)
    found, slopes = free_runs(matrices, inputs, starts, keep, states, moved, scheme=SCHEMES[scheme])
    np.testing.assert_allclose(found, means(theta), rtol=0, atol=1e-10)
    assert slopes is not None
    assert slopes.shape == (2, 2, 2, theta.size)
    for j in range(theta.size):
        wanted = central(means, theta, j)
        assert np.abs(slopes[..., j] * theta[j] - wanted).max() < 1e-6 * max(np.abs(wanted).max(), 1e-3)


def test_progress_is_told_every_step() -> None:
    model, inputs = model_of("plan"), inputs_of("plan")
    told: list[int] = []
    matrices = model.matrices(theta_of("plan"))
    states, _ = spin_up(matrices, inputs, 0, np.array([150]), told.append)
    assert told == list(range(1, 152))
    told.clear()
    free_runs(matrices, inputs, np.array([150]), 12, states, scheme=IMPLICIT_EULER, progress=told.append)
    assert told == list(range(1, 13))


# Telemetry to inputs


def case_with(gaps: dict[str, tuple[int, int]]) -> Case:
    """The first two days of the bundled case with stretches of columns missing."""
    case = load_bundled_case()
    frame = case.telemetry.frame.iloc[:576].copy()
    for column, (first, count) in gaps.items():
        frame.iloc[first : first + count, frame.columns.get_loc(column)] = np.nan
    return Case(case.building, Telemetry.from_frame(frame))


OUTDOOR = "weather_station/outside_air_temperature_sensor"
ZONE = "VAV_F1_W/zone_air_temperature_sensor"
FLOW = "VAV_F1_W/supply_air_flowrate_sensor"


@cache
def bundled_network() -> SymbolicModel:
    return SymbolicModel(build_network(load_bundled_case().building, dx=1.5))


@pytest.mark.parametrize(("count", "bridged"), [(1, True), (4, True), (6, True), (7, False), (40, False)])
def test_gaps_of_inputs_are_bridged_by_straight_lines_up_to_30_minutes(count: int, bridged: bool) -> None:
    whole = replay_inputs(case_with({}), bundled_network().network)
    found = replay_inputs(case_with({OUTDOOR: (100, count)}), bundled_network().network)
    missing = np.zeros(576, dtype=bool)
    missing[100 : 100 + count] = not bridged
    np.testing.assert_array_equal(found.complete, ~missing)
    line = np.interp(np.arange(100, 100 + count), [99, 100 + count], whole.boundary[[99, 100 + count], 0])
    np.testing.assert_allclose(found.boundary[100 : 100 + count, 0], line, rtol=1e-12)
    np.testing.assert_array_equal(
        np.delete(found.boundary, np.s_[100 : 100 + count]), np.delete(whole.boundary, np.s_[100 : 100 + count])
    )


def test_a_missing_flow_costs_its_zone() -> None:
    case = case_with({FLOW: (100, 12)})
    found = replay_inputs(case, bundled_network().network)
    column = case.building.zone_names.index("F1_W")
    assert found.complete.all()
    assert np.isnan(found.zone[100:112, column]).all()
    assert np.isfinite(found.held).all()
    runs = np.array([80, 99, 105, 112])
    seen = np.isfinite(found.targets(runs, np.array([10, 30])))
    np.testing.assert_array_equal(seen[:, :, column], [[True, False], [False, False], [False, False], [True, True]])
    assert np.delete(seen, column, axis=2).all()


def test_flows_that_are_all_missing_leave_the_heat_missing() -> None:
    flows = {c: (100, 12) for c in load_bundled_case().telemetry.frame if c.endswith("supply_air_flowrate_sensor")}
    found = replay_inputs(case_with(flows), bundled_network().network)
    assert not found.complete[100:112].any()
    assert found.complete.sum() == 564
    assert np.isfinite(found.heat).all()


@pytest.mark.parametrize(("count", "bridged"), [(6, True), (7, False)])
def test_gaps_of_a_zone_are_bridged_for_starts_and_always_for_holding(count: int, bridged: bool) -> None:
    case = case_with({ZONE: (100, count)})
    found = replay_inputs(case, bundled_network().network)
    column = case.building.zone_names.index("F1_W")
    stretch = slice(100, 100 + count)
    assert np.isnan(found.zone[stretch, column]).all()
    assert np.isfinite(found.bridged[stretch, column]).all() == bridged
    assert np.isfinite(found.held).all()
    # the zone's temperature is part of its metered heat: bridged, or estimated and said
    assert found.complete[stretch].all()
    assert [e.zone for e in case.estimated] == ([] if bridged else ["F1_W"])


def test_a_zone_whose_sensor_died_is_held_at_its_last_value_for_a_day_and_at_the_estimate_then() -> None:
    """At its last value for weeks, walls would follow a temperature that has long gone."""
    whole, case = replay_inputs(case_with({}), bundled_network().network), case_with({ZONE: (100, 476)})
    found, column = replay_inputs(case, bundled_network().network), case.building.zone_names.index("F1_W")
    held = found.held[:, column]
    np.testing.assert_array_equal(held[:100], whole.held[:100, column])
    np.testing.assert_array_equal(held[100:388], held[99])
    np.testing.assert_array_equal(held[388:], case.zone_temperatures_estimated()["F1_W"].to_numpy()[388:])
    assert np.ptp(held[388:]) > 0.1
    never = replay_inputs(case_with({ZONE: (0, 576)}), bundled_network().network)
    assert np.isnan(never.held[:, column]).all()


def test_inputs_are_the_case_s_signals() -> None:
    case = case_with({})
    found = replay_inputs(case, bundled_network().network)
    assert len(found) == 576
    assert found.step == 300.0
    np.testing.assert_array_equal(found.stamps, case.stamps)
    np.testing.assert_allclose(found.heat, case.zone_heat().to_numpy())
    np.testing.assert_allclose(found.boundary, case.boundary_temperatures().to_numpy())
    np.testing.assert_allclose(found.zone, case.zone_temperatures().to_numpy())
    assert found.airflow.shape == (576, 0)
    assert 270.0 < found.zone.min() < found.zone.max() < 310.0


def test_telemetry_without_zones_or_outdoors_is_refused() -> None:
    network = bundled_network().network
    columns = load_bundled_case().telemetry.frame.columns
    zones = {c: (0, 576) for c in columns if c.endswith("/zone_air_temperature_sensor")}
    with pytest.raises(ModelError, match="zone_air_temperature_sensor"):
        replay_inputs(case_with(zones), network)
    with pytest.raises(ModelError, match="outdoor"):
        replay_inputs(case_with({OUTDOOR: (0, 576)}), network)


def test_telemetry_without_a_complete_step_names_what_is_missing() -> None:
    flows = {c: (0, 576) for c in load_bundled_case().telemetry.frame if c.endswith("supply_air_flowrate_sensor")}
    with pytest.raises(ModelError, match="F1_W"):
        replay_inputs(case_with(flows), bundled_network().network)


def test_what_changes_too_fast_to_be_told_is_left_out_where_it_is_asked_for() -> None:
    inputs = inputs_of("plan")
    zone = inputs.zone.copy()
    zone[200:, 0] += 4.0  # a setpoint jumps, and ideal air follows within the step
    zone[300:, 1] += 0.5 * SUDDEN * inputs.step
    jumped = replace(inputs, zone=zone)
    starts, keep = np.array([195, 295]), np.array([4, 5, 6])
    assert np.isfinite(jumped.targets(starts, keep)).all()
    seen = np.isfinite(jumped.targets(starts, keep, SUDDEN))
    assert not seen[0, 1, 0] and seen.sum() == seen.size - 1
