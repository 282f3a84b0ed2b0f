"""Windows that a vector drawing shows: which rooms they belong to, on which facade, and how wide they are."""

import math
from collections.abc import Mapping, Sequence

import numpy as np

from thermal._types import FloatArray
from thermal.case.plan import FACADE_STEPS
from thermal.plan.guard import extra
from thermal.plan.survey import OUTSIDE_LABEL, WALL_LABEL, FloorSurvey, Window

#: Height that windows are taken to have [m]: from a sill at 0.9 m to a lintel at 2.4 m; plans do not show it.
WINDOW_HEIGHT = 1.5

_TOUCH = 0.06  # m: lines nearer to each other belong to one window: its panes, its frame, its sill
_STEP = 0.1  # m along a window at which both of its sides are looked at
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
        One a window and room behind it; what has rooms on both of its sides is none.
    """
    shapely = extra("shapely")
    reach = _TOUCH / 2.0 / survey.pixel
    drawn = shapely.unary_union([shapely.LineString(line).buffer(reach) for line in lines if len(line) > 1])
    found: list[Window] = []
    for part in getattr(drawn, "geoms", [drawn]):
        if not part.is_empty:
            left, top, right, bottom = part.bounds
            found += _seen((left + reach, top + reach, right - reach, bottom - reach), survey, thickest_wall)
    return tuple(found)


def _seen(box: tuple[float, float, float, float], survey: FloorSurvey, thickest_wall: float) -> list[Window]:
    """Look through a window from place to place along it."""
    left, top, right, bottom = box
    lies = right - left >= bottom - top
    length = max(right - left, bottom - top) * survey.pixel
    if length < _NARROWEST:
        return []
    count = max(1, round(length / _STEP))
    along = (np.arange(count) + 0.5) / count
    middle = ((left + right) / 2.0, (top + bottom) / 2.0)
    facades = ("north", "south") if lies else ("west", "east")
    seen: dict[tuple[int, str], tuple[int, tuple[float, float]]] = {}
    for share in along:
        place = (left + share * (right - left), middle[1]) if lies else (middle[0], top + share * (bottom - top))
        sides = [_beside(place, FACADE_STEPS[facade], survey, thickest_wall) for facade in facades]
        for facade, (outer, _), (inner, point) in zip(facades, sides, sides[::-1], strict=True):
            if outer == OUTSIDE_LABEL and inner > 0:
                times, first = seen.get((inner, facade), (0, point))
                seen[inner, facade] = (times + 1, first)
    return [Window(point, facade, times * length / count) for (_, facade), (times, point) in seen.items()]


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
