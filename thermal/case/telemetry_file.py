"""Reading a telemetry file: Parquet or CSV in any units, to a frame in the library's own."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterable, Mapping, Sequence
from decimal import Decimal
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from thermal.case.points import POINT_TYPES, point_type, split_column
from thermal.case.schema import Location
from thermal.case.telemetry import INDEX, Telemetry
from thermal.errors import CaseError, describe
from thermal.units import check_unit, to_si

SUFFIXES = (".parquet", ".csv")
MISSING = frozenset({"", "nan", "na", "n/a", "null", "none", "<na>"})  # in a CSV, in any case of letters
_OFFSET = re.compile(r"(?:[zZ]|[+-]\d{2}:?\d{2}(?::\d{2})?|[+-]\d{2})$")


def read_telemetry(
    path: Path, units: Mapping[str, str], location: Location, names: Mapping[str, str] | None = None
) -> Telemetry:
    """Read a telemetry file.

    Parameters
    ----------
    path
        ``.parquet`` or ``.csv``.
    units
        Unit of each point type in the file.
    location
        Site: its time zone is the telemetry's, its elevation gives the density for volume flows.
    names
        Columns to read, and what they are in the case format; by default all, as they are.

    Returns
    -------
    Telemetry
        In the library's units, in the building's time zone.

    Raises
    ------
    CaseError
        One of its family, for the first thing in the file that does not fit.
    """
    if path.suffix.lower() not in SUFFIXES:
        raise CaseError(describe("building.yaml: telemetry", "a .parquet or a .csv file", repr(path.name)))
    raw = _read_csv(path) if path.suffix.lower() == ".csv" else _read_parquet(path)
    if names is not None:
        raw = raw.loc[:, [str(column) in names for column in raw.columns]]
        raw = raw.set_axis([names[str(column)] for column in raw.columns], axis=1)
    if isinstance(raw.index, pd.DatetimeIndex) and raw.index.tz is not None:
        raw = raw.tz_convert(location.timezone)
    columns = [str(column) for column in raw.columns]
    converted: dict[str, NDArray[np.float64]] = {}
    for position, column in enumerate(columns):
        _, point = split_column(column, path.name)
        if point not in units:
            expected = f"a unit for {point}, which {path.name} has"
            advice = f"add '{point}: <unit>'"
            raise CaseError(describe("building.yaml: units", expected, "no such key", advice))
        if column in converted:
            raise CaseError(describe(f"{path.name}: columns", "names of their own", f"{column!r} twice"))
        numbers = _numbers(raw.iloc[:, position], f"{path.name}: column {column!r}")
        quantity = POINT_TYPES[point].quantity
        converted[column] = to_si(numbers, units[point], quantity, elevation=location.elevation)
    return Telemetry.from_frame(pd.DataFrame(converted, index=raw.index), where=path.name)


def check_units(units: Mapping[str, str]) -> None:
    """Refuse units that pint does not know, or that do not measure their point.

    Parameters
    ----------
    units
        Unit by point type.

    Raises
    ------
    CaseError
        A key is no point type.
    CaseError
        Pint does not know a unit, or it is one of something else (`CaseError`).
    """
    for point, unit in units.items():
        where = f"building.yaml: units.{point}"
        check_unit(unit, point_type(point, where).quantity, where)


def _read_parquet(path: Path) -> pd.DataFrame:
    try:
        frame = pd.read_parquet(path)
    except Exception as error:  # pyarrow raises a family of its own, and plain ValueError and OSError
        raise CaseError(describe(path.name, "a Parquet file", " ".join(str(error).split()))) from error
    return frame.set_index(INDEX) if INDEX in frame.columns else frame


def _read_csv(path: Path) -> pd.DataFrame:
    """Read a CSV as text; numbers are made of it later, where a message can name what stood there."""
    try:
        with path.open(encoding="utf-8-sig", newline="") as stream:
            rows = [row for row in csv.reader(stream, strict=True) if row]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise CaseError(describe(path.name, "a CSV in UTF-8", " ".join(str(error).split()))) from error
    if not rows:
        raise CaseError(describe(path.name, "a CSV with one header row", "an empty file"))
    header = [name.strip() for name in rows.pop(0)]
    if header.count(INDEX) != 1:
        if INDEX in header:
            raise CaseError(describe(f"{path.name}: columns", "names of their own", f"{INDEX!r} twice"))
        raise CaseError(describe(f"{path.name}: header", f"a column {INDEX!r}", ", ".join(header[:3])))
    for number, row in enumerate(rows, start=1):
        if len(row) != len(header):
            expected = f"{len(header)} cells as in the header"
            raise CaseError(describe(f"{path.name}: data row {number}", expected, f"{len(row)} cells"))
    columns = dict(enumerate(zip(*rows, strict=True))) if rows else dict.fromkeys(range(len(header)), ())
    stamps = _parse_stamps(columns.pop(header.index(INDEX)), path.name)
    names = [header[position] for position in columns]
    values = [
        _parse_numbers(texts, stamps, f"{path.name}: column {name!r}")
        for name, texts in zip(names, columns.values(), strict=True)
    ]
    frame = pd.DataFrame(dict(enumerate(values)), index=stamps, columns=range(len(names)))
    return frame.set_axis(names, axis=1)


def _parse_numbers(texts: Sequence[str], stamps: pd.DatetimeIndex, where: str) -> NDArray[np.float64]:
    values = np.full(len(texts), np.nan)
    for position, text in enumerate(texts):
        try:
            if text.strip().casefold() not in MISSING:
                values[position] = float(text)
        except ValueError as error:
            raise _not_numeric(where, stamps[position], text) from error
    return values


def _parse_stamps(texts: Iterable[str], file: str) -> pd.DatetimeIndex:
    listed = [text.strip() for text in texts]
    for row, text in enumerate(listed, start=1):
        if not re.match(r"\d{4}-?\d{2}-?\d{2}", text):
            raise CaseError(describe(f"{file}: data row {row}", "an ISO 8601 time stamp with offset", repr(text)))
        if ("T" not in text and " " not in text) or not _OFFSET.search(text):
            advice = "write 2023-07-06T07:10:00+02:00"
            raise CaseError(
                describe(f"{file}: data row {row}", "a time stamp with offset", repr(text), advice)
            )
    try:
        stamps = pd.to_datetime(listed, utc=True, format="ISO8601")
    except (ValueError, OverflowError) as error:
        found = " ".join(str(error).split())
        raise CaseError(describe(f"{file}: {INDEX}", "ISO 8601 time stamps with offset", found)) from error
    return pd.DatetimeIndex(stamps, name=INDEX)


def _numbers(column: pd.Series, where: str) -> NDArray[np.float64]:
    if pd.api.types.is_numeric_dtype(column.dtype) and not (
        pd.api.types.is_bool_dtype(column.dtype) or pd.api.types.is_complex_dtype(column.dtype)
    ):
        return column.to_numpy(dtype=float, na_value=np.nan)
    values = np.full(len(column), np.nan)
    for position, (stamp, value) in enumerate(column.items()):
        if isinstance(value, int | float | Decimal) and not isinstance(value, bool):
            values[position] = float(value)
        elif value is not None and value is not pd.NA and value is not pd.NaT:
            raise _not_numeric(where, stamp, value)
    return values


def _not_numeric(where: str, stamp: object, value: object) -> CaseError:
    advice = "leave a missing value blank or NaN"
    return CaseError(describe(f"{where}, stamp {stamp}", "a number", repr(value), advice))
