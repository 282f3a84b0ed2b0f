"""Rooms of a raster drawing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from thermal._types import Int32Array
from thermal.errors import PlanError, describe
from thermal.plan.basins import Basins, find_basins
from thermal.plan.drawing import Drawing
from thermal.plan.ink import Ink, ink_of
from thermal.plan.scale import checked_scale
from thermal.plan.survey import OUTSIDE_LABEL, WALL_LABEL, Door, FloorSurvey, PlanSettings, Room
from thermal.plan.walls import walls_of

_COLUMN = 1.0  # m: free-standing pieces of wall up to this size are columns and part of their room
_COARSE = 0.03  # m/px: a partition of 100 mm is three pixels, and lines of windows are still seen
_OPEN = 0.03  # -, of the building: a bay between wings may seem to have walls on all sides
_NARROWEST_DOOR = 0.45  # m: narrower gaps are flaws of the drawing, closed without a word


def find_rooms(
    drawing: Drawing, metres_per_pixel: float, *, settings: PlanSettings | None = None, straighten: bool = True
) -> FloorSurvey:
    """Find walls, rooms and doors in a raster drawing.

    Parameters
    ----------
    drawing : Drawing
        One floor, walls darker than the paper (or all the other way round).
    metres_per_pixel : float
        Scale [m/px], from `scale_from_points`, `scale_from_length` or `scale_from_paper`.
    settings : PlanSettings, optional
        What counts as a wall, a door and a room.
    straighten : bool
        Whether to turn the drawing so that its walls stand upright; the angle is kept in the result.

    Returns
    -------
    FloorSurvey
        What was understood.

    Raises
    ------
    PlanError
        The walls enclose nothing.
    PlanError
        No building is drawn at this scale.
    """
    ink = ink_of(drawing, checked_scale(metres_per_pixel), straighten)
    return survey_ink(ink, drawing.source, settings or PlanSettings())


def survey_ink(ink: Ink, source: str, settings: PlanSettings) -> FloorSurvey:
    """Find walls, rooms and doors in what is drawn.

    Parameters
    ----------
    ink : Ink
        What is drawn, upright.
    source : str
        The drawing.
    settings : PlanSettings
        What counts as a wall, a door and a room.

    Returns
    -------
    FloorSurvey
        What was understood.

    Raises
    ------
    PlanError
        The walls enclose nothing, with and without the thin strokes.
    """
    margin = int(np.ceil(settings.widest_door / ink.pixel)) + 2
    shift = np.array([[1.0, 0.0, margin], [0.0, 1.0, margin], [0.0, 0.0, 1.0]]) @ ink.placement
    for trial in (settings, replace(settings, thinnest_wall=0.0)):
        walls = np.pad(walls_of(ink.mask, ink.pixel, trial), margin)
        if not walls.any():
            continue
        labels, doors, small = _label(find_basins(walls, ink.pixel, settings), ink.pixel, settings)
        if labels.max() > 0:
            remarks = [f"{small} spaces under {settings.smallest_room:g} m2 count as wall"] if small else []
            if trial is not settings:
                remarks.append(
                    f"no stroke is as thick as {settings.thinnest_wall:g} m, so all of them count as walls: "
                    "arcs of doors and furniture too"
                )
            remarks += _doubts(labels, ink, settings)
            survey = finish(labels, ink.pixel, source, doors, ink.turned, shift, tuple(remarks))
            return replace(survey, ink=np.pad(ink.mask, margin))
    advice = "set widest_door to the widest gap in the walls, or crop to one floor's plan"
    raise PlanError(describe(source, "walls that enclose rooms, but for doors", "none", advice))


def finish(
    labels: Int32Array,
    pixel: float,
    source: str,
    doors: tuple[Door, ...],
    turned: float,
    placement: NDArray[np.float64],
    remarks: tuple[str, ...],
) -> FloorSurvey:
    """Measure the rooms of a floor whose elements are labelled.

    Parameters
    ----------
    labels : ndarray of int, shape (n_row, n_col)
        -1 outside, 0 wall, else rooms from 1 on.
    pixel : float
        Side of an element [m].
    source : str
        The drawing.
    doors : tuple of Door
        Closed gaps.
    turned : float
        Angle taken out [deg].
    placement : ndarray, shape (3, 3)
        Takes (column, row, 1) of the drawing to those of `labels` [px].
    remarks : tuple of str
        So far.

    Returns
    -------
    FloorSurvey
        With areas and innermost points.
    """
    count = int(labels.max())
    areas = np.bincount(labels[labels > 0].ravel(), minlength=count + 1) * pixel**2
    rooms = []
    for label, where in enumerate(ndimage.find_objects(np.maximum(labels, 0), count), start=1):
        inside = np.pad(labels[where] == label, 1)
        depth = ndimage.distance_transform_edt(inside)
        row, column = np.unravel_index(int(depth.argmax()), depth.shape)
        centre = (float(column - 1 + where[1].start), float(row - 1 + where[0].start))
        rooms.append(Room(label, float(areas[label]), centre))
    return FloorSurvey(source, labels, pixel, tuple(rooms), doors, turned, placement, remarks)


def _doubts(labels: Int32Array, ink: Ink, settings: PlanSettings) -> list[str]:
    """Say where a drawing may have been misread: too coarse for its lines, or open where it should be closed."""
    doubts = []
    if ink.drawn_pixel > _COARSE:
        doubts.append(
            f"a pixel is {100 * ink.drawn_pixel:.1f} cm: thin walls and windows may be lost, export it finer than "
            f"{100 * _COARSE:g} cm"
        )
    walled = labels >= WALL_LABEL
    around = np.ones_like(walled)
    for axis in (0, 1):
        for way in (1, -1):
            ahead = np.flip(walled, axis) if way < 0 else walled
            seen = np.logical_or.accumulate(ahead, axis=axis)
            around &= np.flip(seen, axis) if way < 0 else seen
    area = float(np.count_nonzero(around & (labels == OUTSIDE_LABEL))) * ink.pixel**2
    built = float(np.count_nonzero(walled)) * ink.pixel**2
    if area > max(4.0, _OPEN * built):
        doubts.append(
            f"{area:.0f} m2 with walls on all sides are open to the outside: a gap wider than widest_door "
            f"({settings.widest_door:g} m), or a courtyard"
        )
    return doubts


def _label(basins: Basins, pixel: float, settings: PlanSettings) -> tuple[Int32Array, tuple[Door, ...], int]:
    """Give the rooms numbers, row by row; shafts become wall and columns part of their room."""
    pieces = basins.pieces
    count = int(pieces.max())
    area = np.bincount(pieces.ravel(), minlength=count + 1) * pixel**2
    depth = np.asarray(ndimage.maximum(ndimage.distance_transform_edt(pieces > 0), pieces, np.arange(count + 1)))
    is_room = (area >= settings.smallest_room) & (2.0 * depth * pixel > settings.thickest_wall)
    is_room[[0, basins.outside]] = False
    small = int(np.count_nonzero(area[1:] > 0.0) - np.count_nonzero(is_room[1:]) - 1)
    order = [int(piece) for piece in dict.fromkeys(pieces[np.isin(pieces, np.flatnonzero(is_room))].tolist())]
    number = np.zeros(count + 1, dtype=np.int32)
    number[order] = np.arange(1, len(order) + 1)
    number[basins.outside] = OUTSIDE_LABEL
    labels = _without_columns(number[pieces], pixel)
    doors: list[Door] = []
    for a, b, width, row, column in basins.saddles:
        low, high = sorted((int(number[a]), int(number[b])))
        near = any(
            d.rooms == (low, high) and np.hypot(d.centre[0] - column, d.centre[1] - row) * pixel < settings.widest_door
            for d in doors
        )
        if width >= _NARROWEST_DOOR and WALL_LABEL not in (low, high) and low != high and not near:
            doors.append(Door((low, high), width, (float(column), float(row))))
    return labels, tuple(doors), max(small, 0)


def _without_columns(labels: Int32Array, pixel: float) -> Int32Array:
    """Give small free-standing pieces of wall to the room around them."""
    walls, count = ndimage.label(labels == WALL_LABEL, np.ones((3, 3)))
    result = labels.copy()
    for piece, (rows, columns) in enumerate(ndimage.find_objects(walls, count), start=1):
        if np.hypot(rows.stop - rows.start, columns.stop - columns.start) * pixel > _COLUMN:
            continue
        around = tuple(slice(max(0, s.start - 1), s.stop + 1) for s in (rows, columns))
        mine = walls[around] == piece
        beside = np.unique(labels[around][ndimage.binary_dilation(mine, np.ones((3, 3))) & ~mine])
        if beside.size == 1:
            result[around][mine] = beside[0]
    return result
