"""Supply water: what a kelvin of it costs is found, the coldest that does is told, and cold water is no limit."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from calibration.grey_box.network import GreyBox
from mpc.control.identified.ahead import Ahead
from mpc.control.identified.beyond import WEIGHTS
from mpc.control.identified.controller import IdentifiedController
from mpc.control.identified.problem import IdentifiedProblem
from mpc.control.identified.thermostats import Thermostats
from mpc.control.solvers.stages import StageSolver
from mpc.errors import ControlError, PlantError
from mpc.identify.curves import PER, Curve
from mpc.identify.excitation import Excitation, ExcitationSettings
from mpc.identify.machines import Machine, as_heated
from mpc.identify.maps import MachineMap
from mpc.identify.model import PlantModel
from mpc.identify.regression import Loads
from mpc.identify.telemetry import CARRIERS, SET, PlantTelemetry, Site
from mpc.identify.water import SupplyWater, find_water, sensor_of
from mpc.loop.actuators import COOLING_SETPOINT, HEATING_SETPOINT, Actuator
from mpc.loop.plant import Measurements, PointLayout
from mpc.scenario.forecast import Forecast
from thermal._types import FloatArray
from thermal.case.building import Location
from thermal.case.points import HEATING_POWER, OUTDOOR_TEMPERATURE, ZONE_TEMPERATURE

ROOMS, STEP, FULL = ("south", "north"), 900.0, np.array([6000.0, 4000.0])
PLACE = Location(latitude=50.8, longitude=4.35, elevation=100.0, timezone="Etc/GMT-1")
POINTS = {1.0: HEATING_SETPOINT, -1.0: COOLING_SETPOINT}
NAME = "source/supply_water_temperature_setpoint"


def actuator_of(sign: float) -> Actuator:
    """Water of 30 to 50 degC, or what that is in the mirror."""
    low, high = sorted(as_heated(end, sign) for end in (303.15, 323.15))
    return Actuator(NAME, "K", low, high)


def machine_of(room: str, sign: float) -> Machine:
    actuator = Actuator(f"{room}/{POINTS[sign]}", "K", 280.0, 306.3)
    return Machine(actuator, "setpoint", (room,), f"{room}/{HEATING_POWER}")


def water_of(sign: float) -> SupplyWater:
    curve = Curve({"stored": 5000.0, "water": 800.0}, {"stored": 50.0, "water": 20.0})
    own = float(as_heated(313.15, sign)), -0.4
    return SupplyWater(
        actuator_of(sign), sign, (0.6, 0.4), {"electricity": curve}, float(as_heated(313.15, sign)), own
    )


def model_of(sign: float = 1.0) -> PlantModel:
    """Two rooms on water, whose terminals give their full load with the hottest, in any weather."""
    machines = [machine_of(room, sign) for room in ROOMS]
    limits = tuple((float(t), 1.0) for t in np.arange(251.0, 333.0, 2.0))
    maps = tuple(
        MachineMap(machine, "setpoint", Curve({"command": float(full)}, {}),
                   {"electricity": Curve({"command": 0.3 * float(full)}, {})}, (0.0, 0.1), limits)
        for machine, full in zip(machines, FULL, strict=True)
    )  # fmt: skip
    box = GreyBox.start(dict.fromkeys(ROOMS, 40.0), (), {m.name: m.serves for m in machines}, (True, True))
    return PlantModel("rooms", STEP, box, maps, water=water_of(sign))


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_coldest_water_that_does_is_that_of_the_terminal_that_asks_most(sign: float) -> None:
    """A terminal gives heat in proportion to how far water is from air: what is needed gives the loads, and a tenth."""
    water, air = water_of(sign), as_heated(np.array([293.15, 291.15]), sign)
    most = np.array([1.2, 1.0])
    for loads in ([0.6, 0.2], [0.1, 0.75]):
        told = float(water.needed(np.array(loads), most, air))
        way = (as_heated(told, sign) - as_heated(air, sign)) / (323.15 - as_heated(air, sign))
        assert (most * way - np.array(loads)).min() == pytest.approx(0.1 * most[np.argmax(np.array(loads) / most)])
        np.testing.assert_allclose(water.reached(most * way, told, air), most)  # what the hottest would have given
    ends = [float(as_heated(water.needed(np.full(2, load), most, air), sign)) for load in (0.0, 0.01, 1.2)]
    assert ends == pytest.approx([303.15, 303.15, 323.15])
    assert water.missed(as_heated(320.0, sign), as_heated(318.0, sign))
    assert not water.missed(as_heated(320.0, sign), as_heated(319.5, sign))


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_plans_pay_for_water_what_it_costs_and_more_where_one_room_asks_more(sign: float) -> None:
    """The sum of what terminals pay for is the price of the water that is told, at the plan; about it, it is convex."""
    rng, water = np.random.default_rng(4), water_of(sign)
    air, most = as_heated(np.full(2, 293.15), sign), np.array([[1.2, 1.0]])
    for _ in range(20):
        loads = rng.uniform(0.35, 0.9, (1, 2))
        line = water.line(loads, most, air)[0]
        said = water.by_kelvin[0] * water.hotter(loads[0], loads[0] / most[0], line)
        true = float(water.bought(loads, water.needed(loads, most, air))[..., 0].sum())
        assert said == pytest.approx(true, abs=0.05 * 800.0)
        begin, way = rng.uniform(0.0, 1.0, 2), rng.normal(0.0, 0.1, 2)
        course = [water.hotter(u, u / most[0], line) for u in (begin, begin + way, begin + 2.0 * way)]
        assert course[0] - 2.0 * course[1] + course[2] > -1e-9
    even, uneven = (water.hotter(u, u / most[0], water.line(None, most, air)[0])
                    for u in (np.array([0.6, 0.6]), np.array([0.2, 1.2])))  # fmt: skip
    assert uneven > even  # of the same heat


def telemetry_of(sign: float, power, moved: bool = True) -> tuple[PlantTelemetry, Loads, dict[str, FloatArray]]:
    """Two weeks of loads, water that is told at random or by the weather, and what power says of both."""
    rng, count = np.random.default_rng(2), 14 * 96
    load = np.repeat(rng.uniform(0.0, 1.0, (count // 8, 2)), 8, axis=0)
    outdoor = 275.0 + np.repeat(rng.normal(0.0, 4.0, 14), 96) + rng.normal(0.0, 0.2, count)
    own = 318.0 - 0.4 * (outdoor - 275.0)
    told = np.repeat(rng.uniform(303.15, 323.15, count // 12), 12) if moved else own
    free = np.repeat(rng.uniform(size=count // 12) < 0.3, 12)
    told = np.where(free, own, told)
    water = told + rng.normal(0.0, 0.1, count)
    bought = power(load @ FULL / FULL.sum(), water, outdoor) + rng.normal(0.0, 60.0, count)
    stamps = pd.date_range("2023-01-09 00:15", periods=count, freq="15min", tz="Etc/GMT-1")
    frame = {f"weather_station/{OUTDOOR_TEMPERATURE}": as_heated(outdoor, sign), sensor_of(NAME): as_heated(water, sign),
             NAME: as_heated(told, sign), f"{SET}{NAME}": np.where(free, np.nan, as_heated(told, sign)),
             "electricity": bought}  # fmt: skip
    for k, room in enumerate(ROOMS):
        frame |= {f"{room}/{HEATING_POWER}": sign * FULL[k] * load[:, k], f"{room}/{ZONE_TEMPERATURE}": 293.15}
    site = Site("rooms", dict.fromkeys(ROOMS, 40.0), PLACE, water=actuator_of(sign))
    telemetry = PlantTelemetry(pd.DataFrame(frame, index=stamps), STEP, site)
    level = np.column_stack([machine_of(room, sign).level(telemetry) for room in ROOMS])
    return telemetry, Loads(level, as_heated(outdoor, sign), np.full(level.shape, 293.15)), {"electricity": bought}


def _heat_pump(load: FloatArray, water: FloatArray, outdoor: FloatArray) -> FloatArray:
    """1.5 % more for a kelvin of water, and what it takes to warm 1.6 MJ/K of it, at a COP of 3 [W]."""
    warms = np.diff(water, prepend=water[:1]) * 1.6e6 / STEP
    bent = np.minimum(load / 0.25, 1.0)
    return np.asarray(200.0 + 500.0 * bent + 3000.0 * load * (1.0 + 0.015 * (water - 313.15)) + warms / 3.0)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_what_a_kelvin_costs_is_told_from_what_water_takes_up(sign: float) -> None:
    telemetry, loads, bought = telemetry_of(sign, _heat_pump)
    machines = [machine_of(room, sign) for room in ROOMS]
    found = find_water(telemetry, machines, loads, bought)
    assert found is not None and found.shares == pytest.approx((0.6, 0.4), abs=0.01)
    whole = sum(machine.full(telemetry) for machine in machines) / FULL.sum()
    curve = found.powers["electricity"]
    assert curve.coefficients["water"] == pytest.approx(3000.0 * whole * 0.15, abs=3.0 * curve.deviations["water"])
    assert curve.coefficients["stored"] == pytest.approx(PER * 1.6e6 / STEP / 3.0, rel=0.03)
    assert curve.deviations["water"] < 0.1 * curve.coefficients["water"]
    measured = telemetry.column(found.sensor)
    np.testing.assert_allclose(
        found.stored(measured)[:, 0], sign * np.diff(measured, prepend=measured[:1]) * 1.6e6 / STEP / 3.0,
        atol=0.03 * np.abs(np.diff(measured)).max() * 1.6e6 / STEP / 3.0,
    )  # fmt: skip
    mild = as_heated(np.array([275.0, 280.0]), sign)  # the plant's own water: 318 K there, 0.4 K less for each kelvin
    np.testing.assert_allclose(as_heated(found.of_plant(mild), sign), [318.0, 316.0], atol=0.2)


def test_nothing_is_decided_where_hot_water_costs_no_more_or_nothing_tells() -> None:
    machines = [machine_of(room, 1.0) for room in ROOMS]
    telemetry, loads, bought = telemetry_of(1.0, lambda load, water, outdoor: 200.0 + 3500.0 * load)
    assert find_water(telemetry, machines, loads, bought) is None  # electric resistance in the loop
    telemetry, loads, bought = telemetry_of(1.0, _heat_pump)
    assert find_water(replace(telemetry, site=replace(telemetry.site, water=None)), machines, loads, bought) is None
    unmeasured = replace(telemetry, frame=telemetry.frame.drop(columns=sensor_of(NAME)))
    with pytest.raises(PlantError, match="telemetry: source/supply_water_temperature_sensor: expected the temperature"):
        find_water(unmeasured, machines, loads, bought)
    by_air = [replace(machines[0], heat="", air=("a", "b", "c")), machines[1]]
    with pytest.raises(PlantError, match="expected setpoints of zones whose heat has a meter, found south/"):
        find_water(telemetry, by_air, loads, bought)


def seen_of(sign: float, zones: FloatArray, heats: FloatArray, outdoor: float, water: float) -> Measurements:
    names = [f"{room}/{point}" for point in (ZONE_TEMPERATURE, HEATING_POWER) for room in ROOMS]
    layout = PointLayout((*names, f"weather_station/{OUTDOOR_TEMPERATURE}", sensor_of(NAME)), "Etc/GMT-1")
    values = [*as_heated(zones, sign), *(sign * heats), as_heated(outdoor, sign), as_heated(water, sign)]
    return Measurements(layout, 0, values)


def test_cold_water_is_no_limit_and_water_that_is_missed_is_one() -> None:
    """Both rooms below their setpoints: because their water is cold, or because its source cannot warm it."""
    relied, zone, outdoor = {}, np.full(2, 291.15), np.full(8, 265.0)
    way = (308.15 - 291.15) / (323.15 - 291.15)
    for told in (308.15, 320.15):
        led = Thermostats(model_of())
        for _ in range(6):
            led.tell_water(np.full(2, (told - 291.15) / 32.0 - 0.1), outdoor[:1], zone)
            for k in range(2):
                led.tell(k, 0.9, 1.0, np.full((1, 2), 293.15), (293.15, 297.15))
            led.learn(seen_of(1.0, zone, way * FULL, 265.0, 308.15), zone, 265.0)
        np.testing.assert_allclose(led.most(outdoor)[0], 1.0, atol=0.1)  # with the hottest water, in either case
        relied[told] = led.together(outdoor)[1]
    assert np.isinf(relied[308.15]) and relied[320.15] < 1.1 * way


def ahead_of(model: PlantModel, count: int = 24) -> Ahead:
    nothing = np.zeros((count, 2))
    return Ahead(
        np.full(count, 265.0), np.empty((count, 0)), nothing, np.tile([0.3, 0.0, 0.0][: len(CARRIERS)], (count, 1)),
        nothing + 293.15, nothing + 297.15, np.ones((count, 2), dtype=bool), np.zeros((count, 2, WEIGHTS)),
        np.full(count, np.inf),
    )  # fmt: skip


def test_a_plan_spreads_its_heat_for_colder_water() -> None:
    """At a constant price, before the band rises: longer, and less at once."""
    plans = {}
    for water in (None, water_of(1.0)):
        model = replace(model_of(), water=water)
        ahead, problem = ahead_of(model), IdentifiedProblem(model)
        lower = ahead.lower.copy()
        lower[:12] = 288.15
        ahead = replace(ahead, lower=lower)
        free, most = np.zeros((24, 2)), np.ones((24, 2))
        state = np.concatenate([np.full(8, 290.15 - 293.15), np.zeros(2)])
        data = problem.data(state, ahead, free, 10.0, (free, most), most=most)
        guess = np.full((24, 2), 0.5)
        found = StageSolver(problem.stage, 24).solve(data, problem.stage.follow(data, guess), guess)
        plans[water is None] = found.decisions
    assert (plans[False] ** 2).sum() < 0.9 * (plans[True] ** 2).sum()
    assert (plans[False] > 0.05).sum() > (plans[True] > 0.05).sum()


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_controller_tells_the_water_of_its_plan(sign: float) -> None:
    model = PlantModel.from_dict(json.loads(json.dumps(model_of(sign).to_dict())))
    assert model.water == water_of(sign)
    actuators = (*(m.machine.actuator for m in model.maps), actuator_of(sign))
    controller = IdentifiedController(model, actuators, PLACE)
    stamps = pd.date_range("2023-01-09 05:15", periods=40, freq="15min", tz="Etc/GMT-1")
    edges = as_heated(np.array([293.15, 297.15]), sign)
    table = {OUTDOOR_TEMPERATURE: as_heated(265.0, sign), "electricity_price": 0.3}
    for room in ROOMS:
        table |= {f"{room}/comfort_lower_temperature": min(edges), f"{room}/comfort_upper_temperature": max(edges)}
    seen = seen_of(sign, np.full(2, 294.65), np.zeros(2), 265.0, 305.0)
    action = controller.step(seen, Forecast(pd.DataFrame(table, index=stamps)))
    assert action.source == "optimal plan"
    levels, zone = action.solution.decisions[:1, :2], action.zone[1]
    told = model.water.needed(levels[0], np.ones(2), zone) if model.water is not None else np.nan
    assert action[NAME] == pytest.approx(float(told), abs=0.5) and 303.15 < as_heated(action[NAME], sign) < 323.15
    hot = model.bought(np.zeros((1, 8)), levels, 265.0, actuator_of(sign).highest)
    cold = model.bought(np.zeros((1, 8)), levels, 265.0, actuator_of(sign).lowest)
    assert sign * float((hot - cold).sum()) == pytest.approx(2.0 * 800.0 * float(levels[0] @ [0.6, 0.4]))
    with pytest.raises(ControlError, match="source/supply_water_temperature_setpoint"):
        IdentifiedController(model, actuators[:2], PLACE)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_an_experiment_moves_the_water_and_gives_it_back_near_the_edge(sign: float) -> None:
    stamps = pd.date_range("2023-01-09 00:15", periods=2000, freq="15min", tz="Etc/GMT-1")
    edges = as_heated(np.array([293.15, 297.15]), sign)
    table = pd.DataFrame({f"{room}/comfort_{side}_temperature": edge for room in ROOMS
                          for side, edge in (("lower", min(edges)), ("upper", max(edges)))}, index=stamps)  # fmt: skip
    machines, water = [machine_of(room, sign) for room in ROOMS], actuator_of(sign)
    moved, still = (Excitation(machines, STEP, ExcitationSettings(seed=3), each) for each in (water, None))
    told = list[float]()
    for k in range(1500):
        warm = seen_of(sign, np.array([295.0, 294.0]), np.zeros(2), 275.0, 310.0)
        chosen, before = (dict(each.step(warm, Forecast(table.iloc[k : k + 48]))) for each in (moved, still))
        told.append(chosen.pop(NAME, np.nan))
        assert chosen == before  # what rooms are told is as it was
    known = np.array(told)[np.isfinite(told)]
    assert 0.2 < np.isnan(told).mean() < 0.4 and water.lowest <= known.min() < known.max() <= water.highest
    assert np.ptp(known) > 18.0
    held = np.diff(np.flatnonzero(np.abs(np.diff(np.nan_to_num(told))) > 0.0))
    assert held.min() >= 4  # an hour
    near = seen_of(sign, np.array([295.0, 293.3]), np.zeros(2), 275.0, 310.0)
    assert NAME not in moved.step(near, Forecast(table.iloc[1500:1548]))
    back = [NAME in moved.step(warm, Forecast(table.iloc[1501 : 1501 + 48])) for _ in range(3)]
    assert not any(back)


@pytest.mark.parametrize("exponent", [1.0, 1.3])
def test_radiators_get_what_is_planned_too(exponent: float) -> None:
    """Of EN 442: in proportion to a power of the difference, of which a reading with cold water says too little."""
    led, zone, outdoor = Thermostats(model_of()), np.full(2, 293.15), np.full(1, 275.0)
    short = []
    for k in range(40):
        plan = np.array([0.3, 0.6]) + 0.2 * np.sin(k / 4.0)
        water = float(led.tell_water(plan, outdoor, zone)[NAME])
        has = ((water - 293.15) / 30.0) ** exponent
        given = np.minimum(plan, has)
        for room in range(2):  # out of reach where not all is given that is wanted
            led.tell(room, float(plan[room]), 2.0, np.full((1, 2), 293.15 + 2.0 * (given[room] < plan[room])),
                     (292.15, 299.15))  # fmt: skip
        led.learn(seen_of(1.0, zone, given * FULL, 275.0, water), zone, 275.0)
        short.append((plan - given).max())
    assert max(short[20:]) < 0.05 and np.mean(short[20:]) < 0.02
