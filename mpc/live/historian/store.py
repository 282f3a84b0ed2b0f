"""Schema of the historian, and what is written to and read from it."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from importlib import resources
from types import TracebackType
from typing import TYPE_CHECKING, Any, LiteralString

import numpy as np
import pandas as pd

from mpc.errors import HistorianError
from mpc.live.historian.samples import Samples
from thermal.plan.guard import extra

if TYPE_CHECKING:
    import psycopg

#: Interval that a chunk of a hypertable holds: its samples of some 1,000 points at a minute stay within memory.
_CHUNK = "7 days"

#: Key of the lock that lets one process migrate at a time: any number that nobody else takes.
_LOCK = 2_808_2026

_STAGE = "CREATE TEMP TABLE IF NOT EXISTS stage (name text, micros bigint, value double precision)"


class Historian:
    """Samples of points in a PostgreSQL database.

    Parameters
    ----------
    address : str
        Of the database, ``postgresql://user@host/name``, or any string that libpq takes.
    schema : str
        Name of the schema that the tables are in.
    patience : float
        Longest wait for a connection or for a statement [s].

    Raises
    ------
    HistorianError
        When the schema's name is none, or, from any method, when the database cannot do what is asked for.

    Examples
    --------
    >>> with Historian("postgresql:///building") as historian:  # doctest: +SKIP
    ...     historian.migrate()
    ...     historian.latest()
    """

    def __init__(self, address: str, schema: str = "buildingmpc", patience: float = 10.0) -> None:
        expected = "a name of lower-case letters, digits and _"
        HistorianError.unless(re.fullmatch(r"[a-z_][a-z0-9_]{0,62}", schema), "schema", expected, repr(schema))
        self._psycopg: Any = extra("psycopg", "live", "the historian")
        self.address, self.schema, self.patience = address, schema, patience
        self._connection: psycopg.Connection[Any] | None = None

    def __enter__(self) -> Historian:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Leave the database; the next call connects again."""
        connection, self._connection = self._connection, None
        if connection is not None:
            connection.close()

    def migrate(self) -> int:
        """Make the schema, or bring it to the newest version; return that.

        Several processes may call it at the same time.
        """

        def work(cursor: psycopg.Cursor[Any]) -> int:
            cursor.execute("SELECT pg_advisory_xact_lock(%s)", [_LOCK])
            cursor.execute(self._text(f"CREATE SCHEMA IF NOT EXISTS {self.schema}"))
            cursor.execute("CREATE TABLE IF NOT EXISTS migration (version integer PRIMARY KEY, made timestamptz)")
            done = {row[0] for row in cursor.execute("SELECT version FROM migration").fetchall()}
            steps = migrations()
            newest = max(done | set(steps))
            expected = f"a schema of version {max(steps)} at most"
            HistorianError.unless(newest == max(steps), "historian", expected, f"{newest}", "update buildingmpc")
            for version in sorted(set(steps) - done):
                cursor.execute(self._text(steps[version]))
                cursor.execute("INSERT INTO migration VALUES (%s, now())", [version])
            return newest

        found: int = self._run("migrate", work)
        self._run("hypertable", self._chunked)
        return found

    def _chunked(self, cursor: psycopg.Cursor[Any]) -> None:
        """Make the samples a hypertable where the database has TimescaleDB."""
        if not cursor.execute("SELECT 1 FROM pg_extension WHERE extname = 'timescaledb'").fetchone():
            return
        made = f"create_hypertable('{self.schema}.sample', 'time', chunk_time_interval => interval '{_CHUNK}', "
        cursor.execute(self._text(f"SELECT {made} if_not_exists => true, migrate_data => true)"))

    def write(self, samples: Samples, units: Mapping[str, str] | None = None) -> int:
        """Write samples; they are on disk when it returns. One that is there already stays as it is.

        Parameters
        ----------
        samples : Samples
            Of points that may be new.
        units : mapping of str to str, optional
            Of new points, by name.

        Returns
        -------
        int
            Number of samples that were new.
        """
        names = sorted(set(samples.names))
        given = units or {}

        def work(cursor: psycopg.Cursor[Any]) -> int:
            cursor.execute(
                "INSERT INTO point (name, unit) SELECT * FROM unnest(%s::text[], %s::text[]) AS new (name, unit) "
                "WHERE NOT EXISTS (SELECT 1 FROM point WHERE point.name = new.name) ON CONFLICT DO NOTHING",
                [names, [given.get(name) for name in names]],
            )
            cursor.execute(f"{_STAGE} ON COMMIT DROP")
            with cursor.copy("COPY stage FROM STDIN") as copy:
                micros = np.round(1e6 * samples.seconds).astype(np.int64).tolist()
                for row in zip(samples.names, micros, samples.values.tolist(), strict=True):
                    copy.write_row(row)
            cursor.execute(
                "INSERT INTO sample SELECT point.id, timestamptz 'epoch' + micros * interval '1 microsecond', value "
                "FROM stage JOIN point USING (name) "
                "ON CONFLICT DO NOTHING"
            )
            return int(cursor.rowcount)

        return int(self._run("write", work)) if len(samples) else 0

    def read(self, columns: Sequence[str], start: pd.Timestamp, end: pd.Timestamp) -> pd.DataFrame:
        """Read samples as a table by time.

        Parameters
        ----------
        columns : sequence of str
            Names of points.
        start, end : Timestamp
            First time, and the first that is left out; with time zones.

        Returns
        -------
        DataFrame, shape (n_time, n_column)
            Every time that a sample was taken at, in UTC; NaN where a point has none.

        Raises
        ------
        HistorianError
            When a point is not known.
        """
        self._need(columns)

        def work(cursor: psycopg.Cursor[Any]) -> list[tuple[Any, ...]]:
            cursor.execute(
                "SELECT name, array_agg(extract(epoch FROM time)::float8 ORDER BY time), "
                "array_agg(value ORDER BY time) FROM sample JOIN point ON point.id = point "
                "WHERE name = ANY(%s) AND time >= %s AND time < %s GROUP BY name",
                [list(columns), start.floor("us").to_pydatetime(), end.floor("us").to_pydatetime()],
            )
            return cursor.fetchall()

        rows = {name: (times, values) for name, times, values in self._run("read", work)}
        series = {
            name: pd.Series(np.asarray(values, dtype=float), index=_stamps(times))
            for name, (times, values) in rows.items()
        }
        table = pd.DataFrame(series) if series else pd.DataFrame(index=_stamps([]))
        return table.reindex(columns=list(columns)).astype(float).rename_axis("time")

    def latest(
        self, columns: Sequence[str] | None = None, before: float | None = None
    ) -> dict[str, tuple[float, float]]:
        """Find the last sample of each point.

        Parameters
        ----------
        columns : sequence of str, optional
            Names of points; default all that there are. One without samples is left out.
        before : float, optional
            Latest time that counts, since 1970 in UTC [s].

        Returns
        -------
        dict of str to tuple of float
            Time since 1970 in UTC [s] and value.
        """

        def work(cursor: psycopg.Cursor[Any]) -> list[tuple[Any, ...]]:
            cursor.execute(
                "SELECT name, extract(epoch FROM time)::float8, value FROM point, LATERAL (SELECT time, value FROM "
                "sample WHERE point = point.id AND (%s::float8 IS NULL OR time <= to_timestamp(%s::float8)) "
                "ORDER BY time DESC LIMIT 1) AS last WHERE %s::text[] IS NULL OR name = ANY(%s::text[])",
                [before, before, *[None if columns is None else list(columns)] * 2],
            )
            return cursor.fetchall()

        return {str(name): (float(time), float(value)) for name, time, value in self._run("read", work)}

    def points(self) -> pd.DataFrame:
        """List the points: name, unit, number of samples and times of the first and the last, by name."""

        def work(cursor: psycopg.Cursor[Any]) -> list[tuple[Any, ...]]:
            cursor.execute(
                "SELECT name, unit, count(time), min(time), max(time) FROM point LEFT JOIN sample ON point.id = point "
                "GROUP BY name, unit ORDER BY name"
            )
            return cursor.fetchall()

        return pd.DataFrame(self._run("read", work), columns=["name", "unit", "samples", "first", "last"])

    def trim(self, before: pd.Timestamp) -> int:
        """Delete the samples before a time, packed ones too; return how many of those that are not packed.

        Parameters
        ----------
        before : Timestamp
            First time that is kept, with a time zone.
        """

        def work(cursor: psycopg.Cursor[Any]) -> int:
            first = before.floor("us").tz_convert("UTC")
            cursor.execute("DELETE FROM packed_day WHERE day <= %s", [first.date()])  # of its own day samples are left
            cursor.execute("DELETE FROM packed_slots WHERE day <= %s", [first.date()])
            cursor.execute("DELETE FROM sample WHERE time < %s", [first.to_pydatetime()])
            return int(cursor.rowcount)

        return int(self._run("trim", work))

    def _need(self, columns: Sequence[str]) -> None:
        rows = self._run("read", lambda cursor: cursor.execute("SELECT name FROM point").fetchall())
        for column in columns:
            HistorianError.unless_known(column, [row[0] for row in rows], "historian", "a point that has samples")

    def _run(self, what: str, work: Any) -> Any:
        """Do work in one transaction; what the database refuses becomes our error."""
        try:
            connection = self._connected()
            with connection.transaction(), connection.cursor() as cursor:
                return work(cursor)
        except self._psycopg.Error as error:
            self.close()
            told = " ".join(str(error).split()) or type(error).__name__
            raise HistorianError(f"historian: {what}", "a database that answers", told) from error

    def _connected(self) -> psycopg.Connection[Any]:
        if self._connection is None or self._connection.closed:
            self._connection = self._psycopg.connect(
                self.address, connect_timeout=max(round(self.patience), 1), autocommit=True,
                options=f"-c search_path={self.schema} -c statement_timeout={round(1000 * self.patience)}",
            )  # fmt: skip
        return self._connection

    def _text(self, text: str) -> LiteralString:
        """Hand on SQL that stands in the package, with a schema's name that was checked."""
        return text


def migrations() -> dict[int, str]:
    """Give the SQL of each version of the schema, in order."""
    text = resources.files("mpc.live.historian").joinpath("migrations.sql").read_text(encoding="utf-8")
    parts = re.split(r"^-- version (\d+)$", text, flags=re.MULTILINE)[1:]
    return {int(version): sql for version, sql in zip(parts[::2], parts[1::2], strict=True)}


def _stamps(seconds: Sequence[float]) -> pd.DatetimeIndex:
    micros = np.round(1e6 * np.asarray(seconds, dtype=float)).astype(np.int64)
    return pd.DatetimeIndex(pd.to_datetime(micros, unit="us", utc=True))
