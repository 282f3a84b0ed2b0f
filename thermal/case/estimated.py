"""Temperatures of zones whose sensor is dead or stuck for long, estimated from what was measured a day before."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from thermal.case.signal_faults import runs

#: Longest gap that is bridged by a straight line, not estimated [s] (results contract: 30 minutes).
LONGEST_BRIDGE = 1800.0

#: Age of what an estimate may know [s]: a run of at most a day sees nothing that comes after its start.
DELAY = 86400.0


@dataclass(frozen=True)
class Estimated:
    """An interval in which a zone's temperature was estimated.

    Parameters
    ----------
    zone
        Name of the zone.
    start, end
        First and last stamp of it.
    """

    zone: str
    start: pd.Timestamp
    end: pd.Timestamp


def estimate_remarks(found: Sequence[Estimated]) -> tuple[str, ...]:
    """Say of each zone for how long its temperature was estimated.

    Parameters
    ----------
    found
        Where.
    """
    told = []
    for zone in dict.fromkeys(interval.zone for interval in found):
        own = [interval for interval in found if interval.zone == zone]
        hours = sum((i.end - i.start).total_seconds() for i in own) / 3600.0
        told.append(
            f"zone {zone!r}: no usable temperature for {hours:.0f} h since {own[0].start}; its heat follows from an "
            "estimate, and its errors do not count"
        )
    return tuple(told)


def estimate_temperatures(measured: pd.DataFrame, step: float) -> tuple[pd.DataFrame, tuple[Estimated, ...]]:
    """Fill long gaps of zone temperatures with the mean of the other zones a day before.

    Parameters
    ----------
    measured
        Temperatures of the zones that devices give air to, shape (n_time, n_zone) [K], NaN where missing.
    step
        Time from a stamp to the next [s].

    Returns
    -------
    tuple
        The same temperatures [K] with gaps of more than 30 minutes filled, and where they were. Gaps of up to 30
        minutes stay, and so does everything where no zone is measured.

    Notes
    -----
    The zone's mean difference from the others is added, a day old as well. In the first day of the telemetry, where
    nothing is a day old, the first stamp's mean stands; a run of over a day still sees what comes after its start.
    """
    limit, delay = int(LONGEST_BRIDGE // step), max(1, round(DELAY / step))
    filled, found = measured.copy(), []
    mean = measured.mean(axis=1).ffill().bfill()
    for zone in measured.columns:
        gap = measured[zone].isna().to_numpy()
        long = [(a, b) for a, b in runs(gap) if b - a + 1 > limit]
        if not long or mean.isna().all():
            continue
        difference = (measured[zone] - mean).expanding().mean().shift(delay).fillna(0.0)
        estimate = (mean.shift(delay).bfill() + difference).to_numpy()
        values = measured[zone].to_numpy(dtype=float, copy=True)
        for a, b in long:
            values[a : b + 1] = estimate[a : b + 1]
            found.append(Estimated(str(zone), measured.index[a], measured.index[b]))
        filled[zone] = np.asarray(values)
    return filled, tuple(found)
