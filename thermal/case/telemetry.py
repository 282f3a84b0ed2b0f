"""Telemetry: what the sensors of a building reported, read from any file and units, in SI units on a regular clock."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from decimal import Decimal
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from thermal.case.building import Location
from thermal.case.points import POINT_TYPES, point_type, split_column
from thermal.case.years import EXPECTED, shown, within_years
from thermal.errors import CaseError
from thermal.units import check_unit, to_si

INDEX = "timestamp"
LONGEST_STEP = 7200.0  # s
FILL_LIMIT = 20  # missing rows a given one: more than that is a wrong stamp rather than a gap


@dataclass(frozen=True, eq=False)
class Telemetry:
    """Telemetry of a building.

    Parameters
    ----------
    frame
        Shape (n_time, n_column), float64 in the library's units, columns ``ENTITY/POINT``, a regular tz-aware index
        named ``timestamp``. A value stands for the interval that ends at its stamp. NaN = missing.
    step
        Time from a stamp to the next [s].
    missing_rows
        Stamps that the source left out; their rows are NaN.
    """

    frame: pd.DataFrame
    step: float
    missing_rows: tuple[pd.Timestamp, ...] = ()

    @classmethod
    def from_frame(cls, frame: pd.DataFrame, *, where: str = "telemetry") -> Telemetry:
        """Build telemetry from a frame, after a look at its stamps and columns.

        Parameters
        ----------
        frame
            Shape (n_time, n_column), numbers in the library's units, tz-aware index named ``timestamp``.
        where
            File, for messages.

        Returns
        -------
        Telemetry
            The frame with a regular clock: rows that it leaves out come in as NaN.

        Raises
        ------
        CaseError
            The stamps have no zone, stand twice, run backwards or are not a whole number of steps apart.
        CaseError
            There are fewer than two rows, or no columns.
        CaseError
            Two columns have the same name.
        CaseError
            A column cannot be read as numbers.
        """
        doubled = frame.columns[frame.columns.duplicated()]
        if len(doubled):
            raise CaseError(f"{where}: columns", "names of their own", f"{str(doubled[0])!r} twice", "drop one")
        if len(frame) < 2 or frame.shape[1] == 0:
            found = f"{len(frame)} rows and {frame.shape[1]} columns"
            raise CaseError(where, "at least two rows and one column", found)
        index = _checked_index(frame.index, where)
        step = _regular_step(index, where)
        full = pd.date_range(index[0], index[-1], freq=pd.Timedelta(step, unit="s"), name=INDEX)
        full = full.as_unit("us")
        numbers = _as_numbers(frame, where).set_axis(index, axis=0)
        missing = tuple(full.difference(index)) if len(full) != len(index) else ()
        if missing:
            numbers = numbers.reindex(full)
        numbers.index = full
        return cls(frame=numbers, step=step, missing_rows=missing)


def _as_numbers(frame: pd.DataFrame, where: str) -> pd.DataFrame:
    for column in frame.columns:
        try:
            frame[column].astype(float)
        except (TypeError, ValueError) as error:
            raise CaseError(f"{where}: column {str(column)!r}", "numbers", " ".join(str(error).split())) from error
    return frame.astype(float)


def _checked_index(index: pd.Index, where: str) -> pd.DatetimeIndex:
    if not isinstance(index, pd.DatetimeIndex) or index.name != INDEX:
        found = f"an index {index.name!r} of {index.dtype}"
        raise CaseError(where, f"an index {INDEX!r} of time stamps", found, "rename or set the index")
    if index.tz is None:
        advice = "write stamps with their offset, or localise them to the building's time zone"
        raise CaseError(f"{where}: {INDEX}", "stamps with a time zone", f"{index[0]} without one", advice)
    if index.hasnans:
        row = int(np.flatnonzero(index.isna())[0]) + 1
        raise CaseError(f"{where}: data row {row}", "a time stamp", "nothing", "drop the row")
    _check_years(index, where)
    gaps = np.diff(index.as_unit("us").asi8)
    if (gaps <= 0).any():
        row = int(np.flatnonzero(gaps <= 0)[0]) + 1
        at = f"{where}: data row {row + 1}"
        if (index == index[row]).sum() > 1:
            raise CaseError(at, "a new stamp", f"{index[row]} again", "drop or merge the row")
        raise CaseError(at, "stamps that go forwards", f"{index[row]} after {index[row - 1]}", "sort the rows")
    return index.as_unit("us")


def _check_years(index: pd.DatetimeIndex, where: str) -> None:
    wrong = np.flatnonzero(~within_years(index) & ~np.asarray(index.isna()))
    if wrong.size:
        raise CaseError(f"{where}: data row {wrong[0] + 1}", EXPECTED, shown(index, wrong[0]), "correct the stamp")


def _regular_step(index: pd.DatetimeIndex, where: str) -> float:
    """Find the most common difference [s]; refuse a difference that is no multiple of it."""
    gaps = np.diff(index.asi8)
    values, counts = np.unique(gaps, return_counts=True)
    step = int(values[np.argmax(counts)])  # the smallest of the most common ones
    off = np.flatnonzero(gaps % step)
    if off.size:
        row = int(off[0]) + 1
        expected = f"a whole number of steps of {step / 1e6:g} s"
        found = f"{index[row]}, {gaps[row - 1] / 1e6:g} s after the row before"
        raise CaseError(f"{where}: data row {row + 1}", expected, found, "resample the telemetry to one step")
    CaseError.unless(step / 1e6 <= LONGEST_STEP, where, f"steps of up to {LONGEST_STEP:g} s", f"{step / 1e6:g} s")
    if gaps.sum() // step > FILL_LIMIT * len(index) + FILL_LIMIT:
        row = int(np.argmax(gaps)) + 1
        found = f"{index[row]} after {index[row - 1]}"
        advice = "correct the stamp, or make a case of each stretch"
        raise CaseError(f"{where}: data row {row + 1}", "telemetry without years of gaps", found, advice)
    return step / 1e6


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
        raise CaseError("building.yaml: telemetry", "a .parquet or a .csv file", repr(path.name))
    raw = _read_csv(path) if path.suffix.lower() == ".csv" else _read_parquet(path)
    if names is not None:
        raw = raw.loc[:, [str(column) in names for column in raw.columns]]
        raw = raw.set_axis([names[str(column)] for column in raw.columns], axis=1)
    if isinstance(raw.index, pd.DatetimeIndex) and raw.index.tz is not None:
        _check_years(raw.index, path.name)
        raw = raw.tz_convert(location.timezone)
    columns = [str(column) for column in raw.columns]
    converted: dict[str, NDArray[np.float64]] = {}
    for position, column in enumerate(columns):
        _, point = split_column(column, path.name)
        expected = f"a unit for {point}, which {path.name} has"
        CaseError.unless(point in units, "building.yaml: units", expected, "no such key", f"add '{point}: <unit>'")
        CaseError.unless(column not in converted, f"{path.name}: columns", "names of their own", f"{column!r} twice")
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
        raise CaseError(path.name, "a Parquet file", " ".join(str(error).split())) from error
    return frame.set_index(INDEX) if INDEX in frame.columns else frame


def _read_csv(path: Path) -> pd.DataFrame:
    """Read a CSV as text; numbers are made of it later, where a message can name what stood there."""
    try:
        with path.open(encoding="utf-8-sig", newline="") as stream:
            rows = [row for row in csv.reader(stream, strict=True) if row]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise CaseError(path.name, "a CSV in UTF-8", " ".join(str(error).split())) from error
    CaseError.unless(rows, path.name, "a CSV with one header row", "an empty file")
    header = [name.strip() for name in rows.pop(0)]
    if header.count(INDEX) != 1:
        CaseError.unless(INDEX not in header, f"{path.name}: columns", "names of their own", f"{INDEX!r} twice")
        raise CaseError(f"{path.name}: header", f"a column {INDEX!r}", ", ".join(header[:3]))
    for number, row in enumerate(rows, start=1):
        if len(row) != len(header):
            expected = f"{len(header)} cells as in the header"
            raise CaseError(f"{path.name}: data row {number}", expected, f"{len(row)} cells")
    columns = dict(enumerate(zip(*rows, strict=True))) if rows else dict.fromkeys(range(len(header)), ())
    stamps = _parse_stamps(columns.pop(header.index(INDEX)), path.name)
    names = [header[position] for position in columns]
    frame = pd.DataFrame({k: [_cell(text) for text in texts] for k, texts in columns.items()}, index=stamps)
    return frame.set_axis(names, axis=1)


def _cell(text: str) -> float | str:
    """Return the number in a cell of a CSV, NaN where it is missing, and the text where it is no number."""
    try:
        return np.nan if text.strip().casefold() in MISSING else float(text)
    except ValueError:
        return text


def _parse_stamps(texts: Iterable[str], file: str) -> pd.DatetimeIndex:
    listed = [text.strip() for text in texts]
    for row, text in enumerate(listed, start=1):
        if not re.match(r"\d{4}-?\d{2}-?\d{2}", text):
            raise CaseError(f"{file}: data row {row}", "an ISO 8601 time stamp with offset", repr(text))
        if ("T" not in text and " " not in text) or not _OFFSET.search(text):
            advice = "write 2023-07-06T07:10:00+02:00"
            raise CaseError(f"{file}: data row {row}", "a time stamp with offset", repr(text), advice)
    try:
        stamps = pd.to_datetime(listed, utc=True, format="ISO8601")
    except (ValueError, OverflowError) as error:
        raise CaseError(f"{file}: {INDEX}", "ISO 8601 time stamps with offset", " ".join(str(error).split())) from error
    return pd.DatetimeIndex(stamps, name=INDEX)


def _numbers(column: pd.Series, where: str) -> NDArray[np.float64]:
    if column.dtype.kind in "iuf":
        return column.to_numpy(dtype=float, na_value=np.nan)
    values = np.full(len(column), np.nan)
    for position, (stamp, value) in enumerate(column.items()):
        if isinstance(value, int | float | Decimal) and not isinstance(value, bool):
            values[position] = float(value)
        elif value is not None and value is not pd.NA and value is not pd.NaT:
            raise CaseError(f"{where}, stamp {stamp}", "a number", repr(value), "leave a missing value blank or NaN")
    return values
