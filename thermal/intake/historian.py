"""The historian of live operation as a table on regular steps: months of minutes, read a day at a time."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pandas as pd

from thermal._types import FloatArray
from thermal.case.building import Building
from thermal.case.points import POINT_TYPES
from thermal.case.telemetry import INDEX, LONGEST_STEP
from thermal.errors import CaseError, PlanError
from thermal.intake.historian_steps import StepSums, samples_of_rows, slots_of, slots_of_row
from thermal.intake.resample import LONGEST_COMMAND
from thermal.intake.series import RawSeries
from thermal.intake.source import shown
from thermal.intake.stamps import ClockReport
from thermal.intake.telemetry import (
    SHORTEST_STEP,
    ImportSettings,
    TelemetryImport,
    match_series,
    telemetry_of_series,
)
from thermal.plan.guard import extra
from thermal.plan.match import PointMatch
from thermal.units import QUANTITIES

#: Schema that live operation keeps its samples in.
SCHEMA = "buildingmpc"

_DAY = pd.Timedelta(days=1)

_PACKED = "string_agg(timestamptz_send(time) || float8send(value), ''::bytea ORDER BY time)"

Progress = Callable[[str, int, int], None]


def read_historian(
    address: str,
    start: pd.Timestamp,
    end: pd.Timestamp,
    step: float,
    schema: str = SCHEMA,
    progress: Progress | None = None,
) -> dict[str, RawSeries]:
    """Read means over regular steps of all points of a historian.

    Parameters
    ----------
    address : str
        ``postgresql://USER:PASSWORD@HOST/DATABASE``.
    start, end : Timestamp
        Beginning of the first step, and end of the last; with time zones.
    step : float
        Length of the steps [s].
    schema : str
        Schema with the tables ``point`` (id, name) and ``sample`` (point, time, value).
    progress : callable, optional
        Told stage, days done and all days.

    Returns
    -------
    dict of str to RawSeries
        By name of the point, those with samples; values in the library's units, as live operation keeps them.

    Raises
    ------
    PlanError
        The database cannot be read, has no such tables, or no samples in that time.
    MissingExtraError
        Without the extra ``telemetry``.

    Notes
    -----
    Points with a sample a step and more get the mean of each step's samples; others are brought to steps as
    `import_telemetry` does. Days that `pack_days` has packed are read as they are. Memory: the table of means, and the
    samples of one day.
    """
    count = round((end - start).total_seconds() / step)
    PlanError.unless(count >= 2, "interval", "two steps or more", f"{start} to {end}", "give a later --end")
    length = pd.Timedelta(seconds=step)
    lead = math.ceil(LONGEST_COMMAND / step)  # what was set the day before may still hold
    first = start - lead * length
    ends = pd.date_range(first + length, periods=lead + count, freq=length, name=INDEX)
    with _connected(address, schema) as cursor:
        names = dict(cursor.execute("SELECT id, name FROM point ORDER BY name").fetchall())
        PlanError.unless(names, shown(address), "a historian with points", "none")
        steps = StepSums(list(names), ends, step)
        days = _days(first, end)
        for number, day in enumerate(days):
            if progress is not None:
                progress("reading samples", number, len(days))
            _add_day(cursor, day, steps)
    found = {name: _series(name, steps.means(row, name), ends, lead) for row, name in enumerate(names.values())}
    PlanError.unless(
        any(found.values()), shown(address), f"samples from {start} to {end}", "none", "look at --start and --end"
    )
    return {name: series for name, series in found.items() if series is not None}


def historian_telemetry(
    building: Building,
    address: str,
    period: tuple[pd.Timestamp, pd.Timestamp],
    step: float,
    matches: Sequence[PointMatch] | None = None,
    *,
    schema: str = SCHEMA,
    progress: Progress | None = None,
) -> TelemetryImport:
    """Make telemetry of a building from a historian.

    Parameters
    ----------
    building : Building
        Whose zones and devices the points are of.
    address : str
        ``postgresql://USER:PASSWORD@HOST/DATABASE``.
    period : tuple of Timestamp
        Beginning of the first step and end of the last, local.
    step : float
        Length of the steps [s], 60 to 7200.
    matches : sequence of PointMatch, optional
        What points are, corrected by a person; default: matched by name.
    schema : str
        As for `read_historian`.
    progress : callable, optional
        Told stage, days done and all days.

    Returns
    -------
    TelemetryImport
        Telemetry, and all that was done.

    Raises
    ------
    PlanError
        The historian cannot be read, or no point is matched.
    CaseError
        An entity is none of the building's, or the steps are out of range.
    """
    fits = SHORTEST_STEP <= step <= LONGEST_STEP and not 86400.0 % step
    expected = f"{SHORTEST_STEP:g} to {LONGEST_STEP:g} s that divide a day"
    CaseError.unless(fits, "step", expected, f"{step:g} s", "such as 5min, 15min or 1h")
    series = read_historian(address, *period, step, schema, progress)
    listed = tuple(matches) if matches is not None else match_series(building, series)
    return telemetry_of_series(building, series, ClockReport(), ImportSettings(step=step), listed, shown(address))


def pack_days(address: str, before: pd.Timestamp, schema: str = SCHEMA) -> int:
    """Pack whole days of samples, so that they are read several times as fast; the samples stay.

    Parameters
    ----------
    address : str
        ``postgresql://USER:PASSWORD@HOST/DATABASE``.
    before : Timestamp
        Days that end by then are packed: late samples should have come in. A day whose samples have become more is
        packed anew.
    schema : str
        As for `read_historian`; live operation makes its table ``packed_day``, and deletes from it.

    Returns
    -------
    int
        Days that were packed.

    Raises
    ------
    PlanError
        The database cannot be read or written.
    """
    with _connected(address, schema, read_only=False) as cursor:
        first, last = cursor.execute("SELECT min(time), max(time) FROM sample WHERE time < %s", [before]).fetchone()
        if first is None:
            return 0
        done = 0
        for day in _days(pd.Timestamp(first), min(pd.Timestamp(last), before.tz_convert("UTC").normalize())):
            if day + _DAY > before:
                continue
            bounds = [day.to_pydatetime(), (day + _DAY).to_pydatetime()]
            here = cursor.execute("SELECT count(*) FROM sample WHERE time >= %s AND time < %s", bounds).fetchone()[0]
            kept = cursor.execute("SELECT coalesce(sum(count), 0) FROM packed_day WHERE day = %s", [day.date()])
            if here == kept.fetchone()[0]:
                continue
            for table in ("packed_day", "packed_slots"):
                cursor.execute(f"DELETE FROM {table} WHERE day = %s", [day.date()])
            cursor.execute(
                f"INSERT INTO packed_day SELECT %s, point, count(*), {_PACKED} FROM sample WHERE time >= %s AND time "
                "< %s GROUP BY point", [day.date(), *bounds]
            )  # fmt: skip
            rows = cursor.execute("SELECT point, samples FROM packed_day WHERE day = %s", [day.date()]).fetchall()
            if rows:
                packed = [array.tobytes() for array in slots_of(*samples_of_rows(rows), day)]
                cursor.execute("INSERT INTO packed_slots VALUES (%s, %s, %s, %s)", [day.date(), *packed])
            done += 1
        return done


class _connected:  # noqa: N801 - used as a function
    """A cursor on a database; what it refuses becomes a `PlanError` without the password."""

    def __init__(self, address: str, schema: str, read_only: bool = True) -> None:
        expected = "a name of lower-case letters, digits and _"
        PlanError.unless(re.fullmatch(r"[a-z_][a-z0-9_]{0,62}", schema), "schema", expected, repr(schema))
        self._psycopg: Any = extra("psycopg", of="telemetry", needed_by="a historian")
        self._address, self._schema, self._read_only = address, schema, read_only

    def __enter__(self) -> Any:
        try:
            options = f"-c search_path={self._schema}"
            self._connection = self._psycopg.connect(self._address, options=options, connect_timeout=10)
        except self._psycopg.Error as error:
            raise self._refused(error) from error
        self._connection.read_only = self._read_only
        return self._connection.cursor(binary=True)

    def __exit__(self, kind: Any, error: BaseException | None, trace: Any) -> None:
        if error is None:
            self._connection.commit()
        self._connection.close()
        if isinstance(error, self._psycopg.Error):
            raise self._refused(error) from error

    def _refused(self, error: BaseException) -> PlanError:
        found = " ".join(str(error).split())[:200]
        return PlanError(shown(self._address), "a historian that can be read", found, "check address, user and schema")


def _days(start: pd.Timestamp, end: pd.Timestamp) -> list[pd.Timestamp]:
    """Days in UTC that an interval touches, its ends included."""
    return list(pd.date_range(start.tz_convert("UTC").normalize(), end.tz_convert("UTC"), freq="D"))


def _add_day(cursor: Any, day: pd.Timestamp, steps: StepSums) -> None:
    """Add a day: sums of its slots where these are packed and steps are made of them, else its samples."""
    date = [day.date()]
    is_packed = cursor.execute("SELECT to_regclass('packed_slots') IS NOT NULL").fetchone()[0]
    if is_packed and steps.has_slots(day):
        row = cursor.execute("SELECT points, sums, counts FROM packed_slots WHERE day = %s", date).fetchone()
        if row is not None:
            few = steps.add_slots(day, *slots_of_row(row))
            if len(few):
                asked = "SELECT point, samples FROM packed_day WHERE day = %s AND point = ANY(%s)"
                steps.keep(*samples_of_rows(cursor.execute(asked, [*date, few.tolist()]).fetchall()))
            return
    rows = []
    if is_packed:
        rows = cursor.execute("SELECT point, samples FROM packed_day WHERE day = %s", date).fetchall()
    if not rows:
        bounds = [day.to_pydatetime(), (day + _DAY).to_pydatetime()]
        rows = cursor.execute(
            f"SELECT point, {_PACKED.replace(' ORDER BY time', '')} FROM sample WHERE time >= %s AND time < %s "
            "GROUP BY point", bounds
        ).fetchall()  # fmt: skip
    if rows:
        steps.add(*samples_of_rows(rows))


def _series(name: str, means: FloatArray | None, ends: pd.DatetimeIndex, lead: int) -> RawSeries | None:
    """Give a point from the step after the lead on; None where nothing is known of it."""
    if means is None or not np.isfinite(means[lead:]).any():
        return None
    kind = POINT_TYPES.get(name.rpartition("/")[2])
    unit = QUANTITIES[kind.quantity].unit if kind is not None else ""
    return RawSeries(name, pd.Series(means, index=ends)[lead:], unit)
