"""What a dead or stuck sensor leaves unknown, estimated: a zone's temperature, its heat, the flow of a device."""

from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from typing import Any

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


def estimate_summary(found: Sequence[Estimated]) -> list[dict[str, Any]]:
    """Sum up by sensor what was estimated.

    Parameters
    ----------
    found
        Where.

    Returns
    -------
    list of dict
        ``zone``, ``lacking``, first ``start``, last ``end``, and ``hours`` in all [h], one a sensor.
    """
    entries = []
    for zone, lacking in dict.fromkeys((interval.zone, interval.lacking) for interval in found):
        own = [interval for interval in found if (interval.zone, interval.lacking) == (zone, lacking)]
        start, end = own[0].start.isoformat(), own[-1].end.isoformat()
        hours = round(sum((i.end - i.start).total_seconds() for i in own) / 3600.0, 1)
        entries.append({"zone": zone, "lacking": lacking, "start": start, "end": end, "hours": hours})
    return entries


def estimate_entry(found: Sequence[Estimated]) -> dict[str, Any]:
    """Entry ``estimated`` of a results file; nothing where nothing was estimated.

    Parameters
    ----------
    found
        Where.
    """
    return {"estimated": estimate_summary(found)} if found else {}


def estimate_remarks(found: Sequence[Estimated]) -> tuple[str, ...]:
    """Say of each sensor for how long it was missing and that its zone's heat was estimated.

    Parameters
    ----------
    found
        Where.
    """
    return tuple(
        f"zone {e['zone']!r}: no usable {e['lacking']} for {e['hours']:.0f} h since {e['start'][:10]}; "
        "its heat follows from an estimate, and its errors do not count"
        for e in estimate_summary(found)
    )


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


def like_others(values: pd.DataFrame, name: Hashable, step: float, age: float = 0.0) -> pd.Series:
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
        gaps = long_gaps(measured[zone], step)
        guess = like_others(measured, zone, step, DELAY) if gaps else measured[zone]
        for a, b in gaps:
            found.append(Estimated(zone, ZONE_TEMPERATURE, measured.index[a], measured.index[b]))
            filled.loc[found[-1].start : found[-1].end, zone] = guess
    return filled, tuple(found)
