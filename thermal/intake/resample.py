"""Series on clocks of their own become means over regular steps; readings of counters become power or flow."""

from dataclasses import dataclass

import numpy as np
import pandas as pd

from thermal._types import FloatArray

#: Share of a step that must be measured for its mean to count [-].
LEAST_COVERED = 0.5

#: Times its usual interval that a value may stand for [-]; jitter, and one or two values that are missing.
LONGEST_HOLD = 1.5

#: Intervals between readings over which a counter's rise is spread evenly, as a multiple of the usual one [-].
LONGEST_SPREAD = 3.0

#: How long a setpoint or command holds without being logged again [s]: such points are often logged on change.
LONGEST_COMMAND = 24 * 3600.0

#: Readings within which a counter that fell back must be where it was, to be taken for a glitch.
GLITCH = 3

#: Decimals that means keep, of values as a share of their range: rounding of sums must not make a stuck sensor move.
_DECIMALS = 9


@dataclass(frozen=True)
class CounterReport:
    """What became of the readings of a counter.

    Parameters
    ----------
    resets
        Times that it began anew: of that interval only what it counted since is known.
    rollovers
        Times that it ran over its last digit.
    glitches
        Readings that fell back for a moment, left out.
    per_interval
        Whether values are amounts of each interval rather than readings of a counter.
    """

    resets: int = 0
    rollovers: int = 0
    glitches: int = 0
    per_interval: bool = False


def usual_interval(stamps: pd.DatetimeIndex) -> float:
    """Most common time from a stamp to the next, jitter aside [s].

    Parameters
    ----------
    stamps
        In order, none twice.

    Returns
    -------
    float
        Median of the differences; NaN for fewer than two.
    """
    return float(np.median(np.diff(stamps.as_unit("us").asi8))) / 1e6 if len(stamps) > 1 else np.nan


def step_means(series: pd.Series, ends: pd.DatetimeIndex, step: float, *, holds: bool = False) -> FloatArray:
    """Means of a series over regular steps.

    Parameters
    ----------
    series
        Values [any], NaN where unknown; tz-aware index in order, none twice.
    ends
        Ends of the steps, shape (n_time,).
    step
        Their length [s].
    holds
        Whether a value stands from its stamp on, as a setpoint does, rather than for the time before it, as what is
        measured does.

    Returns
    -------
    ndarray
        Shape (n_time,); NaN where under half of a step is known.

    Notes
    -----
    A value stands for the time since the one before, for 1.5 usual intervals at most. So jitter of some seconds moves
    no value into another step, and a series with longer steps than asked for is held.
    """
    usual = usual_interval(pd.DatetimeIndex(series.index))
    stamps = _seconds(pd.DatetimeIndex(series.index))
    if holds:
        begin = stamps
        end = np.minimum(np.append(stamps[1:], stamps[-1] + max(usual, step)), stamps + LONGEST_COMMAND)
    else:
        hold = LONGEST_HOLD * usual if np.isfinite(usual) else step
        begin = np.maximum(np.concatenate(([stamps[0] - hold / LONGEST_HOLD], stamps[:-1])), stamps - hold)
        end = stamps
    return interval_means(begin, end, series.to_numpy(dtype=float), ends, step)


def interval_means(
    begin: FloatArray, end: FloatArray, values: FloatArray, ends: pd.DatetimeIndex, step: float
) -> FloatArray:
    """Means over regular steps of values that stand for intervals of their own.

    Parameters
    ----------
    begin, end
        Of the intervals, shape (n,), in order and apart from each other [s since 1970].
    values
        Mean of each interval, shape (n,) [any]; NaN where unknown.
    ends
        Ends of the steps, shape (n_time,).
    step
        Their length [s].

    Returns
    -------
    ndarray
        Shape (n_time,); NaN where under half of a step is known.
    """
    known = np.isfinite(values)
    if not known.any():
        return np.full(len(ends), np.nan)
    begin, end, values = begin[known], end[known], values[known]
    middle = float(np.median(values))
    span = float(np.abs(values - middle).max()) or 1.0
    times = np.column_stack([begin, end]).ravel()
    lengths = end - begin
    sums, covered = np.zeros(len(times)), np.zeros(len(times))
    sums[1::2], covered[1::2] = np.cumsum((values - middle) / span * lengths), np.cumsum(lengths)
    sums[2::2], covered[2::2] = sums[1:-1:2], covered[1:-1:2]
    last = _seconds(ends)
    total, time = (np.interp(last, times, of) - np.interp(last - step, times, of) for of in (sums, covered))
    with np.errstate(invalid="ignore", divide="ignore"):
        means = np.round(total / time, _DECIMALS) * span + middle
    return np.where(time >= LEAST_COVERED * step - 1e-6, means, np.nan)


def counter_means(readings: pd.Series, ends: pd.DatetimeIndex, step: float) -> tuple[FloatArray, CounterReport]:
    """Mean rise a second of a counter over regular steps.

    Parameters
    ----------
    readings
        Readings of a counter, or amounts of each interval [unit]; tz-aware index in order, none twice.
    ends
        Ends of the steps, shape (n_time,).
    step
        Their length [s].

    Returns
    -------
    tuple of ndarray and CounterReport
        Shape (n_time,) [unit/s], NaN where unknown, and what was done.

    Notes
    -----
    What a counter rises by between two readings is spread evenly over that time. Where it falls: at nine tenths of a
    power of ten it ran over its last digit; where it is back within three readings, those between are glitches; else it
    began anew at zero, and what it counted since is counted. Values that fall more than every tenth time are amounts of
    each interval.
    """
    readings = readings.dropna()
    values, stamps = readings.to_numpy(dtype=float), _seconds(pd.DatetimeIndex(readings.index))
    if len(values) < 2:
        return np.full(len(ends), np.nan), CounterReport()
    usual = usual_interval(pd.DatetimeIndex(readings.index))
    changes = np.diff(values)
    changed = changes[changes != 0.0]
    if changed.size > 10 and np.mean(changed < 0.0) > 0.1:
        begin = np.concatenate(([stamps[0] - usual], np.maximum(stamps[:-1], stamps[1:] - LONGEST_SPREAD * usual)))
        rates = values / np.maximum(stamps - begin, 1e-9)
        return interval_means(begin, stamps, rates, ends, step), CounterReport(per_interval=True)
    keep = np.ones(len(values), dtype=bool)
    for k in np.flatnonzero(changes < 0.0):
        back = np.flatnonzero(values[k + 1 : k + 2 + GLITCH] >= values[k])
        if keep[k] and len(back):
            keep[k + 1 : k + 1 + back[0]] = False
    values, stamps = values[keep], stamps[keep]
    rises = np.diff(values)
    largest = 3.0 * float(np.quantile(rises[rises >= 0.0], 0.99)) if (rises >= 0.0).any() else np.inf
    falls = np.flatnonzero(rises < 0.0)
    rollovers = 0
    for k in falls:
        full = 10.0 ** np.ceil(np.log10(max(values[k], 1.0)))
        over = full - values[k] + values[k + 1]
        ran_over = values[k] >= 0.9 * full and over <= max(largest, 0.01 * full)
        rollovers += ran_over
        rises[k] = over if ran_over else values[k + 1] if values[k + 1] <= largest else np.nan
    lengths = np.diff(stamps)
    rates = np.where(lengths <= max(LONGEST_SPREAD * usual, step), rises / lengths, np.nan)
    report = CounterReport(len(falls) - rollovers, rollovers, int((~keep).sum()))
    return interval_means(stamps[:-1], stamps[1:], rates, ends, step), report


def _seconds(stamps: pd.DatetimeIndex) -> FloatArray:
    return np.asarray(stamps.as_unit("us").asi8 / 1e6, dtype=float)
