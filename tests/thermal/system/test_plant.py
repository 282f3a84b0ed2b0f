from dataclasses import replace

import numpy as np
import pytest

from thermal.components.component import Conditions
from thermal.components.thermostat import Mode, Thermostat
from thermal.errors import ModelError
from thermal.system.plant import HvacPlant

LOW, HIGH = np.full(5, 293.0), np.full(5, 297.0)
CONDITIONS = Conditions(np.array([290.0, 294.0, 296.5, 297.4, 300.0]), LOW, HIGH, 280.0)
ACTIONS = {"supply_air_temperature_setpoint": (287.0, 288.0), "supply_water_temperature_setpoint": 335.0}


@pytest.fixture
def plant(plant_system):
    return HvacPlant(plant_system)


@pytest.fixture
def actions(plant_system):
    return plant_system.actions(**ACTIONS)


def test_steps_repeat_bit_for_bit(plant, plant_system, actions):
    def day(plant):
        state, heats = plant.start(supply_water_temperature=300.0), []
        for k in range(288):
            zone = CONDITIONS.zone_temperature + np.sin(k / 40.0)
            conditions = CONDITIONS._replace(zone_temperature=zone, outdoor_temperature=285.0 + 8.0 * np.sin(k / 46.0))
            state, step = plant.step(state, conditions, actions, 300.0)
            heats.append(plant.heat(step))
        return np.array(heats), state.values[0]

    first, second = day(plant), day(HvacPlant(plant_system))
    assert np.array_equal(first[0], second[0]) and first[1] == second[1]


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        (
            {"supply_air_temperature_setpoint": 13.0},
            r"supply_air_temperature_setpoint: expected 273.15 to 333.15 K, found 13.0; .* degC",
        ),
        (
            {"supply_air_temperature_setpoint": (287.0, float("nan"))},
            r"AHU_1/supply_air_temperature_setpoint: .*not finite",
        ),
        ({"supply_air_temperature_setpoint": (287.0,)}, r"expected one value or 2, one a component, found 1 values"),
        (
            {"supply_water_temperature_setpoint": float("inf")},
            r"supply_water_temperature_setpoint: .* found inf \(not finite\)",
        ),
        (
            {"supply_water_temperature_setpoint": None},
            r"supply_water_temperature_setpoint: expected a number of K, found None",
        ),
        (
            {"supply_water_temperature_setpoint": "warm"},
            r"supply_water_temperature_setpoint: expected a number of K, found 'warm'",
        ),
        ({"supply_air_static_pressure_setpoint": -5.0}, r"supply_air_static_pressure_setpoint: expected 1 to 2500 Pa"),
        ({"differential_pressure_setpoint": 1e7}, r"differential_pressure_setpoint: expected 1000 to 600000 Pa"),
        ({"fan_running": 2.0}, r"fan_running: expected 0 to 1 -"),
        ({"boiler_running": -1.0}, r"boiler_running: expected 0 to 1 -"),
    ],
)
def test_actions_are_refused_by_name(plant, changed, said):
    with pytest.raises(ModelError, match=said):
        plant.step(plant.start(), CONDITIONS, plant.system.actions(**(ACTIONS | changed)), 300.0)


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"zone_temperature": np.array([290.0, np.nan, 294.0, 295.0, 296.0])}, r"zone_temperature\[1\]: .* nan"),
        ({"zone_temperature": np.array([290.0, 22.0, 294.0, 295.0, 296.0])}, r"zone_temperature\[1\]: .* degC"),
        ({"zone_temperature": np.zeros(4)}, r"zone_temperature: expected an array of 5 zones, found shape \(4,\)"),
        (
            {"zone_air_heating_temperature_setpoint": HIGH + 1.0},
            r"setpoints: expected heating not above cooling, found 298.0 and 297.0 K",
        ),
        (
            {"zone_air_cooling_temperature_setpoint": np.full(5, np.inf)},
            r"zone_air_cooling_temperature_setpoint\[0\]: .*not finite",
        ),
        ({"outdoor_temperature": float("nan")}, r"outdoor_temperature: .*not finite"),
        ({"outdoor_humidity": 6.0}, r"outdoor_humidity: expected 0 to 0.05 kg/kg, found 6.0"),
    ],
)
def test_conditions_are_refused_by_name(plant, actions, changed, said):
    with pytest.raises(ModelError, match=said):
        plant.step(plant.start(), CONDITIONS._replace(**changed), actions, 300.0)


def test_setpoints_that_change_in_place_are_looked_at_again(plant, actions):
    heating = LOW.copy()
    conditions = CONDITIONS._replace(zone_air_heating_temperature_setpoint=heating)
    plant.step(plant.start(), conditions, actions, 300.0)
    heating[3] = np.nan
    with pytest.raises(ModelError, match=r"zone_air_heating_temperature_setpoint\[3\]"):
        plant.step(plant.start(), conditions, actions, 300.0)


def test_actions_may_be_arrays(plant, actions, command):
    given = command(plant.system, np.array([287.0, 288.0]), np.float64(335.0), running=np.array([1.0, 1.0]))
    steps = [plant.step(plant.start(), CONDITIONS, a, 300.0)[1] for a in (given, actions)]
    assert np.array_equal(steps[0].terminals.heat, steps[1].terminals.heat)


def test_steps_and_starts_out_of_range_are_refused(plant, actions):
    with pytest.raises(ModelError, match="step: expected 1 to 3600 s"):
        plant.step(plant.start(), CONDITIONS, actions, 0.0)
    with pytest.raises(ModelError, match="BOILER.supply_water_temperature at the start: expected 273.15 to 373.15 K"):
        plant.start(supply_water_temperature=60.0)


def test_thermostats_that_remember_keep_heating(plant_system, actions):
    plant = HvacPlant(replace(plant_system, thermostat=Thermostat(release=0.5)))
    inside = CONDITIONS._replace(zone_temperature=np.full(5, 294.0))
    state, step = plant.step(plant.start(supply_water_temperature=330.0), inside, actions, 300.0)
    assert set(state.mode) == {Mode.OFF} and not step.terminals.reheat.any()
    state, _ = plant.step(state, CONDITIONS._replace(zone_temperature=np.full(5, 292.0)), actions, 300.0)
    state, step = plant.step(state, inside, actions, 300.0)
    assert set(state.mode) == {Mode.HEAT} and (step.terminals.reheat > 0.0).all()
    state, step = plant.step(state, inside, actions, 300.0, np.ones(5, dtype=bool))
    assert set(state.mode) == {Mode.PASSIVE_COOL} and not step.terminals.reheat.any()


def test_a_plant_gives_the_same_whatever_it_kept(plant_system, command):
    """Openings and actions that come back after others: nothing of the others is left."""
    conditions = Conditions(np.linspace(291.0, 298.0, 5), np.full(5, 294.0), np.full(5, 297.0), 270.0)
    actions = [
        command(plant_system, 287.0, 335.0),
        command(plant_system, (287.0, 290.0), 330.0, 150.0, 4e4),
        command(plant_system, 287.0, 335.0, running=(1.0, 0.0), boiler=0.0),
    ]
    plant = HvacPlant(plant_system)
    for chosen in [*actions, *actions[::-1], *actions]:
        fresh = HvacPlant(plant_system)
        state, step = plant.step(plant.start(supply_water_temperature=330.0), conditions, chosen, 300.0)
        expected_state, expected = fresh.step(fresh.start(supply_water_temperature=330.0), conditions, chosen, 300.0)
        assert state.values[0] == expected_state.values[0]
        assert np.array_equal(step.terminals.heat, expected.terminals.heat)
        assert step.electric_power == expected.electric_power
