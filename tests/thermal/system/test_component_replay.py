import numpy as np
import pytest

from thermal.components.air_handler import AirHandler
from thermal.components.boiler_loop import BoilerLoop
from thermal.components.component import Conditions
from thermal.components.streams import AirCommand
from thermal.components.terminals import Terminals
from thermal.system.component_replay import replay_air_handler, replay_loop, replay_reheat, replay_terminals
from thermal.system.plant import HvacPlant
from thermal.system.points import HvacPoints

N_TIME = 200


@pytest.fixture(scope="module")
def told(plant_system, command):
    """What a plant's sensors say over many steps, with what happened behind them."""
    system = plant_system.named({Terminals: list("abcde"), AirHandler: ["A0", "A1"], BoilerLoop: ["B"]})
    plant, points = HvacPlant(system), HvacPoints(system)
    rng, state, rows, steps = np.random.default_rng(0), plant.start(supply_water_temperature=330.0), [], []
    for k in range(N_TIME):
        zone = rng.uniform(289.0, 300.0, 5)
        conditions = Conditions(zone, np.full(5, 293.0), np.full(5, 297.0), 283.0 + 12.0 * np.sin(k / 30.0), 0.005)
        actions = command(system, (286.0 + np.sin(k / 9.0), 287.0), 335.0 + 5.0 * np.sin(k / 20.0))
        state, step = plant.step(state, conditions, actions, 300.0)
        rows.append(points.read(conditions, actions, step))
        steps.append(step)
    values = dict(zip(points.columns, np.array(rows).T, strict=True))

    def column(entities, point):
        return np.array([values[f"{e}/{point}"] for e in entities]).T

    return column, steps


def test_terminals_follow_their_commands(plant_system, told):
    column, steps = told
    supply = column(["A0", "A1"], "supply_air_temperature_sensor")[:, plant_system.terminals.air_handler]
    found = replay_terminals(
        plant_system.terminals,
        column("abcde", "supply_air_damper_percentage_command"),
        column("abcde", "heating_water_valve_percentage_command"),
        supply,
        column("B", "supply_water_temperature_sensor")[:, 0],
    )
    assert np.allclose(found.airflow, column("abcde", "supply_air_flowrate_sensor"), rtol=1e-9)
    assert np.allclose(found.discharge, column("abcde", "discharge_air_temperature_sensor"), atol=1e-6)
    assert np.allclose(found.reheat, [s.terminals.reheat for s in steps], atol=1e-3)


def test_reheat_holds_measured_discharge(plant_system, told):
    column, steps = told
    supply = column(["A0", "A1"], "supply_air_temperature_sensor")[:, plant_system.terminals.air_handler]
    discharge = column("abcde", "discharge_air_temperature_sensor")
    water = column("B", "supply_water_temperature_sensor")[:, 0]
    found = replay_reheat(
        plant_system.terminals, column("abcde", "supply_air_flowrate_sensor"), supply, discharge, water
    )
    assert np.allclose(found.discharge, discharge, atol=1e-6)
    flows = [s.terminals.valve_flow * plant_system.terminals.water_flow for s in steps]
    assert np.allclose(found.water_flow, flows, atol=1e-6)
    cold = replay_reheat(
        plant_system.terminals, np.full((1, 5), 0.2), np.full((1, 5), 285.0), np.full((1, 5), 330.0), np.array([310.0])
    )
    assert np.all(cold.discharge < 310.0)


def test_an_air_handler_follows_its_air(plant_system, told):
    column, steps = told
    found = replay_air_handler(
        plant_system.air_handlers[0],
        np.array([s.air_handlers[0].mixed.flow for s in steps]),
        column(["A0"], "return_air_temperature_sensor")[:, 0],
        Conditions(None, None, None, column(["A0"], "outside_air_temperature_sensor")[:, 0], 0.005, 0.006),
        AirCommand(column(["A0"], "supply_air_temperature_setpoint")[:, 0], None),
        water=column("B", "supply_water_temperature_sensor")[:, 0],
    )
    assert np.allclose(found.mixed.mixed_temperature, column(["A0"], "mixed_air_temperature_sensor")[:, 0], atol=1e-6)
    assert np.allclose(found.mixed.supply_fan_power, column(["A0"], "supply_fan_power_sensor")[:, 0], rtol=1e-6)
    assert np.allclose(found.electric_power, column(["A0"], "electrical_power_sensor")[:, 0], rtol=1e-6, atol=1e-3)


def test_an_air_handler_that_does_not_run_takes_nothing(gas_system):
    flow = np.array([0.0, 1.0])
    found = replay_air_handler(
        gas_system.air_handlers[0],
        flow,
        np.full(2, 294.0),
        Conditions(None, None, None, np.full(2, 260.0), 0.001, 0.005),
        AirCommand(np.full(2, 292.0), None),
    )
    assert found.electric_power[0] == 0.0 < found.electric_power[1]
    assert found.fuel_power[0] == pytest.approx(0.0, abs=1e-3)
    assert found.fuel_power[1] == pytest.approx(found.heating[1] / 0.8)


def test_a_loop_follows_its_load(plant_system, told):
    column, steps = told
    flows = np.array([s.results["B"].water_flow for s in steps])
    found = replay_loop(
        plant_system.loop,
        np.array([s.results["B"].load for s in steps]),
        flows,
        column("B", "supply_water_temperature_setpoint")[:, 0],
        300.0,
        330.0,
    )
    assert np.allclose(found.supply_temperature, column("B", "supply_water_temperature_sensor")[:, 0], atol=1e-6)
    assert np.allclose(found.return_temperature, column("B", "return_water_temperature_sensor")[:, 0], atol=1e-6)
    assert np.allclose(found.fuel_power, column("B", "gas_power_sensor")[:, 0], rtol=1e-6, atol=1e-2)
    assert np.allclose(found.pump_power, column("B", "pump_power_sensor")[:, 0], rtol=1e-9)


def test_a_loop_without_flow_is_off(plant_system):
    found = replay_loop(plant_system.loop, np.zeros(3), np.zeros(3), np.full(3, 340.0), 300.0, 320.0)
    assert not found.boiler.any() and not found.pump_power.any()
    assert np.all(np.diff(found.supply_temperature) < 0.0)
