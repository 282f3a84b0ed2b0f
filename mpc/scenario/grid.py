"""The clock of a closed loop: regular steps in the building's time zone, its calendar, and means from other clocks."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field
from datetime import date, datetime
from functools import cached_property

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from mpc.errors import ScenarioError
from thermal._types import FloatArray, IntArray
from thermal.case.building import Building
from thermal.case.case import local_timestamp
from thermal.case.years import EXPECTED, FIRST_YEAR, LAST_YEAR, shown, within_years

#: Local clocks, schedules and tariffs change on multiples of this [s]; offsets of time zones are whole quarter hours.
RESOLUTION = 300

WEEKDAY, SATURDAY, SUNDAY = 0, 1, 2  # kinds of a day; a holiday is like a Sunday


@dataclass(frozen=True)
class StepGrid:
    """Regular steps of time, each known by the stamp at its end.

    Parameters
    ----------
    start : pandas.Timestamp
        Start of the first step, in the building's time zone; a whole second.
    step : float
        Length of a step [s], a whole number.
    n_steps : int
        Number of steps, at least 1.

    Raises
    ------
    ScenarioError
        When the start has no time zone or is of no year that stamps can lie in, or a number is out of range.

    Examples
    --------
    >>> day = StepGrid(pd.Timestamp("2023-03-26", tz="Europe/Berlin"), 3600.0, 23)  # clocks go forward
    >>> day.stamps[-1].isoformat()
    '2023-03-27T00:00:00+02:00'
    """

    start: pd.Timestamp
    step: float
    n_steps: int

    def __post_init__(self) -> None:
        zoned = self.start.tzinfo is not None and not self.start.microsecond
        ScenarioError.unless(zoned, "start", "a whole second in a time zone", repr(self.start))
        ScenarioError.unless(FIRST_YEAR <= self.start.year <= LAST_YEAR, "start", EXPECTED, self.start)
        whole = self.step >= 1 and float(self.step).is_integer() and self.n_steps >= 1
        ScenarioError.unless(whole, "grid", "at least one step of a whole number of seconds", self)

    @classmethod
    def between(cls, start: str | datetime, end: str | datetime, step: float, building: Building) -> StepGrid:
        """Cover an interval of local time.

        Parameters
        ----------
        start, end : str or datetime
            ISO 8601; without an offset local to the building.
        step : float
            Length of a step [s].
        building : Building
            Whose clock counts.

        Raises
        ------
        ScenarioError
            When there is not a whole number of steps between them, at least one.
        CaseError
            When a time cannot be read, or is one that the local clock skips or shows twice.
        """
        first, last = (local_timestamp(time, building) for time in (start, end))
        count = (last - first).total_seconds() / step if step > 0 else 0.0
        expected = f"a whole number of steps of {step:g} s from start to end"
        ScenarioError.unless(count >= 1 and count.is_integer(), "grid", expected, f"{first} to {last}")
        return cls(first, step, int(count))

    @cached_property
    def stamps(self) -> pd.DatetimeIndex:
        """Ends of the steps, shape (n_steps,), local."""
        return self._times(self.step, self.step, self.n_steps)

    @cached_property
    def edges(self) -> NDArray[np.int64]:
        """Starts and ends of the steps, shape (n_steps + 1,), seconds since 1970 in UTC [s]."""
        return int(self.start.timestamp()) + np.arange(self.n_steps + 1, dtype=np.int64) * int(self.step)

    @cached_property
    def per_step(self) -> int:
        """Pieces of a step; within a piece no local clock, schedule or tariff changes."""
        return int(self.step) // math.gcd(int(self.step), RESOLUTION, int(self.edges[0]))

    @cached_property
    def middles(self) -> pd.DatetimeIndex:
        """Middles of the pieces, shape (n_steps * per_step,), local."""
        piece = self.step / self.per_step
        return self._times(piece / 2.0, piece, self.n_steps * self.per_step)

    @cached_property
    def days(self) -> tuple[date, ...]:
        """Local days that the grid touches, in order."""
        last = self.stamps[-1] - pd.Timedelta(seconds=1)
        return tuple(pd.date_range(self.start.date(), last.date()).date)

    def mean(self, pieces: FloatArray) -> FloatArray:
        """Average what is known at the pieces over each step.

        Parameters
        ----------
        pieces : ndarray, shape (n_steps * per_step,)
            A value a piece [any].

        Returns
        -------
        ndarray, shape (n_steps,)
            Means over the steps [as given].
        """
        parts = np.asarray(pieces, dtype=float).reshape(self.n_steps, self.per_step)
        first = parts[:, 0]  # so that the mean of equal values is that value, to the last digit
        return np.asarray(first + (parts - first[:, None]).mean(axis=1))

    def _times(self, first: float, spacing: float, count: int) -> pd.DatetimeIndex:
        start = self.start + pd.Timedelta(seconds=first)
        return pd.date_range(start, periods=count, freq=pd.Timedelta(seconds=spacing), name="timestamp")


def index_seconds(stamps: pd.DatetimeIndex) -> NDArray[np.int64]:
    """Seconds since 1970 in UTC [s].

    Parameters
    ----------
    stamps : DatetimeIndex
        With a time zone.
    """
    return np.asarray(stamps.as_unit("s").asi8, dtype=np.int64)


def regular_steps(
    index: pd.Index, where: str, error: type[ScenarioError], step: float = 0.0, longest: float = np.inf
) -> float:
    """Step of regular stamps with a time zone [s].

    Parameters
    ----------
    index : Index
        Stamps.
    where : str
        What they belong to, for the message.
    error : type
        Raised when they are no such stamps, fewer than two, or irregular.
    step : float
        What their step should be [s]; 0, the default, for any; where it is given one stamp will do.
    longest : float
        Longest step that is allowed, unless it is the given one [s].
    """
    if not isinstance(index, pd.DatetimeIndex) or index.tz is None or len(index) < 1 + (not step):
        found = f"{len(index)} of {index.dtype}"
        raise error(where, "at least two stamps with a time zone", found)
    if wrong := np.flatnonzero(~within_years(index)).tolist():
        raise error(f"{where}: row {wrong[0] + 1}", EXPECTED, shown(index, wrong[0]), "correct the stamp")
    gaps = np.diff(index_seconds(index)) if len(index) > 1 else np.array([int(step)])
    uneven = (gaps != (step or gaps[0])) | (gaps <= 0) | (gaps > max(longest, step))
    if uneven.any():
        row, limit = int(np.argmax(uneven)), f" of up to {longest:g} s" if np.isfinite(longest) else ""
        found, advice = f"{index[row + 1]} after {index[row]}", "fill the gap, and sort the stamps"
        raise error(where, f"one step{limit}", found, advice)
    return float(gaps[0])


def require_cover(grid: StepGrid, first: float, last: float, where: str, error: type[ScenarioError]) -> None:
    """Refuse what does not cover a grid.

    Parameters
    ----------
    grid : StepGrid
        Steps.
    first, last : float
        What there is, seconds since 1970 [s].
    where : str
        Of what, for the message.
    error : type
        Raised when that is less than the grid.
    """
    begin, end = (pd.Timestamp(int(edge), unit="s", tz="UTC").tz_convert(grid.start.tz) for edge in (first, last))
    covered = first <= grid.edges[0] and grid.edges[-1] <= last
    error.unless(covered, where, f"{where} from {grid.start} to {grid.stamps[-1]}", f"{begin} to {end}")


@dataclass(frozen=True)
class Calendar:
    """Which days are working days.

    Parameters
    ----------
    holidays : iterable of datetime.date
        Local days that count as Sundays, such as those of `pandas.tseries.holiday.USFederalHolidayCalendar`. Default
        none.

    Examples
    --------
    >>> Calendar([date(2023, 7, 4)]).kind([date(2023, 7, 3), date(2023, 7, 4), date(2023, 7, 8)]).tolist()
    [0, 2, 1]
    """

    holidays: Iterable[date] = field(default_factory=frozenset)

    def __post_init__(self) -> None:
        object.__setattr__(self, "holidays", frozenset(pd.Timestamp(day).date() for day in self.holidays))

    def kind(self, days: Iterable[date]) -> NDArray[np.int64]:
        """Tell the kinds of days: 0 a weekday, 1 a Saturday, 2 a Sunday or holiday.

        Parameters
        ----------
        days : iterable of datetime.date
            Local days.
        """
        holidays = frozenset(self.holidays)
        kinds = (SUNDAY if day in holidays else max(day.weekday() - 4, WEEKDAY) for day in days)
        return np.fromiter(kinds, dtype=np.int64)

    def kinds_on(self, times: pd.DatetimeIndex) -> NDArray[np.int64]:
        """Tell the kind of the day of each time.

        Parameters
        ----------
        times : DatetimeIndex
            Local.
        """
        number, days = pd.factorize(times.tz_localize(None).normalize())
        return np.asarray(self.kind(pd.DatetimeIndex(days).date)[number])


def local_hours(times: pd.DatetimeIndex) -> FloatArray:
    """Hour that the local clock shows, with its fraction [h].

    Parameters
    ----------
    times : DatetimeIndex
        Local.
    """
    return np.asarray(times.hour + times.minute / 60.0 + times.second / 3600.0, dtype=float)


def by_clock(table: FloatArray, calendar: Calendar, grid: StepGrid) -> FloatArray:
    """Look a table of the local clock up at the pieces of a grid, shape (n_steps * per_step,).

    Parameters
    ----------
    table : ndarray, shape (3, 12, 24)
        A value a kind of day, month and local hour [any]; axes may have length 1 where they make no difference.
    calendar : Calendar
        Which days are holidays.
    grid : StepGrid
        Steps in the building's time zone.
    """
    times, whole = grid.middles, np.broadcast_to(table, (3, 12, 24))
    return np.asarray(whole[calendar.kinds_on(times), np.asarray(times.month) - 1, np.asarray(times.hour)])


def means_of_steps(source: FloatArray, values: FloatArray, edges: FloatArray) -> FloatArray:
    """Average over steps what is constant over other intervals, exactly.

    Parameters
    ----------
    source : ndarray, shape (n_interval + 1,)
        Edges of the intervals [s].
    values : ndarray, shape (n_interval,) or (n_interval, m)
        Over each of them [any].
    edges : ndarray, shape (n_steps + 1,)
        Edges of the steps [s], within those of the intervals.

    Returns
    -------
    ndarray, shape (n_steps,) or (n_steps, m)
        Means [as given].
    """
    total = np.concatenate([np.zeros_like(values[:1]), np.cumsum((values.T * np.diff(source)).T, axis=0)])
    k = np.clip(np.searchsorted(source, edges, side="right") - 1, 0, len(values) - 1)
    integral = total[k] + (values[k].T * (edges - source[k])).T
    return np.asarray((np.diff(integral, axis=0).T / np.diff(edges)).T)


def hours_of_week(stamps: pd.DatetimeIndex, step: float) -> IntArray:
    """Hours since Monday, 0 to 167, in which steps begin that end at the stamps, shape (n,).

    Parameters
    ----------
    stamps : DatetimeIndex, shape (n,)
        Local.
    step : float
        Length of the steps [s].
    """
    begins = stamps - pd.Timedelta(seconds=step)
    return np.asarray(begins.day_of_week * 24 + begins.hour)
