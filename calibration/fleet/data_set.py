"""Results of many cases as a data set of Parquet tables, in parts of so many cases each, that DuckDB reads.

It is made of the records of the cases and of nothing else, in the order of their names: after any number of deaths and
repetitions it is the same, bit by bit, but for the table ``runs``, which says how long things took.
"""

from __future__ import annotations

import io
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict
from itertools import islice
from pathlib import Path
from typing import Any, Protocol

import pyarrow as pa
import pyarrow.parquet as pq

from calibration.fleet.outcome import RECORD, CaseOutcome, key_of, parse_record
from calibration.results import plain

#: Folder of the data set in the folder of results.
TABLES = "tables"

#: Cases of a part [-]: with 25 parameters a megabyte of Parquet, and a hundred thousand cases are two hundred parts.
PART = 500

_TEXT, _NUMBER, _TRUE, _COUNT = pa.string(), pa.float64(), pa.bool_(), pa.int64()
_TEXTS, _NUMBERS = pa.list_(_TEXT), pa.list_(_NUMBER)

#: Columns of the tables that are known; a table of another job has those of its first row.
SCHEMAS = {
    "cases": pa.schema({
        "case": _TEXT, "status": _TEXT, "held_out_mae_before": _NUMBER, "held_out_mae_after": _NUMBER, "verdict": _TEXT,
        "effects": _TEXTS, "error": _TEXT, "message": _TEXT, "has_windows": _TRUE, "key": _TEXT,
    }),
    "runs": pa.schema({
        "case": _TEXT, "run": _TEXT, "seconds": _NUMBER, "attempts": _COUNT, "memory": _NUMBER, "version": _TEXT,
    }),
    "parameters": pa.schema({
        "case": _TEXT, "name": _TEXT, "base": _TEXT, "unit": _TEXT, "value": _NUMBER, "lower": _NUMBER,
        "upper": _NUMBER, "start": _NUMBER, "standard_error": _NUMBER, "at_bound": _TRUE, "identifiable": _TRUE,
        "prior_deviation": _NUMBER, "point": _NUMBER, "own_deviation": _NUMBER, "pull": _NUMBER,
        "covariance": _NUMBERS, "information": _NUMBERS,
    }),
    "effects": pa.schema({
        "case": _TEXT, "effect": _TEXT, "probability": _NUMBER, "score": _NUMBER, "retained_share": _NUMBER,
        "testable": _TRUE, "found": _TRUE, "zones": _TEXTS, "group": _TEXTS,
    }),
}  # fmt: skip


class Folder(Protocol):
    """Where results lie: `calibration.fleet.store.Store`, or `LocalFolder`."""

    def read(self, name: str) -> bytes:
        """Read a file; FileNotFoundError where it is not there."""

    def write(self, name: str, content: bytes) -> None:
        """Write a file, whole or not at all."""

    def remove(self, name: str) -> None:
        """Remove a file, if it is there."""

    def files(self, under: str = "") -> list[str]:
        """Names of the files below a folder of it."""


class LocalFolder:
    """A folder of this machine.

    Parameters
    ----------
    path : Path
        The folder.
    """

    def __init__(self, path: Path) -> None:
        self._path = path

    def read(self, name: str) -> bytes:
        """Read a file.

        Parameters
        ----------
        name : str
            Relative.
        """
        return (self._path / name).read_bytes()

    def write(self, name: str, content: bytes) -> None:
        """Write a file, whole or not at all.

        Parameters
        ----------
        name : str
            Relative; folders are made.
        content : bytes
            What it is to hold.
        """
        path = self._path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        new = path.with_name(f".{path.name}.new")
        new.write_bytes(content)
        new.replace(path)

    def remove(self, name: str) -> None:
        """Remove a file, if it is there.

        Parameters
        ----------
        name : str
            Relative.
        """
        (self._path / name).unlink(missing_ok=True)

    def files(self, under: str = "") -> list[str]:
        """Names of the files below a folder of it, relative to it.

        Parameters
        ----------
        under : str
            Relative.
        """
        return sorted(p.relative_to(self._path).as_posix() for p in (self._path / under).rglob("*") if p.is_file())


def write_data_set(folder: Folder, outcomes: Iterable[CaseOutcome]) -> None:
    """Write the tables of a run, part by part; parts of an earlier run that are no more are removed.

    Parameters
    ----------
    folder : Folder
        Of the results: a folder a case with its record.
    outcomes : iterable of CaseOutcome
        Of all cases, in the order of their names; of those with results the record is read.
    """
    before, made = set(folder.files(TABLES)), set()
    coming, number = iter(outcomes), 0
    while part := list(islice(coming, PART)):
        tables: dict[str, list[dict[str, Any]]] = {"cases": [], "runs": []}
        for outcome in part:
            _add(tables, outcome, folder)
        for name, rows in tables.items():
            if rows:
                path = f"{TABLES}/{name}/part-{number:05d}.parquet"
                folder.write(path, _parquet(rows, SCHEMAS.get(name)))
                made.add(path)
        number += 1
    for path in sorted(before - made):
        folder.remove(path)


def read_table(folder: Folder, table: str) -> Iterator[pa.Table]:
    """Read a table part by part.

    Parameters
    ----------
    folder : Folder
        Of the results.
    table : str
        Name of the table.
    """
    for path in folder.files(f"{TABLES}/{table}"):
        yield pq.read_table(io.BytesIO(folder.read(path)))


def _add(tables: dict[str, list[dict[str, Any]]], outcome: CaseOutcome, folder: Folder) -> None:
    """Add the rows of a case."""
    try:
        record = parse_record(folder.read(f"{outcome.case}/{RECORD}")) or {}
    except FileNotFoundError:
        record = {}
    told: dict[str, Any] = record.get("outcome") or asdict(outcome)
    name = {"case": outcome.case}
    tables["cases"].append(told | name | {"key": key_of(record) if record else None})
    tables["runs"].append(
        {k: told[k] for k in ("seconds", "attempts", "memory")}
        | name
        | {"run": record.get("run"), "version": record.get("version")}
    )
    for table, rows in record.get("tables", {}).items():
        tables.setdefault(table, []).extend({**name, **row} for row in rows)


def _parquet(rows: Sequence[Mapping[str, Any]], schema: pa.Schema | None) -> bytes:
    written = io.BytesIO()
    pq.write_table(pa.Table.from_pylist([plain(row) for row in rows], schema), written)
    return written.getvalue()
