"""Rooms of a drawing: basins between walls, parted at doors.

The distance from the walls is a landscape in which each room is a basin and each door a saddle between two of them
(watershed; Meyer 1994, doi:10.1016/0165-1684(94)90060-4). A saddle is a door when it is narrow enough, when the space
widens again right behind it on both sides, and when on one side at least it ends at a jamb, a wall seen from its end: a
narrow corridor between the doors of two rows of rooms stays in one piece.
"""

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp
from scipy import ndimage
from scipy.sparse.csgraph import connected_components

from thermal._types import BoolArray, Float32Array, FloatArray, Int32Array, IntArray
from thermal.errors import PlanError
from thermal.plan.drawing import Drawing, checked_scale
from thermal.plan.guard import extra
from thermal.plan.ink import Ink, ink_of, walls_of
from thermal.plan.survey import OUTSIDE_LABEL, WALL_LABEL, Door, FloorSurvey, PlanSettings, rooms_of
from thermal.plan.windows import see_windows

_PEAK_REACH = 0.15  # m: lower peaks of the distance within this are part of a higher one's basin
_WIDENS = 1.12  # -, of a door's width, reached close behind it: a corridor is at least that much wider than its doors
_STRAIGHT = 25.0  # deg: a neck this close to upright is taken as upright
_DEPTH = 2.0  # px: how deep in the wall a jamb is measured


@dataclass(frozen=True, eq=False)
class Basins:
    """Free space in pieces.

    Parameters
    ----------
    pieces : ndarray of int, shape (n_row, n_col)
        0 wall, else the piece; the one at the edge of the drawing is the outside.
    outside : int
        That piece.
    saddles : list of tuple
        Two pieces, width [m], row and column [px] of each gap between them.
    """

    pieces: Int32Array
    outside: int
    saddles: list[tuple[int, int, float, int, int]]


def find_basins(walls: BoolArray, pixel: float, settings: PlanSettings) -> Basins:
    """Cut free space into rooms at the doors.

    Parameters
    ----------
    walls : ndarray of bool, shape (n_row, n_col)
        Solid walls with gaps; all free at the edge.
    pixel : float
        Side of an element [m].
    settings : PlanSettings
        How wide doors and how thick walls are.

    Returns
    -------
    Basins
        Rooms, the outside, and the gaps that were closed.
    """
    exact, nearest = ndimage.distance_transform_edt(~walls, return_indices=True)
    distance = (exact * pixel).astype(np.float32)
    # Nothing depends on how wide a wide space is, and a flat landscape has fewer peaks.
    np.minimum(distance, np.float32(0.75 * settings.widest_door), out=distance)
    size = 2 * max(1, round(_PEAK_REACH / pixel)) + 1
    peaks = (ndimage.maximum_filter(distance, size) == distance) & ~walls
    markers, _ = ndimage.label(peaks, np.ones((3, 3)))
    watershed = extra("skimage.segmentation").watershed
    cut: Int32Array = watershed(-distance, markers, mask=~walls).astype(np.int32)
    first, second, half, place = _interfaces(cut, distance)
    roots = _join_wide(int(cut.max()), first, second, 2.0 * half > settings.widest_door)
    outside = int(roots[cut[0, 0]])
    narrow = np.flatnonzero(2.0 * half <= settings.widest_door)
    kept, closed = [], np.zeros_like(walls)
    for k in narrow[np.argsort(-half[narrow], kind="stable")]:
        a, b = int(roots[first[k]]), int(roots[second[k]])
        if a == b:
            continue
        row, column = divmod(int(place[k]), cut.shape[1])
        reach = settings.thickest_wall / 2.0 + float(half[k]) + 2.0 * pixel
        near = tuple(slice(max(0, x - round(reach / pixel)), x + round(reach / pixel) + 1) for x in (row, column))
        around, depth = roots[cut[near]], distance[near]
        widens = all(float(depth[around == side].max(initial=0.0)) >= _WIDENS * float(half[k]) for side in (a, b))
        along = _jamb(walls, nearest, (row, column), settings.thickest_wall / pixel + 2.0) if widens else None
        if along is not None:
            closed |= _between_jambs(walls, (row, column), along, 2.0 * float(half[k]) / pixel, reach / pixel)
            kept.append((int(first[k]), int(second[k]), 2.0 * float(half[k]), row, column))
        else:
            roots[roots == b] = a
            outside = a if outside == b else outside
    saddles = [(int(roots[a]), int(roots[b]), *rest) for a, b, *rest in kept if roots[a] != roots[b]]
    joined: Int32Array = roots[cut].astype(np.int32)
    joined[closed] = 0
    return Basins(joined, outside, saddles)


def _interfaces(cut: Int32Array, distance: Float32Array) -> tuple[Int32Array, Int32Array, Float32Array, IntArray]:
    """Pairs of pieces that touch, the largest distance from the walls where they do [m], and the place of that."""
    index = np.arange(cut.size).reshape(cut.shape)
    sides = []
    for here, there in ((np.s_[:, :-1], np.s_[:, 1:]), (np.s_[:-1], np.s_[1:])):
        touching = (cut[here] != cut[there]) & (cut[here] > 0) & (cut[there] > 0)
        a, b = cut[here][touching], cut[there][touching]
        depth = np.minimum(distance[here][touching], distance[there][touching])
        sides.append((np.minimum(a, b), np.maximum(a, b), depth, index[here][touching]))
    low, high, depth, place = (np.concatenate(column) for column in zip(*sides, strict=True))
    order = np.lexsort((-depth, high, low))
    low, high, depth, place = low[order], high[order], depth[order], place[order]
    new = np.ones(low.size, dtype=bool)
    new[1:] = (low[1:] != low[:-1]) | (high[1:] != high[:-1])
    return low[new], high[new], depth[new], place[new]


def _join_wide(count: int, first: Int32Array, second: Int32Array, wide: BoolArray) -> Int32Array:
    """Give pieces that are joined by more than a door one number; returns it by piece."""
    ones = np.ones(int(wide.sum()))
    graph = sp.coo_matrix((ones, (first[wide], second[wide])), shape=(count + 1, count + 1))
    parts = connected_components(graph, directed=False)[1]
    parts = np.where(parts == parts[0], 0, parts + 1)  # 0 is wall, and joined to nothing
    return np.asarray(parts, dtype=np.int32)


def _jamb(walls: BoolArray, nearest: Int32Array, place: tuple[int, int], thickest: float) -> FloatArray | None:
    """Direction of a neck that ends, on one side at least, at a wall no longer than thick along the way through it."""
    here: FloatArray = np.array(place, dtype=float)
    direction: FloatArray
    ends = [nearest[:, place[0], place[1]].astype(float)]
    across = here - ends[0]
    beyond = np.rint(here + 0.5 * across).astype(int)
    if (beyond >= 0).all() and (beyond < walls.shape).all():
        ends.append(nearest[:, beyond[0], beyond[1]].astype(float))
    for end in ends:
        direction = end - here
        direction /= max(float(np.hypot(*direction)), 1e-9)
        axis = np.rint(direction)
        if abs(axis).sum() == 1.0 and float(direction @ axis) >= np.cos(np.radians(_STRAIGHT)):
            direction = axis
        through = np.array([-direction[1], direction[0]])
        start = end + _DEPTH * direction
        if _run(walls, start, through, thickest) + _run(walls, start, -through, thickest) <= thickest:
            return direction
    return None


def _between_jambs(
    walls: BoolArray, place: tuple[int, int], along: FloatArray, width: float, reach: float
) -> BoolArray:
    """Mark what lies between the two jambs of a door, so that its floor counts to the wall as elsewhere."""
    marked = np.zeros_like(walls)
    half = int(np.ceil(max(width, reach))) + 2
    rows, columns = (slice(max(0, x - half), x + half + 1) for x in place)
    points = np.argwhere(~walls[rows, columns]) + np.array([rows.start, columns.start])
    most = width + 3.0
    way = np.zeros(len(points))
    for side in (along, -along):
        steps = np.arange(1, int(most) + 1)
        there = np.rint(points[:, None, :] + steps[:, None] * side).astype(int)
        there = np.clip(there, 0, np.array(walls.shape) - 1)
        hit = walls[there[..., 0], there[..., 1]]
        way += np.where(hit.any(axis=1), steps[hit.argmax(axis=1)], np.inf)
    inside = points[way <= most]
    marked[inside[:, 0], inside[:, 1]] = True
    return marked


def _run(walls: BoolArray, start: FloatArray, step: FloatArray, most: float) -> float:
    """Length of wall from a point in a direction [px]; more than `most` is not told apart."""
    points = np.rint(start + np.arange(int(most) + 2)[:, None] * step).astype(int)
    points = np.clip(points, 0, np.array(walls.shape) - 1)
    free = ~walls[points[:, 0], points[:, 1]]
    return float(free.argmax()) if free.any() else most + 1.0


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
    settings = settings or PlanSettings()
    survey = survey_ink(ink, drawing.source, settings)
    windows, said = see_windows(survey, settings.thickest_wall)
    return replace(survey, windows=windows, remarks=(*survey.remarks, said))


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
            rooms, drawn = rooms_of(labels, ink.pixel), np.pad(ink.mask, margin)
            return FloorSurvey(source, labels, ink.pixel, rooms, doors, ink.turned, shift, tuple(remarks), drawn)
    advice = "set widest_door to the widest gap in the walls, or crop to one floor's plan"
    raise PlanError(source, "walls that enclose rooms, but for doors", "none", advice)


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
        before, after = (np.logical_or.accumulate(w, axis=axis) for w in (walled, np.flip(walled, axis)))
        around &= before & np.flip(after, axis)
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
    depth = np.zeros(count + 1)
    np.maximum.at(depth, pieces.ravel(), ndimage.distance_transform_edt(pieces > 0).ravel())  # no sort
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
