"""Reading a telemetry file: Parquet or CSV in any units, to a frame in the library's own."""

from __future__ import annotations

import csv
import re
import warnings
from collections.abc import Mapping
from decimal import Decimal
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from thermal.case.points import POINT_TYPES, point_type, split_column
from thermal.case.schema import Location
from thermal.case.telemetry import INDEX, Telemetry
from thermal.errors import (
    DuplicateColumnError,
    MissingTimeZoneError,
    MissingUnitError,
    NonNumericColumnError,
    TimestampError,
    UnknownFileTypeError,
    UnreadableFileError,
    describe,
)
from thermal.units import check_unit, to_si

SUFFIXES = (".parquet", ".csv")
_OFFSET = re.compile(r"(?:[zZ]|[+-]\d{2}:?\d{2}(?::\d{2})?|[+-]\d{2})$")


def read_telemetry(path: Path, units: Mapping[str, str], location: Location) -> Telemetry:
    """Read a telemetry file.

    Parameters
    ----------
    path
        ``.parquet`` or ``.csv``.
    units
        Unit of each point type in the file.
    location
        Site: its time zone is the telemetry's, its elevation gives the density for volume flows.

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
        raise UnknownFileTypeError(describe("building.yaml: telemetry", "a .parquet or a .csv file", repr(path.name)))
    raw = _read_csv(path) if path.suffix.lower() == ".csv" else _read_parquet(path)
    columns = [str(column) for column in raw.columns]
    converted: dict[str, NDArray[np.float64]] = {}
    for position, column in enumerate(columns):
        _, point = split_column(column, path.name)
        if point not in units:
            expected = f"a unit for {point}, which {path.name} has"
            advice = f"add '{point}: <unit>'"
            raise MissingUnitError(describe("building.yaml: units", expected, "no such key", advice))
        if column in converted:
            raise DuplicateColumnError(describe(f"{path.name}: columns", "names of their own", f"{column!r} twice"))
        numbers = _numbers(raw.iloc[:, position], f"{path.name}: column {column!r}")
        quantity = POINT_TYPES[point].quantity
        converted[column] = to_si(numbers, units[point], quantity, elevation=location.elevation)
    telemetry = Telemetry.from_frame(pd.DataFrame(converted, index=raw.index), where=path.name)
    local = telemetry.frame.tz_convert(location.timezone)
    missing = tuple(stamp.tz_convert(location.timezone) for stamp in telemetry.missing_rows)
    return Telemetry(frame=local, step=telemetry.step, missing_rows=missing)


def check_units(units: Mapping[str, str]) -> None:
    """Refuse units that pint does not know, or that do not measure their point.

    Parameters
    ----------
    units
        Unit by point type.

    Raises
    ------
    UnknownPointError
        A key is no point type.
    UnknownUnitError
        Pint does not know a unit, or it is one of something else (`IncompatibleUnitError`).
    """
    for point, unit in units.items():
        where = f"building.yaml: units.{point}"
        check_unit(unit, point_type(point, where).quantity, where)


def _read_parquet(path: Path) -> pd.DataFrame:
    try:
        frame = pd.read_parquet(path)
    except Exception as error:  # pyarrow raises a family of its own, and plain ValueError and OSError
        raise UnreadableFileError(describe(path.name, "a Parquet file", " ".join(str(error).split()))) from error
    return frame.set_index(INDEX) if INDEX in frame.columns else frame


def _read_csv(path: Path) -> pd.DataFrame:
    try:
        with path.open(encoding="utf-8-sig", newline="") as stream:
            header = next(csv.reader(stream), [])
        with warnings.catch_warnings():
            warnings.simplefilter("error", pd.errors.ParserWarning)  # rows longer than the header
            frame = pd.read_csv(
                path, index_col=False, encoding="utf-8-sig", float_precision="round_trip", low_memory=False
            )
    except (OSError, UnicodeDecodeError, csv.Error, ValueError, pd.errors.ParserWarning) as error:
        found = " ".join(str(error).split())
        raise UnreadableFileError(describe(path.name, "a CSV with one header row, in UTF-8", found)) from error
    frame.columns = pd.Index(header)
    if INDEX not in header:
        raise TimestampError(describe(f"{path.name}: header", f"a column {INDEX!r}", ", ".join(header[:3])))
    if header.count(INDEX) > 1:
        raise DuplicateColumnError(describe(f"{path.name}: columns", "names of their own", f"{INDEX!r} twice"))
    stamps = _parse_stamps(frame[INDEX], path.name)
    return frame.drop(columns=INDEX).set_axis(stamps, axis=0)


def _parse_stamps(texts: pd.Series, file: str) -> pd.DatetimeIndex:
    listed = [str(text).strip() for text in texts]
    for row, text in enumerate(listed, start=1):
        if not re.match(r"\d{4}-?\d{2}-?\d{2}", text):
            raise TimestampError(describe(f"{file}: data row {row}", "an ISO 8601 time stamp with offset", repr(text)))
        if ("T" not in text and " " not in text) or not _OFFSET.search(text):
            advice = "write 2023-07-06T07:10:00+02:00"
            raise MissingTimeZoneError(
                describe(f"{file}: data row {row}", "a time stamp with offset", repr(text), advice)
            )
    try:
        stamps = pd.to_datetime(listed, utc=True, format="ISO8601")
    except (ValueError, OverflowError) as error:
        found = " ".join(str(error).split())
        raise TimestampError(describe(f"{file}: {INDEX}", "ISO 8601 time stamps with offset", found)) from error
    return pd.DatetimeIndex(stamps, name=INDEX)


def _numbers(column: pd.Series, where: str) -> NDArray[np.float64]:
    if pd.api.types.is_numeric_dtype(column.dtype) and not (
        pd.api.types.is_bool_dtype(column.dtype) or pd.api.types.is_complex_dtype(column.dtype)
    ):
        return column.to_numpy(dtype=float, na_value=np.nan)
    present = column[column.notna()]
    for stamp, value in present.items():
        if isinstance(value, bool) or not isinstance(value, int | float | Decimal):
            advice = "leave a missing value blank or NaN"
            raise NonNumericColumnError(describe(f"{where}, stamp {stamp}", "a number", repr(value), advice))
    return np.array([np.nan if missing else float(value) for value, missing in zip(column, column.isna(), strict=True)])
