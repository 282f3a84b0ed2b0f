"""Plans of codes, as the paper's simulator has them: CSV and NumPy arrays of 0 inside, 1 wall, 2 outside."""

from __future__ import annotations

import csv
import zipfile
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import ndimage

from thermal.errors import OversizedFileError, PlanError, describe
from thermal.plan.guard import MOST_BYTES, check_pixels, checked_file, checked_number
from thermal.plan.rooms import finish
from thermal.plan.survey import OUTSIDE_LABEL, FloorSurvey

CODE_KINDS = (".csv", ".npy", ".npz")
INSIDE, WALL, OUTSIDE = 0, 1, 2

_REFINE = 4  # parts a cell's side, so that a wall of one cell can be split between its two sides


def read_codes(path: str | PathLike[str], cell_size: float) -> FloorSurvey:
    """Read a plan of codes.

    Parameters
    ----------
    path : str or path
        CSV, ``.npy``, or ``.npz`` with one array; each cell 0 inside, 1 wall, 2 outside.
    cell_size : float
        Side of a cell [m], 0.01 to 5.

    Returns
    -------
    FloorSurvey
        Its rooms are the parts of the inside that hang together by their sides; doors must be closed already.

    Raises
    ------
    PlanError
        The file is damaged, its rows differ in length, or it holds another code.
    OversizedFileError
        It has, or unpacks to, more than any real plan.
    PlanError
        It has no inside that walls part from the outside.
    """
    file = checked_file(Path(path), CODE_KINDS)
    return survey_codes(_read_csv(file) if file.suffix.lower() == ".csv" else _read_numpy(file), cell_size, file.name)


def survey_codes(codes: ArrayLike, cell_size: float, source: str = "codes") -> FloorSurvey:
    """Find the rooms in an array of codes.

    Parameters
    ----------
    codes : array_like of int, shape (n_row, n_col)
        0 inside, 1 wall, 2 outside [-]; the first row is the plan's "up".
    cell_size : float
        Side of a cell [m], 0.01 to 5.
    source : str
        For messages and pictures.

    Returns
    -------
    FloorSurvey
        Walls, rooms and the outside.

    Raises
    ------
    PlanError
        It has another shape or another code.
    OversizedFileError
        It has more cells than any real plan.
    PlanError
        It has no inside, or one that touches the outside.

    Examples
    --------
    >>> codes = np.pad(np.pad(np.zeros((4, 5), dtype=int), 1, constant_values=1), 1, constant_values=2)
    >>> survey_codes(codes, 0.5).rooms[0].area
    5.0
    """
    checked_number(cell_size, "cell_size", 0.01, 5.0, "m")
    array = np.asarray(codes)
    if array.ndim != 2 or array.size == 0 or array.dtype.kind not in "iufb":
        found = f"an array of shape {array.shape} and type {array.dtype}"
        raise PlanError(describe(source, "rows and columns of codes", found))
    check_pixels(_REFINE * array.shape[1], _REFINE * array.shape[0], source)
    unknown = ~np.isin(array, [INSIDE, WALL, OUTSIDE])
    if unknown.any():
        row, column = (int(x) for x in np.argwhere(unknown)[0])
        where = f"{source}: row {row + 1}, column {column + 1}"
        raise PlanError(describe(where, "0 inside, 1 wall or 2 outside", repr(array[row, column].item())))
    framed = np.pad(array.astype(np.int32), 1, constant_values=OUTSIDE)
    labels, count = ndimage.label(framed == INSIDE)
    labels = labels.astype(np.int32)
    labels[framed == OUTSIDE] = OUTSIDE_LABEL
    if count == 0:
        raise PlanError(describe(source, "cells of code 0, inside", "none"))
    _check_closed(labels, source)
    fine = np.repeat(np.repeat(labels, _REFINE, axis=0), _REFINE, axis=1)
    middle = 1.5 * _REFINE - 0.5
    placement = np.array([[_REFINE, 0, middle], [0, _REFINE, middle], [0, 0, 1]], dtype=float)
    return finish(fine, cell_size / _REFINE, source, (), 0.0, placement, ())


def _check_closed(labels: NDArray[np.int32], source: str) -> None:
    """Refuse a room that has the outside, or the edge, beside it."""
    for here, there in ((np.s_[:, :-1], np.s_[:, 1:]), (np.s_[:-1], np.s_[1:])):
        a, b = labels[here], labels[there]
        open_ = ((a > 0) & (b == OUTSIDE_LABEL)) | ((b > 0) & (a == OUTSIDE_LABEL))
        if open_.any():
            row, column = (int(x) for x in np.argwhere(open_)[0])
            where = f"{source}: near row {max(row, 1)}, column {max(column, 1)}"
            raise PlanError(describe(where, "a wall (1) between inside (0) and outside (2)", "none"))


def _read_csv(file: Path) -> NDArray[Any]:
    try:
        with file.open(encoding="utf-8-sig", newline="") as stream:
            rows = [row for row in csv.reader(stream, strict=True) if any(cell.strip() for cell in row)]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise PlanError(describe(file.name, "a CSV of codes in UTF-8", str(error))) from error
    for number, row in enumerate(rows, start=1):
        if len(row) != len(rows[0]):
            expected = f"{len(rows[0])} cells as in row 1"
            raise PlanError(describe(f"{file.name}: row {number}", expected, f"{len(row)} cells"))
    try:
        return np.array(rows, dtype=float)
    except ValueError as error:
        found = " ".join(str(error).split())
        raise PlanError(describe(file.name, "codes 0, 1 and 2", found)) from error


def _read_numpy(file: Path) -> NDArray[Any]:
    """Read an array, never an object that runs code, and nothing that unpacks to more than a plan."""
    try:
        if file.suffix.lower() == ".npz":
            with zipfile.ZipFile(file) as archive:
                unpacked = sum(entry.file_size for entry in archive.infolist())
                names = archive.namelist()
            if unpacked > MOST_BYTES:
                expected, found = f"at most {MOST_BYTES / 1e6:.0f} MB unpacked", f"{unpacked / 1e6:.0f} MB"
                raise OversizedFileError(describe(file.name, expected, found, "this is no plan"))
            if len(names) != 1:
                raise PlanError(describe(file.name, "one array", ", ".join(names[:5]) or "none"))
            with np.load(file, allow_pickle=False) as arrays:
                return np.asarray(arrays[arrays.files[0]])
        mapped = np.load(file, mmap_mode="r", allow_pickle=False)
        return np.asarray(mapped)
    except (OSError, ValueError, EOFError, KeyError, zipfile.BadZipFile) as error:
        found = " ".join(str(error).replace(str(file), file.name).split())
        raise PlanError(describe(file.name, "a NumPy array of codes", found)) from error
