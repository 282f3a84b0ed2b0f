"""Windows that a vector drawing shows: which rooms they belong to, on which facade, and how wide they are."""

import math
from collections.abc import Iterator, Mapping, Sequence

from thermal._types import FloatArray
from thermal.case.plan import FACADE_STEPS
from thermal.plan.guard import extra
from thermal.plan.survey import OUTSIDE_LABEL, WALL_LABEL, FloorSurvey, Window

#: Height that windows are taken to have [m]: from a sill at 0.9 m to a lintel at 2.4 m; plans do not show it.
WINDOW_HEIGHT = 1.5

_TOUCH = 0.06  # m: lines nearer to each other belong to one window: its panes, its frame, its sill
_STEP = 0.05  # m along a window at which both of its sides are looked at
_NARROWEST = 0.3  # m: shorter marks are frames and posts
_BEYOND = 0.3  # m beyond the thickest wall at which a room, and the outside, are looked for


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
