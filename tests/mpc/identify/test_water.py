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
from mpc.identify.identify import Identified, identify
from mpc.identify.machines import Machine, as_heated
from mpc.identify.maps import MachineMap
from mpc.identify.model import PlantModel
from mpc.identify.regression import Loads
from mpc.identify.telemetry import CARRIERS, SET, PlantTelemetry, Site
from mpc.identify.water import SupplyWater, sensor_of
from mpc.identify.water_regression import WaterCourse, decided_water, find_water
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
        actuator_of(sign), sign, (0.6, 0.4), {"electricity": curve}, float(as_heated(313.15, sign)), own,
        float(as_heated(323.15, sign)),
    )  # fmt: skip


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
        np.testing.assert_allclose(water.reached(most * way, told, air, told), most)  # what the hottest would have given
        assert np.isnan(water.reached(most * way, told, air, as_heated(323.15, sign))).all()  # radiators still hot
        assert np.isnan(water.reached(most * way, as_heated(290.0, sign), air, as_heated(290.0, sign))).all()
    ends = [float(as_heated(water.needed(np.full(2, load), most, air), sign)) for load in (0.0, 0.01, 1.2)]
    assert ends == pytest.approx([303.15, 303.15, 323.15])
    assert water.missed(as_heated(320.0, sign), as_heated(317.0, sign))
    low = replace(water, below=1.5)  # a sensor, or a controller with a band
    assert not any(each.missed(as_heated(320.0, sign), as_heated(318.2, sign)) for each in (water, low))
    assert not low.missed(as_heated(320.0, sign), as_heated(317.0, sign))


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


def _worth(telemetry: PlantTelemetry, sign: float, loads: Loads, bought: dict[str, FloatArray]) -> SupplyWater | None:
    machines = [machine_of(room, sign) for room in ROOMS]
    course = WaterCourse.of(telemetry, machines)
    assert course is not None
    return find_water(course, telemetry, machines, loads, bought)


@pytest.mark.parametrize("gap", [0, 30])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_what_a_kelvin_costs_is_told_from_what_water_takes_up(sign: float, gap: int) -> None:
    telemetry, loads, bought = telemetry_of(sign, _heat_pump)
    telemetry.frame.loc[telemetry.frame.index[400 : 400 + gap], sensor_of(NAME)] = np.nan  # of hours: not bridged
    found = _worth(telemetry, sign, loads, bought)
    assert found is not None and found.shares == pytest.approx((0.6, 0.4), abs=0.01)
    whole = sum(machine_of(room, sign).full(telemetry) for room in ROOMS) / FULL.sum()
    curve = found.powers["electricity"]
    assert curve.coefficients["water"] == pytest.approx(3000.0 * whole * 0.15, abs=3.0 * curve.deviations["water"])
    assert curve.coefficients["stored"] == pytest.approx(PER * 1.6e6 / STEP / 3.0, rel=0.03)
    assert curve.deviations["water"] < 0.1 * curve.coefficients["water"]
    assert found.below == pytest.approx(0.0, abs=0.1) and found.hottest == as_heated(323.15, sign)
    warmer = as_heated(np.array([310.0, 313.0, 313.0, 311.0]), sign)
    warms = np.array([0.0, 3.0, 0.0, -2.0]) * 1.6e6 / STEP / 3.0
    np.testing.assert_allclose(found.stored(warmer)[:, 0], warms, rtol=0.03)
    mild = as_heated(np.array([275.0, 280.0]), sign)  # the plant's own water: 318 K there, 0.4 K less for each kelvin
    np.testing.assert_allclose(as_heated(found.of_plant(mild), sign), [318.0, 316.0], atol=0.2)


def test_nothing_is_decided_where_hot_water_costs_no_more_or_nothing_tells() -> None:
    resistance = telemetry_of(1.0, lambda load, water, outdoor: 200.0 + 3500.0 * load)
    assert _worth(resistance[0], 1.0, *resistance[1:]) is None
    telemetry, loads, bought = telemetry_of(1.0, _heat_pump, moved=False)
    telemetry = replace(telemetry, frame=telemetry.frame.drop(columns=f"{SET}{NAME}"))
    assert _worth(telemetry, 1.0, loads, bought) is None  # its own reset alone, which the weather explains
    machines = [machine_of(room, 1.0) for room in ROOMS]
    unmeasured = replace(telemetry, frame=telemetry.frame.drop(columns=sensor_of(NAME)))
    with pytest.raises(PlantError, match="telemetry: source/supply_water_temperature_sensor: expected the temperature"):
        WaterCourse.of(unmeasured, machines)
    by_air = [replace(machines[0], heat="", air=("a", "b", "c")), machines[1]]
    others = replace(telemetry.site, water=None)
    assert decided_water(telemetry.site, machines) == actuator_of(1.0)
    for site, found in ((others, machines), (telemetry.site, by_air), (telemetry.site, machines[:1])):
        assert decided_water(site, found) is None


@pytest.fixture(scope="module")
def rooms() -> dict[str, FloatArray]:
    """Ten days of two rooms, each a thermostat with a terminal of 200 W for a kelvin of its water over its air."""
    rng, count = np.random.default_rng(5), 10 * 96
    hour = np.arange(count) / 4.0
    outdoor = 274.0 + 4.0 * np.sin(2.0 * np.pi * (hour - 9.0) / 24.0) + np.repeat(rng.normal(0.0, 3.0, 10), 96)
    setpoint = np.repeat(rng.uniform(289.0, 296.0, (count // 8, 2)), 8, axis=0)
    told = np.repeat(rng.uniform(303.15, 323.15, count // 12), 12)
    told[np.repeat(rng.uniform(size=count // 12) < 0.3, 12)] = np.nan
    water = np.where(np.isnan(told), 312.0, told) + rng.normal(0.0, 0.1, count)
    zone, heat = np.full((count, 2), 292.0), np.zeros((count, 2))
    air, wall = np.full(2, 292.0), np.full(2, 290.0)
    for k in range(count):
        parts = []
        for _ in range(5):
            wanted = np.maximum(setpoint[k] - air, 0.0) / 0.3
            given = np.minimum(wanted, 1.0) * 200.0 * np.maximum(water[k] - air, 0.0)
            air = air + 180.0 / 1.2e6 * (given + 250.0 * (wall - air) + 60.0 * (outdoor[k] - air))
            wall = wall + 180.0 / 9e6 * (250.0 * (air - wall) + 60.0 * (outdoor[k] - wall))
            parts.append((air, given))
        zone[k], heat[k] = np.mean(parts, axis=0)
    load = heat.sum(axis=1) / 12_000.0
    bought = _heat_pump(load, water, outdoor) + rng.normal(0.0, 30.0, count)
    return {"outdoor": outdoor, "setpoint": setpoint, "told": told, "water": water, "zone": zone, "heat": heat,
            "bought": bought}  # fmt: skip


def _identified(rooms: dict[str, FloatArray], sign: float, bought: FloatArray) -> Identified:
    own = np.where(np.isnan(rooms["told"]), 312.0, rooms["told"])
    frame = {f"weather_station/{OUTDOOR_TEMPERATURE}": as_heated(rooms["outdoor"], sign), "electricity": bought,
             sensor_of(NAME): as_heated(rooms["water"], sign), NAME: as_heated(own, sign),
             f"{SET}{NAME}": as_heated(rooms["told"], sign)}  # fmt: skip
    for k, room in enumerate(ROOMS):
        frame |= {f"{room}/{ZONE_TEMPERATURE}": as_heated(rooms["zone"][:, k], sign),
                  f"{room}/{HEATING_POWER}": sign * rooms["heat"][:, k],
                  f"{SET}{room}/{POINTS[sign]}": as_heated(rooms["setpoint"][:, k], sign)}  # fmt: skip
    stamps = pd.date_range("2023-01-09 00:15", periods=len(own), freq="15min", tz="Etc/GMT-1")
    site = Site("rooms", dict.fromkeys(ROOMS, 40.0), PLACE, water=actuator_of(sign))
    telemetry = PlantTelemetry(pd.DataFrame(frame, index=stamps), STEP, site)
    return identify(telemetry, [machine_of(room, sign) for room in ROOMS])


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_limits_are_those_of_the_hottest_water_and_maps_those_of_one(rooms: dict[str, FloatArray], sign: float) -> None:
    """Whatever the water was: 200 W for a kelvin that it has over rooms of 17 degC, and power told apart from it."""
    found = _identified(rooms, sign, rooms["bought"])
    model = found.model
    assert model.water is not None and model.shared == () and found.notes == tuple(
        note for note in found.notes if "left to the plant" not in note
    )  # fmt: skip
    full = model.led_heat
    for k, each in enumerate(model.maps):
        most = np.array([load for _, load in each.limits]) * full[k]
        assert len(most) > 3 and np.median(most) == pytest.approx(200.0 * (323.15 - 290.5), rel=0.04)
        assert most.min() > 0.85 * np.median(most) and most.max() < 1.15 * np.median(most)
    share = model.water.by_kelvin[0] * PER / full.sum()
    assert share == pytest.approx(3000.0 * 0.15 / 12_000.0, rel=0.15)
    loads = np.array([[0.5, 0.5]])
    given = float(loads[0] @ full) / 12_000.0
    for water in (308.15, 318.15):
        said = model.bought(np.zeros((1, 8)), loads, as_heated(np.array([275.0]), sign), as_heated(water, sign)).sum()
        true = float(_heat_pump(np.array([given]), np.array([water]), np.array([275.0]))[0])
        assert said + model.base["electricity"] == pytest.approx(true, rel=0.05)


def test_water_that_is_left_to_the_plant_is_no_limit_either_and_is_said(rooms: dict[str, FloatArray]) -> None:
    """Resistance in the loop: what rooms have with the water of the experiment says nothing of the plant's own."""
    bought = 200.0 + rooms["heat"].sum(axis=1) + np.random.default_rng(7).normal(0.0, 50.0, len(rooms["heat"]))
    found = _identified(rooms, 1.0, bought)
    assert found.model.water is None and found.model.shared == ()
    assert any(note.startswith(f"{NAME} is left to the plant: it was told in ") for note in found.notes)
    for k, each in enumerate(found.model.maps):
        most = np.array([limit for _, limit in each.limits]) * found.model.led_heat[k]
        assert most.max() < 1.06 * 200.0 * (312.0 - 289.5)


def test_a_narrower_range_of_water_leaves_less() -> None:
    """Of the plant that a model runs: what is told is what gives the plan, and no plan wants more than it can."""
    model = model_of()
    narrow = Actuator(NAME, "K", 303.15, 313.15)
    bound = model.bound([*(m.machine.actuator for m in model.maps), narrow])
    assert bound.water is not None and model.water is not None and bound.water.actuator == narrow
    air, loads, most = np.full(2, 293.15), np.array([0.4, 0.4]), np.ones(2)
    assert bound.water.needed(loads, most, air) == pytest.approx(float(model.water.needed(loads, most, air)))
    assert float(bound.water.needed(np.full(2, 0.8), most, air)) == 313.15
    np.testing.assert_allclose(bound.water.share(air), 20.0 / 30.0)
    np.testing.assert_allclose(model.water.share(air), 1.0)
    led, outdoor = Thermostats(bound), np.full(1, 275.0)
    led.learn(seen_of(1.0, air, np.zeros(2), 275.0, 310.0), air, 275.0)
    np.testing.assert_allclose(led.most(outdoor), led.with_hottest(outdoor) * 20.0 / 30.0)


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
        np.full(count, np.inf), np.zeros(count, dtype=int), np.zeros(count),
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
