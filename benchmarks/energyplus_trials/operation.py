"""Set points of the zones and hours of use."""

from __future__ import annotations

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from energyplus_trials.specification import Use

Series = NDArray[np.float64]
OFF = (5.0, 45.0)  # [degC], set points of a terminal that is off


def setpoints(use: Use, starts: pd.DatetimeIndex, n_zone: int) -> tuple[Series, Series]:
    """Return heating and cooling set points, shape (n_time, n_zone) [degC].

    Zones differ in level, set-back and hours. `schedule`: set back at night and at weekends, with a few changes by
    hand; `prbs`: two levels that take turns at random; `float`: a schedule whose terminals are off for long stretches.

    Parameters
    ----------
    use : Use
        Of a trial.
    starts : DatetimeIndex, shape (n_time,)
        Starts of intervals, standard time.
    n_zone : int
        Number of zones.
    """
    rng = np.random.default_rng([use.seed, 1])
    heating = rng.uniform(19.5, 22.5, n_zone)
    gap = rng.uniform(1.5, 3.5, n_zone)
    back, forth = rng.uniform(1.5, 4.5, n_zone), rng.uniform(1.5, 4.0, n_zone)
    start, end = (
        np.round(4.0 * rng.uniform(5.5, 8.5, n_zone)) / 4.0,
        np.round(4.0 * rng.uniform(16.5, 20.0, n_zone)) / 4.0,
    )
    saturday = rng.random(n_zone) < 0.2
    if use.excitation == "prbs":
        shift = np.column_stack([_prbs(rng, len(starts)) for _ in range(n_zone)])
        middle = heating + 0.5
        return middle + shift - 0.2, middle + shift + 0.8
    day = occupied(starts, start, end, saturday)
    low, high = np.where(day, heating, heating - back), np.where(day, heating + gap, heating + gap + forth)
    by_hand = np.column_stack([_changes(rng, len(starts)) for _ in range(n_zone)])
    low, high = low + by_hand, high + by_hand
    if use.excitation == "float":
        off = np.column_stack([_stretches(rng, len(starts)) for _ in range(n_zone)])
        return np.where(off, OFF[0], low), np.where(off, OFF[1], high)
    return low, high


def occupied(starts: pd.DatetimeIndex, start: Series, end: Series, saturday: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Tell when zones are in use, shape (n_time, n_zone).

    Parameters
    ----------
    starts : DatetimeIndex, shape (n_time,)
        Starts of intervals.
    start, end : ndarray, shape (n_zone,)
        Hours of a working day [h].
    saturday : ndarray of bool, shape (n_zone,)
        Whether Saturday is one, until 13:00.
    """
    hour = (starts.hour + starts.minute / 60.0).to_numpy()[:, None]
    weekday = starts.day_of_week.to_numpy()[:, None]
    inside = (hour >= start) & (hour < end)
    return np.asarray(inside & ((weekday < 5) | (saturday & (weekday == 5) & (hour < 13.0))), dtype=bool)


def _prbs(rng: np.random.Generator, n: int) -> Series:
    clock = int(rng.integers(12, 49))  # one to four hours
    levels = rng.uniform(1.0, 1.75) * rng.choice([-1.0, 1.0], n // clock + 2)
    return np.asarray(np.repeat(levels, clock)[rng.integers(clock) :][:n], dtype=float)


def _changes(rng: np.random.Generator, n: int) -> Series:
    """Somebody turns a thermostat for a few hours, every second day or so."""
    offset = np.zeros(n)
    for first in np.sort(rng.choice(n, max(n // 500, 1), replace=False)):
        offset[first : first + int(rng.integers(18, 60))] = rng.choice([-1.5, -1.0, 1.0, 1.5])
    return offset


def _stretches(rng: np.random.Generator, n: int) -> NDArray[np.bool_]:
    """On and off in turns of half a day to two days."""
    lengths = rng.integers(144, 576, n // 144 + 2)
    state = (np.arange(lengths.size) + int(rng.integers(2))) % 2 == 0
    return np.asarray(np.repeat(state, lengths)[:n], dtype=bool)
