"""The compiled central devices are the equations as they stand."""

from dataclasses import replace

import numpy as np
import pytest

from thermal.hvac._advance import advance
from thermal.hvac._boiler import BoilerLoop
from thermal.hvac._compiled import CompiledCentral
from thermal.hvac._operations import StepOperations
from thermal.hvac._plant import HvacPlant
from thermal.hvac._settings import settings_of
from thermal.hvac._step import Actions, Calls, Conditions
from thermal.hvac._system import HvacSystem


def drawn(seed, n):
    rng = np.random.default_rng(seed)
    calls = Calls(rng.uniform(0.0, 1.0, n) * (rng.random(n) < 0.6), rng.uniform(0.0, 1.0, n) * (rng.random(n) < 0.6))
    conditions = Conditions(
        rng.uniform(284.0, 304.0, n), np.zeros(n), np.zeros(n), rng.uniform(255.0, 315.0), rng.uniform(0.001, 0.02),
        tuple(rng.uniform(0.003, 0.014, 2)), rng.uniform(285.0, 300.0),
    )  # fmt: skip
    actions = Actions(
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


def same(system, seed, central):
    ops, (water, calls, conditions, actions) = StepOperations(), drawn(seed, len(system.terminals))
    settings = settings_of(ops, system, actions)
    steps = [advance(ops, system, water, calls, conditions, settings, 300.0, c) for c in (central, None)]
    one, other = (np.concatenate(list(plain(step))) for step in steps)
    assert np.allclose(one, other, rtol=1e-10, atol=1e-7)
    assert type(steps[0].fuel_power) is float and type(steps[0].mixed[0].sensible) is float


def test_every_value_of_a_step_is_that_of_the_equations(plant_system):
    central = CompiledCentral(plant_system)
    for seed in range(60):
        same(plant_system, seed, central)


def test_coils_that_burn_gas_or_none_at_all(gas_system):
    bare = replace(gas_system.air_handlers[0], heating=None, cooling=None, exhaust_fan=None)
    mixed = HvacSystem((gas_system.air_handlers[0], bare), gas_system.loop, replace_handlers(gas_system))
    central = CompiledCentral(mixed)
    for seed in range(30):
        same(mixed, seed, central)


def replace_handlers(system):
    return replace(system.terminals, air_handler=np.array([0, 1, 0, 1, 1]))


def test_a_step_does_not_remember_the_one_before(plant_system):
    plant = HvacPlant(plant_system)
    conditions = Conditions(np.full(5, 291.0), np.full(5, 294.0), np.full(5, 297.0), 280.0)
    first, second = Actions(287.0, 335.0), Actions(292.0, 350.0, running=(1.0, 0.0))
    steps = [plant.step(plant.start(330.0), conditions, actions, 300.0)[1] for actions in (first, second, first)]
    assert np.array_equal(steps[0].terminal_heat, steps[2].terminal_heat)
    assert steps[0].mixed == steps[2].mixed and steps[0].fuel_power == steps[2].fuel_power
    assert steps[1].pump_power != pytest.approx(steps[0].pump_power)


def test_another_loop_is_another_function(plant_system):
    smaller = replace(plant_system, loop=BoilerLoop(5_000.0, plant_system.loop.pump, water_volume=0.3))
    conditions = Conditions(np.full(5, 285.0), np.full(5, 294.0), np.full(5, 297.0), 260.0)
    powers = [
        plant.step(plant.start(300.0), conditions, Actions(290.0, 350.0), 300.0)[1].fuel_power
        for plant in (HvacPlant(plant_system), HvacPlant(smaller))
    ]
    assert powers[1] < powers[0]
