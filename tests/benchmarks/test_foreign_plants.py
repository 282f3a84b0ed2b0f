"""Plants to develop on: curves and prices by hand, and in EnergyPlus heat that arrives, and overwrites that reach."""

from __future__ import annotations

import importlib.util
import json
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pandas as pd
import pytest
import yaml

from mpc.adapters.described.load import load_plant
from mpc.errors import ControlError
from mpc.identify.curves import EMITTER
from mpc.identify.excitation import ExcitationSettings
from mpc.identify.machines import Machine, find_machines
from mpc.identify.regression import Loads
from mpc.identify.water_regression import WaterCourse, find_water
from mpc.loop.actuators import Actuator
from mpc.loop.plant import Measurements, PointLayout
from mpc.loop.run import run_closed_loop
from mpc.scenario.forecast import Forecast
from mpc.studies.described import PlantStudy
from mpc.studies.excited import experiment_period, run_experiment
from thermal.case.points import HEATING_POWER, ZONE_TEMPERATURE

_WITHOUT = importlib.util.find_spec("pyenergyplus") is None


def needs_energyplus(test: Callable[..., None]) -> Callable[..., None]:
    """Skip a test where EnergyPlus is not installed."""
    return pytest.mark.skipif(_WITHOUT, reason="needs the extra [energyplus]")(pytest.mark.energyplus(test))


SPEED, CIRCULATOR = "heat_pump/compressor_speed", "floor/pump"


@pytest.fixture(scope="module")
def models(package: Callable[[str], ModuleType]) -> Callable[[str], ModuleType]:
    package("energyplus_trials.frame")  # neighbours that the plants are made with
    return lambda name: package(f"foreign_models.{name}")


@pytest.fixture(scope="module")
def made(models: Callable[[str], ModuleType], tmp_path_factory: pytest.TempPathFactory) -> Callable[..., Any]:
    folder = tmp_path_factory.mktemp("plants")

    def run(name: str, controller: Any, steps: int, start: str = "2023-01-09") -> pd.DataFrame:
        path, short = folder / name / "plant.yaml", {"start": start, "days": 2, "warm_up_days": 1}
        if not path.exists():
            models("plants").write_plant(name, folder)
        with load_plant(path, changes={"period": short}) as plant:
            return run_closed_loop(plant, controller, steps=steps).measurements

    return run


class Held:
    """Actions of the control steps: what holds from each step on."""

    def __init__(self, changes: dict[int, dict[str, float]]) -> None:
        self.changes, self.count, self.now = changes, 0, dict[str, float]()

    def step(self, measurements: Any, forecast: Forecast | None) -> dict[str, float]:
        self.now = self.changes.get(self.count, self.now)
        self.count += 1
        return self.now


def test_curves_of_a_heat_pump_follow_their_law(models: Callable[[str], ModuleType]) -> None:
    machine = models("heat_pump").HeatPump(capacity=10_000.0, cop=4.0, standing=0.3)
    capacity, per_heat = machine.curves().values()

    def at(curve: np.ndarray, water: float, air: float) -> float:
        return float(curve @ [1.0, water, water**2, air, air**2, water * air])

    assert at(capacity, 45.0, -8.0) == pytest.approx(1.0 - 0.006 * 10.0 - 0.022 * 15.0)
    # Carnot between 5 K above the water and 5 K below the air: 58 K over 313.15 + 10 K, beside 38 K over 313.15 K
    assert at(per_heat, 45.0, -3.0) == pytest.approx((58.0 / 323.15) / (38.0 / 313.15), rel=0.01)
    constant, factor, exponent = machine.part_load()
    powers = [load * (constant + factor * load**exponent) for load in (0.5, 1.0)]
    assert powers == pytest.approx([0.3 + 0.7 * 0.5, 1.0])


def test_curves_of_a_chiller_follow_their_law(models: Callable[[str], ModuleType]) -> None:
    machine = models("heat_pump").Chiller(capacity=40_000.0, cop=3.2, standing=0.2)
    capacity, per_heat = machine.curves().values()

    def at(curve: np.ndarray, water: float, air: float) -> float:
        return float(curve @ [1.0, water, water**2, air, air**2, water * air])

    assert at(capacity, 9.0, 25.0) == pytest.approx(1.0 + 0.03 * 2.0 + 0.009 * 10.0)
    # Carnot between 5 K above the air and 5 K below the water: 28 K over 275.15 K, beside 38 K over 275.15 K
    assert at(per_heat, 7.0, 25.0) == pytest.approx(28.0 / 38.0, rel=0.01) and at(per_heat, 7.0, 35.0) == pytest.approx(
        1.0, rel=0.01
    )


def test_rooms_lie_side_by_side(models: Callable[[str], ModuleType]) -> None:
    rooms = models("rooms").Rooms(3, 2, 5.0, 4.0, 3.0, (3.0, 2.0))
    assert rooms.names == ("SOUTHWEST", "SOUTHMIDDLE", "SOUTHEAST", "NORTHWEST", "NORTHMIDDLE", "NORTHEAST")
    assert rooms.outer == (3.0 * (6 * 5.0 + 4 * 4.0), 6 * 3.0 + 4 * 2.0) and rooms.area == 20.0
    middle = rooms.box(4)
    behind = {name: face.get("outside_boundary_condition_object") for name, face in
              middle["BuildingSurface:Detailed"].items()}  # fmt: skip
    assert behind["NORTHMIDDLE south"] == "SOUTHMIDDLE north" and behind["NORTHMIDDLE east"] == "NORTHEAST west"
    assert list(middle["Window"]) == ["NORTHMIDDLE north window"] and behind["NORTHMIDDLE north"] is None


def test_prices_are_drawn_from_their_seed(models: Callable[[str], ModuleType]) -> None:
    drawn = models("prices").dynamic_prices("Etc/GMT+5")
    again, other = (models("prices").dynamic_prices("Etc/GMT+5", seed) for seed in (20, 21))
    price = drawn["dynamic"].to_numpy()
    assert drawn.equals(again) and not drawn.equals(other)
    assert drawn["timestamp"].iloc[0] == "2023-01-01T00:00:00-05:00" and len(drawn) == 366 * 24 + 24
    by_hour = price[:8760].reshape(365, 24).mean(axis=0)
    assert by_hour.argmax() == 18 and price.min() > 0.05 and 0.03 < price.std() < 0.06


def test_drawn_buildings_are_the_same_again_and_differ(models: Callable[[str], ModuleType]) -> None:
    drawn = models("drawn")
    first, again = drawn.drawn_plants(), drawn.drawn_plants()
    assert [plant.about for plant in first.values()] == [plant.about for plant in again.values()]
    assert len(first) == 28 and len({plant.about for plant in first.values()}) == 28
    told = [plant.description() for name, plant in first.items() if name in ("drawn_1", "drawn_2")]
    assert [list(each["zones"]) for each in told] == [["house"], ["flat_1", "flat_2"]]
    windows = first["drawn_1"].model()["Window"]
    assert all(0.0 < window["starting_x_coordinate"] < 8.0 for window in windows.values())


def test_settings_of_optimal_control_are_read_from_names(script: Callable[[str], ModuleType], models: Any) -> None:
    runs, table = prepared(script, models)
    kind, settings = runs.settings_of("mpc price 0.5")
    assert kind == "mpc" and settings.comfort_price == 0.5 and settings.guarantee is None
    assert runs.settings_of("mpc edge -0.05")[1].back_off == -0.05 and runs.settings_of("mpc perfect")[1] is None
    assert table.title_of("mpc price 0.5") == "MPC, a kelvin hour below counts 0.5 EUR"


def test_a_clock_is_early_and_a_schedule_holds_its_hours(models: Callable[[str], ModuleType]) -> None:
    office = [8 <= hour < 18 for hour in range(24)]
    setpoints = models("thermostats").clock(office)
    assert [hour for hour in range(24) if setpoints[hour] > 20.0] == list(range(6, 18))
    fields = [line["field"] for line in models("objects").daily([1.0] * 8 + [2.0] * 16, [3.0] * 24)["data"]]
    assert fields == ["Through: 12/31", "For: Weekdays", "Until: 8:00", 1.0, "Until: 24:00", 2.0,
                      "For: AllOtherDays", "Until: 24:00", 3.0]  # fmt: skip


def test_a_pi_gives_the_speed_that_the_coming_hours_ask_for(script: Callable[[str], ModuleType]) -> None:
    stamps = pd.date_range("2023-01-09 04:15", periods=24, freq="15min", tz="Etc/GMT+5")
    lower = np.where(stamps > stamps[7], 294.15, 289.15)  # from 6 h on
    forecast = Forecast(pd.DataFrame({"room/comfort_lower_temperature": lower}, index=stamps))
    seen = Measurements(PointLayout((f"room/{ZONE_TEMPERATURE}",), "Etc/GMT+5"), int(stamps[0].timestamp()), [293.0])
    speed = Actuator("pump/speed", "1", 0.0, 1.0, kind="modulating", minimum=0.25)
    machine, pi = Machine(speed, "machine", ("room",)), script("_foreign_rules").ProportionalIntegral
    told = [pi([machine], lead=lead, above=0.0, gain=gain).step(seen, forecast) for lead, gain in (
        (1.0, 0.5), (3.0, 0.5), (3.0, 0.15), (3.0, 0.05)
    )]  # fmt: skip
    assert [action["pump/speed"] for action in told] == pytest.approx([0.0, 0.5 * 1.15, 0.25, 0.0])
    thermostat = Machine(Actuator("room/setpoint", "K", 285.0, 298.0), "setpoint", ("room",))
    with pytest.raises(ControlError, match="expected a machine with a speed, found room/setpoint"):
        pi([thermostat])


@needs_energyplus
def test_heat_of_the_house_arrives_late_and_is_paid_by_the_map(
    made: Callable[..., Any], models: Callable[[str], ModuleType]
) -> None:
    off, full = {SPEED: 0.0}, {SPEED: 1.0}
    seen = made("house", Held({0: off, 24: full, 48: off, 72: {SPEED: 0.0, CIRCULATOR: 1.0}}), 80)
    heat, power = seen[f"heat_pump/{HEATING_POWER}"], seen["heat_pump/electrical_power_sensor"]
    water = seen["heat_pump/supply_water_temperature_sensor"] - 273.15
    air = seen["weather_station/outside_air_temperature_sensor"] - 273.15
    house = models("house")
    capacity, per_heat = house.MACHINE.curves().values()
    terms = np.column_stack([np.ones(80), water, water**2, air, air**2, water * air])
    steady = slice(40, 48)
    np.testing.assert_allclose(heat[steady], (terms @ capacity * house.MACHINE.capacity)[steady], rtol=0.01)
    np.testing.assert_allclose(power[steady], (heat * (terms @ per_heat) / house.MACHINE.cop)[steady], rtol=0.01)
    # heat of the machine and of the pump's friction is in the floor, but for what the water holds
    assert (heat[30:48].sum() + 18 * 45.0) == pytest.approx(seen[f"floor/{HEATING_POWER}"][30:48].sum(), rel=0.01)
    # the slab is slow: in the second hour the room rises faster than in the first half, and goes on when it is off
    room = seen[f"house/{ZONE_TEMPERATURE}"].to_numpy()
    fall = room[23] - room[21]
    assert room[25] - room[23] < 0.7 * (room[31] - room[29]) and room[51] - room[47] > -2.0 * abs(fall)
    assert (power[:24] == 0.0).all() and (seen["floor/pump_power_sensor"][72:] == house.CIRCULATOR).all()
    assert (seen["floor/pump_power_sensor"][50:72] == 0.0).all()


@pytest.mark.long
@needs_energyplus
@pytest.mark.parametrize("name", ["flats", "office", "shop"])
def test_every_setpoint_reaches_its_heater(made: Callable[..., Any], name: str) -> None:
    with_own = made(name, Held({}), 8)
    setpoints = [column for column in with_own if column.endswith("zone_air_heating_temperature_setpoint")]
    acted = made(name, Held({4: {column: 296.15 for column in setpoints}}), 8)
    assert len(setpoints) == {"flats": 3, "office": 4, "shop": 1}[name]
    np.testing.assert_allclose(acted.iloc[:4], with_own.iloc[:4], rtol=1e-6, atol=1e-6)
    np.testing.assert_allclose(acted[setpoints].iloc[4:], 296.15)
    for column in setpoints:
        room = f"{column.rpartition('/')[0]}/{ZONE_TEMPERATURE}"
        assert acted[room].iloc[-1] > with_own[room].iloc[-1] + 0.5
    heats = [column for column in with_own if column.endswith(HEATING_POWER)]
    assert (acted[heats].iloc[5] > with_own[heats].iloc[5] + 500.0).all()


@pytest.mark.long
@needs_energyplus
@pytest.mark.parametrize(("name", "zones"), [("cooled_shop", 1), ("cooled_office", 4)])
def test_every_setpoint_of_cooling_reaches_its_machine(made: Callable[..., Any], name: str, zones: int) -> None:
    with_own = made(name, Held({}), 60, "2023-07-10")
    setpoints = [column for column in with_own if column.endswith("zone_air_cooling_temperature_setpoint")]
    assert len(setpoints) == zones
    told = {column: 295.15 for column in setpoints}
    told |= {column.replace("cooling", "heating"): 291.15 for column in setpoints}
    acted = made(name, Held({52: told}), 60, "2023-07-10")
    np.testing.assert_allclose(acted.iloc[:52], with_own.iloc[:52], rtol=1e-6, atol=1e-6)
    heats = [
        column for column in with_own if column.endswith(HEATING_POWER) and (zones == 1 or "heat_pump" not in column)
    ]
    assert (acted[heats].iloc[53] < with_own[heats].iloc[53] - 500.0).all() and (
        with_own[heats].iloc[:8] == 0.0
    ).all().all()
    for column in setpoints:
        room = f"{column.rpartition('/')[0]}/{ZONE_TEMPERATURE}"
        assert with_own[room].iloc[50] == pytest.approx(297.15, abs=0.05)  # its own clock holds 24 degC
        assert acted[room].iloc[-1] < with_own[room].iloc[-1] - 1.0


@pytest.mark.long
@needs_energyplus
def test_what_a_kelvin_of_supply_water_is_worth_is_that_of_the_machines_law(
    models: Callable[[str], ModuleType], tmp_path: Path
) -> None:
    """Of Carnot between water and outdoor air, without the share that is drawn at any load."""
    path, office = models("plants").write_plant("office", tmp_path), models("office")
    study = PlantStudy(path, None, *experiment_period(path, None, 7))
    made = run_experiment(study, 7, ExcitationSettings())
    level = np.column_stack([machine.level(made.telemetry) for machine in made.machines])
    loads = Loads(level, made.telemetry.outdoor, np.full(level.shape, EMITTER))
    course, bought = WaterCourse.of(made.telemetry, made.machines), made.telemetry.column("electricity")
    assert course is not None
    found = find_water(course, made.telemetry, made.machines, loads, {"electricity": bought})
    assert found is not None
    (rated_water, rated_air), share = office.MACHINE.at[0], 1.0 - office.MACHINE.standing
    air, water = float(np.mean(loads.outdoor)) - 273.15, found.temperature - 273.15
    per_heat = models("heat_pump")._per_heat
    slope = (per_heat(water + 5.0, air) - per_heat(water - 5.0, air)) / per_heat(rated_water, rated_air)
    heat = sum(machine.full(made.telemetry) for machine in made.machines)
    curve = found.powers["electricity"]
    assert curve.coefficients["water"] == pytest.approx(heat * share * slope / office.MACHINE.cop, rel=0.2)
    own = found.of_plant(np.array([263.15, 288.15])) - 273.15  # its reset: 45 degC at -10, 35 at 15
    np.testing.assert_allclose(own, [45.0, 35.0], atol=1.5)


@pytest.mark.long
@needs_energyplus
def test_heat_of_supply_air_is_what_energyplus_says_of_the_terminal(
    models: Callable[[str], ModuleType], tmp_path: Path
) -> None:
    path = models("plants").write_plant("vav_floor", tmp_path)
    told = yaml.safe_load(path.read_text(encoding="utf-8"))
    rooms = {"core": "Core_bottom", "south": "Perimeter_bot_ZN_1", "north": "Perimeter_bot_ZN_3"}
    kinds = {HEATING_POWER: "Heating", "electrical_power_sensor": "Cooling"}
    told["measurements"] |= {
        f"{room}/{point}": {"signal": f"{zone} VAV Box, Zone Air Terminal Sensible {kind} Rate", "unit": "W"}
        for room, zone in rooms.items() for point, kind in kinds.items()
    }  # fmt: skip
    path.write_text(yaml.safe_dump(told), encoding="utf-8")
    with load_plant(path, changes={"period": {"start": "2023-01-09", "days": 1, "warm_up_days": 1}}) as plant:
        columns = [name for name in plant.columns if not name.endswith(tuple(kinds))]
        machines = find_machines(plant.actuators, columns, plant.zone_names)
        assert [m.meter for m in machines] == [f"{z}/supply_air_flowrate_sensor" for z in plant.zone_names]
        seen = run_closed_loop(plant, Held({}), steps=84).measurements.iloc[40:]  # while flows are steady
    by_room = {m.serves[0]: m for m in machines}
    for room in rooms:
        heat = seen[f"{room}/{HEATING_POWER}"] - seen[f"{room}/electrical_power_sensor"]
        found = by_room[room].metered_heat(lambda column: seen[column])
        assert np.abs(heat).max() > 2000.0
        # of a step in which the air handler stops the product of means is none of the mean of products
        assert float(np.quantile(np.abs(found - heat), 0.95)) < 0.02 * float(np.abs(heat).max())


@pytest.mark.long
@needs_energyplus
def test_gas_of_a_dwelling_is_what_its_radiators_give_over_the_efficiency(
    made: Callable[..., Any], models: Callable[[str], ModuleType]
) -> None:
    seen = made("drawn_14", Held({}), 96)
    radiators = sum(seen[f"{room}/{HEATING_POWER}"] for room in ("south", "north"))
    heat, gas, pump = (seen[c] for c in ("boiler/heating_power_sensor", "boiler/gas_power_sensor",
                                         "hot_water/pump_power_sensor"))  # fmt: skip
    friction = radiators.sum() - heat.sum()
    assert heat.sum() > 96 * 500.0 and 0.0 < friction < pump.sum()  # the pump's friction is in the water, no more
    steady = heat > 1500.0
    returned = seen["boiler/return_water_temperature_sensor"][steady] - 273.15
    law = 0.88 + 0.0045 * (50.0 - returned)
    assert steady.sum() > 10 and law.max() - law.min() > 0.01
    np.testing.assert_allclose((heat / gas)[steady], law, rtol=0.02)


def prepared(script: Callable[[str], ModuleType], models: Callable[[str], ModuleType]) -> tuple[ModuleType, ModuleType]:
    """Runs and table, after what they import."""
    for name in ("plants", "periods"):
        models(name)
    for name in ("_code", "_table", "_foreign_rules", "_common_control", "_do_mpc_peer", "_foreign_do_mpc"):
        script(name)
    return script("_foreign_runs"), script("foreign_plants")


@needs_energyplus
def test_a_run_of_the_table(script: Callable[[str], ModuleType], models: Any, tmp_path: Path,
                            monkeypatch: pytest.MonkeyPatch) -> None:  # fmt: skip
    runs, table = prepared(script, models)
    monkeypatch.setattr(runs, "DAYS", 1)
    arguments = ["--out", str(tmp_path), "--plants", "house", "--periods", "coldest", "--controllers", "own", "rule"]
    assert table.main(arguments) == 0
    rows = json.loads((tmp_path / "foreign_plants.json").read_text())
    assert [row["controller"] for row in rows] == ["own", "rule"] and all(row["days"] == 1.0 for row in rows)
    assert "| house | coldest | own control |" in (tmp_path / "foreign_plants.md").read_text()
    assert 0.005 < rows[1]["cost"] < rows[0]["cost"] < 0.05
