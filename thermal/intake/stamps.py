"""Time stamps of other people's tables: any way of writing them, clocks that are put forward and back, in UTC."""

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from zoneinfo import ZoneInfo, available_timezones

import numpy as np
import pandas as pd

from thermal._types import BoolArray
from thermal.case.years import EXPECTED, within_years
from thermal.errors import PlanError

_OFFSET = re.compile(r"(?:[zZ]|[+-]\d{2}:?\d{2})$")


@dataclass
class ClockReport:
    """What became of stamps.

    Parameters
    ----------
    unreadable
        Rows without a stamp that can be read.
    impossible
        Rows of a year that no stamp can lie in (`thermal.case.years`): left out.
    first_impossible
        The first of these, as it was written.
    resolved
        Rows in the hour that a clock shows twice whose order told which of the two it was.
    ambiguous
        Rows in that hour of which nothing told it: left out.
    skipped
        Rows in the hour that a clock leaves out: left out; a logger that writes them does not change its clock.
    first_skipped
        The first of these, as it was written.
    """

    unreadable: int = 0
    impossible: int = 0
    first_impossible: str = ""
    resolved: int = 0
    ambiguous: int = 0
    skipped: int = 0
    first_skipped: str = field(default="")

    def sentences(self, timezone: str) -> Iterator[str]:
        """Say what was done.

        Parameters
        ----------
        timezone
            Time zone of stamps without an offset.
        """
        if self.unreadable:
            yield f"{self.unreadable} rows without a time stamp that can be read were left out"
        if self.impossible:
            yield (
                f"{self.impossible} rows are not {EXPECTED} (first {self.first_impossible}) and were left out: a "
                "logger whose clock was lost, or a mistyped stamp; correct them in the table where their values matter"
            )
        if self.resolved:
            yield f"{self.resolved} values of the hour that {timezone} has twice were told apart by their order"
        if self.ambiguous:
            yield (
                f"{self.ambiguous} values of the hour that {timezone} has twice were left out: it stands there once; a "
                "logger that does not change its clock needs a --tz without daylight-saving time, such as Etc/GMT-1"
            )
        if self.skipped:
            yield (
                f"{self.skipped} values of an hour that {timezone} does not have (first {self.first_skipped}) were "
                "left out: the logger does not seem to change its clock; give a --tz without daylight-saving time"
            )


def checked_zone(name: str, where: str) -> str:
    """Refuse what is no time zone; empty stays empty.

    Parameters
    ----------
    name
        IANA name.
    where
        What gave it, for messages.

    Returns
    -------
    str
        The same.

    Raises
    ------
    PlanError
        There is no time zone of that name.
    """
    if name:
        PlanError.unless_known(name, available_timezones(), where, "an IANA name")
    return name


def parse_stamps(cells: pd.Series, where: str, report: ClockReport) -> pd.Series:
    """Read time stamps.

    Parameters
    ----------
    cells
        Times, text or seconds since 1970 (milliseconds where they are over 1e11).
    where
        Source, for messages.
    report
        What was left out is added to it.

    Returns
    -------
    Series
        Times in UTC where all have an offset, without a zone where none has one; NaT where a cell says nothing, or a
        year that no stamp can lie in (`thermal.case.years`).

    Raises
    ------
    PlanError
        They are written in a way that could be read in two, or some have an offset and others none.
    """
    read = _read(cells, where)
    stamps = read.where(within_years(pd.DatetimeIndex(read)))
    wrong = np.asarray(stamps.isna() & read.notna())
    report.unreadable += int(stamps.isna().sum() - wrong.sum())
    if wrong.any():
        report.impossible += int(wrong.sum())
        report.first_impossible = report.first_impossible or spelled(cells[wrong].iloc[0])
    if stamps.isna().all():
        advice = "write ISO 8601, such as 2023-07-06T07:10:00+02:00"
        found = repr(spelled(cells.iloc[0])) if len(cells) else "nothing"
        raise PlanError(where, f"a column of {EXPECTED}", found, advice)
    return stamps


def spelled(cell: object) -> str:
    """Spell a cell of time stamps; pandas spells none before the year 1 or after 9999.

    Parameters
    ----------
    cell
        A time, text or a number.
    """
    return str(cell.asm8) if isinstance(cell, pd.Timestamp) and not 1 <= cell.year <= 9999 else str(cell)


def _read(cells: pd.Series, where: str) -> pd.Series:
    """Read times of any year."""
    if pd.api.types.is_datetime64_any_dtype(cells):
        return cells.dt.tz_convert("UTC") if cells.dt.tz is not None else cells
    numbers = pd.to_numeric(cells, errors="coerce")
    if numbers.notna().mean() > 0.5:
        scale = 1e-3 if numbers.abs().median() > 1e11 else 1.0
        return pd.to_datetime(numbers * scale, unit="s", utc=True, errors="coerce")
    text = cells.where(cells.notna(), "").astype(str).str.strip()
    given = text[text != ""]
    with_offset = given.str.contains(_OFFSET) & given.str.contains(r"[T ]")
    if with_offset.any() and not with_offset.all():
        odd = given[~with_offset].iloc[0] if with_offset.mean() > 0.5 else given[with_offset].iloc[0]
        raise PlanError(where, "stamps that all have an offset, or none", f"{odd!r} among the others", "correct them")
    if len(given) and given.str.match(r"\d{4}-?\d{2}-?\d{2}").mean() > 0.5:
        everywhere = bool(len(with_offset) and with_offset.all())
        return pd.to_datetime(text, format="ISO8601", errors="coerce", utc=everywhere)
    return pd.to_datetime(text, format=_local_format(given, where), errors="coerce")


def _local_format(given: pd.Series, where: str) -> str:
    """Find out how days and months are written: 31.12.2023 and 31/12/2023, or 12/31/2023."""
    parts = given.str.extract(r"^(\d{1,2})([./-])(\d{1,2})[./-](\d{4})[ T](\d{1,2}:\d{2})(:\d{2})?$").dropna(subset=[0])
    if parts.empty:
        found = repr(given.iloc[0]) if len(given) else "nothing"
        advice = "write ISO 8601, such as 2023-07-06T07:10:00+02:00"
        raise PlanError(where, "a column of time stamps", found, advice)
    sign, clock = parts[1].iloc[0], "%H:%M:%S" if parts[5].notna().all() else "%H:%M"
    first, second = parts[0].astype(int).max(), parts[2].astype(int).max()
    if sign != "." and first <= 12 and second <= 12:
        advice = "export the dates as 2023-12-31"
        raise PlanError(where, "dates that can be read in one way", repr(given.iloc[0]), advice)
    day_first = sign == "." or first > 12
    return f"%d{sign}%m{sign}%Y {clock}" if day_first else f"%m{sign}%d{sign}%Y {clock}"


def to_utc(stamps: pd.Series, timezone: str, report: ClockReport) -> pd.Series:
    """Read local stamps of one series, in the order of its rows, in UTC.

    Parameters
    ----------
    stamps
        Without a zone (or in UTC: then they stay), NaT where missing.
    timezone
        IANA name of the zone whose clock they show.
    report
        What was done is added to it.

    Returns
    -------
    Series
        In UTC; NaT where a stamp says nothing.

    Notes
    -----
    In autumn a clock shows an hour twice. Where stamps step back inside of it, those before are of summer time; where
    most of its stamps stand there twice, the first of each is. Else nothing tells, and they are left out.
    """
    if stamps.dt.tz is not None:
        return stamps
    zone = ZoneInfo(timezone)
    naive = pd.DatetimeIndex(stamps)
    early = naive.tz_localize(zone, ambiguous=np.ones(len(naive), dtype=bool), nonexistent="NaT")
    late = naive.tz_localize(zone, ambiguous=np.zeros(len(naive), dtype=bool), nonexistent="NaT")
    missing = np.asarray(naive.isna())
    skipped = np.asarray(early.isna()) & ~missing
    if skipped.any():
        report.skipped += int(skipped.sum())
        report.first_skipped = report.first_skipped or str(naive[skipped][0])
    utc, others = (of.tz_convert("UTC").tz_localize(None).to_numpy(copy=True) for of in (early, late))
    twice = np.asarray(early != late) & ~missing & ~skipped
    for date in np.unique(naive[twice].date) if twice.any() else ():
        rows = np.flatnonzero(twice & (naive.date == date))
        summer = _first_pass(naive[rows])
        if summer is None:
            report.ambiguous += len(rows)
            utc[rows] = np.datetime64("NaT")
        else:
            report.resolved += len(rows)
            utc[rows[~summer]] = others[rows[~summer]]
    return pd.Series(pd.DatetimeIndex(utc).tz_localize("UTC"), index=stamps.index)


def _first_pass(stamps: pd.DatetimeIndex) -> BoolArray | None:
    """Whether each stamp of the hour that a clock shows twice is of its first showing; None where nothing tells."""
    steps = np.diff(stamps.asi8)
    back = np.flatnonzero(steps < 0)
    if len(back) == 1 and len(stamps) > 2:
        return np.asarray(np.arange(len(stamps)) <= back[0])
    again = np.asarray(stamps.duplicated(keep="first"))
    return ~again if again.sum() * 2 >= len(stamps) - 1 and again.any() else None
