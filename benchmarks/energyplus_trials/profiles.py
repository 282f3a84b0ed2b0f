"""Series in time that effects follow."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from energyplus_trials.operation import occupied
from energyplus_trials.sites import site_of
from energyplus_trials.specification import Climate

Series = NDArray[np.float64]


def hours(starts: pd.DatetimeIndex, first: float, last: float, *, every_day: bool = False) -> Series:
    """Return 1 between two hours of working days, else 0.

    Parameters
    ----------
    starts : DatetimeIndex, shape (n_time,)
        Starts of intervals.
    first, last : float
        [h]
    every_day : bool
        At weekends, too.
    """
    if every_day:
        hour = (starts.hour + starts.minute / 60.0).to_numpy()
        return np.asarray((hour >= first) & (hour < last), dtype=float)
    return occupied(starts, np.array([first]), np.array([last]), np.array([False]))[:, 0].astype(float)


def use(starts: pd.DatetimeIndex, form: str, parameters: Mapping[str, Any]) -> Series:
    """Return how much of the internal gains there is, from their base to about 1.

    `office` rises and falls within an hour and dips at noon; `bimodal` has a morning's and an evening's peak;
    `random_days` has days of random height, empty ones too.

    Parameters
    ----------
    starts : DatetimeIndex, shape (n_time,)
        Starts of intervals.
    form : str
        Which.
    parameters : dict
        `base`, `start_h`, `end_h`, `seed`.
    """
    hour = (starts.hour + starts.minute / 60.0).to_numpy()
    weekday = starts.day_of_week.to_numpy() < 5
    first, last, base = parameters["start_h"], parameters["end_h"], parameters["base"]
    if form == "bimodal":
        shape = np.exp(-0.5 * ((hour - first - 1.5) / 1.0) ** 2) + np.exp(-0.5 * ((hour - last - 2.0) / 1.2) ** 2)
        return np.asarray(base + (1.0 - base) * 1.3 * shape, dtype=float)
    day = np.clip(hour - first + 0.5, 0.0, 1.0) * np.clip(last + 0.5 - hour, 0.0, 1.0)
    day = day * (1.0 - 0.3 * ((hour >= 12.0) & (hour < 13.0)))
    if form == "random_days":
        rng = np.random.default_rng([parameters["seed"], 2])
        number = (starts.normalize() - starts[0].normalize()).days.to_numpy()
        height = rng.choice([0.0, 0.4, 1.0, 1.4], number.max() + 1)[number]
        return np.asarray(base + (1.0 - base) * day * height, dtype=float)
    return np.asarray(base + (1.0 - base) * day * weekday, dtype=float)


def ground_temperature(place: Climate, starts: pd.DatetimeIndex) -> Series:
    """Return the temperature of the ground below a building [degC].

    The year's mean outdoors, and a tenth of its swing three months late: a metre or two below a slab.

    Parameters
    ----------
    place : Climate
        Of a trial.
    starts : DatetimeIndex, shape (n_time,)
        Starts of intervals.
    """
    site = site_of(place.source, place.latitude)
    phase = 2.0 * np.pi * (starts.day_of_year.to_numpy() - 20.0 - 91.0) / 365.0
    return np.asarray(site.mean + place.warmer - 0.1 * site.swing * np.cos(phase), dtype=float)


def doors(starts: pd.DatetimeIndex, form: str, parameters: Mapping[str, Any]) -> Series:
    """Return how far doors are open: always, in working hours, or for all of some days.

    Parameters
    ----------
    starts : DatetimeIndex, shape (n_time,)
        Starts of intervals.
    form : str
        `constant`, `scheduled` or `some_days`.
    parameters : dict
        `start_h` and `end_h`, or `seed`.
    """
    if form == "scheduled":
        return hours(starts, parameters["start_h"], parameters["end_h"])
    if form == "some_days":
        rng = np.random.default_rng(parameters["seed"])
        number = (starts.normalize() - starts[0].normalize()).days.to_numpy()
        return np.asarray((rng.random(number.max() + 1) < 0.4)[number], dtype=float)
    return np.ones(len(starts))


def openings(starts: pd.DatetimeIndex, rng: np.random.Generator) -> Series:
    """Return when somebody has a window open: once or twice a working day, for a quarter of an hour to two hours.

    Parameters
    ----------
    starts : DatetimeIndex, shape (n_time,)
        Starts of intervals.
    rng : Generator
        Random numbers.
    """
    open_ = np.zeros(len(starts))
    for day in np.flatnonzero((starts.hour == 0) & (starts.minute == 0) & (starts.day_of_week < 5)):
        for _ in range(int(rng.integers(1, 3))):
            first = day + int(rng.integers(96, 200))
            open_[first : first + int(rng.integers(3, 25))] = 1.0
    return open_


def on_and_off(rng: np.random.Generator, n: int) -> Series:
    """Return 1 and 0 in turns of four hours to three days.

    Parameters
    ----------
    rng : Generator
        Random numbers.
    n : int
        Number of steps.
    """
    lengths = rng.integers(48, 864, n // 48 + 2)
    return np.asarray(np.repeat((np.arange(lengths.size) + int(rng.integers(2))) % 2, lengths)[:n], dtype=float)
