"""From walls to rooms: the free space falls apart at its necks, and necks as short and narrow as doors are doors.

The distance from the walls is a landscape in which each room is a basin and each door a saddle between two of them
(watershed; Meyer 1994, doi:10.1016/0165-1684(94)90060-4). A saddle is a door when it is narrow enough, when the space
widens again right behind it on both sides, and when on one side at least it ends at a jamb, a wall seen from its end: a
narrow corridor between the doors of two rows of rooms stays in one piece.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from scipy import ndimage
from scipy.sparse.csgraph import connected_components

from thermal._types import BoolArray, Float32Array, FloatArray, Int32Array, IntArray
from thermal.plan.extra import extra
from thermal.plan.survey import PlanSettings

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
        widens = _widens(cut, distance, roots, (a, b), (row, column), float(half[k]), round(reach / pixel))
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


def _widens(
    cut: Int32Array,
    distance: Float32Array,
    roots: Int32Array,
    sides: tuple[int, int],
    place: tuple[int, int],
    half: float,
    reach: int,
) -> bool:
    """Whether the space widens on both sides of a saddle, within `reach` pixels."""
    rows, columns = (slice(max(0, x - reach), x + reach + 1) for x in place)
    around, depth = roots[cut[rows, columns]], distance[rows, columns]
    return all(float(depth[around == side].max(initial=0.0)) >= _WIDENS * half for side in sides)


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
