"""Partition of an outline into zones."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from thermal.pilot.outline import DEEP_WING, THIN_WING, Mask, exterior_ring, facade_runs, grow, row_runs, run_lengths

Kind = Literal["perimeter", "corridor", "core"]

NARROWEST = {"perimeter": 2.4, "corridor": 1.5, "core": 3.0}  # m, clear width of a zone
SHARE = {"perimeter": 1.0, "corridor": 2.2, "core": 2.6}  # -, usual area of a zone over that of a room at the facade
_SPREAD = 0.3  # -, log standard deviation that every cut gives the shares, so that some rooms stay large


@dataclass(frozen=True, eq=False)
class Region:
    """A connected part of a floor with walls all around it.

    Parameters
    ----------
    kind : {"perimeter", "corridor", "core"}
        What it is used for.
    side : int
        Side that its facade looks to: 0 north, 1 east, 2 south, 3 west of the plan; -1 without its own facade.
    corner : tuple of int
        Row and column of the mask's first cell on the floor.
    mask : numpy.ndarray of bool, shape (n_row, n_col)
        Its cells in its bounding box.
    exposed : numpy.ndarray of bool, shape (n_row, n_col)
        Those of its cells that touch the exterior wall.
    share : float
        Area that it should have [relative to a room at the facade], positive.
    """

    kind: Kind
    side: int
    corner: tuple[int, int]
    mask: Mask
    exposed: Mask
    share: float

    @property
    def cells(self) -> int:
        """Number of cells."""
        return int(self.mask.sum())


def parts(kind: Kind, side: int, cells: Mask, exposed: Mask, share: float) -> list[Region]:
    """Make a region of each connected part of some cells.

    Parameters
    ----------
    kind, side, share
        As of `Region` [-].
    cells, exposed : numpy.ndarray of bool, shape (n_row, n_col)
        Cells on the floor, and the cells of the floor that touch the exterior wall.

    Returns
    -------
    list of Region
        In row-major order; empty without cells.
    """
    labels, _ = ndimage.label(cells)
    regions = []
    for number, box in enumerate(ndimage.find_objects(labels), start=1):
        mask = labels[box] == number
        regions.append(Region(kind, side, (box[0].start, box[1].start), mask, mask & exposed[box], share))
    return regions


def is_habitable(region: Region, cell_size: float, min_zone_area: float) -> bool:
    """Tell whether a region is wide and large enough for a zone, and has the facade that its kind needs.

    Parameters
    ----------
    region : Region
        The region.
    cell_size : float
        Side of a cell [m], positive.
    min_zone_area : float
        Smallest area of a zone [m2], positive.

    Returns
    -------
    bool
        True when it can be a zone.
    """
    if region.cells * cell_size**2 < min_zone_area:
        return False
    narrowest = width_cells(region.kind, cell_size)
    if region.side >= 0 and int(region.exposed.sum()) < narrowest:
        return False
    return int(run_lengths(region.mask).min()) >= narrowest


def width_cells(kind: Kind, cell_size: float) -> int:
    """Clear width that a zone of a kind needs.

    Parameters
    ----------
    kind : {"perimeter", "corridor", "core"}
        What the zone is used for.
    cell_size : float
        Side of a cell [m], positive.

    Returns
    -------
    int
        Width [cells], at least 1.
    """
    return max(1, int(np.ceil(NARROWEST[kind] / cell_size - 1e-9)))


def cut(
    rng: np.random.Generator, region: Region, cell_size: float, min_zone_area: float, most: int, tries: int = 10
) -> list[Region]:
    """Cut a region by one straight wall, one cell thick, where the parts come out best.

    Parameters
    ----------
    rng : numpy.random.Generator
        Source of the variety.
    region : Region
        What to cut.
    cell_size : float
        Side of a cell [m], positive.
    min_zone_area : float
        Smallest area of a part [m2], positive.
    most : int
        Parts at most, at least 2.
    tries : int
        Places to look at.

    Returns
    -------
    list of Region
        The parts; empty when no place is good.
    """
    best: tuple[float, list[Region]] = (-np.inf, [])
    for wall, axis in _walls(rng, region, cell_size, tries):
        labels, _ = ndimage.label(region.mask & ~wall)
        before, behind = (labels[np.roll(wall, step, axis)] for step in (-1, 1))
        if np.any(before == behind):
            continue  # some of it would part nothing
        pieces = parts(region.kind, region.side, region.mask & ~wall, region.exposed, region.share)
        if 2 <= len(pieces) <= most and all(is_habitable(piece, cell_size, min_zone_area) for piece in pieces):
            score = _quality(pieces) + 0.3 * rng.random()
            best = max(best, (score, pieces), key=lambda scored: scored[0])
    return [
        replace(
            piece,
            corner=(piece.corner[0] + region.corner[0], piece.corner[1] + region.corner[1]),
            share=region.share * float(np.exp(rng.normal(0.0, _SPREAD))),
        )
        for piece in best[1]
    ]


def _walls(rng: np.random.Generator, region: Region, cell_size: float, tries: int) -> Iterator[tuple[Mask, int]]:
    """Walls to try: across a row of rooms; anywhere, and first in line with its corners, in other regions."""
    n_row, n_column = region.mask.shape
    margin = width_cells(region.kind, cell_size)
    along = [0, 1] if region.side < 0 else [1 - region.side % 2]  # axis that the wall's position counts on
    places: list[tuple[int, int]] = []
    for axis in along:
        count = (n_row, n_column)[axis]
        middle = range(max(margin, int(0.3 * count)), min(count - margin, int(np.ceil(0.7 * count))))
        turns = np.flatnonzero(np.diff(region.mask.astype(np.int8), axis=axis).any(axis=1 - axis))
        corners = [int(turn) + step for turn in turns for step in (0, 1) if 0 < turn + step < count - 1]
        drawn = rng.permutation(middle)[:tries]
        places += [(axis, place) for place in corners] + [(axis, int(place)) for place in drawn]
    order = rng.permutation(len(places))[: 2 * tries]
    for axis, place in (places[index] for index in order):
        yield from ((wall, axis) for wall in _wall_stretches(region.mask, axis, place))


def _wall_stretches(mask: Mask, axis: int, place: int) -> Iterator[Mask]:
    """Wall along a whole line, and along each of its stretches where there are several; none beside another wall."""
    line = np.zeros_like(mask)
    at = (slice(None), place) if axis else (place, slice(None))
    line[at] = mask[at]
    labels, count = ndimage.label(line)
    beside = np.roll(mask, 1, axis) & np.roll(mask, -1, axis)
    stretches = [stretch for stretch in (labels == number for number in range(1, count + 1)) if beside[stretch].all()]
    if len(stretches) > 1:
        yield np.logical_or.reduce(stretches)
    yield from stretches


def _quality(pieces: list[Region]) -> float:
    """Score parts: compact, not too long, and of like size."""
    areas: npt.NDArray[np.float64] = np.array([piece.cells for piece in pieces], dtype=float)
    compact = np.array([piece.mask.mean() for piece in pieces])
    square = np.array([min(piece.mask.shape) / max(piece.mask.shape) for piece in pieces])
    weight = areas / areas.sum()
    return float(weight @ compact + 0.5 * weight @ square + 0.4 * areas.min() / areas.max())


ROOM_DEPTH = (4.0, 6.0)  # m, from the facade to the wall of the corridor
CORRIDOR_WIDTH = (1.5, 2.5)  # m, clear
_NARROWEST_CORE = 3.5  # m, clear; what is narrower is part of the corridor
_LONGEST_END = 16.0  # m, the end of a wing up to this long has no rooms of its own: the corridor ends there
_TRIES = 4  # ways to lay out a floor before its outline is given up


def partition(
    rng: np.random.Generator, mask: Mask, zones: int, cell_size: float, min_zone_area: float
) -> list[Region] | None:
    """Cut a floor into zones with one-cell walls between them.

    Parameters
    ----------
    rng : numpy.random.Generator
        Source of the variety.
    mask : numpy.ndarray of bool, shape (n_row, n_col)
        Outline with a margin of one cell.
    zones : int
        Zones on this floor, at least 1.
    cell_size : float
        Side of a cell [m], positive.
    min_zone_area : float
        Smallest area of a zone [m2], positive.

    Returns
    -------
    list of Region or None
        As many as `zones`; None when the floor cannot be cut so.
    """
    exposed = ndimage.binary_dilation(exterior_ring(mask)) & mask
    for _ in range(_TRIES):
        regions = _bands(rng, mask, exposed, cell_size)
        habitable = all(is_habitable(region, cell_size, min_zone_area) for region in regions)
        if len(regions) > zones or not habitable or not _walls_are_thin(mask, regions):
            continue
        regions = _cut_to(rng, regions, zones, cell_size, min_zone_area)
        if len(regions) == zones:
            return regions
    for _ in range(_TRIES):  # too small or too few zones for corridors: rooms alone
        regions = _cut_to(rng, parts("core", -1, mask, exposed, SHARE["core"]), zones, cell_size, min_zone_area)
        if len(regions) == zones:
            return regions
    return None


def _cut_to(
    rng: np.random.Generator, regions: list[Region], zones: int, cell_size: float, min_zone_area: float
) -> list[Region]:
    """Cut the region that is largest against its share until there are as many as asked for, or none can be cut."""
    open_regions = list(regions)
    whole: list[Region] = []  # too small to cut
    while open_regions and len(open_regions) + len(whole) < zones:
        region = max(open_regions, key=lambda candidate: candidate.cells / candidate.share)
        open_regions.remove(region)
        most = zones - len(open_regions) - len(whole)
        pieces = cut(rng, region, cell_size, min_zone_area, most)
        if pieces:
            open_regions += pieces
        else:
            whole.append(region)
    return open_regions + whole


def _walls_are_thin(mask: Mask, regions: list[Region]) -> bool:
    """Tell whether no four cells between the regions make a square of wall: a row of rooms was squeezed out there."""
    wall = mask.copy()
    for region in regions:
        (row, column), (n_row, n_column) = region.corner, region.mask.shape
        wall[row : row + n_row, column : column + n_column] &= ~region.mask
    return not (wall[1:, 1:] & wall[:-1, 1:] & wall[1:, :-1] & wall[:-1, :-1]).any()


def _bands(rng: np.random.Generator, mask: Mask, exposed: Mask, cell_size: float) -> list[Region]:
    """Divide a floor into rows of rooms, corridor and core."""
    strips = _strips(rng, mask, cell_size)
    rows = np.zeros_like(mask)
    regions: list[Region] = []
    for index in rng.permutation(len(strips)):  # whoever comes first has the corner
        side, strip = strips[index]
        strip = strip & ~grow(rows)
        rows |= strip
        regions += parts("perimeter", side, strip, exposed, SHARE["perimeter"])
    rest = mask & ~grow(rows)
    width = round(rng.uniform(*CORRIDOR_WIDTH) / cell_size)
    width = max(width, width_cells("corridor", cell_size))
    inner = ndimage.minimum_filter(rest.astype(np.uint8), size=2 * (width + 1) + 1, mode="constant")
    core = ndimage.grey_opening(inner, size=(max(1, round(_NARROWEST_CORE / cell_size)),) * 2, mode="constant") > 0
    corridor = rest & ~grow(core)
    regions += parts("corridor", -1, corridor, exposed, SHARE["corridor"])
    return regions + parts("core", -1, core, exposed, SHARE["core"])


def _strips(rng: np.random.Generator, mask: Mask, cell_size: float) -> list[tuple[int, Mask]]:
    """Rows of rooms along each straight facade: the side it looks to, its cells; at corners they overlap."""
    depths = _depths(rng, mask, cell_size)
    strips = []
    for side in range(4):
        turned = np.rot90(mask, side)
        for row, start, stop, left_inside, right_inside in facade_runs(turned):
            if not (left_inside or right_inside) and _is_end(stop - start, turned, side, cell_size):
                continue
            # At a re-entrant corner the row goes on behind the rooms of the next facade.
            start -= depths[(side + 1) % 4] if left_inside else 0
            stop += depths[(side + 3) % 4] if right_inside else 0
            strip = np.zeros_like(turned)
            strip[row : row + depths[side], start:stop] = True
            strips.append((side, np.rot90(strip & turned, -side)))
    return strips


def _is_end(length: int, turned: Mask, side: int, cell_size: float) -> bool:
    """Tell whether a facade between two outer corners is the narrow end of a wing."""
    depth = int(turned.any(axis=1).sum())
    return length * cell_size <= _LONGEST_END and (length < depth or (length == depth and side % 2 == 1))


def _depths(rng: np.random.Generator, mask: Mask, cell_size: float) -> list[int]:
    """Depth of the rooms on each side [cells], so that a thin wing keeps a corridor of the usual width."""
    depths = rng.uniform(*ROOM_DEPTH, 4)
    for pair, lines in ((slice(0, 4, 2), mask.T), (slice(1, 4, 2), mask)):
        wing = row_runs(lines).min() * cell_size
        if wing < 0.5 * (THIN_WING[1] + DEEP_WING):
            room = wing - 2.0 * cell_size - rng.uniform(*CORRIDOR_WIDTH)
            depths[pair] = np.clip(depths[pair] * room / depths[pair].sum(), *ROOM_DEPTH)
    return [round(depth / cell_size) for depth in depths]
