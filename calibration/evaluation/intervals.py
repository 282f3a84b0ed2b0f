"""Tuning and held-out intervals, and the runs that start in them."""

import itertools
import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from calibration.errors import CalibrationError, HorizonError, NotEnoughDataError
from calibration.results import Plain
from thermal._types import IntArray
from thermal.case.case import Case, local_timestamp
from thermal.errors import CaseError
from thermal.model.case_replay import LEAST_SPIN_UP, SPIN_UP, Inputs

#: Days that tune before one that is held out, where they alternate, and fewest such turns.
_TUNING_DAYS, _TURNS = 2, 3


@dataclass(frozen=True)
class Interval(Plain):
    """An interval of telemetry; a run belongs to the interval that holds its target.

    Parameters
    ----------
    start, end : Timestamp
        First and last stamp, both included, with a time zone.
    """

    start: pd.Timestamp
    end: pd.Timestamp

    def __post_init__(self) -> None:
        if not self.start < self.end:
            raise CalibrationError(f"interval {self.start}/{self.end}: expected the start before the end")


def parse_interval(text: str, case: Case) -> Interval:
    """Read ``START/END``.

    Parameters
    ----------
    text : str
        Two ISO 8601 times; a time without offset is local to the building.
    case : Case
        Whose telemetry the interval cuts.

    Raises
    ------
    CalibrationError
        When it is not two ordered times, or holds no telemetry.
    """
    parts = text.split("/")
    advice = "for example 2023-10-02/2023-10-09T12:00"
    CalibrationError.unless(len(parts) == 2, "interval", "START/END in ISO 8601", repr(text), advice)
    try:
        start, end = (pd.Timestamp(local_timestamp(part.strip(), case.building)) for part in parts)
    except CaseError as error:
        raise CalibrationError(f"interval {text!r}: {error}") from error
    stamps = case.stamps
    interval = Interval(start, end)
    if end < stamps[0] or start > stamps[-1]:
        raise CalibrationError(
            f"interval {text!r}: outside of the telemetry, which goes from {stamps[0]} to {stamps[-1]}"
        )
    return interval


def default_intervals(
    case: Case, tune: Sequence[Interval] = (), hold_out: Sequence[Interval] = ()
) -> tuple[list[Interval], list[Interval]]:
    """Complete tuning and held-out intervals.

    Parameters
    ----------
    case : Case
        With telemetry.
    tune, hold_out : sequence of Interval
        First two thirds and last third of the telemetry when both are empty. When only one is given, the other is what
        follows it, or what precedes it where that is longer.

    Returns
    -------
    tuple of lists
        Tuning and held-out intervals, each in order.

    Raises
    ------
    CalibrationError
        When the given intervals leave nothing, or overlap.
    """
    stamps = case.stamps
    if not tune and not hold_out:
        split = (2 * len(stamps)) // 3
        return [Interval(stamps[0], stamps[split - 1])], [Interval(stamps[split], stamps[-1])]
    tune, hold_out = merge(tune), merge(hold_out)
    return tune or [_rest(stamps, hold_out)], hold_out or [_rest(stamps, tune)]


def alternating_intervals(case: Case) -> tuple[list[Interval], list[Interval]]:
    """Tuning and held-out intervals that take turns, so that both see the weather and the use of all the telemetry.

    Parameters
    ----------
    case : Case
        With telemetry.

    Returns
    -------
    tuple of lists
        Two local days in three from midnight to midnight, from whose stamps runs start and end, and what lies between
        them; what is left at the end tunes where it is over a day, and is held out else.

    Raises
    ------
    NotEnoughDataError
        When the telemetry is shorter than three such turns.
    """
    stamps = case.stamps
    start, end, step = stamps[0], stamps[-1], stamps[1] - stamps[0]
    midnight, turn = start.normalize(), _TUNING_DAYS + 1
    days = ((end + step).tz_localize(None) - midnight.tz_localize(None)) / pd.Timedelta(days=1)
    turns = int(days) // turn
    expected = f"{_TURNS * turn} days of telemetry or more"
    NotEnoughDataError.unless(turns >= _TURNS, "alternating intervals", expected, f"{days:.1f}")
    begins = [midnight + pd.DateOffset(days=k * turn) for k in range(turns + 1)]
    tuned = [Interval(max(b, start), b + pd.DateOffset(days=_TUNING_DAYS)) for b in begins[:-1]]
    judged = [Interval(i.end + step, b - step) for i, b in zip(tuned, begins[1:], strict=True)]
    if end - begins[-1] > pd.Timedelta(days=1):
        return [*tuned, Interval(begins[-1], end)], judged
    return tuned, [*judged[:-1], Interval(judged[-1].start, end)]


def _rest(stamps: pd.DatetimeIndex, given: Sequence[Interval]) -> Interval:
    """Find the longer part of the telemetry before or after the given intervals."""
    before, after = stamps[stamps < given[0].start], stamps[stamps > max(i.end for i in given)]
    longer = max((after, before), key=len)
    if len(longer) < 2:
        raise CalibrationError(
            "intervals: what is given leaves no telemetry for the other; give both --tune and --hold-out"
        )
    return Interval(longer[0], longer[-1])


def horizon_steps(horizon: str, step: float) -> int:
    """Count the steps N of a horizon.

    Parameters
    ----------
    horizon : str
        Such as ``6h`` or ``30min``.
    step : float
        Step of the telemetry [s].

    Raises
    ------
    HorizonError
        When it is not a positive whole number of steps.
    """
    try:
        day = re.sub(r"d$", "D", horizon.strip())  # pandas is giving up its lower-case day
        seconds = pd.Timedelta(day).total_seconds()
    except ValueError as error:
        raise HorizonError(f"horizon: expected a duration such as 6h or 90min, got {horizon!r}") from error
    steps = seconds / step
    if not (np.isfinite(steps) and steps >= 1 and abs(steps - round(steps)) < 1e-9):
        raise HorizonError(
            f"horizon {horizon!r}: expected a positive multiple of the telemetry's step of {step:g} s, "
            f"got {seconds:g} s, {steps:.4g} steps"
        )
    return round(steps)


@dataclass(frozen=True)
class Runs:
    """N-step runs whose targets lie in one interval.

    Parameters
    ----------
    begin : int
        Stamp at which their common spin-up begins.
    starts : ndarray of int, shape (n_run,)
        Stamps t0, on the hour.
    skipped : int
        Runs left out because inputs, or every zone's temperature at start or target, are missing.
    """

    begin: int
    starts: IntArray
    skipped: int


def select_runs(
    inputs: Inputs,
    interval: Interval,
    steps: int,
    every: float = 3600.0,
    spin_up: float = SPIN_UP,
    least: float = LEAST_SPIN_UP,
) -> Runs:
    """Find the runs of an interval.

    Parameters
    ----------
    inputs : Inputs
        The telemetry.
    interval : Interval
        Where targets must lie.
    steps : int
        N, steps from start to target.
    every : float
        Time between starts [s]; an hour in the contract of results.
    spin_up : float
        Telemetry before the interval that the spin-up may use [s].
    least : float
        Least spin-up of a run [s].

    Raises
    ------
    NotEnoughDataError
        When the interval has no room for a single run.
    """
    stamps, step = inputs.stamps, inputs.step
    first = int(stamps.searchsorted(interval.start))
    last = int(stamps.searchsorted(interval.end, side="right")) - 1
    begin = max(0, first - round(spin_up / step))
    stride = max(1, round(every / step))
    on_hour = np.flatnonzero((stamps.minute == 0) & (stamps.second == 0))
    anchor = int(on_hour[0]) if on_hour.size else 0
    lowest = max(begin + int(np.ceil(least / step)), first - steps)
    starts = np.arange(anchor, last - steps + 1, stride)
    starts = starts[starts >= lowest]
    if starts.size == 0:
        raise NotEnoughDataError(
            f"interval {interval.start} to {interval.end}: expected room for a run of {steps} steps "
            f"of {step:g} s after {least / 3600:g} h of spin-up, found {last - first + 1} stamps"
        )
    gaps = np.concatenate([[0], np.cumsum(~inputs.complete)])
    whole = gaps[starts + steps + 1] == gaps[starts + 1]
    seen = np.isfinite(inputs.targets(starts, np.array([steps]))).any(axis=(1, 2))
    usable = whole & seen
    return Runs(begin, starts[usable], int((~usable).sum()))


def merge(intervals: Sequence[Interval]) -> list[Interval]:
    """Order intervals by their start.

    Parameters
    ----------
    intervals : sequence of Interval
        In any order.

    Raises
    ------
    CalibrationError
        When two of them overlap: their telemetry would count twice.
    """
    ordered = sorted(intervals, key=lambda i: (i.start, i.end))
    for a, b in itertools.pairwise(ordered):
        if b.start <= a.end:
            raise CalibrationError(
                f"intervals {a.start}/{a.end} and {b.start}/{b.end} overlap: their telemetry would count twice"
            )
    return ordered


def days_of(intervals: Sequence[Interval]) -> float:
    """Length of intervals together [days].

    Parameters
    ----------
    intervals : sequence of Interval
        That do not overlap.
    """
    return sum((i.end - i.start for i in intervals), pd.Timedelta(0)) / pd.Timedelta(days=1)
