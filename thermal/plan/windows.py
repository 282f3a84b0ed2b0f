"""Windows that a drawing shows: which rooms they belong to, on which facade, and how wide they are."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from thermal._types import BoolArray, FloatArray, IntArray
from thermal.case.plan import FACADE_STEPS
from thermal.plan.guard import extra
from thermal.plan.survey import OUTSIDE_LABEL, WALL_LABEL, FloorSurvey, Window

#: Height that windows are taken to have [m]: from a sill at 0.9 m to a lintel at 2.4 m; plans do not show it.
WINDOW_HEIGHT = 1.5

_TOUCH = 0.06  # m: lines nearer to each other belong to one window: its panes, its frame, its sill
_STEP = 0.05  # m along a window at which both of its sides are looked at
_NARROWEST = 0.3  # m: shorter marks are frames and posts
_BEYOND = 0.3  # m beyond the thickest wall at which a room, and the outside, are looked for

_MULLION = 0.12  # m: wider posts part two windows
_LINE = 0.2  # m: shorter strokes along a wall are its hatching
_FULL, _HOLLOW = 0.8, 0.6  # -, of a wall's thickness that is ink: above the one it is solid, below the other hollow
_USUAL = 0.25  # -, of all walls of a drawing: a way to draw them that fewer have is not the drawing's
_SEEN_OUTSIDE = 0.1  # -, of the exterior walls that must be drawn like that too, so that windows differ from them

#: Remarks where windows cannot be told from wall, seem to be none, or want a look; and on a vector drawing.
UNTOLD = "how the exterior wall is drawn does not tell windows from wall: give their share of the facades"
NONE_SEEN = "no window is seen in the exterior walls: give their share of the facades"
LOOK = "windows are gaps in the wall with thin lines along them; a door with a sill looks the same: compare"
NOT_CALLED = "no layer and no block is called a window: give their share of the facades"


def find_windows(lines: Sequence[FloatArray], survey: FloorSurvey, thickest_wall: float) -> tuple[Window, ...]:
    """Find the windows of a drawing.

    Parameters
    ----------
    lines : sequence of ndarray, shape (n_point, 2)
        What is drawn of windows: column and row [px of the survey].
    survey : FloorSurvey
        The floor.
    thickest_wall : float
        As in `PlanSettings` [m].

    Returns
    -------
    tuple of Window
        One a room and facade, as wide as all of its windows there together; what has rooms on both sides is none.
    """
    shapely = extra("shapely")
    reach = _TOUCH / 2.0 / survey.pixel
    drawn = shapely.unary_union([shapely.LineString(line).buffer(reach) for line in lines if len(line) > 1])
    covered: dict[tuple[int, str], set[int]] = {}  # steps along the facade: panes and sills lie over each other
    rooms: dict[int, tuple[float, float]] = {}
    for part in getattr(drawn, "geoms", [drawn]):
        if not part.is_empty:
            left, top, right, bottom = part.bounds
            box = (left + reach, top + reach, right - reach, bottom - reach)
            for step, facade, room, point in _seen(box, survey, thickest_wall):
                covered.setdefault((room, facade), set()).add(step)
                rooms.setdefault(room, point)
    return tuple(Window(rooms[room], facade, len(steps) * _STEP) for (room, facade), steps in covered.items())


def _seen(
    box: tuple[float, float, float, float], survey: FloorSurvey, thickest_wall: float
) -> Iterator[tuple[int, str, int, tuple[float, float]]]:
    """Look through a window from step to step along it: step, facade, room behind it and a point there."""
    left, top, right, bottom = box
    lies, pixel = right - left >= bottom - top, survey.pixel
    first, last = (left, right) if lies else (top, bottom)
    if (last - first) * pixel < _NARROWEST:
        return
    across = (top + bottom) / 2.0 if lies else (left + right) / 2.0
    facades = ("north", "south") if lies else ("west", "east")
    for step in range(round(first * pixel / _STEP), round(last * pixel / _STEP)):
        along = (step + 0.5) * _STEP / pixel
        place = (along, across) if lies else (across, along)
        sides = [_beside(place, FACADE_STEPS[facade], survey, thickest_wall) for facade in facades]
        for facade, (outer, _), (inner, point) in zip(facades, sides, sides[::-1], strict=True):
            if outer == OUTSIDE_LABEL and inner > 0:
                yield step, facade, inner, point


def _beside(
    place: tuple[float, float], step: tuple[int, int], survey: FloorSurvey, thickest_wall: float
) -> tuple[int, tuple[float, float]]:
    """Label of what is not wall beyond a place in a wall, and where; wall where there is nothing else in reach."""
    row, column, point = round(place[1]), round(place[0]), place
    for _ in range(math.ceil((thickest_wall + _BEYOND) / survey.pixel)):
        row, column = row + step[0], column + step[1]
        if not (0 <= row < survey.labels.shape[0] and 0 <= column < survey.labels.shape[1]):
            return OUTSIDE_LABEL, point
        label, point = int(survey.labels[row, column]), (float(column), float(row))
        if label != WALL_LABEL:
            return label, point
    return WALL_LABEL, point


def see_windows(survey: FloorSurvey, thickest_wall: float) -> tuple[tuple[Window, ...], str]:
    """Find the windows of a picture: where lines run along an exterior wall that is drawn in another way elsewhere.

    Walls that are solid have windows where they are hollow between two lines or more; walls that are two lines, hatched
    or not, have them where there are further lines between the two.

    Parameters
    ----------
    survey : FloorSurvey
        The floor, with its ink.
    thickest_wall : float
        As in `PlanSettings` [m].

    Returns
    -------
    tuple
        Windows, one a room and facade, and what a person is to know of them: what to compare, that there are none, or
        that they cannot be told from wall.
    """
    if survey.ink is None:
        return (), UNTOLD
    views = {facade: _view(survey, turns, thickest_wall) for turns, facade in enumerate(_TURNED)}
    share, strokes, outer = (
        np.concatenate([getattr(view, key) for view in views.values()]) for key in ("share", "strokes", "outer")
    )
    if not outer.any():
        return (), UNTOLD
    solid, lined = share >= _FULL, (strokes == 2) & (share < _HOLLOW)
    usual = next((w for w in (solid, lined) if w.mean() >= _USUAL and w[outer].mean() >= _SEEN_OUTSIDE), None)
    if usual is None:
        return (), UNTOLD
    least = 2 if usual is solid else 3
    found = []
    for facade, view in views.items():
        glass = view.outer & (view.share < _HOLLOW) & (view.strokes >= least)
        for room in np.unique(view.room[glass]):
            if width := _width(view.along[glass & (view.room == room)], survey.pixel):
                found.append(Window(survey.rooms[room - 1].centre, facade, width))
    return tuple(found), LOOK if found else NONE_SEEN


#: Facades in the order in which quarter turns counterclockwise bring them to the top.
_TURNED = ("north", "east", "south", "west")


@dataclass(frozen=True, eq=False)
class _View:
    """Walls with a room below them, crossed downwards once a column of a plan that was turned.

    Parameters
    ----------
    along : ndarray of int, shape (n_crossing,)
        Column.
    room : ndarray of int, shape (n_crossing,)
        The room below.
    outer : ndarray of bool, shape (n_crossing,)
        Whether the outside is above.
    share, strokes : ndarray, shape (n_crossing,)
        Share of the thickness that is ink [-], and number of strokes of it.
    """

    along: IntArray
    room: IntArray
    outer: BoolArray
    share: FloatArray
    strokes: IntArray


def _view(survey: FloorSurvey, turns: int, thickest: float) -> _View:
    """Cross the walls of a plan that is turned counterclockwise by quarters; doors are left out."""
    labels = np.rot90(np.where(_at_doors(survey), _DOOR, survey.labels), turns)
    n_row = labels.shape[0]
    flat = labels.T.ravel()  # column after column: outside at both ends of each
    ink = np.zeros(flat.size + 1, dtype=np.int64)
    drawn = _along(np.rot90(np.asarray(survey.ink), turns), survey.pixel).T.ravel()
    wall = np.concatenate(([False], flat == WALL_LABEL, [False]))
    edges = np.flatnonzero(wall[1:] != wall[:-1])
    first, end = edges[::2], edges[1::2]
    kept = (first > 0) & (end < flat.size) & (end - first <= (thickest + _TOUCH) / survey.pixel)
    first, end = first[kept], end[kept]
    kept = flat[end] > 0
    first, end = first[kept], end[kept]
    np.cumsum(drawn, out=ink[1:])
    begun = np.concatenate(([0], np.cumsum(np.diff(drawn.astype(np.int8), prepend=0) == 1)))
    strokes = begun[end] - begun[first] + (drawn[first] & drawn[first - 1])
    return _View(
        first // n_row, flat[end], flat[first - 1] == OUTSIDE_LABEL, (ink[end] - ink[first]) / (end - first), strokes
    )


def _along(ink: BoolArray, pixel: float) -> BoolArray:
    """Keep what runs across the plan: faces and panes, no hatching; a line may step up or down by a pixel."""
    thick = ndimage.binary_dilation(ink, np.ones((3, 1)))
    runs: BoolArray = ndimage.binary_opening(thick, np.ones((1, max(1, round(_LINE / pixel)))))
    return runs & ink


_DOOR = -2  # label: neither wall nor room


def _at_doors(survey: FloorSurvey) -> BoolArray:
    """Mark walls at closed gaps, and their jambs."""
    marked = np.zeros(survey.labels.shape, dtype=bool)
    for door in survey.doors:
        reach = math.ceil((door.width / 2.0 + _NARROWEST) / survey.pixel)
        rows, columns = (slice(max(0, round(x) - reach), round(x) + reach + 1) for x in door.centre[::-1])
        marked[rows, columns] = survey.labels[rows, columns] == WALL_LABEL
    return marked


def _width(along: IntArray, pixel: float) -> float:
    """Width of windows that cover some columns [m]; posts are glass, what is too narrow is none."""
    columns = np.unique(along)
    parted = np.flatnonzero(np.diff(columns) * pixel > _MULLION)
    starts, ends = columns[np.r_[0, parted + 1]], columns[np.r_[parted, columns.size - 1]]
    widths = (ends - starts + 1) * pixel
    return float(widths[widths >= _NARROWEST].sum())


def clipped_glazing(
    drawn: Mapping[str, Mapping[str, float]], facades: Mapping[str, Mapping[str, float]]
) -> dict[str, dict[str, float]]:
    """Take glazed areas down to what the facades of a plan of cells have room for.

    Parameters
    ----------
    drawn, facades : mapping
        Area of glass, and of facade, by zone and facade [m2].

    Returns
    -------
    dict
        Area of glass by zone and facade [m2]; without those that are empty.
    """
    found: dict[str, dict[str, float]] = {}
    for zone, sides in drawn.items():
        kept = {side: round(min(area, facades.get(zone, {}).get(side, 0.0)), 2) for side, area in sides.items()}
        if glass := {side: area for side, area in kept.items() if area > 0.0}:
            found[zone] = glass
    return found
