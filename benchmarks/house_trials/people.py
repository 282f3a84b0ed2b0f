"""People of a house: when they are in, what they set thermostats to, and which windows and doors they open."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from house_trials.specification import HouseSpec

Series = NDArray[np.float64]

STEPS_PER_HOUR = 12
#: Usual set points [degC] (EN 16798-1, category II, and usual practice); others are at 20.
_SET_POINTS = {"bath": 22.5, "shower": 22.5, "living": 21.0, "bedroom": 18.5, "hall": 18.5, "landing": 18.5,
               "store": 16.0, "utility": 17.0, "child": 20.5}  # fmt: skip
_UNOCCUPIED = 12.0  # [degC], what a thermostat that is turned down keeps


@dataclass(frozen=True)
class Household:
    """People, hour by hour.

    Parameters
    ----------
    count : int
        How many.
    home : ndarray, shape (n_time,)
        How many are in.
    awake : ndarray, shape (n_time,)
        Whether somebody is in and awake [-].
    """

    count: int
    home: Series
    awake: Series


def household(spec: HouseSpec, starts: pd.DatetimeIndex) -> Household:
    """Return who is in, drawn from the trial's seed.

    Parameters
    ----------
    spec : HouseSpec
        Of a trial.
    starts : DatetimeIndex, shape (n_time,)
        Starts of the intervals of five minutes, whole days.
    """
    rng = np.random.default_rng([spec.people, 0])
    count, days = int(rng.integers(1, 5)), len(starts) // (24 * STEPS_PER_HOUR)
    hour = np.asarray(starts.hour + starts.minute / 60.0).reshape(days, -1)
    workday = np.asarray(starts.day_of_week < 5).reshape(days, -1)[:, 0]
    home, awake = np.zeros_like(hour), np.zeros_like(hour)
    for _ in range(count):
        works, leaves, returns = rng.random() < 0.75, rng.uniform(7.0, 8.8), rng.uniform(14.5, 18.0)
        rises, sleeps = leaves - rng.uniform(0.7, 1.4), rng.uniform(21.0, 23.5)
        for day in range(days):
            away = workday[day] and works and rng.random() < 0.93
            out = (leaves, returns) if away else _outing(rng)
            shift = rng.normal(0.0, 0.3, 4) + (0.0 if away else np.array([0.0, 0.0, 1.2, 0.5]))
            inside = ~((hour[day] > out[0] + shift[0]) & (hour[day] < out[1] + shift[1]))
            home[day] += inside
            awake[day] += inside & (hour[day] > rises + shift[2]) & (hour[day] < sleeps + shift[3])
    return Household(count, home.ravel(), (awake.ravel() > 0).astype(float))


def _outing(rng: np.random.Generator) -> tuple[float, float]:
    """Start and end of an outing of a day off [h]; on some days there is none."""
    start = float(rng.uniform(9.5, 16.0))
    return (start, start + float(rng.uniform(1.0, 5.0))) if rng.random() < 0.7 else (30.0, 30.0)


def set_points(spec: HouseSpec, starts: pd.DatetimeIndex, people: Household) -> Series:
    """Return the rooms' set points, shape (n_time, n_room) [degC]: own levels, nights, absence, and turns by hand.

    Parameters
    ----------
    spec : HouseSpec
        Of a trial.
    starts : DatetimeIndex, shape (n_time,)
        Starts of the intervals.
    people : Household
        Who is in.
    """
    heating, rng = spec.heating, np.random.default_rng([spec.heating.seed, 1])
    days = len(starts) // (24 * STEPS_PER_HOUR)
    hour = np.asarray(starts.hour + starts.minute / 60.0).reshape(days, -1)
    away = people.home.reshape(days, -1) == 0.0
    turned_down = rng.random() < 0.4  # also by day, when nobody is in
    found = []
    for name in spec.zone_names:
        level = _SET_POINTS.get(name, 20.0) + rng.normal(0.0, 0.7)
        on, off = rng.uniform(5.0, 7.0), rng.uniform(21.0, 23.0)
        jitter = rng.normal(0.0, 0.2, (days, 2))
        low = (hour < on + jitter[:, :1]) | (hour > off + jitter[:, 1:])
        if turned_down:
            low |= away
        values = np.where(low, level - heating.setback, level).ravel()
        for _ in range(int(rng.poisson(0.25 * days))):  # by hand: warmer, or off, for hours
            first = int(rng.integers(values.size))
            values[first : first + int(rng.uniform(2.0, 9.0) * STEPS_PER_HOUR)] = (
                level + rng.uniform(1.0, 2.5) if rng.random() < 0.5 else _UNOCCUPIED
            )
        found.append(values)
    return np.column_stack(found)


def openings(people: Household, rng: np.random.Generator) -> Series:
    """Return when a window stands open, shape (n_time,) [-]: after rising, and now and then while somebody is awake.

    Parameters
    ----------
    people : Household
        Who is in.
    rng : Generator
        Of the window.
    """
    awake = people.awake > 0.0
    rising = awake & ~np.concatenate([[False], awake[:-1]])
    likely = np.where(rising, 0.6, np.where(awake, 1.0 / (10.0 * STEPS_PER_HOUR), 0.0))
    found = np.zeros(awake.size)
    for step in np.flatnonzero(rng.random(awake.size) < likely):
        minutes = float(np.exp(rng.normal(np.log(25.0), 0.7)))
        found[step : step + max(round(minutes / 5.0), 1)] = rng.choice([0.3, 1.0])  # tilted, or wide
    return found


def doors(people: Household, rng: np.random.Generator) -> Series:
    """Return when a door stands open, shape (n_time,) [-]: people who are awake leave it as it was for an hour or two.

    Parameters
    ----------
    people : Household
        Who is in.
    rng : Generator
        Of the door.
    """
    state, found = bool(rng.integers(2)), np.zeros(people.awake.size)
    changes = rng.random(people.awake.size) < 1.0 / (1.5 * STEPS_PER_HOUR)
    for step, (change, awake) in enumerate(zip(changes, people.awake, strict=True)):
        state ^= bool(change and awake)
        found[step] = state
    return found


def now_and_then(rng: np.random.Generator, n: int, share: float, hours: tuple[float, float], at: float) -> Series:
    """Return a device that runs on some days about one time of day, shape (n_time,) [-].

    Parameters
    ----------
    rng : Generator
        Of the device.
    n : int
        Intervals, whole days.
    share : float
        Of the days [-].
    hours : tuple of float
        How long at least and at most [h].
    at : float
        When it starts, in the mean [h].
    """
    found, day = np.zeros(n), 24 * STEPS_PER_HOUR
    for first in range(0, n, day):
        if rng.random() < share:
            start = first + int((at + rng.normal(0.0, 0.7)) * STEPS_PER_HOUR)
            found[start : start + int(rng.uniform(*hours) * STEPS_PER_HOUR)] = 1.0
    return found
