"""Columns of a telemetry file, and what they were matched to, as a file that a person can correct."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from os import PathLike
from pathlib import Path

from thermal.case.telemetry import INDEX
from thermal.errors import PlanError, describe
from thermal.plan.guard import checked_file
from thermal.plan.match import PointMatch

_HEADER = ("column", "entity", "point", "confidence", "remark")


def read_columns(path: str | PathLike[str]) -> tuple[str, ...]:
    """Read the names of the columns of a telemetry file, without its values.

    Parameters
    ----------
    path : str or path
        CSV or Parquet.

    Returns
    -------
    tuple of str
        All but the first of a CSV, and all but ``timestamp``.

    Raises
    ------
    PlanError
        The file is missing or neither.
    """
    file = checked_file(Path(path), (".csv", ".parquet"))
    try:
        if file.suffix.lower() == ".csv":
            with file.open(encoding="utf-8-sig", newline="") as stream:
                names = next(csv.reader(stream, strict=True), [])[1:]
        else:
            from pyarrow import parquet

            names = [str(name) for name in parquet.read_schema(file).names]
    except (OSError, UnicodeDecodeError, ValueError, csv.Error) as error:
        found = " ".join(str(error).split())[:200]
        raise PlanError(describe(file.name, "telemetry with one column a point", found)) from error
    return tuple(name for name in names if name not in (INDEX, "__index_level_0__"))


def write_matches(matches: Sequence[PointMatch], path: str | PathLike[str]) -> Path:
    """Write what columns were matched to as CSV.

    Parameters
    ----------
    matches : sequence of PointMatch
        From `match_points`.
    path : str or path
        File to write.

    Returns
    -------
    Path
        The file: column, entity, point, confidence, remark.
    """
    file = Path(path)
    with file.open("w", encoding="utf-8", newline="") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(_HEADER)
        writer.writerows([m.column, m.entity, m.point, f"{m.confidence:.3f}", m.remark] for m in matches)
    return file


def read_matches(path: str | PathLike[str]) -> tuple[PointMatch, ...]:
    """Read what columns were matched to, as a person has corrected it.

    Parameters
    ----------
    path : str or path
        CSV of `write_matches`: columns ``column``, ``entity`` and ``point``; others are not needed.

    Returns
    -------
    tuple of PointMatch
        One a row. A row with a remark, or without an entity or a point, is a column that is left out.

    Raises
    ------
    PlanError
        The file is missing or no CSV.
    PlanError
        A column of it is missing, or a row names a column without a name.
    """
    file = checked_file(Path(path), (".csv",))
    try:
        with file.open(encoding="utf-8-sig", newline="") as stream:
            reader = csv.DictReader(stream, strict=True)
            rows, header = list(reader), tuple(reader.fieldnames or ())
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        found = " ".join(str(error).split())[:200]
        raise PlanError(describe(file.name, "a CSV in UTF-8", found)) from error
    if not {*_HEADER[:3]} <= {*header}:
        raise PlanError(describe(file.name, f"columns {', '.join(_HEADER[:3])}", ", ".join(header) or "none"))
    matches = []
    for number, row in enumerate(rows, start=2):
        column, entity, point = ((row[name] or "").strip() for name in _HEADER[:3])
        if not column:
            raise PlanError(describe(f"{file.name}: line {number}", "the name of a column", "none"))
        remark = (row.get("remark") or "").strip() or ("" if entity and point else "left out")
        matches.append(PointMatch(column, entity, point, 1.0, remark))
    return tuple(matches)
