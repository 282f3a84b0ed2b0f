import pickle

from thermal.components.last_value import LastValue
from thermal.components.operations import FloatOperations
from thermal.components.water_coil import WaterCoil


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
