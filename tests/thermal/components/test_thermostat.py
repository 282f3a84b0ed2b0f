import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from thermal.components.operations import FloatOperations, NumpyOperations
from thermal.components.thermostat import Mode, Thermostat
from thermal.errors import ModelError

LOW, HIGH = np.array([293.0]), np.array([297.0])
DAY, NIGHT = np.array([False]), np.array([True])


def run(thermostat, temperatures, set_back=None, mode=Mode.OFF):
    """Modes along a series of zone temperatures."""
    modes, now, was = [], np.array([mode], dtype=np.int8), DAY
    for k, t in enumerate(temperatures):
        back = np.array([False if set_back is None else set_back[k]])
        now = thermostat.next_mode(now, np.array([t]), LOW, HIGH, back, was)
        was = back
        modes.append(Mode(int(now[0])))
    return modes


def test_the_papers_modes_end_half_way_between_the_setpoints():
    heating = run(Thermostat(release=0.5), [294.0, 292.9, 294.0, 294.9, 295.1, 294.0])
    assert heating == [Mode.OFF, Mode.HEAT, Mode.HEAT, Mode.HEAT, Mode.OFF, Mode.OFF]
    cooling = run(Thermostat(release=0.5), [296.0, 297.1, 296.0, 295.1, 294.9, 296.0])
    assert cooling == [Mode.OFF, Mode.COOL, Mode.COOL, Mode.COOL, Mode.OFF, Mode.OFF]


def test_set_back_begins_with_passive_cooling():
    modes = run(
        Thermostat(release=0.5), [298.0, 298.0, 296.0, 293.1, 292.9, 294.0], [False, True, True, True, True, True]
    )
    assert modes == [Mode.COOL, Mode.PASSIVE_COOL, Mode.PASSIVE_COOL, Mode.PASSIVE_COOL, Mode.HEAT, Mode.HEAT]


def test_passive_cooling_ends_with_set_back():
    modes = run(Thermostat(release=0.5), [298.0, 298.0, 298.0], [False, True, False])
    assert modes[-1] is Mode.COOL


def test_calls_are_those_of_the_mode():
    thermostat = Thermostat(throttling_range=2.0, release=0.5)
    t = np.array([294.0])
    assert thermostat.calls_in(np.array([Mode.HEAT]), t, LOW, HIGH) == (np.array([0.5]), np.array([0.0]))
    assert thermostat.calls_in(np.array([Mode.PASSIVE_COOL]), t, LOW, HIGH) == (np.array([0.0]), np.array([0.0]))


@given(t=st.floats(280.0, 310.0), width=st.floats(0.0, 0.3))
def test_calls_without_memory_oppose_the_distance_and_exclude_each_other(t, width):
    heat, cool = Thermostat().calls(FloatOperations(width), t, 293.0, 297.0)
    warmer, cooler = Thermostat().calls(FloatOperations(width), t + 0.1, 293.0, 297.0)
    assert -1e-12 <= min(heat, cool) and max(heat, cool) <= 1.0 + 1e-12
    assert warmer <= heat + 1e-12 and cooler >= cool - 1e-12
    assert min(heat, cool) <= 0.5 * width
    exact = Thermostat().calls(FloatOperations(), t, 293.0, 297.0)
    assert abs(heat - exact[0]) <= 0.5 * width + 1e-12 and abs(cool - exact[1]) <= 0.5 * width + 1e-12


@given(t=st.floats(285.0, 305.0))
def test_the_version_without_memory_lies_between_the_branches_of_the_one_with(t):
    thermostat, zone = Thermostat(release=0.5), np.array([t])
    smooth = thermostat.calls(NumpyOperations(), zone, LOW, HIGH)[0]
    on = thermostat.calls_in(np.array([Mode.HEAT]), zone, LOW, HIGH)[0]
    onset = np.clip((LOW - zone) / thermostat.throttling_range, 0.0, 1.0)
    assert onset <= smooth <= on


def test_a_range_out_of_bounds_is_refused():
    with pytest.raises(ModelError, match=r"Thermostat.throttling_range: expected 0.05 to 5 K, found 0.0"):
        Thermostat(throttling_range=0.0)
    with pytest.raises(ModelError, match=r"Thermostat.release"):
        Thermostat(release=0.7)
