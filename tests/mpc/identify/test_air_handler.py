"""Boxes on one air handler: what it blows at rooms that nobody heats is known to plans, and when it runs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from calibration.estimation.state_space import REFERENCE
from calibration.grey_box.network import GreyBox
from mpc.control.identified.ahead import Ahead
from mpc.control.identified.by_rule import _rule, estimate_rule
from mpc.control.identified.controller import IdentifiedController, IdentifiedSettings
from mpc.control.identified.electric import Electric
from mpc.control.identified.observer import GreyBoxObserver
from mpc.control.identified.problem import IdentifiedProblem
from mpc.control.identified.thermostats import Thermostats
from mpc.identify.air_handler import (
    AirHandler,
    RunningHours,
    find_air_handler,
    running,
    told_by_whole_steps,
)
from mpc.identify.curves import Curve
from mpc.identify.identify import identify
from mpc.identify.machines import Machine
from mpc.identify.maps import MachineMap
from mpc.identify.model import PlantModel
from mpc.identify.telemetry import SET, PlantTelemetry, Site
from mpc.loop.actuators import HEATING_SETPOINT, Actuator
from mpc.loop.plant import Measurements, PointLayout
from mpc.scenario.forecast import Forecast
from mpc.scenario.grid import hours_of_week
from thermal._types import FloatArray
from thermal.case.building import Location
from thermal.case.points import DISCHARGE_TEMPERATURE, OUTDOOR_TEMPERATURE, SUPPLY_FLOW, ZONE_TEMPERATURE
from thermal.components.battery import Battery

STEP, SUPPLY, FAN = 900.0, 286.0, 400.0
PLACE = Location(latitude=41.0, longitude=-87.0, elevation=200.0, timezone="Etc/GMT+6")
ROOMS, FLOWS, FULL = ("north", "south"), np.array([0.2, 0.3]), np.array([6000.0, 8000.0])
CAPACITY = 1006.0 * FLOWS


def setpoint_of(room: str) -> str:
    return f"{room}/{HEATING_SETPOINT}"


def machine_of(room: str) -> Machine:
    air = tuple(f"{room}/{point}" for point in (SUPPLY_FLOW, DISCHARGE_TEMPERATURE, ZONE_TEMPERATURE))
    return Machine(Actuator(setpoint_of(room), "K", 285.0, 299.0), "setpoint", (room,), air=air)


MACHINES = tuple(machine_of(room) for room in ROOMS)


def runs_by_itself(stamp: pd.Timestamp) -> bool:
    return stamp.day_of_week < 5 and 7 <= stamp.hour < 19


def recorded(days: int = 7, *, warm: bool = False) -> PlantTelemetry:
    """Two rooms whose boxes reheat; where one asks for heat out of hours its air handler runs for both."""
    rng, stamps = np.random.default_rng(3), pd.date_range("2023-01-09 00:15", periods=96 * days, freq="15min", tz=PLACE.timezone)
    air, wall = np.full(2, 292.0), np.full(2, 290.0)
    columns: dict[str, list[float]] = {}
    asked = np.full(2, 292.0)
    for k, stamp in enumerate(stamps):
        begin = stamp - pd.Timedelta(seconds=STEP)
        outdoor = 270.0 + 4.0 * np.sin(2.0 * np.pi * (k / 96.0 - 0.4))
        if k % 16 == 0:
            asked = rng.choice([286.0, 290.0, 294.0, 296.0], 2)
        if k % 96 in range(48, 56):
            asked = np.full(2, 286.0)  # nobody asks at noon
        zone, flow, heat = np.zeros(2), np.zeros(2), np.zeros(2)
        for _ in range(15):
            runs = runs_by_itself(begin) or bool((air < asked).any())
            blown = SUPPLY + (12.0 if warm else 0.0)
            reheat = runs * FULL * np.clip((asked - air) / 0.5, 0.0, 1.0)
            given = runs * CAPACITY * (blown - air) + reheat
            air = air + 60.0 / 2e6 * (given + 150.0 * (wall - air) + 60.0 * (outdoor - air) + 900.0)
            wall = wall + 60.0 / 2e7 * (150.0 * (air - wall) + 50.0 * (outdoor - wall))
            zone, flow, heat = zone + air / 15.0, flow + runs * FLOWS / 15.0, heat + reheat / 15.0
        power = float(heat.sum()) + FAN * float(flow.sum() / FLOWS.sum())
        row = {f"weather_station/{OUTDOOR_TEMPERATURE}": outdoor, "electricity": power}
        for room, t, m, q, told in zip(ROOMS, zone, flow, heat, asked, strict=True):
            supply = blown + q / (1006.0 * m) if m > 0.0 else t
            row |= {f"{room}/{ZONE_TEMPERATURE}": t, f"{room}/{SUPPLY_FLOW}": m, f"{room}/{DISCHARGE_TEMPERATURE}": supply,
                    f"{SET}{setpoint_of(room)}": told}  # fmt: skip
        for name, value in row.items():
            columns.setdefault(name, []).append(float(value))
    site = Site("offices", dict.fromkeys(ROOMS, 100.0), PLACE)
    return PlantTelemetry(pd.DataFrame(columns, index=stamps), STEP, site)


@pytest.fixture(scope="module")
def telemetry() -> PlantTelemetry:
    return recorded()


def above_of(telemetry: PlantTelemetry) -> FloatArray:
    frame = telemetry.frame
    return np.column_stack([frame[f"{SET}{setpoint_of(r)}"] - frame[f"{r}/{ZONE_TEMPERATURE}"] for r in ROOMS])


def test_it_is_found_by_the_air_of_boxes_that_heat_nothing(telemetry: PlantTelemetry) -> None:
    found, machines, heat = find_air_handler(telemetry, MACHINES, above_of(telemetry))
    assert found is not None and found.supply == pytest.approx(SUPPLY, abs=0.1)
    assert found.conductances == pytest.approx(CAPACITY)
    # of the hours that show it, all as they are; nights are known as soon as it rests
    assert {hour % 24 for hour, runs in found.hours if runs} <= set(range(7, 19)) and len(found.hours) > 10
    assert all(runs_by_itself(pd.Timestamp("2023-01-09") + pd.Timedelta(hours=h)) == runs for h, runs in found.hours)
    frame = telemetry.frame
    for k, (room, machine) in enumerate(zip(ROOMS, machines, strict=True)):  # all heat is there, in two parts
        of_box = machine.metered_heat(lambda column: frame[column])
        whole = 1006.0 * frame[f"{room}/{SUPPLY_FLOW}"] * (frame[f"{room}/{DISCHARGE_TEMPERATURE}"] - frame[f"{room}/{ZONE_TEMPERATURE}"])
        np.testing.assert_allclose(of_box + heat[:, k], whole, atol=1e-6)
        assert of_box.min() > -50.0


def test_what_only_looks_like_it_is_none(telemetry: PlantTelemetry) -> None:
    """Warm air, a box alone, and boxes that begin and end each for itself."""
    warm = recorded(2, warm=True)
    assert find_air_handler(warm, MACHINES, above_of(warm))[0] is None
    assert find_air_handler(telemetry, MACHINES[:1], above_of(telemetry)[:, :1])[0] is None
    column = f"south/{SUPPLY_FLOW}"
    apart = telemetry.frame.assign(**{column: np.roll(telemetry.frame[column], 40)})
    assert find_air_handler(replace(telemetry, frame=apart), MACHINES, above_of(telemetry))[0] is None


def test_identified_of_it_are_its_fan_and_the_boxes_reheat(telemetry: PlantTelemetry) -> None:
    model = identify(telemetry, MACHINES).model
    assert model.air_handler is not None
    assert model.air_handler.powers["electricity"] == pytest.approx(FAN, rel=0.1)
    assert model.base["electricity"] == pytest.approx(0.0, abs=40.0)
    for found, full in zip(model.maps, FULL, strict=True):
        assert float(found.at(found.heat, 1.0, 270.0, 293.0)) == pytest.approx(full, rel=0.15)
        assert float(found.at(found.powers["electricity"], 1.0, 270.0, 293.0)) == pytest.approx(full, rel=0.2)
    again = PlantModel.from_dict(model.to_dict())
    assert again.air_handler == model.air_handler and again.maps[0].machine.supply == model.maps[0].machine.supply


def model_of(supply: float | None = SUPPLY) -> PlantModel:
    made = []
    for machine, full in zip(MACHINES, FULL, strict=True):
        curve = Curve({"command": float(full)}, {"command": 0.0})
        made.append(MachineMap(replace(machine, supply=supply), "setpoint", curve, {"electricity": curve}, (-0.1, 0.3)))
    sources = {setpoint_of(room): (room,) for room in ROOMS}
    box = GreyBox.start(dict.fromkeys(ROOMS, 100.0), (), sources, (True, True))
    handler = None if supply is None else AirHandler(supply, tuple(CAPACITY), {"electricity": FAN}, ((34, True),))
    return PlantModel("offices", STEP, box, tuple(made), {"electricity": 50.0}, air_handler=handler)


def forecast(begin: str, steps: int, lower: FloatArray) -> Forecast:
    stamps = pd.date_range(begin, periods=steps, freq="15min", tz=PLACE.timezone)
    table = {OUTDOOR_TEMPERATURE: 268.15, "electricity_price": 0.2}
    for room in ROOMS:
        table |= {f"{room}/comfort_lower_temperature": lower, f"{room}/comfort_upper_temperature": 299.15,
                  f"{room}/internal_gain": 0.0, f"{room}/occupancy_count_sensor": (lower > 292.0).astype(float)}  # fmt: skip
    return Forecast(pd.DataFrame(table, index=stamps))


def test_a_step_of_the_plan_is_that_of_the_building() -> None:
    """Every room loses to the air while it runs, in hours of its own or for a box; by hand, with its fan."""
    model, problem = model_of(), IdentifiedProblem(model_of())
    ahead = replace(Ahead.of(model, forecast("2023-01-10 00:15", 4, np.full(4, 288.15)), PLACE),
                    running=np.array([0.0, 0.0, 1.0, 1.0]))  # fmt: skip
    rng, free = np.random.default_rng(0), (np.zeros((4, 2)), np.ones((4, 2)))
    state = np.append(rng.normal(0.0, 2.0, 8), np.zeros(2))
    parameters = problem.data(state, ahead, np.zeros((4, 2)), 10.0, free).parameters
    (transition, drive), extra = problem.matrices, np.array([0.4, 0.0, 0.3, 0.0])
    for k, levels in enumerate(([0.4, 0.1], [0.0, 0.0], [0.2, 0.9], [0.0, 0.0])):
        runs = max(ahead.running[k], extra[k])
        following, cost = problem.stage.step(state[:8], [*levels, extra[k]], parameters[k])
        heat = model.box.delivered(FULL * np.array(levels), 268.15)
        lost = runs * CAPACITY * (SUPPLY - REFERENCE - state[:2])
        inputs = np.concatenate([[268.15 - REFERENCE], heat, model.box.parts["constant gain"] + lost])
        np.testing.assert_allclose(np.array(following).ravel(), transition @ state[:8] + drive @ inputs, rtol=1e-9)
        watts = float(FULL @ levels) + FAN * runs  # what is bought anyway is no part of a plan's cost
        even = 1e-4 * (np.square(levels).sum() + extra[k] ** 2)
        assert float(cost) / 10.0 == pytest.approx(0.2 * watts * STEP / 3.6e6 + even, rel=1e-9)
        kept = np.array(problem.stage.kept(state[:8], [*levels, extra[k]], parameters[k])).ravel()
        assert bool((kept[1:3] <= 1e-12).all()) == bool(max(levels) <= runs + 1e-12)
        assert bool(kept[3] <= 1e-12) == (extra[k] <= sum(levels) + 1e-12)
        assert problem.running(ahead.running[k : k + 1], np.array([[*levels, extra[k]]]))[0] == pytest.approx(runs)
        np.testing.assert_allclose(model.lost(state, runs), lost)
        assert model.bought_anyway(np.array([runs]))[0, 0] == pytest.approx(50.0 + FAN * runs)


def test_a_plan_heats_rooms_at_a_time_where_each_would_cool_the_other() -> None:
    """Before the hours of the air handler, warmer bands ahead: heat of one room costs the other, so both have it."""
    lower = np.where(np.arange(48) < 28, 288.15, 293.15)  # from 7 h on
    seen = Measurements(PointLayout(tuple(f"{r}/{ZONE_TEMPERATURE}" for r in ROOMS), PLACE.timezone), 0, [289.5, 289.5])
    plans = {}
    for supply in (SUPPLY, None):
        model = model_of(supply)
        made = IdentifiedController(model, tuple(m.actuator for m in MACHINES), PLACE, IdentifiedSettings(guarantee=None))
        action = made.step(seen, forecast("2023-01-10 00:15", 48, lower))
        assert action.source == "optimal plan"
        plans[supply] = action
    plan = plans[SUPPLY].solution
    levels, runs = plan.decisions[:28, :2], plan.decisions[:28, 2]
    assert (levels <= runs[:, None] + 1e-4).all()
    # each running step serves both rooms: the longest of both loads is hardly more than their mean
    ran = levels.max(axis=1) > 0.05
    assert ran.any() and levels[ran].min() > 0.2 * levels[ran].max()
    # who knows nothing of the air expects the band to be kept for less, and is wrong by what the rooms lose
    assert plans[None].power[28:, 0].mean() < 0.8 * plans[SUPPLY].power[28:, 0].mean()
    assert plans[SUPPLY].rule is not None and plans[SUPPLY].rule.rule > 0.0


def test_a_battery_beside_it_has_its_own_decision() -> None:
    electric = Electric(Battery(36e6, 5000.0, 0.95, 0.95), "battery/power", "battery/level")
    problem = IdentifiedProblem(model_of(), electric)
    decisions = np.full(problem.decisions, 0.5)
    assert problem.command(decisions).keys() == {"battery/power"}
    assert problem.running(np.array([0.5]), decisions[None])[0] == 0.75


def test_the_observer_takes_its_air_as_measured_else_as_planned() -> None:
    model = model_of()
    ahead = Ahead.of(model, forecast("2023-01-10 10:15", 4, np.full(4, 293.15)), PLACE)
    ahead = replace(ahead, running=np.ones(4))
    zone = [f"{room}/{ZONE_TEMPERATURE}" for room in ROOMS]
    air = {f"{r}/{SUPPLY_FLOW}": f for r, f in zip(ROOMS, FLOWS, strict=True)}
    air |= {f"{r}/{DISCHARGE_TEMPERATURE}": SUPPLY for r in ROOMS}
    ends = []
    for known in (air, {}):
        observer, columns = GreyBoxObserver(model), (*zone, *known)
        measured = Measurements(PointLayout(columns, PLACE.timezone), 0, [293.15, 293.15, *known.values()])
        observer.start(measured, 268.15)
        observer.update(measured, ahead, np.zeros(2))
        ends.append(observer.state)
    np.testing.assert_allclose(ends[0], ends[1], rtol=1e-9)
    still = replace(ahead, running=np.zeros(4))
    observer.start(measured, 268.15)
    observer.update(measured, still, np.zeros(2))
    assert (observer.state[:2] > ends[0][:2]).all()


def test_a_controller_learns_when_it_runs_by_itself() -> None:
    """On Saturdays nobody is expected, and yet it runs: seen once, it is known."""
    model = model_of()
    made = IdentifiedController(model, tuple(m.actuator for m in MACHINES), PLACE, IdentifiedSettings(guarantee=None))
    columns = tuple(c for m in MACHINES for c in m.air)
    lower = np.full(24, 288.15)
    for k in range(3):
        begin = pd.Timestamp("2023-01-14 09:00", tz=PLACE.timezone) + pd.Timedelta(seconds=k * STEP)
        values = [v for flow in FLOWS for v in (flow, SUPPLY, 292.0)]
        seen = Measurements(PointLayout(columns, PLACE.timezone), int(begin.timestamp()), values)
        made.step(seen, forecast(str((begin + pd.Timedelta(seconds=STEP)).tz_localize(None)), 24, lower))
    ahead = Ahead.of(model, forecast("2023-01-14 09:15", 24, lower), PLACE)
    known = made._thermostats.runs_by_itself(ahead)
    assert known[:4].tolist() == [1.0] * 4 and not known[4:].any()


@pytest.mark.parametrize(("share", "learns"), [(0.5, False), (1.0, True)])
def test_what_boxes_have_is_told_by_whole_steps_alone(share: float, learns: bool) -> None:
    """Where it ran for half of a step boxes that give half are at no limit, though their setpoints are out of reach."""
    model = model_of()
    made = Thermostats(model)
    columns = tuple(c for m in MACHINES for c in m.air)
    made.tell(0, 1.0, 1.0, np.full((4, 2), 293.0), (290.0, 299.0))
    made.tell(1, 0.5, 1.0, np.full((4, 2), 290.0), (288.0, 299.0))  # which has what it asks for
    discharge = [SUPPLY + 0.5 * full / (1006.0 * flow * share) for full, flow in zip(FULL, FLOWS, strict=True)]
    values = [v for flow, warm in zip(FLOWS, discharge, strict=True) for v in (flow * share, warm, 290.0)]
    before = made.most(np.array([265.0]))[0]
    made.learn(Measurements(PointLayout(columns, PLACE.timezone), 0, values), np.full(2, 290.0), 265.0)
    after = made.most(np.array([265.0]))[0]
    assert bool(after[0] < 0.7 * before[0]) == learns and after[1] == before[1] and (learns or after[0] == before[0])


def test_limits_are_read_from_whole_steps(telemetry: PlantTelemetry) -> None:
    found, machines, _ = find_air_handler(telemetry, MACHINES, above_of(telemetry))
    assert found is not None
    flow = np.column_stack([telemetry.column(m.air[0]) for m in machines])
    told = told_by_whole_steps(found.share(flow), above_of(telemetry))
    part = telemetry.frame[f"north/{SUPPLY_FLOW}"].to_numpy() < 0.95 * FLOWS[0]
    assert np.isnan(told[part]).all() and np.isfinite(told[~part]).all() and 10 < part.sum() < part.size / 2


def test_hours_of_which_nothing_is_known_are_those_of_other_days_or_of_people() -> None:
    stamps = pd.date_range("2023-01-09 00:15", periods=4 * 168, freq="15min", tz=PLACE.timezone)
    hours = hours_of_week(stamps, STEP)
    assert hours[0] == 0 and hours[-1] == 167 and (np.bincount(hours) == 4).all()
    told = RunningHours(((7, True), (20, False), (31, False)))
    people = np.isin(np.arange(168) % 24, range(9, 17))
    found = told.at(np.arange(168), people)
    assert found[7] == 1.0 and found[31] == 0.0 and found[55] == 0.0  # of each hour the last that was seen
    assert found[[33, 40, 44, 129]].tolist() == [1.0, 1.0, 0.0, 1.0] and found[120 + 20] == 0.0


def test_the_rule_is_estimated_with_its_air() -> None:
    """A rule that keeps the same bands costs more where the rooms are blown cold."""
    lower, costs = np.full(48, 293.15), {}
    for supply in (SUPPLY, None):
        model = model_of(supply)
        problem = IdentifiedProblem(model)
        ahead = replace(Ahead.of(model, forecast("2023-01-10 08:15", 48, lower), PLACE), running=np.ones(48))
        free = np.zeros((48, 2)), np.ones((48, 2))
        state = np.append(np.full(8, 0.3), np.zeros(2))
        parameters = problem.data(state, ahead, np.zeros((48, 2)), 10.0, free).parameters
        planned = np.tile(state[:8], (49, 1)), np.zeros((48, problem.decisions))
        costs[supply] = estimate_rule(problem, ahead, parameters, planned, free[1], np.zeros(2, dtype=bool)).rule
    lost = float(CAPACITY.sum()) * (293.15 - SUPPLY) + FAN
    assert costs[SUPPLY] - costs[None] == pytest.approx(0.2 * lost * 48 * STEP / 3.6e6, rel=0.2)


def test_a_box_that_has_less_makes_it_run_for_longer() -> None:
    """Half of the load from a box that has at most that: it runs whole steps, in the plan and in the rule."""
    model = model_of()
    problem, most = IdentifiedProblem(model), np.array([0.5, 1.0])
    ahead = Ahead.of(model, forecast("2023-01-10 00:15", 4, np.full(4, 293.15)), PLACE)
    state = np.append(np.full(8, 0.0), np.zeros(2))
    parameters = problem.data(state, ahead, np.zeros((4, 2)), 10.0, (np.zeros((4, 2)), np.tile(most, (4, 1)))).parameters
    for runs, fits in ((0.6, False), (1.0, True)):  # decisions are shares of what each has
        kept = np.array(problem.stage.kept(state[:8], [1.0, 0.2, runs], parameters[0])).ravel()
        assert bool((kept <= 1e-12).all()) == fits
    assert running(np.zeros(1), np.array([[0.5, 0.2]]), most[None])[0] == 1.0
    assert running(np.array([0.3]), np.array([[0.1, 0.2]]), most[None])[0] == pytest.approx(0.3)


def test_the_rule_keeps_its_edge_where_heat_makes_it_run() -> None:
    model = model_of()
    problem = IdentifiedProblem(model)
    ahead = Ahead.of(model, forecast("2023-01-10 00:15", 48, np.full(48, 293.15)), PLACE)
    ahead, free = replace(ahead, running=np.zeros(48)), (np.zeros((48, 2)), np.ones((48, 2)))
    state = np.append(np.full(8, 0.3), np.zeros(2))
    parameters = problem.data(state, ahead, np.zeros((48, 2)), 10.0, free).parameters
    states, levels = _rule(problem, ahead, parameters, (state[:8], free[1], np.zeros(2, dtype=bool)))
    assert levels.max() > 0.2 and states[24:, :2].min() > 293.15 - REFERENCE - 0.15  # that of its thermostats


@pytest.mark.parametrize(("missing", "part"), [("discharge", 1), ("flow", 0), ("zone", 2)])
def test_a_sensor_that_is_missing_teaches_nothing(missing: str, part: int) -> None:
    """Neither hours nor limits, and no warning; both rooms ask for more than they have."""
    model = model_of()
    made, columns = Thermostats(model), tuple(c for m in MACHINES for c in m.air)
    for k in range(2):
        made.tell(k, 1.0, 1.0, np.full((4, 2), 293.0), (290.0, 299.0))
    values = [v for flow in FLOWS for v in (0.5 * flow, SUPPLY + 8.0, 290.0)]
    values[part] = np.nan
    stamp = int(pd.Timestamp("2023-01-10 03:15", tz=PLACE.timezone).timestamp())
    zone = np.array([np.nan if missing == "zone" else 290.0, 290.0])
    made.learn(Measurements(PointLayout(columns, PLACE.timezone), stamp, values), zone, 265.0)
    assert made._hours.seen == model.air_handler.hours and (made.most(np.array([265.0])) == 1.0).all()
    assert np.isinf(made.together(np.array([265.0, 265.0]))).all()


def test_flow_that_varies_is_no_air_handler_of_this_kind(telemetry: PlantTelemetry) -> None:
    rng, frame = np.random.default_rng(0), telemetry.frame.copy()
    for room in ROOMS:
        frame[f"{room}/{SUPPLY_FLOW}"] *= rng.uniform(0.4, 1.6, len(frame))
    assert find_air_handler(replace(telemetry, frame=frame), MACHINES, above_of(telemetry))[0] is None
    for room in ROOMS:
        frame[f"{room}/{DISCHARGE_TEMPERATURE}"] = np.nan
    assert find_air_handler(replace(telemetry, frame=frame), MACHINES, above_of(telemetry))[0] is None
