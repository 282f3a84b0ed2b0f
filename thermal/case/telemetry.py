"""Telemetry: what the sensors of a building reported, in SI units, on a regular clock."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd

from thermal.errors import CaseError, describe

INDEX = "timestamp"
LONGEST_STEP = 3600.0  # s: "steps of up to 60 minutes are valid" (case format)
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
            found = f"{str(doubled[0])!r} twice"
            raise CaseError(describe(f"{where}: columns", "names of their own", found, "drop one"))
        if len(frame) < 2 or frame.shape[1] == 0:
            found = f"{len(frame)} rows and {frame.shape[1]} columns"
            raise CaseError(describe(where, "at least two rows and one column", found))
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
    try:
        return frame.astype(float)
    except (TypeError, ValueError):
        for column in frame.columns:
            try:
                frame[column].astype(float)
            except (TypeError, ValueError) as error:
                at = f"{where}: column {str(column)!r}"
                found = " ".join(str(error).split())
                raise CaseError(describe(at, "numbers", found)) from error
        raise


def _checked_index(index: pd.Index, where: str) -> pd.DatetimeIndex:
    if not isinstance(index, pd.DatetimeIndex) or index.name != INDEX:
        found = f"an index {index.name!r} of {index.dtype}"
        raise CaseError(describe(where, f"an index {INDEX!r} of time stamps", found, "rename or set the index"))
    if index.tz is None:
        found = f"{index[0]} without one"
        advice = "write stamps with their offset, or localise them to the building's time zone"
        raise CaseError(describe(f"{where}: {INDEX}", "stamps with a time zone", found, advice))
    if index.hasnans:
        row = int(np.flatnonzero(index.isna())[0]) + 1
        raise CaseError(describe(f"{where}: data row {row}", "a time stamp", "nothing", "drop the row"))
    gaps = np.diff(index.as_unit("us").asi8)
    if (gaps <= 0).any():
        row = int(np.flatnonzero(gaps <= 0)[0]) + 1
        at = f"{where}: data row {row + 1}"
        if gaps[row - 1] == 0:
            raise CaseError(describe(at, "a new stamp", f"{index[row]} again", "drop or merge the row"))
        found = f"{index[row]} after {index[row - 1]}"
        if (index == index[row]).sum() > 1:
            raise CaseError(describe(at, "a new stamp", f"{index[row]} again", "drop or merge the row"))
        raise CaseError(describe(at, "stamps that go forwards", found, "sort the rows"))
    return index.as_unit("us")


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
        advice = "resample the telemetry to one step"
        raise CaseError(describe(f"{where}: data row {row + 1}", expected, found, advice))
    if step / 1e6 > LONGEST_STEP:
        raise CaseError(describe(where, f"steps of up to {LONGEST_STEP:g} s", f"{step / 1e6:g} s"))
    if gaps.sum() // step > FILL_LIMIT * len(index) + FILL_LIMIT:
        row = int(np.argmax(gaps)) + 1
        found = f"{index[row]} after {index[row - 1]}"
        advice = "correct the stamp, or make a case of each stretch"
        raise CaseError(
            describe(f"{where}: data row {row + 1}", "telemetry without years of gaps", found, advice)
        )
    return step / 1e6
