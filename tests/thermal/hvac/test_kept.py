import pickle

import numpy as np

from thermal.hvac._coil import WaterCoil
from thermal.hvac._kept import LastValue
from thermal.hvac._operations import FloatOperations
from thermal.hvac._plant import HvacPlant
from thermal.hvac._step import Actions, Conditions


def test_a_value_is_made_once_as_long_as_its_arguments_stay():
    made = []

    def make(x, y):
        made.append((x, y))
        return x + y

    kept = LastValue(make)
    assert [kept(1.0, 2.0), kept(1.0, 2.0), kept(1.0, 3.0), kept(1.0, 2.0)] == [3.0, 3.0, 4.0, 3.0]
    assert made == [(1.0, 2.0), (1.0, 3.0), (1.0, 2.0)]


def test_devices_that_keep_values_can_be_pickled():
    coil, ops = WaterCoil.sized(5000.0, 0.3), FloatOperations()
    used = coil.conductance(ops, 0.2, 0.7)
    assert pickle.loads(pickle.dumps(coil)).conductance(ops, 0.2, 0.7) == used


def test_a_plant_gives_the_same_whatever_it_kept(plant_system):
    """Openings and actions that come back after others: nothing of the others is left."""
    conditions = Conditions(np.linspace(291.0, 298.0, 5), np.full(5, 294.0), np.full(5, 297.0), 270.0)
    actions = [
        Actions(287.0, 335.0),
        Actions((287.0, 290.0), 330.0, 150.0, 4e4),
        Actions(287.0, 335.0, running=(1.0, 0.0), boiler=0.0),
    ]
    plant = HvacPlant(plant_system)
    for chosen in [*actions, *actions[::-1], *actions]:
        fresh = HvacPlant(plant_system)
        state, step = plant.step(plant.start(330.0), conditions, chosen, 300.0)
        expected_state, expected = fresh.step(fresh.start(330.0), conditions, chosen, 300.0)
        assert state.water == expected_state.water
        assert np.array_equal(step.terminal_heat, expected.terminal_heat)
        assert step.electric_power == expected.electric_power
