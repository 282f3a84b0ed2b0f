import numpy as np
import pytest

from thermal.case.points import POINT_TYPES
from thermal.components.air_handler import AirHandler
from thermal.components.boiler_loop import BoilerLoop
from thermal.components.component import Conditions
from thermal.components.terminals import Terminals
from thermal.errors import ModelError
from thermal.system.plant import HvacPlant
from thermal.system.points import HvacPoints

NAMES = [f"VAV_{k}" for k in range(5)]


def named(system, names):
    return system.named({Terminals: NAMES, AirHandler: names, BoilerLoop: ["BOILER"]})


def read(system, names, command, given, pressures=False):
    system = named(system, names)
    actions, plant = command(system, **given), HvacPlant(system)
    zone = np.array([290.0, 294.0, 296.5, 297.4, 300.0])
    conditions = Conditions(zone, np.full(5, 293.0), np.full(5, 297.0), 275.0)
    state, step = plant.step(plant.start(supply_water_temperature=330.0), conditions, actions, 300.0)
    points = HvacPoints(system, pressures)
    return dict(zip(points.columns, points.read(conditions, actions, step), strict=True)), step, state


def test_points_have_the_names_of_the_format_and_possible_values(plant_system, command):
    values, _, _ = read(plant_system, ["AHU_1", "AHU_2"], command, {"air": (287.0, 288.0), "water": 335.0})
    for column, value in values.items():
        kind = POINT_TYPES[column.rpartition("/")[2]]
        assert kind.lowest <= value <= kind.highest, column


def test_points_say_what_happened(plant_system, command):
    values, step, state = read(plant_system, ["AHU_1", "AHU_2"], command, {"air": (287.0, 288.0), "water": 335.0})
    assert values["VAV_2/zone_air_temperature_sensor"] == 296.5
    assert values["VAV_0/supply_air_flowrate_sensor"] == step.terminals.airflow[0]
    assert values["VAV_4/supply_air_damper_percentage_command"] == pytest.approx(1.0)
    assert values["VAV_4/heating_water_valve_percentage_command"] == pytest.approx(0.0, abs=1e-9)
    assert values["VAV_0/heating_water_valve_percentage_command"] > 0.1
    assert values["AHU_2/supply_air_temperature_setpoint"] == 288.0
    assert values["BOILER/supply_water_temperature_sensor"] == state.values[0]
    assert values["BOILER/gas_power_sensor"] == pytest.approx(step.fuel_power)


def test_meters_add_up(gas_system, command):
    values, step, _ = read(gas_system, ["AHU"], command, {"air": 290.0, "water": 335.0})
    gas = [v for column, v in values.items() if column.endswith("gas_power_sensor")]
    electric = [v for column, v in values.items() if column.endswith(("electrical_power_sensor", "pump_power_sensor"))]
    assert sum(gas) == pytest.approx(step.fuel_power)
    assert sum(electric) == pytest.approx(step.electric_power)


def test_an_air_handler_that_is_off_has_closed_dampers(plant_system, command):
    values, _, _ = read(
        plant_system, ["AHU_1", "AHU_2"], command, {"air": 287.0, "water": 335.0, "running": (0.0, 1.0)}
    )
    assert values["VAV_0/supply_air_damper_percentage_command"] == 0.0
    assert values["VAV_1/supply_air_damper_percentage_command"] > 0.0


def test_pressures_are_held_while_the_drives_run(plant_system, command):
    actions = {"air": 287.0, "water": 335.0, "static": (120.0, 300.0), "pressure": 4e4, "running": (0.0, 1.0)}
    plain, _, _ = read(plant_system, ["AHU_1", "AHU_2"], command, actions)
    values, _, _ = read(plant_system, ["AHU_1", "AHU_2"], command, actions, pressures=True)
    more = {column: value for column, value in values.items() if column not in plain}
    assert more == {
        "AHU_1/supply_air_static_pressure_setpoint": 120.0, "AHU_2/supply_air_static_pressure_setpoint": 300.0,
        "AHU_1/supply_air_static_pressure_sensor": 0.0, "AHU_2/supply_air_static_pressure_sensor": 300.0,
        "BOILER/differential_pressure_setpoint": 4e4, "BOILER/differential_pressure_sensor": 4e4,
    }  # fmt: skip
    assert {column: values[column] for column in plain} == plain


def test_names_that_do_not_fit_are_refused(plant_system):
    with pytest.raises(ModelError, match="expected 5 terminals and 2 air handlers, all named differently"):
        named(plant_system, ["AHU"])
    with pytest.raises(ModelError, match="all named differently"):
        named(plant_system, ["AHU", "AHU"])
