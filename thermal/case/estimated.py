"""What a dead or stuck sensor leaves unknown, estimated: a zone's temperature, its heat, the flow of a device."""

from collections.abc import Sequence
from dataclasses import dataclass

import pandas as pd

from thermal.case.points import ZONE_TEMPERATURE
from thermal.case.signal_faults import runs

#: Longest gap that is bridged by a straight line, not estimated [s] (results contract: 30 minutes).
LONGEST_BRIDGE = 1800.0

#: Age of what an estimate may know [s]: a run of at most a day sees nothing that comes after its start.
DELAY = 86400.0


@dataclass(frozen=True)
class Estimated:
    """An interval in which what a zone's heat follows from was estimated.

    Parameters
    ----------
    zone
        Name of the zone.
    lacking
        What no usable value was there of: ``zone_air_temperature_sensor``, or ``DEVICE/POINT``.
    start, end
        First and last stamp of it.
    """

    zone: str
    lacking: str
    start: pd.Timestamp
    end: pd.Timestamp


def estimate_remarks(found: Sequence[Estimated]) -> tuple[str, ...]:
    """Say of each sensor for how long it was missing and that its zone's heat was estimated.

    Parameters
    ----------
    found
        Where.
    """
    told = []
    for zone, lacking in dict.fromkeys((interval.zone, interval.lacking) for interval in found):
        own = [interval for interval in found if (interval.zone, interval.lacking) == (zone, lacking)]
        hours = sum((i.end - i.start).total_seconds() for i in own) / 3600.0
        told.append(
            f"zone {zone!r}: no usable {lacking} for {hours:.0f} h since {own[0].start}; its heat follows from an "
            "estimate, and its errors do not count"
        )
    return tuple(told)


def long_gaps(values: pd.Series, step: float) -> list[tuple[int, int]]:
    """Find gaps that are too long to be bridged by a straight line.

    Parameters
    ----------
    values
        Shape (n_time,), NaN where missing.
    step
        Time from a stamp to the next [s].

    Returns
    -------
    list of tuple
        First and last position of each gap of more than 30 minutes.
    """
    return [(a, b) for a, b in runs(values.isna().to_numpy()) if b - a + 1 > int(LONGEST_BRIDGE // step)]


def like_others(values: pd.DataFrame, name: str, step: float, age: float = 0.0) -> pd.Series:
    """Estimate a column from the others: their mean, and the mean difference from it until a day before.

    Parameters
    ----------
    values
        Shape (n_time, n), NaN where missing.
    name
        Column to estimate. Without others it is its own mean until a day before.
    step
        Time from a stamp to the next [s].
    age
        How old the mean of the others is [s]; 0 for inputs of a model, which are given, not for what it predicts.

    Returns
    -------
    Series
        Shape (n_time,) [unit of `values`]; NaN where all the others are missing.
    """
    rest = values.drop(columns=name)
    others = rest.mean(axis=1) if rest.shape[1] else pd.Series(0.0, index=values.index)
    usual = (values[name] - others).expanding().mean().shift(max(1, round(DELAY / step)))
    if age:
        others = others.ffill().bfill().shift(max(1, round(age / step))).bfill()
    return others + (usual.fillna(0.0) if rest.shape[1] else usual.bfill())


def estimate_temperatures(measured: pd.DataFrame, step: float) -> tuple[pd.DataFrame, tuple[Estimated, ...]]:
    """Fill long gaps of zone temperatures with those of the other zones a day before (`like_others`).

    Parameters
    ----------
    measured
        Temperatures of the zones, shape (n_time, n_zone) [K], NaN where missing.
    step
        Time from a stamp to the next [s].

    Returns
    -------
    tuple
        The same temperatures [K] with gaps of more than 30 minutes filled, and where they were. Gaps of up to 30
        minutes stay, and so does everything where no zone is measured.

    Notes
    -----
    In the first day of the telemetry, where nothing is a day old, the first stamp's mean stands; a run of over a day
    still sees what comes after its start.
    """
    filled, found = measured.copy(), []
    for zone in map(str, measured.columns):
        for a, b in long_gaps(measured[zone], step):
            found.append(Estimated(zone, ZONE_TEMPERATURE, measured.index[a], measured.index[b]))
            filled.loc[found[-1].start : found[-1].end, zone] = like_others(measured, zone, step, DELAY)
    return filled, tuple(found)
