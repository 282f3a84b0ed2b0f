"""Pseudo-random set-points: two levels, a clock a zone, as good as white."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from thermal.errors import ThermalError
from thermal.pilot.thermostat import draw_prbs_thermostats, draw_thermostats

TIMES = pd.date_range("2023-01-09", periods=21 * 96, freq="15min", tz="Etc/GMT+8")


def test_two_levels_about_the_occupied_setpoints() -> None:
    base, prbs = draw_thermostats(3, 8), draw_prbs_thermostats(3, 8)
    heating, cooling = prbs.setpoints(TIMES)
    shift = heating - base.heating
    assert np.allclose(np.abs(shift), 1.5)
    assert np.allclose(cooling - base.cooling, shift)
    assert (heating < cooling).all()
    assert np.abs(shift.mean(axis=0)).max() < 0.3
    assert (prbs.clock % 900 == 0).all()
    assert (prbs.clock >= 3600).all()
    assert (prbs.clock <= 4 * 3600).all()
    assert np.unique(prbs.clock).size > 3


def test_a_level_lasts_whole_clocks() -> None:
    prbs = draw_prbs_thermostats(4, 6)
    heating, _ = prbs.setpoints(TIMES)
    seconds = TIMES.as_unit("s").asi8
    for zone in range(6):
        switched = seconds[1:][np.diff(heating[:, zone]) != 0.0]
        assert switched.size > 20
        assert (switched % prbs.clock[zone] == 0).all()


def test_the_sequence_is_white_at_its_clock() -> None:
    """A maximum-length sequence has the autocorrelation -1/511 at every lag but zero."""
    prbs = draw_prbs_thermostats(5, 1)
    clock = int(prbs.clock[0])
    first = int(np.ceil(TIMES[0].timestamp() / clock)) * clock
    times = pd.DatetimeIndex(pd.to_datetime(first + clock * np.arange(511), unit="s", utc=True))
    levels = np.sign(prbs.setpoints(times)[0][:, 0] - prbs.heating[0])
    for lag in (1, 2, 17, 255):
        assert np.mean(levels * np.roll(levels, lag)) == pytest.approx(-1.0 / 511.0)


def test_zones_move_apart() -> None:
    heating, _ = draw_prbs_thermostats(6, 10).setpoints(TIMES)
    correlation = np.corrcoef(heating.T) - np.eye(10)
    assert np.abs(correlation).max() < 0.5


def test_same_seed_same_setpoints_and_no_resolution_of_time_matters() -> None:
    first, second, other = (draw_prbs_thermostats(seed, 4).setpoints(TIMES)[0] for seed in (1, 1, 2))
    assert np.array_equal(first, second)
    assert not np.array_equal(first, other)
    assert np.array_equal(first, draw_prbs_thermostats(1, 4).setpoints(TIMES.as_unit("ns"))[0])


def test_bad_arguments_are_refused() -> None:
    with pytest.raises(ThermalError, match="a seed of 0 or more and a zone"):
        draw_prbs_thermostats(-1, 3)
