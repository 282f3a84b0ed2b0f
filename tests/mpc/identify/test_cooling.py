"""Machines that cool: what holds of heating holds of them in temperatures that are mirrored about 20 degC."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import astuple, replace

import numpy as np
import pandas as pd
import pytest

from calibration.estimation.state_space import REFERENCE
from calibration.grey_box.network import GreyBox
from mpc.baselines.plants import FullSpeed
from mpc.control.identified.beyond import PowerLearner
from mpc.control.identified.controller import IdentifiedController
from mpc.control.identified.electric import Electric
from mpc.control.identified.thermostats import Thermostats
from mpc.errors import PlantError
from mpc.identify.curves import Curve
from mpc.identify.excitation import Excitation, ExcitationSettings
from mpc.identify.identify import identify
from mpc.identify.machines import Machine, as_heated, find_machines, pairs_as_heated
from mpc.identify.maps import MachineMap, OwnPower
from mpc.identify.model import PlantModel
from mpc.identify.telemetry import SET, PlantTelemetry, Site
from mpc.loop.actuators import COOLING_SETPOINT, HEATING_SETPOINT, Actuator
from mpc.loop.plant import Measurements, PointLayout
from mpc.scenario.forecast import Forecast
from thermal._types import FloatArray
from thermal.case.building import Location
from thermal.case.points import HEATING_POWER, OUTDOOR_TEMPERATURE, SUPPLY_FLOW, ZONE_TEMPERATURE

ROOMS, STEP, POWER = ("south", "north"), 900.0, "electrical_power_sensor"
PLACE = Location(latitude=50.8, longitude=4.35, elevation=100.0, timezone="Etc/GMT-1")
POINTS = {1.0: HEATING_SETPOINT, -1.0: COOLING_SETPOINT}
BANDS = {1.0: ("lower", "upper"), -1.0: ("upper", "lower")}


def setpoint_of(room: str, sign: float) -> str:
    return f"{room}/{POINTS[sign]}"


def machine_of(room: str, sign: float, *, more: bool = False) -> Machine:
    """A setpoint with measured heat; with `more` power of its own, and the zone's other setpoint beside it."""
    own, other = (Actuator(setpoint_of(room, s), "K", 280.0, 306.3) for s in (sign, -sign))
    found = Machine(own, "setpoint", (room,), f"{room}/{HEATING_POWER}")
    return replace(found, power=f"{room}/{POWER}", beside=other) if more else found


def model_of(
    sign: float, shared: tuple[tuple[float, float], ...] = (), sheet: tuple[tuple[float, float], ...] = ()
) -> PlantModel:
    """Two rooms with terminals of 4 kW, whose limits and common limit are those of the mirror."""
    heat, box = Curve({"command": 4000.0}, {}), {room: 40.0 for room in ROOMS}
    limits = tuple(sorted((as_heated(outdoor, sign), load) for outdoor, load in ((270.0, 0.9), (278.0, 1.0))))
    maps = tuple(
        MachineMap(machine_of(room, sign, more=True), "setpoint", heat, {"electricity": Curve({"command": 1500.0}, {})},
                   (-0.1, 0.3), limits)
        for room in ROOMS
    )  # fmt: skip
    network = GreyBox.start(box, (), {m.machine.name: m.machine.serves for m in maps}, (True, True))
    common = [pairs_as_heated(pairs, sign) for pairs in (shared, sheet)]
    return PlantModel("rooms", STEP, network, maps, shared=common[0], sheet=common[1])


def forecast_of(sign: float, outdoor: FloatArray, begin: str = "2023-01-09 05:15") -> pd.DataFrame:
    stamps = pd.date_range(begin, periods=len(outdoor), freq="15min", tz="Etc/GMT-1")
    hours = np.arange(len(outdoor)) // 4
    edges = np.where((hours % 24 >= 3) & (hours % 24 < 13), 293.15, 288.15), np.full(len(outdoor), 297.15)
    table = {OUTDOOR_TEMPERATURE: as_heated(outdoor, sign), "electricity_price": 0.2 + 0.1 * (hours % 5 == 0)}
    for room in ROOMS:
        table |= {f"{room}/comfort_{side}_temperature": as_heated(edge, sign)
                  for side, edge in zip(BANDS[sign], edges, strict=True)}  # fmt: skip
        table |= {f"{room}/internal_gain": sign * 100.0, f"{room}/occupancy_count_sensor": 1.0}
    return pd.DataFrame(table, index=stamps)


def seen_of(sign: float, second: int, zones: FloatArray, heats: FloatArray, outdoor: float) -> Measurements:
    names = [f"{room}/{point}" for point in (ZONE_TEMPERATURE, HEATING_POWER, POWER) for room in ROOMS]
    layout = PointLayout((*names, f"weather_station/{OUTDOOR_TEMPERATURE}"), "Etc/GMT-1")
    return Measurements(
        layout, second, [*as_heated(zones, sign), *(sign * heats), *(20.0 + 0.5 * heats), as_heated(outdoor, sign)]
    )


@pytest.mark.parametrize(
    "sheet", [(), ((258.0, 0.3), (273.0, 0.65), (288.0, 1.0))], ids=["no data sheet", "a data sheet"]
)
@pytest.mark.parametrize("electric", [None, Electric(demand=2.0)])
def test_a_controller_that_cools_does_what_one_that_heats_does_in_the_mirror(electric: Electric | None, sheet) -> None:
    rng = np.random.default_rng(3)
    outdoor = 273.0 + 5.0 * np.sin(np.arange(80) / 12.0)
    zones = 293.0 + np.cumsum(rng.normal(0.0, 0.25, (20, 2)), axis=0)
    heats = rng.uniform(0.0, 3600.0, (20, 2))
    told, kept = {}, {}
    rules: dict[float, list[tuple[float, ...]]] = {1.0: [], -1.0: []}
    for sign in (1.0, -1.0):
        model = model_of(sign, ((272.0, 0.7),), sheet)
        there = [a for m in model.maps for a in (m.machine.actuator, m.machine.beside) if a is not None]
        controller = IdentifiedController(model, tuple(there), PLACE, electric=electric)
        forecast = forecast_of(sign, outdoor)
        rows = []
        for k in range(20):
            second = int(forecast.index[k].timestamp()) - 900
            seen = seen_of(sign, second, zones[k], heats[k], outdoor[max(k - 1, 0)])
            action = controller.step(seen, Forecast(forecast.iloc[k : k + 32]))
            assert action.source == "optimal plan"
            rows.append([as_heated(action[setpoint_of(room, s)], sign) for s in (sign, -sign) for room in ROOMS])
            if action.compare is not None:
                rules[sign].append(astuple(action.compare()))
        told[sign] = np.array(rows)
        assert controller.conformal is not None and controller.conformal.count == 38
        kept[sign] = controller.conformal.values
    np.testing.assert_allclose(told[1.0], told[-1.0], atol=2e-3)
    np.testing.assert_allclose(kept[1.0], kept[-1.0])
    np.testing.assert_allclose(rules[1.0], rules[-1.0], atol=2e-3)
    assert np.ptp(told[1.0][:, :2]) > 2.0 and controller.conformal.outside > 0  # of something that happened
    assert (told[1.0][:, 2:] >= told[1.0][:, :2] + 1.0 - 1e-9).all()
    assert electric is not None or (np.abs(rules[1.0]).max(axis=0) > 0.05).all()


def test_power_of_their_own_is_learned_by_what_is_taken() -> None:
    """At 20 degC, which is its own mirror: a compressor of 2.1 kW where the map says 1.5."""
    weights = []
    for sign in (1.0, -1.0):
        model = model_of(sign)
        own = OwnPower(Curve({"command": 1500.0}, {}), 20.0)
        model = replace(model, maps=tuple(replace(m, own=own) for m in model.maps))
        learner = PowerLearner(model)
        seen = seen_of(sign, 0, np.full(2, 293.0), np.array([4000.0, 2000.0]), REFERENCE)
        learner.learn(seen, np.zeros(2), REFERENCE, np.zeros(10))
        weights.append(learner.along(np.array([REFERENCE]), np.ones((1, 2))))
    np.testing.assert_allclose(weights[0], weights[1])
    assert weights[0][0, 0].sum() > 100.0


def telemetry_of(sign: float, rows: Mapping[str, FloatArray]) -> PlantTelemetry:
    """Five days of a room, as they are or in the mirror."""
    stamps = pd.date_range("2023-01-09 00:15", periods=len(rows["outdoor"]), freq="15min", tz="Etc/GMT-1")
    frame = {
        f"weather_station/{OUTDOOR_TEMPERATURE}": as_heated(rows["outdoor"], sign), "electricity": rows["bought"],
        f"south/{ZONE_TEMPERATURE}": as_heated(rows["zone"], sign), f"south/{HEATING_POWER}": sign * rows["heat"],
        f"{SET}{setpoint_of('south', sign)}": as_heated(rows["setpoint"], sign),
    }  # fmt: skip
    return PlantTelemetry(pd.DataFrame(frame, index=stamps), STEP, Site("room", {"south": 40.0}, PLACE))


@pytest.fixture(scope="module")
def recorded() -> dict[str, FloatArray]:
    """Air and walls of a room under a proportional thermostat of 3 kW that is asked for much on cold mornings."""
    rng, count = np.random.default_rng(1), 5 * 96
    hours = np.arange(count) / 4.0
    outdoor = 272.0 + 4.0 * np.sin(2.0 * np.pi * (hours - 9.0) / 24.0) + np.cumsum(rng.normal(0.0, 0.1, count))
    setpoint = np.repeat(rng.uniform(289.0, 296.0, count // 6), 6)
    air, wall, zone, heat = 291.0, 289.0, np.empty(count), np.empty(count)
    for k in range(count):
        parts = []
        for _ in range(15):
            given = 3000.0 * np.clip((setpoint[k] - air) / 0.6, 0.0, 1.0)
            air += 60.0 / 6e5 * (given + 200.0 * (wall - air) + 30.0 * (outdoor[k] - air))
            wall += 60.0 / 8e6 * (200.0 * (air - wall) + 40.0 * (outdoor[k] - wall))
            parts.append((air, given))
        zone[k], heat[k] = np.mean(parts, axis=0)
    zone += rng.normal(0.0, 0.02, count)
    return {"outdoor": outdoor, "setpoint": setpoint, "zone": zone, "heat": heat, "bought": 150.0 + heat / 3.0}


def test_what_is_identified_of_cooling_is_that_of_heating_in_the_mirror(recorded: dict[str, FloatArray]) -> None:
    found = {s: identify(telemetry_of(s, recorded), [machine_of("south", s)]) for s in (1.0, -1.0)}
    heated, cooled = found[1.0], found[-1.0]
    errors = [[error.grey_box for error in each.errors] for each in (heated, cooled)]
    np.testing.assert_allclose(errors[0], errors[1], rtol=2e-3)
    assert max(errors[0]) < 0.6 and cooled.model.sign == -1.0
    for a, b in zip(heated.model.maps, cooled.model.maps, strict=True):
        assert a.above == pytest.approx(b.above, abs=1e-6) and 0.0 < a.above[1] < 1.0
        mirrored = sorted((as_heated(outdoor, -1.0), load) for outdoor, load in b.limits)
        np.testing.assert_allclose(a.limits, mirrored, rtol=1e-6)
        assert len(a.limits) > 1 and b.heat.coefficients["command"] > 2000.0
    assert float(cooled.model.heat(np.zeros((1, 4)), np.ones((1, 1)), 303.15)[0, 0]) < -2000.0
    assert PlantModel.from_dict(cooled.model.to_dict()).sign == -1.0


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("point", ["discharge_air_temperature_sensor", "supply_air_temperature_sensor"])
def test_heat_of_supply_air_is_as_good_as_a_meter(recorded: dict[str, FloatArray], sign: float, point: str) -> None:
    """Of a terminal whose flow and temperature are measured, as of VAV boxes: 1006 J/kg/K by ASHRAE's handbook."""
    telemetry = telemetry_of(sign, recorded)
    flow = 0.2 + 0.1 * (recorded["heat"] > 1000.0)
    heat, zone = telemetry.frame[f"south/{HEATING_POWER}"], telemetry.frame[f"south/{ZONE_TEMPERATURE}"]
    air = {f"south/{SUPPLY_FLOW}": flow, f"south/{point}": zone + heat / (1006.0 * flow)}
    by_air = replace(telemetry, frame=telemetry.frame.drop(columns=f"south/{HEATING_POWER}").assign(**air))
    columns = [str(c) for c in by_air.frame if not str(c).startswith(SET)]
    there = [Actuator(setpoint_of("south", sign), "K", 280.0, 306.3)]
    (machine,) = find_machines(there, columns, ["south"], cooling=sign < 0.0)
    assert machine.heat == "" and machine.meter == f"south/{SUPPLY_FLOW}"
    found, metered = identify(by_air, [machine]), identify(telemetry, [machine_of("south", sign)])
    np.testing.assert_allclose(found.loads.level, metered.loads.level, atol=1e-9)
    np.testing.assert_allclose(found.model.maps[0].limits, metered.model.maps[0].limits)
    gap = by_air.frame.copy()
    gap.iloc[100:150, gap.columns.get_loc(f"south/{ZONE_TEMPERATURE}")] = np.nan  # twelve hours are no 0 K
    assert machine.full(replace(by_air, frame=gap)) == pytest.approx(machine.full(by_air), rel=0.05)
    again = PlantModel.from_dict(found.model.to_dict()).maps[0].machine
    layout = PointLayout(again.air, "Etc/GMT-1")
    assert again.given(Measurements(layout, 0, [0.2, 293.0 + sign * 5.0, 293.0])) == pytest.approx(1006.0)
    assert np.isnan(again.given(Measurements(PointLayout(again.air[:2], "Etc/GMT-1"), 0, [0.2, 300.0])))


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_data_sheet_of_a_source_is_a_share_of_all_full_loads(recorded: dict[str, FloatArray], sign: float) -> None:
    telemetry = telemetry_of(sign, recorded)
    later = telemetry.frame.shift(8).bfill()  # the same room, two hours later
    both = {f"north/{p}": later[f"south/{p}"] for p in (ZONE_TEMPERATURE, HEATING_POWER)}
    both[f"{SET}{setpoint_of('north', sign)}"] = later[f"{SET}{setpoint_of('south', sign)}"]
    sheet = pairs_as_heated(((255.0, 2000.0), (280.0, 4500.0)), sign)
    site = Site("rooms", {"south": 40.0, "north": 40.0}, PLACE, sheet)
    machines = [machine_of(room, sign) for room in ROOMS]
    found = identify(replace(telemetry, frame=telemetry.frame.assign(**both), site=site), machines).model
    whole = float(found.led_heat.sum())
    assert [pair[1] * whole for pair in pairs_as_heated(found.sheet, sign)] == pytest.approx([2000.0, 4500.0])
    again = PlantModel.from_dict(found.to_dict())
    assert again.sheet == found.sheet
    told = Thermostats(again).together(np.array([as_heated(255.0, sign)] * 2))
    assert told[1] == pytest.approx(0.95 * 2000.0 / whole, rel=0.1) and told[0] < 0.5
    with pytest.raises(PlantError, match="source: expected setpoints of all zones"):
        identify(replace(telemetry, site=replace(site, areas={"south": 40.0})), machines[:1])


def test_setpoints_of_cooling_are_chosen_when_they_are_asked_for() -> None:
    actuators = [Actuator(setpoint_of(room, sign), "K", 285.0, 305.0) for room in ROOMS for sign in (1.0, -1.0)]
    columns = [f"{room}/{HEATING_POWER}" for room in ROOMS]
    heating = find_machines(actuators, columns, ROOMS)
    cooling = find_machines(actuators, columns, ROOMS, cooling=True)
    assert [m.name for m in heating] == [setpoint_of(room, 1.0) for room in ROOMS]
    assert [m.name for m in cooling] == [setpoint_of(room, -1.0) for room in ROOMS]
    assert {m.sign for m in heating} == {1.0} and {m.sign for m in cooling} == {-1.0}
    assert all(m.role == "setpoint" and m.heat == f"{m.serves[0]}/{HEATING_POWER}" for m in cooling)
    assert cooling[0].beside == heating[0].actuator and heating[1].beside == cooling[1].actuator
    both = (setpoint_of("south", 1.0), setpoint_of("north", -1.0))
    with pytest.raises(PlantError, match="machines that all heat, or all cool"):
        find_machines(actuators, columns, ROOMS, both)
    with pytest.raises(PlantError, match="expected a zone_air_cooling_temperature_setpoint"):
        find_machines(actuators[::2], columns, ROOMS, cooling=True)
    with pytest.raises(PlantError, match="expected setpoints of cooling alone, found south/zone_air_heating"):
        find_machines(actuators, columns, ROOMS, both[:1], cooling=True)


@pytest.mark.parametrize("ends", [(280.0, 306.3), (291.15, 297.15)])
def test_setpoints_of_a_zone_never_cross(ends: tuple[float, float]) -> None:
    """Also where the other one's range ends first: the setpoint gives way."""
    for sign in (1.0, -1.0):
        machine, other = machine_of("south", sign, more=True), 297.15 if sign > 0.0 else 293.15
        assert machine.beside is not None
        machine = replace(machine, beside=replace(machine.beside, lowest=ends[0], highest=ends[1]))
        for value in np.linspace(284.0, 304.0, 21):
            told = machine.told(float(value), other)
            apart = told[setpoint_of("south", -1.0)] - told[setpoint_of("south", 1.0)]
            assert apart >= 1.0 - 1e-9 and ends[0] <= told[setpoint_of("south", -sign)] <= ends[1]
            assert told[machine.name] == value or ends[0] > 285.0
    heating = machine_of("south", 1.0, more=True)
    assert heating.told(293.15, 297.15)[setpoint_of("south", -1.0)] == 297.15  # at its edge where there is room
    assert machine_of("south", 1.0).told(293.15, 297.15) == {heating.name: 293.15}


def test_what_the_plant_has_of_a_zone_is_kept_clear_of() -> None:
    """Setpoints of heating that cannot be told: as they are measured, else in the other half of the band."""
    cooling, near, far = machine_of("south", -1.0), as_heated(297.15, -1.0), as_heated(293.15, -1.0)
    stops = [as_heated(each, -1.0) for each in (
        cooling.farthest(near, far, {setpoint_of("south", 1.0): 294.15}), cooling.farthest(near, far, {}),
        machine_of("south", -1.0, more=True).farthest(near, far, {setpoint_of("south", 1.0): 294.15}),
    )]  # fmt: skip
    assert stops == pytest.approx([295.15, 295.15, 293.15])
    assert machine_of("south", 1.0).farthest(293.15, 297.15, {}) == 297.15
    assert machine_of("south", 1.0).farthest(293.15, 297.15, {setpoint_of("south", -1.0): 296.15}) == 295.15


def test_a_controller_keeps_to_the_plant_that_it_runs() -> None:
    """Whose ranges are narrower than where the model was identified, and which lacks the other setpoint."""
    model = model_of(-1.0)
    narrow = tuple(replace(m.machine.actuator, lowest=296.0, highest=300.0) for m in model.maps)
    controller = IdentifiedController(model, narrow, PLACE)
    forecast = forecast_of(-1.0, np.full(32, 265.0))
    seen = seen_of(-1.0, int(forecast.index[0].timestamp()) - 900, np.full(2, 288.5), np.zeros(2), 265.0)
    action = controller.step(seen, Forecast(forecast))
    assert set(action) == {a.name for a in narrow} and all(296.0 <= value <= 300.0 for value in action.values())
    assert {m.machine.beside for m in controller.model.maps} == {None}


def test_the_rule_cools_to_the_lowest_edge_of_the_coming_hours() -> None:
    machine = machine_of("south", -1.0, more=True)
    table = forecast_of(-1.0, np.full(32, 290.0))
    upper = table["south/comfort_upper_temperature"].to_numpy()
    assert upper[0] == as_heated(288.15, -1.0) and upper[12] == as_heated(293.15, -1.0)
    seen = seen_of(-1.0, 0, np.full(2, 293.0), np.zeros(2), 290.0)
    for first, edge in ((0, 288.15), (1, 293.15)):  # an hour or less than three before the edge falls
        told = FullSpeed([machine]).step(seen, Forecast(table.iloc[first:]))
        assert told[setpoint_of("south", -1.0)] == pytest.approx(as_heated(edge, -1.0))
        assert told[setpoint_of("south", 1.0)] == pytest.approx(as_heated(297.15, -1.0))


@pytest.mark.parametrize("beside", [False, True])
def test_an_excitation_stays_clear_of_the_heating(beside: bool) -> None:
    machine = machine_of("south", -1.0, more=beside)
    table = forecast_of(-1.0, np.full(2000, 290.0))
    low, high = as_heated(297.15, -1.0), as_heated(293.15, -1.0)
    excitation, cooled = Excitation([machine], STEP, ExcitationSettings(seed=1)), []
    for k in range(12, 52):  # while people are in
        seen = seen_of(-1.0, 0, np.full(2, 293.0), np.zeros(2), 290.0)
        told = excitation.step(seen, Forecast(table.iloc[12 + k % 4 : 12 + k % 4 + 48]))
        cooled.append(told[machine.name])
        if beside:  # at the edge of the coming steps, clear of the cooling
            assert told[setpoint_of("south", 1.0)] == pytest.approx(min(low, told[machine.name] - 1.0))
    assert low + 0.2 - 1e-9 <= min(cooled) and max(cooled) <= high - 0.2 + 1e-9 and np.ptp(cooled) > 1.0
    assert (min(cooled) < 0.5 * (low + high)) == beside


def test_an_excitation_that_cools_counts_the_edges_of_the_mirror() -> None:
    """Three hours of the edge that it cools to and twelve of the other; a night's heating stays at the night's edge."""
    stamps = pd.date_range("2023-07-10 00:15", periods=96, freq="15min", tz="Etc/GMT-1")
    hours = np.arange(96) / 4.0
    day = (hours >= 6.0) & (hours < 16.0)
    table = pd.DataFrame({"south/comfort_lower_temperature": np.where(day, 293.15, 288.15),
                          "south/comfort_upper_temperature": np.where(day, 297.15, 303.15)}, index=stamps)  # fmt: skip
    layout = PointLayout((f"south/{ZONE_TEMPERATURE}",), "Etc/GMT-1")
    cooled, heated = [], []
    for seed in range(40):
        excitation = Excitation([machine_of("south", -1.0, more=True)], STEP, ExcitationSettings(seed=seed))
        told = excitation.step(Measurements(layout, 0, [298.0]), Forecast(table.iloc[4:64]))  # five hours before
        cooled.append(told[setpoint_of("south", -1.0)])
        heated.append(told[setpoint_of("south", 1.0)])
    assert 293.35 <= min(cooled) < 295.0 and 300.0 < max(cooled) <= 302.95 and set(heated) == {288.15}


def test_a_sensor_that_cooling_does_not_move_is_of_what_heats(recorded: dict[str, FloatArray]) -> None:
    telemetry = telemetry_of(-1.0, recorded)
    radiator = replace(telemetry, frame=telemetry.frame.assign(**{f"south/{HEATING_POWER}": 0.0}))
    with pytest.raises(PlantError, match="expected negative heat while the zone is cooled"):
        identify(radiator, [machine_of("south", -1.0)])
    frame = radiator.frame.assign(**{f"south/{POWER}": recorded["heat"] / 3.0})
    found = identify(replace(radiator, frame=frame), [machine_of("south", -1.0, more=True)])
    assert found.model.maps[0].machine.heat == "" and found.model.box.metered == (False,)
    assert float(found.model.heat(np.zeros((1, 4)), np.ones((1, 1)), 303.15)[0, 0]) < -500.0
    assert any("no heat of south/zone_air_cooling" in note for note in found.notes)


def test_a_mirror_is_its_own_inverse() -> None:
    assert as_heated(as_heated(301.0, -1.0), -1.0) == 301.0 and as_heated(301.0, 1.0) == 301.0
    assert as_heated(REFERENCE, -1.0) == REFERENCE
