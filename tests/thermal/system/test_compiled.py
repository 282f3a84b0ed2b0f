"""The compiled single components are the equations as they stand."""

from dataclasses import replace

import numpy as np
import pytest

from thermal.components.boiler_loop import BoilerLoop
from thermal.components.component import Calls, Conditions
from thermal.components.operations import StepOperations
from thermal.system.compiled import CompiledSystem
from thermal.system.exchange import advance
from thermal.system.plant import HvacPlant
from thermal.system.system import vav_system


def drawn(system, command, seed):
    rng, n = np.random.default_rng(seed), len(system.terminals)
    calls = Calls(rng.uniform(0.0, 1.0, n) * (rng.random(n) < 0.6), rng.uniform(0.0, 1.0, n) * (rng.random(n) < 0.6))
    conditions = Conditions(
        rng.uniform(284.0, 304.0, n), np.zeros(n), np.zeros(n), rng.uniform(255.0, 315.0), rng.uniform(0.001, 0.02),
        tuple(rng.uniform(0.003, 0.014, 2)), rng.uniform(285.0, 300.0),
    )  # fmt: skip
    actions = command(
        system,
        tuple(rng.uniform(281.0, 300.0, 2)), rng.uniform(300.0, 355.0), tuple(rng.uniform(80.0, 400.0, 2)),
        rng.uniform(2e4, 1.2e5), tuple(rng.choice([0.0, 1.0], 2)), rng.choice([0.0, 1.0]),
        tuple(rng.uniform(0.0, 1.0, 2)),
    )  # fmt: skip
    return rng.uniform(285.0, 355.0), calls, conditions, actions


def plain(values):
    for value in values:
        if isinstance(value, tuple):
            yield from plain(value)
        else:
            yield np.ravel(value)


def same(system, command, seed, compiled):
    water, calls, conditions, actions = drawn(system, command, seed)
    chosen = tuple((system.defaults | actions)[name] for name in system.actuators)
    steps = (
        compiled.step((water,), calls, conditions, chosen, 300.0),
        advance(StepOperations(), system, (water,), calls, conditions, actions, 300.0),
    )
    one, other = (np.concatenate(list(plain([*step.results.values(), *step[1:]]))) for step in steps)
    assert np.allclose(one, other, rtol=1e-10, atol=1e-7)
    assert type(steps[0].fuel_power) is float and type(steps[0].air_handlers[0].mixed.sensible) is float


def test_every_value_of_a_step_is_that_of_the_equations(plant_system, command):
    compiled = CompiledSystem(plant_system)
    for seed in range(60):
        same(plant_system, command, seed, compiled)


def test_coils_that_burn_gas_or_none_at_all(gas_system, command):
    bare = replace(gas_system.air_handlers[0], heating=None, cooling=None, exhaust_fan=None)
    mixed = vav_system((gas_system.air_handlers[0], bare), gas_system.loop, replace_handlers(gas_system))
    compiled = CompiledSystem(mixed)
    for seed in range(30):
        same(mixed, command, seed, compiled)


def replace_handlers(system):
    return replace(system.terminals, air_handler=np.array([0, 1, 0, 1, 1]))


def test_a_step_does_not_remember_the_one_before(plant_system, command):
    plant = HvacPlant(plant_system)
    conditions = Conditions(np.full(5, 291.0), np.full(5, 294.0), np.full(5, 297.0), 280.0)
    first = command(plant_system, 287.0, 335.0)
    second = command(plant_system, 292.0, 350.0, running=(1.0, 0.0))
    steps = [
        plant.step(plant.start(supply_water_temperature=330.0), conditions, actions, 300.0)[1]
        for actions in (first, second, first)
    ]
    assert np.array_equal(steps[0].terminals.heat, steps[2].terminals.heat)
    assert steps[0].air_handlers == steps[2].air_handlers and steps[0].fuel_power == steps[2].fuel_power
    assert steps[1].results["BOILER"].pump_power != pytest.approx(steps[0].results["BOILER"].pump_power)


def test_another_loop_is_another_function(plant_system, command):
    smaller = plant_system.having(BOILER=BoilerLoop(5_000.0, plant_system.loop.pump, water_volume=0.3))
    conditions = Conditions(np.full(5, 285.0), np.full(5, 294.0), np.full(5, 297.0), 260.0)
    powers = [
        plant.step(plant.start(supply_water_temperature=300.0), conditions, command(plant_system, 290.0, 350.0), 300.0)[
            1
        ].fuel_power
        for plant in (HvacPlant(plant_system), HvacPlant(smaller))
    ]
    assert powers[1] < powers[0]
