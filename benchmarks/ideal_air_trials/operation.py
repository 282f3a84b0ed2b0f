"""Set points of thermostats, and what people do: hours, openings, gains."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pandas as pd
from _worlds import Effect
from numpy.typing import NDArray

from ideal_air_trials.specification import STEPS_PER_DAY, STEPS_PER_HOUR, USE, Spec, generator

Series = NDArray[np.float64]

_HEATING_LIMITS, _COOLING_LIMIT = (16.5, 25.0), 26.5  # [degC] of set points
_LEAST_BAND = 0.4  # [K] between the set points
WORK = (8, 18)  # [h], when doors are open and people open windows


class Setpoints(NamedTuple):
    """Set points of all zones and steps.

    Parameters
    ----------
    heating, cooling : DataFrame, shape (n_time, n_zone)
        [degC]
    """

    heating: pd.DataFrame
    cooling: pd.DataFrame


def hours(spec: Spec) -> Series:
    """Return the hours of the day at which steps begin, shape (n_time,) [h].

    Parameters
    ----------
    spec : Spec
        Of a trial.
    """
    return np.arange(len(spec.starts)) / STEPS_PER_HOUR % 24.0


def working_days(spec: Spec) -> NDArray[np.bool_]:
    """Tell which steps are on working days, shape (n_time,).

    Parameters
    ----------
    spec : Spec
        Of a trial.
    """
    return np.asarray(spec.starts.day_of_week < 5)


def working_hours(spec: Spec) -> NDArray[np.bool_]:
    """Tell which steps are within `WORK`, shape (n_time,).

    Parameters
    ----------
    spec : Spec
        Of a trial.
    """
    hour = hours(spec)
    return (hour >= WORK[0]) & (hour < WORK[1]) & working_days(spec)


def draw_excitation(rng: np.random.Generator) -> str:
    """Draw how set points move; it is the first that is drawn of them.

    Parameters
    ----------
    rng : Generator
        Random numbers of set points.
    """
    return "prbs" if rng.random() < 0.5 else "schedule"


def setpoints(spec: Spec) -> Setpoints:
    """Return the set points of thermostats.

    Half of the offices have pseudo-random binary sequences that are independent by zone, half of them working hours.

    Parameters
    ----------
    spec : Spec
        Of a trial.
    """
    rng = generator(spec.stream, spec.seed, USE)
    excitation, period = draw_excitation(rng), int(rng.choice([1, 2, 3])) * STEPS_PER_HOUR
    arrival, departure, setback = rng.uniform(5.0, 8.0), rng.uniform(17.0, 20.0), rng.uniform(1.5, 4.0)
    warmer, hour, work = float(rng.uniform(-0.5, 1.0)), hours(spec), working_days(spec)
    heating, cooling = {}, {}
    for zone in spec.zone_names:
        if excitation == "prbs":
            level, swing = rng.uniform(19.3, 21.8) + warmer, rng.uniform(1.0, 2.0)
            bits = rng.integers(0, 2, int(np.ceil(len(hour) / period)))
            sequence = np.roll(np.repeat(bits, period)[: len(hour)], int(rng.integers(0, period)))
            low = level + swing * (2 * sequence - 1)
            high = low + rng.uniform(0.4, 1.2)
        else:
            comfort = rng.uniform(20.0, 22.0) + warmer
            first, last = arrival + rng.uniform(-0.75, 0.75), departure + rng.uniform(-0.75, 0.75)
            empty = comfort - setback * rng.uniform(0.7, 1.3)
            there = (hour >= first) & (hour < last) & work
            low = np.where(there, comfort, empty)
            high = np.where(there, comfort + rng.uniform(2.0, 3.2), comfort + rng.uniform(4.0, 5.5))
        heating[zone] = np.clip(np.round(low, 2), *_HEATING_LIMITS)
        cooling[zone] = np.clip(np.round(high, 2), heating[zone] + _LEAST_BAND, _COOLING_LIMIT)
    return Setpoints(pd.DataFrame(heating, spec.starts), pd.DataFrame(cooling, spec.starts))


def occupied(spec: Spec, effect: Effect, rng: np.random.Generator) -> Series:
    """Return the share of a zone's equipment that is on, shape (n_time,): by day, by hour, and always some of it.

    Parameters
    ----------
    spec : Spec
        Of a trial.
    effect : Effect
        Internal gains.
    rng : Generator
        Of what people do.
    """
    numbers, hour = effect.parameters, hours(spec)
    late = rng.uniform(-0.5, 0.5, 2)
    there = (hour >= numbers["arrival_h"] + late[0]) & (hour < numbers["departure_h"] + late[1])
    share = np.where((hour >= 12.0) & (hour < 13.0), there * numbers["lunch_share"], there)
    share = share * np.where(working_days(spec), 1.0, numbers["weekend_share"])
    varying = np.clip(rng.normal(1.0, 0.12, len(hour) // STEPS_PER_HOUR), 0.5, 1.5)
    base = numbers["base_share"]
    return np.asarray(np.round(base + (1.0 - base) * share * np.repeat(varying, STEPS_PER_HOUR), 2))


def openings(spec: Spec, outdoor: Series, eagerness: float, rng: np.random.Generator) -> Series:
    """Return how far windows of a zone are open, shape (n_time,) [-].

    People open them in working hours, at 21 degC most often, and leave them open for half an hour in the mean, in warm
    weather for two hours.

    Parameters
    ----------
    spec : Spec
        Of a trial.
    outdoor : ndarray, shape (n_time,)
        Temperature [degC].
    eagerness : float
        Factor on how often they do [-].
    rng : Generator
        Of what people do.
    """
    shares, work, k = np.zeros(len(outdoor)), working_hours(spec), 0
    an_hour = (0.5 * np.exp(-(((outdoor - 21.0) / 6.0) ** 2)) + 0.07) * eagerness
    while k < len(shares):
        if work[k] and rng.random() < an_hour[k] / STEPS_PER_HOUR:
            steps = int(np.clip(rng.exponential(6.0 if outdoor[k] < 12.0 else 24.0), 1, 72))
            shares[k : k + steps] = np.round(rng.uniform(0.4, 1.0), 2)
            k += steps
        k += 1
    return shares


def fires(spec: Spec, a_day: float, duration: float, rng: np.random.Generator) -> Series:
    """Return the share of its power that a stove gives, shape (n_time,): it warms up, burns, and dies down.

    Parameters
    ----------
    spec : Spec
        Of a trial.
    a_day : float
        Fires a day in the mean, from 7 to 21 h.
    duration : float
        [h]
    rng : Generator
        Of what people do.
    """
    share = np.zeros(len(spec.starts))
    for day in range(len(share) // STEPS_PER_DAY):
        for _ in range(rng.poisson(a_day)):
            first = int(day * STEPS_PER_DAY + rng.uniform(7.0, 21.0) * STEPS_PER_HOUR)
            steps = int(max(6, duration * STEPS_PER_HOUR * rng.uniform(0.5, 1.4)))
            course = np.minimum(np.linspace(0.5, 3.0, steps), np.linspace(2.2, 0.2, steps)).clip(0.0, 1.0)
            there = share[first : first + steps]
            there[:] = np.round(course, 2)[: len(there)]
    return share
