"""Survey of a floor: settings, rooms and doors, and surveys from arrays of codes."""

import csv
import zipfile
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from tokenize import TokenError
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import ndimage

from thermal._types import BoolArray, FloatArray, Int32Array
from thermal.errors import OversizedFileError, PlanError
from thermal.plan.guard import MOST_BYTES, check_pixels, checked_file, checked_number, reading

#: Labels of what is no room.
OUTSIDE_LABEL, WALL_LABEL = -1, 0


@dataclass(frozen=True)
class PlanSettings:
    """What counts as a wall, a door and a room.

    Parameters
    ----------
    widest_door : float
        Gaps in walls up to this width are doors and closed [m], 0.3 to 4. Default: a wide single door; double doors
        need 2.
    thickest_wall : float
        Two lines at most this far apart are the faces of one wall [m], 0.1 to 2. Default: an insulated exterior wall.
    thinnest_wall : float
        Thinner strokes are no walls but doors' arcs, furniture, text, dimensions [m], 0 to 0.5; 0 keeps every stroke.
        Default: less than the thinnest partition (75 mm).
    smallest_room : float
        Smaller spaces are shafts and count as wall [m2], 0.1 to 50.
    smallest_zone : float
        Smaller rooms are proposed as part of the zone next to them [m2], 0 to 100; 0 makes each room a zone. Default:
        less than a single office, more than a closet.

    Raises
    ------
    PlanError
        A value is out of its range.
    """

    widest_door: float = 1.3
    thickest_wall: float = 0.6
    thinnest_wall: float = 0.06
    smallest_room: float = 1.0
    smallest_zone: float = 4.0

    def __post_init__(self) -> None:
        checked_number(self.widest_door, "widest_door", 0.3, 4.0, "m")
        checked_number(self.thickest_wall, "thickest_wall", 0.1, 2.0, "m")
        checked_number(self.thinnest_wall, "thinnest_wall", 0.0, 0.5, "m")
        checked_number(self.smallest_room, "smallest_room", 0.1, 50.0, "m2")
        checked_number(self.smallest_zone, "smallest_zone", 0.0, 100.0, "m2")
        expected = f"less than thickest_wall ({self.thickest_wall} m)"
        PlanError.unless(self.thinnest_wall < self.thickest_wall, "thinnest_wall", expected, f"{self.thinnest_wall}")


@dataclass(frozen=True)
class Room:
    """A room of a drawing.

    Parameters
    ----------
    label : int
        Its number in `FloorSurvey.labels`, from 1.
    area : float
        Clear floor area, between the faces of its walls [m2].
    centre : tuple of float
        Column and row of its innermost point [px of the survey].
    name : str
        As the drawing has it; empty when it has none.
    """

    label: int
    area: float
    centre: tuple[float, float]
    name: str = ""


@dataclass(frozen=True)
class Door:
    """A gap in a wall that was closed.

    Parameters
    ----------
    rooms : tuple of int
        Labels on its two sides, the lower first; -1 is outside.
    width : float
        Clear width [m].
    centre : tuple of float
        Column and row [px of the survey].
    """

    rooms: tuple[int, int]
    width: float
    centre: tuple[float, float]


@dataclass(frozen=True)
class Window:
    """Glass between a room and the outside.

    Parameters
    ----------
    room : tuple of float
        Column and row of a point in the room behind it [px of the survey].
    facade : str
        ``north`` is up on the plan.
    width : float
        [m].
    """

    room: tuple[float, float]
    facade: str
    width: float


@dataclass(frozen=True, eq=False)
class FloorSurvey:
    """One floor as it was understood from its drawing.

    Parameters
    ----------
    source : str
        The drawing.
    labels : ndarray of int, shape (n_row, n_col)
        -1 outside, 0 wall, else the room; upright.
    pixel : float
        Side of an element of `labels` [m].
    rooms : tuple of Room
        In the order of their labels.
    doors : tuple of Door
        Closed gaps.
    turned : float
        Angle by which the drawing's walls stood clockwise of upright, taken out of `labels` [deg].
    placement : ndarray, shape (3, 3)
        Takes (column, row, 1) of the drawing to those of `labels` [px].
    remarks : tuple of str
        What a look at the picture should confirm.
    ink : ndarray of bool or None, shape (n_row, n_col)
        What is drawn there, walls or not, for pictures.
    windows : tuple of Window
        Those that the drawing shows.
    """

    source: str
    labels: Int32Array
    pixel: float
    rooms: tuple[Room, ...]
    doors: tuple[Door, ...] = ()
    turned: float = 0.0
    placement: FloatArray | None = None
    remarks: tuple[str, ...] = ()
    ink: BoolArray | None = None
    windows: tuple[Window, ...] = ()

    def place(self, point: tuple[float, float]) -> tuple[float, float]:
        """Where a point of the drawing lies.

        Parameters
        ----------
        point : tuple of float
            Column and row of the drawing [px]; of a DXF, its own x and y.

        Returns
        -------
        tuple of float
            Column and row of `labels` [px].
        """
        matrix = np.eye(3) if self.placement is None else self.placement
        column, row, _ = matrix @ np.array([point[0], point[1], 1.0])
        return float(column), float(row)

    def label_at(self, point: tuple[float, float]) -> int:
        """Label at a point of the drawing.

        Parameters
        ----------
        point : tuple of float
            Column and row of the drawing [px]; of a DXF, its own x and y.

        Returns
        -------
        int
            As in `labels`; -1 beyond them.
        """
        column, row = (round(x) for x in self.place(point))
        n_row, n_col = self.labels.shape
        return int(self.labels[row, column]) if 0 <= row < n_row and 0 <= column < n_col else OUTSIDE_LABEL


def innermost(inside: BoolArray, where: tuple[slice, ...]) -> tuple[float, float, float]:
    """Column and row of the point of a shape that is the farthest from its edge, and how far that is.

    Parameters
    ----------
    inside : ndarray of bool, shape (n_row, n_col)
        Elements of the shape, in the box that holds it.
    where : tuple of slice
        Place of the box.

    Returns
    -------
    tuple of float
        Column, row and depth [px].
    """
    depth = ndimage.distance_transform_edt(np.pad(inside, 1))
    row, column = np.unravel_index(int(depth.argmax()), depth.shape)
    return float(column - 1 + where[1].start), float(row - 1 + where[0].start), float(depth.max())


def rooms_of(labels: Int32Array, pixel: float) -> tuple[Room, ...]:
    """Measure the rooms of a floor whose elements are labelled.

    Parameters
    ----------
    labels : ndarray of int, shape (n_row, n_col)
        -1 outside, 0 wall, else rooms from 1 on [-].
    pixel : float
        Side of an element [m].

    Returns
    -------
    tuple of Room
        With areas and innermost points.
    """
    count = int(labels.max())
    areas = np.bincount(labels[labels > 0].ravel(), minlength=count + 1) * pixel**2
    boxes = enumerate(ndimage.find_objects(np.maximum(labels, 0), count), start=1)
    return tuple(
        Room(label, float(areas[label]), innermost(labels[where] == label, where)[:2]) for label, where in boxes
    )


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
        raise PlanError(source, "rows and columns of codes", f"an array of shape {array.shape} and type {array.dtype}")
    check_pixels(_REFINE * array.shape[1], _REFINE * array.shape[0], source)
    unknown = ~np.isin(array, [INSIDE, WALL, OUTSIDE])
    if unknown.any():
        row, column = (int(x) for x in np.argwhere(unknown)[0])
        where = f"{source}: row {row + 1}, column {column + 1}"
        raise PlanError(where, "0 inside, 1 wall or 2 outside", repr(array[row, column].item()))
    framed = np.pad(array.astype(np.int32), 1, constant_values=OUTSIDE)
    labels, count = ndimage.label(framed == INSIDE)
    labels = labels.astype(np.int32)
    labels[framed == OUTSIDE] = OUTSIDE_LABEL
    PlanError.unless(count != 0, source, "cells of code 0, inside", "none")
    _check_closed(labels, source)
    fine = np.repeat(np.repeat(labels, _REFINE, axis=0), _REFINE, axis=1)
    middle = 1.5 * _REFINE - 0.5
    placement = np.array([[_REFINE, 0, middle], [0, _REFINE, middle], [0, 0, 1]], dtype=float)
    pixel = cell_size / _REFINE
    return FloorSurvey(source, fine, pixel, rooms_of(fine, pixel), placement=placement)


def _check_closed(labels: NDArray[np.int32], source: str) -> None:
    """Refuse a room that has the outside, or the edge, beside it."""
    for here, there in ((np.s_[:, :-1], np.s_[:, 1:]), (np.s_[:-1], np.s_[1:])):
        a, b = labels[here], labels[there]
        open_ = ((a > 0) & (b == OUTSIDE_LABEL)) | ((b > 0) & (a == OUTSIDE_LABEL))
        if open_.any():
            row, column = (int(x) for x in np.argwhere(open_)[0])
            where = f"{source}: near row {max(row, 1)}, column {max(column, 1)}"
            raise PlanError(where, "a wall (1) between inside (0) and outside (2)", "none")


def _read_csv(file: Path) -> NDArray[Any]:
    expected = "a CSV of codes in UTF-8"
    with reading(file, expected, csv.Error), file.open(encoding="utf-8-sig", newline="") as stream:
        rows = [row for row in csv.reader(stream, strict=True) if any(cell.strip() for cell in row)]
    for number, row in enumerate(rows, start=1):
        if len(row) != len(rows[0]):
            raise PlanError(f"{file.name}: row {number}", f"{len(rows[0])} cells as in row 1", f"{len(row)} cells")
    with reading(file, "codes 0, 1 and 2"):
        codes = np.array(rows, dtype=float)
    return codes


def _read_numpy(file: Path) -> NDArray[Any]:
    """Read an array, never an object that runs code, and nothing that unpacks to more than a plan."""
    # a spoilt header is read as Python by NumPy: TokenError and SyntaxError
    kinds = (EOFError, KeyError, SyntaxError, TokenError, zipfile.BadZipFile)
    with reading(file, "a NumPy array of codes", *kinds):
        if file.suffix.lower() == ".npz":
            with zipfile.ZipFile(file) as archive:
                unpacked = sum(entry.file_size for entry in archive.infolist())
                names = archive.namelist()
            expected, found = f"at most {MOST_BYTES / 1e6:.0f} MB unpacked", f"{unpacked / 1e6:.0f} MB"
            OversizedFileError.unless(unpacked <= MOST_BYTES, file.name, expected, found, "this is no plan")
            PlanError.unless(len(names) == 1, file.name, "one array", ", ".join(names[:5]) or "none")
            with np.load(file, allow_pickle=False) as arrays:
                codes = np.asarray(arrays[arrays.files[0]])
        else:
            codes = np.asarray(np.load(file, mmap_mode="r", allow_pickle=False))
    return codes
