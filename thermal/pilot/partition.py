"""One floor of an office: rows of rooms along the facades, a corridor behind them, a core inside it, cut into zones."""

from __future__ import annotations

import numpy as np
from scipy import ndimage

from thermal.pilot.outline import DEEP_WING, THIN_WING, Mask, exterior_ring, facade_runs, grow, row_runs
from thermal.pilot.regions import SHARE, Region, cut, is_habitable, parts, width_cells

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
    exposed = _beside(exterior_ring(mask)) & mask
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


def _beside(cells: Mask) -> Mask:
    """Cells with one of these as a neighbour across a side."""
    beside = np.zeros_like(cells)
    beside[1:] |= cells[:-1]
    beside[:-1] |= cells[1:]
    beside[:, 1:] |= cells[:, :-1]
    beside[:, :-1] |= cells[:, 1:]
    return beside


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
