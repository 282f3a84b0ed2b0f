"""Telemetry under any names becomes that of a case."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from os import PathLike
from pathlib import Path

from thermal.case.case import Case
from thermal.case.load import load_case
from thermal.case.points import point_type
from thermal.case.telemetry_file import check_units, read_telemetry
from thermal.errors import PlanError, describe
from thermal.plan.columns import read_columns
from thermal.plan.guard import checked_file
from thermal.plan.match import PointMatch
from thermal.units import QUANTITIES


def with_telemetry(
    path: str | PathLike[str],
    file: str | PathLike[str],
    matches: Sequence[PointMatch],
    units: Mapping[str, str] | None = None,
) -> Case:
    """Load a case and give it other telemetry.

    Parameters
    ----------
    path : str or path
        Case folder.
    file : str or path
        CSV or Parquet: a column ``timestamp`` of ISO 8601 with offset, and a column a point under any name.
    matches : sequence of PointMatch
        What its columns are; those without an entity or a point, or with a remark, are left out.
    units : mapping of str to str, optional
        Unit in the file by point type; those of the case format's table for the rest.

    Returns
    -------
    Case
        Not saved yet, which is when its columns are held against its devices.

    Raises
    ------
    PlanError
        No column is matched, or the file lacks one that is.
    CaseError
        One of its family: the case does not load, or values cannot be read.
    """
    case = load_case(path)
    source = checked_file(Path(file), (".csv", ".parquet"))
    names = {match.column: f"{match.entity}/{match.point}" for match in matches if match.point and not match.remark}
    if not names:
        raise PlanError(describe(source.name, "a column that is matched to a point", "none", "see points.csv"))
    lacking = sorted(names.keys() - {*read_columns(source)})
    if lacking:
        found = f"no {lacking[0]!r}" + (f" and {len(lacking) - 1} more" if len(lacking) > 1 else "")
        raise PlanError(describe(source.name, "the columns of the list of points", found))
    given = dict(units or {})
    check_units(given)
    points = {m.point: point_type(m.point, f"points: {m.column!r}") for m in matches if m.column in names}
    usual = {point: QUANTITIES[kind.quantity].file_unit for point, kind in points.items()}
    telemetry = read_telemetry(source, usual | given, case.building.location, names)
    return replace(case, telemetry=telemetry, judged=None)
