"""Floor plans of tokens: reading, what a plan must keep to, and the areas and volumes of its zones."""

import csv
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from thermal.case.building import EXTERIOR_WALL, INTERIOR_WALL, OUTSIDE, PLAN_TOKENS, Building, FloorPlan, FloorPlans
from thermal.errors import CaseError


def read_plan(path: Path) -> NDArray[np.str_]:
    """Read a plan of tokens from CSV.

    Parameters
    ----------
    path
        CSV file, UTF-8; blanks around a token and blank lines at the end do not count.

    Returns
    -------
    ndarray of str
        Shape (n_row, n_col).

    Raises
    ------
    CaseError
        It is no UTF-8 text or no CSV.
    CaseError
        Its rows differ in length.
    CaseError
        A cell is blank.
    CaseError
        It has no row.
    """
    try:
        with path.open(encoding="utf-8-sig", newline="") as stream:
            rows = [[token.strip() for token in row] for row in csv.reader(stream, strict=True)]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise CaseError(path.name, "a CSV of tokens in UTF-8", f"{error}") from error
    while rows and not any(rows[-1]):
        rows.pop()
    CaseError.unless(rows, path.name, "rows of tokens", "no row")
    for number, row in enumerate(rows, start=1):
        if len(row) != len(rows[0]):
            raise CaseError(f"{path.name}: row {number}", f"{len(rows[0])} cells as in row 1", f"{len(row)} cells")
        if "" in row:
            where = f"{path.name}: row {number}, column {row.index('') + 1}"
            raise CaseError(where, "'.', '#', '+' or a zone", "a blank", "write '.' for outside")
    return np.array(rows, dtype=np.str_)


def check_plan(tokens: NDArray[np.str_], where: str) -> None:
    """Refuse a plan that does not bound each of its zones.

    Parameters
    ----------
    tokens
        Shape (n_row, n_col).
    where
        File or floor, for the message.

    Raises
    ------
    CaseError
        No cell is a zone.
    CaseError
        A zone's cell has the outside, or the edge of the plan, beside it (cells that meet at a corner only are let
        be).
    CaseError
        The cells of a zone do not hang together by their sides.
    """
    tokens = np.asarray(tokens, dtype=np.str_)
    if tokens.ndim != 2 or tokens.size == 0:
        raise CaseError(where, "rows and columns of tokens", f"an array of shape {tokens.shape}")
    is_zone = ~np.isin(tokens, PLAN_TOKENS)
    CaseError.unless(is_zone.any(), where, "at least one zone", "none")
    _check_walls(tokens, is_zone, where)
    for zone in np.unique(tokens[is_zone]):
        parts, n_part = ndimage.label(tokens == zone)
        if n_part > 1:
            cells = [tuple(int(x) + 1 for x in np.argwhere(parts == part)[0]) for part in (1, 2)]
            found = f"{n_part} parts, with cells at row {cells[0][0]}, column {cells[0][1]} and row {cells[1][0]}, "
            found += f"column {cells[1][1]}"
            advice = "give the parts names of their own, or join them"
            raise CaseError(f"{where}: zone {str(zone)!r}", "cells that hang together", found, advice)


def _check_walls(tokens: NDArray[np.str_], is_zone: NDArray[np.bool_], where: str) -> None:
    outside = np.pad(tokens == OUTSIDE, 1, constant_values=True)
    at_edge = np.pad(np.zeros(tokens.shape, dtype=bool), 1, constant_values=True)
    for d_row, d_col, side in ((-1, 0, "above"), (1, 0, "below"), (0, -1, "to the left"), (0, 1, "to the right")):
        rows = slice(1 + d_row, 1 + d_row + tokens.shape[0])
        cols = slice(1 + d_col, 1 + d_col + tokens.shape[1])
        touching = is_zone & outside[rows, cols]
        if touching.any():
            row, col = (int(x) for x in np.argwhere(touching)[0])
            what = "the edge of the plan" if at_edge[rows, cols][row, col] else "the outside ('.')"
            at = f"{where}: row {row + 1}, column {col + 1} (zone {str(tokens[row, col])!r})"
            raise CaseError(at, f"a wall {side}", what, "draw '#' between zone and outside")


Cell = tuple[int, int]
_SIDES: tuple[Cell, ...] = ((-1, 0), (0, 1), (1, 0), (0, -1))
_CORNERS: tuple[Cell, ...] = ((-1, 1), (1, 1), (1, -1), (-1, -1))
FACADE_STEPS: dict[str, Cell] = dict(zip(("north", "east", "south", "west"), _SIDES, strict=True))


def wall_shares(tokens: NDArray[np.str_]) -> dict[Cell, tuple[str, ...]]:
    """Say which zones share each interior wall cell, in equal parts.

    Parameters
    ----------
    tokens
        Shape (n_row, n_col), text; a floor plan.

    Returns
    -------
    dict
        Zones, sorted, by (row, column) of each ``+`` cell; an empty tuple where no zone can be reached through ``+``.

    Notes
    -----
    The zones beside the cell share it: the two sides of a straight wall get half each, a stub inside a zone is all
    that zone's. Where walls cross and no zone is beside the cell, those at its corners share it. Inside walls thicker
    than that, the zones that are the fewest cells away do.

    Examples
    --------
    >>> wall_shares(np.array([["A", "+", "B"]]))
    {(0, 1): ('A', 'B')}
    """
    walls: list[Cell] = [(int(row), int(col)) for row, col in np.argwhere(tokens == INTERIOR_WALL)]
    framed = np.pad(tokens, 1, constant_values=OUTSIDE)
    found = {cell: _zones_at(framed, cell, _SIDES) or _zones_at(framed, cell, _CORNERS) for cell in walls}
    shares = {cell: zones for cell, zones in found.items() if zones}
    pending = [cell for cell in walls if cell not in shares]
    while pending:
        reached = {(r, c): set().union(*(shares.get((r + y, c + x), set()) for y, x in _SIDES)) for r, c in pending}
        new = {cell: zones for cell, zones in reached.items() if zones}
        if not new:
            break
        shares |= new
        pending = [cell for cell in pending if cell not in new]
    return {cell: tuple(sorted(shares.get(cell, ()))) for cell in walls}


def zone_floor_areas(plans: FloorPlans) -> dict[str, float]:
    """Floor area of each zone, with its share of the interior walls.

    Parameters
    ----------
    plans
        Floor plans.

    Returns
    -------
    dict
        Area [m2] by zone, in the building's order of zones.

    Notes
    -----
    A ``+`` cell counts half to each side (`wall_shares`); ``#`` and ``.`` cells count to nobody.
    """
    return {zone: count * plans.cell_size**2 for floor in plans.floors for zone, count in _cell_counts(floor).items()}


def zone_volumes(plans: FloorPlans) -> dict[str, float]:
    """Volume of each zone, with its share of the interior walls.

    Parameters
    ----------
    plans
        Floor plans.

    Returns
    -------
    dict
        Volume [m3] by zone: floor area times the clear height of its floor.
    """
    areas = zone_floor_areas(plans)
    return {zone: areas[zone] * floor.height for floor in plans.floors for zone in floor.zone_names}


def zone_sizes(building: Building) -> dict[str, tuple[float, float]]:
    """Floor area and volume of each zone.

    Parameters
    ----------
    building
        With plans or a zone table.

    Returns
    -------
    dict
        Area [m2] and volume [m3] by zone, in the building's order.
    """
    geometry = building.geometry
    if not isinstance(geometry, FloorPlans):
        return {zone.name: (zone.floor_area, zone.volume) for zone in geometry.zones}
    areas, volumes = zone_floor_areas(geometry), zone_volumes(geometry)
    return {zone: (areas[zone], volumes[zone]) for zone in building.zone_names}


def facade_areas(plans: FloorPlans) -> dict[str, dict[str, float]]:
    """Area of exterior wall of each zone by facade, seen from inside.

    Parameters
    ----------
    plans
        Floor plans.

    Returns
    -------
    dict
        Area [m2] by zone and by facade of the plan (``north`` is the first row, before rotation).

    Notes
    -----
    A cell of a zone has a facade where the wall cells beside it lead straight to the outside. The ends of interior
    walls count as in `wall_shares`; the corners of the exterior wall count to nobody.
    """
    areas: dict[str, dict[str, float]] = {}
    for floor in plans.floors:
        shares, framed = wall_shares(floor.tokens), np.pad(floor.tokens, 1, constant_values=OUTSIDE)
        areas |= {zone: dict.fromkeys(FACADE_STEPS, 0.0) for zone in floor.zone_names}
        for facade, step in FACADE_STEPS.items():
            for row, col in np.argwhere(_wall_to_outside(floor.tokens, step)):
                inner = (int(row) - step[0], int(col) - step[1])
                token = str(framed[inner[0] + 1, inner[1] + 1])
                owners = shares[inner] if token == INTERIOR_WALL else (token,) if token in areas else ()
                for zone in owners:
                    areas[zone][facade] += plans.cell_size * floor.height / len(owners)
    return areas


def _cell_counts(floor: FloorPlan) -> dict[str, float]:
    cells = dict(zip(*(found.tolist() for found in np.unique(floor.tokens, return_counts=True)), strict=True))
    counts = {zone: float(cells[zone]) for zone in floor.zone_names}
    for zones in wall_shares(floor.tokens).values():
        for zone in zones:
            counts[zone] += 1.0 / len(zones)
    return counts


def _wall_to_outside(tokens: NDArray[np.str_], step: Cell) -> NDArray[np.bool_]:
    """Mark wall cells from which a straight walk through walls, along `step`, ends outside."""
    axis = 0 if step[0] else 1
    forwards = step[axis] > 0
    lines = np.moveaxis(tokens, axis, 0)
    lines = lines[::-1] if forwards else lines  # start where the walk would end
    result = np.zeros(lines.shape, dtype=bool)
    beyond = np.ones(lines.shape[1], dtype=bool)
    for index, line in enumerate(lines):
        result[index] = (line == EXTERIOR_WALL) & beyond
        beyond = (line == OUTSIDE) | result[index]
    return np.moveaxis(result[::-1] if forwards else result, 0, axis)


def _zones_at(framed: NDArray[np.str_], cell: Cell, steps: tuple[Cell, ...]) -> set[str]:
    """Zones at some steps from a cell of a plan that has a row of outside around it."""
    found = {str(framed[1 + cell[0] + d_row, 1 + cell[1] + d_col]) for d_row, d_col in steps}
    return found.difference(PLAN_TOKENS)
