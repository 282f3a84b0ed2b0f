"""Floors brought above each other: by a point that they share, or by their outlines."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from scipy.signal import fftconvolve

from thermal._types import FloatArray
from thermal.errors import PlanError, describe
from thermal.plan.cells import ZonedFloor

_GRID = 0.1  # m, on which outlines are compared
_LEAST_OVERLAP = 0.6  # -, of the smaller floor; below it outlines say nothing


def align_floors(
    floors: Sequence[ZonedFloor], anchors: Mapping[str, tuple[float, float]] | None = None
) -> tuple[ZonedFloor, ...]:
    """Bring floors above each other.

    Parameters
    ----------
    floors : sequence of ZonedFloor
        Lowest first.
    anchors : mapping, optional
        One and the same spot of the building, such as the corner of a lift shaft, as a point of each floor's drawing
        [px], by floor. Without it the floors are moved until their outlines overlap most.

    Returns
    -------
    tuple of ZonedFloor
        With their offsets from the common origin, the lowest floor's corner.

    Raises
    ------
    PlanError
        Some floors have an anchor and others have none.
    """
    anchors = anchors or {}
    missing = [floor.name for floor in floors if floor.name not in anchors]
    if anchors and missing:
        found = f"none for {', '.join(missing)}"
        raise PlanError(describe("anchor", "one for each floor, or for none", found))
    moved = [replace(floors[0], offset=(0.0, 0.0))]
    for floor in floors[1:]:
        if anchors:
            moved.append(replace(floor, offset=_by_anchor(floors[0], floor, anchors)))
            continue
        offset, overlap = _by_outline(floors[0], floor)
        survey = floor.survey
        if overlap < _LEAST_OVERLAP:
            remark = f"its outline covers {overlap:.0%} of the lowest floor's at best; give an anchor for each floor"
            survey = replace(survey, remarks=(*survey.remarks, remark))
        moved.append(replace(floor, offset=offset, survey=survey))
    return tuple(moved)


def _by_anchor(base: ZonedFloor, floor: ZonedFloor, anchors: Mapping[str, tuple[float, float]]) -> tuple[float, float]:
    """Offset at which the anchors fall together."""
    first, second = (
        np.array(f.survey.place(anchors[f.name])) * f.survey.pixel + f.survey.pixel / 2.0 for f in (base, floor)
    )
    return float(first[0] - second[0]), float(first[1] - second[1])


def _by_outline(base: ZonedFloor, floor: ZonedFloor) -> tuple[tuple[float, float], float]:
    """Offset at which the outlines overlap most, and the share of the smaller that then overlaps."""
    first, second = (_outline(f) for f in (base, floor))
    match = fftconvolve(first, second[::-1, ::-1])
    row, column = np.unravel_index(int(match.argmax()), match.shape)
    # The peak of a plateau: a smaller floor fits in many places, and the middle of them is the fairest.
    level = match >= match.max() - 0.5
    parts = np.argwhere(level)
    near = parts[np.abs(parts - [row, column]).max(axis=1) <= 0.5 * max(match.shape)]
    row, column = near.mean(axis=0)
    shift = (column - (second.shape[1] - 1)) * _GRID, (row - (second.shape[0] - 1)) * _GRID
    return (float(shift[0]), float(shift[1])), float(match.max() / min(first.sum(), second.sum()))


def _outline(floor: ZonedFloor) -> FloatArray:
    """Mark what is inside the exterior wall, on a grid of its own."""
    pixel = floor.survey.pixel
    index = []
    for count in floor.zones.shape:
        places = (np.arange(int(np.ceil(count * pixel / _GRID - 1e-6))) + 0.5) * _GRID / pixel
        index.append(np.minimum(np.floor(places + 1e-6).astype(int), count - 1))
    inside = floor.zones[np.ix_(*index)] > 0
    return np.asarray(inside, dtype=float)
