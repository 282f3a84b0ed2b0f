"""Assembly of floors: alignment one above the other, and the grid that keeps their areas."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.signal import fftconvolve

from thermal._types import FloatArray
from thermal.case.building import FloorPlan, FloorPlans
from thermal.case.plan import check_plan, facade_areas, zone_floor_areas
from thermal.errors import LostRoomError, PlanError, some_of
from thermal.plan.cells import ZonedFloor, distinct_names, draw_cells
from thermal.plan.guard import checked_number
from thermal.plan.windows import clipped_glazing

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
        raise PlanError("anchor", "one for each floor, or for none", f"none for {', '.join(missing)}")
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


#: Sides of cells that are tried, largest first [m].
CELL_SIZES = (0.5, 0.4, 0.25, 0.2, 0.1, 0.05)

#: Error of a zone's area that is let be [-].
AREA_TOLERANCE = 0.02

#: Corners of the grid that are tried, in quarters of a cell: the halves first.
_CORNERS = sorted(np.ndindex(4, 4), key=lambda at: at[0] % 2 + at[1] % 2 > 0)
_FIRST = 4  # of them, by which a size is judged

#: A size whose first corners miss the tolerance by more than this factor is left [-]. On a small pilot drawn, with
#: scales 1 % and 1.7 % beside the true one, the best of all corners was at most 1.2 times as good as that of the first.
_HOPELESS = 1.5

#: Of cells as fine as this the first corners are enough, where they meet the tolerance [m]: the others are 25 mm away.
_FINE = 0.1
_MOST_CELLS = 4_000_000  # of all floors together

Progress = Callable[[str, int, int], None]


@dataclass(frozen=True, eq=False)
class PlanImport:
    """Plans of a building, and the drawings that they were made from.

    Parameters
    ----------
    plans : FloorPlans
        For a case.
    floors : tuple of ZonedFloor
        Drawings with their zones, lowest first, above each other.
    area_errors : mapping
        Area of the zone in the plans against that on its drawing, minus one [-], by zone.
    corner : tuple of float
        Rightwards and downwards, from the common origin of the drawings to the plans' first corner [m].
    """

    plans: FloorPlans
    floors: tuple[ZonedFloor, ...]
    area_errors: Mapping[str, float]
    corner: tuple[float, float] = (0.0, 0.0)

    @property
    def largest_error(self) -> float:
        """Largest error of a zone's area [-]."""
        return max(abs(error) for error in self.area_errors.values())

    @property
    def remarks(self) -> tuple[str, ...]:
        """What a look at the pictures should confirm, floor by floor."""
        found = [f"floor {floor.name!r}: {remark}" for floor in self.floors for remark in floor.survey.remarks]
        angles = [floor.survey.turned for floor in self.floors]
        if max(angles) - min(angles) > 20.0:
            listed = ", ".join(f"{floor.name} {floor.survey.turned:.1f} deg" for floor in self.floors)
            found.append(f"drawings were turned upright by angles far apart ({listed}): is 'up' the same on all?")
        coarse = [zone for zone, error in self.area_errors.items() if abs(error) > AREA_TOLERANCE]
        if coarse:
            found.append(
                f"cells of {self.plans.cell_size:g} m miss the area of {len(coarse)} zones by over "
                f"{AREA_TOLERANCE:.0%} ({some_of(coarse, most=5)}): choose smaller cells"
            )
        return tuple(found)


def assemble_plans(
    floors: Sequence[ZonedFloor],
    *,
    cell_size: float | None = None,
    anchors: Mapping[str, tuple[float, float]] | None = None,
    progress: Progress | None = None,
) -> PlanImport:
    """Put floors above each other and draw them as plans of tokens.

    Parameters
    ----------
    floors : sequence of ZonedFloor
        Lowest first.
    cell_size : float, optional
        Side of a cell [m], 0.02 to 5. Default: the largest of `CELL_SIZES` that keeps the area of every zone within
        2 % of its drawing, and otherwise the one with the smallest error.
    anchors : mapping, optional
        The same spot of the building on each floor's drawing [px], by floor; default: outlines are matched.
    progress : callable, optional
        Told stage, steps done and all steps.

    Returns
    -------
    PlanImport
        Plans of the building.

    Raises
    ------
    LostRoomError
        A room has no cell of its own at this size.
    PlanError
        Two floors, or two zones, have the same name.
    PlanError
        `cell_size` is out of its range or makes too many cells, or some floors only have an anchor.

    Notes
    -----
    The grid's corner is chosen too, among 16, for the smallest largest error. Where the size is chosen, four of them
    tell whether the other twelve are tried: not of a size that misses by half as much again, nor of cells of 0.1 m
    that fit.
    """
    named = distinct_names(floors)
    _check_names(named)
    placed = align_floors(named, anchors)
    sizes = CELL_SIZES if cell_size is None else (checked_number(cell_size, "cell_size", 0.02, 5.0, "m"),)
    best: tuple[float, PlanImport] | None = None
    lost: LostRoomError | None = None
    for number, size in enumerate(sizes):
        if progress is not None:
            progress(f"cells of {size:g} m", number, len(sizes))
        cells = sum(f.zones.size * f.survey.pixel**2 for f in placed) / size**2
        if cells > _MOST_CELLS:
            if cell_size is None:
                break
            found = f"{size:g} m, which makes {cells / 1e6:.0f} million"
            raise PlanError("cell_size", f"at most {_MOST_CELLS / 1e6:.0f} million cells", found)
        least = np.inf  # of this size
        for tried, phase in enumerate(_CORNERS):
            if cell_size is None and tried == _FIRST:
                enough = size <= _FINE and least <= AREA_TOLERANCE
                if enough or least > _HOPELESS * AREA_TOLERANCE:
                    break
            try:
                drawn, corner = draw_cells(placed, size, (phase[0] / 4, phase[1] / 4))
            except LostRoomError as error:
                lost = error
                break
            errors = _area_errors(placed, drawn, size)
            worst = max(map(abs, errors.values()))
            least = min(least, worst)
            if best is None or worst < best[0]:
                best = (worst, PlanImport(FloorPlans(size, drawn), placed, errors, corner))
        if best is not None and best[0] <= AREA_TOLERANCE:
            break
    if best is None:
        raise lost or LostRoomError("no cell size fits")
    for plan in best[1].plans.floors:
        check_plan(plan.tokens, f"floor {plan.name!r}")
    shown = {zone: sides for floor in placed for zone, sides in floor.glazing.items()}
    glazing = clipped_glazing(shown, facade_areas(best[1].plans)) if shown else {}
    return replace(best[1], plans=replace(best[1].plans, glazing=glazing))


def _area_errors(floors: Sequence[ZonedFloor], plans: Sequence[FloorPlan], cell_size: float) -> dict[str, float]:
    found = zone_floor_areas(FloorPlans(cell_size, tuple(plans)))
    return {zone: found.get(zone, 0.0) / wanted - 1.0 for floor in floors for zone, wanted in floor.areas.items()}


def _check_names(floors: Sequence[ZonedFloor]) -> None:
    PlanError.unless(floors, "floors", "at least one", "none")
    named = {"floor": [floor.name for floor in floors], "zone": [zone for floor in floors for zone in floor.names]}
    for what, names in named.items():
        for name in names:
            PlanError.unless(names.count(name) <= 1, f"{what} {name!r}", "a name of its own", "two of that name")
