"""A floor plan at a chosen cell size: refined by splitting cells, coarsened by merging like cells."""

from dataclasses import dataclass
from fractions import Fraction

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components

from thermal._types import IntArray
from thermal.case.building import FloorPlan
from thermal.errors import ModelError

#: Steps (row, column) towards the plan's sides; north is the first row.
FACADES: dict[str, tuple[int, int]] = {"north": (-1, 0), "south": (1, 0), "west": (0, -1), "east": (0, 1)}


@dataclass(frozen=True)
class FloorGrid:
    """One floor's cells and the control volume each belongs to.

    Parameters
    ----------
    tokens : ndarray of str, shape (n_row + 2, n_column + 2)
        Tokens of the cells, with a rim of outside cells around the plan.
    cell : float
        Side of a cell [m].
    spacing : float
        Distance between neighbouring control volumes [m]: ``cell``, or the block's side after coarsening.
    volume : ndarray of int, shape like ``tokens``
        Number of the cell's control volume on this floor, -1 outside.
    place : ndarray, shape (n_volume, 2)
        Row and column of each control volume in units of ``spacing``.
    token : ndarray of str, shape (n_volume,)
        What each control volume is.
    """

    tokens: NDArray[np.str_]
    cell: float
    spacing: float
    volume: IntArray
    place: IntArray
    token: NDArray[np.str_]

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns of the control volumes' grid, the rim left out."""
        rows, columns = self.tokens.shape
        return tuple(int(np.ceil(round((n - 2) * self.cell / self.spacing, 9))) for n in (rows, columns))  # type: ignore[return-value]

    def neighbours(self, step: tuple[int, int]) -> tuple[IntArray, IntArray]:
        """Flat cell numbers of all pairs (cell, neighbour in direction ``step``).

        Parameters
        ----------
        step : tuple of (int, int)
            Row and column step, as in `FACADES`.
        """
        index = np.arange(self.tokens.size).reshape(self.tokens.shape)
        dr, dc = step
        n_r, n_c = self.tokens.shape
        here = index[max(0, -dr) : n_r - max(0, dr), max(0, -dc) : n_c - max(0, dc)]
        there = index[max(0, dr) : n_r - max(0, -dr), max(0, dc) : n_c - max(0, -dc)]
        return here.ravel(), there.ravel()


def _resolution(cell_size: float, dx: float | None) -> tuple[int, Fraction]:
    """How to reach cells of ``dx`` from plan cells: split factor and merge ratio.

    Parameters
    ----------
    cell_size : float
        Side of the plan's cells [m].
    dx : float or None
        Wanted distance between control volumes [m]; None keeps the plan's.

    Returns
    -------
    tuple of (int, Fraction)
        Each cell is split into split x split, then blocks of merge x merge cells are merged.

    Raises
    ------
    ModelError
        When ``dx`` is not positive, or is finer than the plan but does not divide its cells.
    """
    if dx is None:
        return 1, Fraction(1)
    if isinstance(dx, bool) or not isinstance(dx, int | float | np.number) or not 0 < dx < np.inf:
        raise ModelError(f"cell size: expected a positive number of metres, got {dx!r}")
    ratio = Fraction(cell_size / dx).limit_denominator(1000)
    if ratio > 1:
        if ratio.denominator != 1:
            near = f"nearest that does: {cell_size / max(2, round(cell_size / dx)):g} m"
            raise ModelError(f"cell size {dx} m does not divide the plan's cells of {cell_size} m; {near}")
        return int(ratio), Fraction(1)
    return 1, 1 / ratio


def floor_grid(plan: FloorPlan, cell_size: float, dx: float | None = None) -> FloorGrid:
    """Cells and control volumes of one floor at distance ``dx``.

    Merging keeps what the plan says: cells of different tokens in one block become different control volumes, so
    areas, volumes and one-cell walls stay exact and zones never merge.

    Parameters
    ----------
    plan : FloorPlan
        The floor.
    cell_size : float
        Side of the plan's cells [m].
    dx : float, optional
        Distance between control volumes [m]; the plan's own by default.

    Raises
    ------
    ModelError
        When ``dx`` is not positive, or is finer than the plan but does not divide its cells; also when a
        block would swallow a whole zone together with a neighbour.
    """
    split, merge = _resolution(cell_size, dx)
    tokens = np.repeat(np.repeat(np.asarray(plan.tokens), split, axis=0), split, axis=1)
    _refuse_swallowed_zones(plan, tokens, float(merge), cell_size)
    tokens = np.pad(tokens, 1, constant_values=".")
    names, inverse = np.unique(tokens, return_inverse=True)
    code: IntArray = np.reshape(inverse, tokens.shape)
    rows: IntArray = np.floor((np.arange(tokens.shape[0]) - 0.5) / float(merge)).astype(np.int64)
    columns: IntArray = np.floor((np.arange(tokens.shape[1]) - 0.5) / float(merge)).astype(np.int64)
    solid = tokens != "."
    key = np.ravel_multi_index(
        (*np.broadcast_arrays(rows[:, None] + 1, columns[None, :] + 1), code),
        (rows[-1] + 2, columns[-1] + 2, len(names)),
    )
    volume = _connected(key, solid)
    first = np.unique(volume[solid], return_index=True)[1]
    at_row, at_column = (axis[first] for axis in np.nonzero(solid))
    cell = cell_size / split
    place = np.column_stack([rows[at_row], columns[at_column]])
    return FloorGrid(tokens, cell, cell * float(merge), volume, place, tokens[at_row, at_column])


def _connected(key: IntArray, solid: NDArray[np.bool_]) -> IntArray:
    """Give connected cells of equal keys one number, -1 outside: two walls in one block stay two volumes."""
    index = np.arange(key.size).reshape(key.shape)
    pairs = []
    for here, there in ((np.s_[:, :-1], np.s_[:, 1:]), (np.s_[:-1], np.s_[1:])):
        same = (key[here] == key[there]) & solid[here] & solid[there]
        pairs.append(np.column_stack([index[here][same], index[there][same]]))
    first, second = np.concatenate(pairs).T
    graph = sp.coo_matrix((np.ones(first.size), (first, second)), shape=(key.size, key.size))
    label = connected_components(graph, directed=False)[1].reshape(key.shape)
    volume = np.full(key.shape, -1, dtype=np.int64)
    volume[solid] = np.unique(label[solid], return_inverse=True)[1].ravel()
    return volume


def _refuse_swallowed_zones(plan: FloorPlan, tokens: NDArray[np.str_], merge: float, cell_size: float) -> None:
    """Refuse blocks wider than the narrowest zone and its walls: it would be lost in its neighbour."""
    if merge <= 1.0:
        return
    for zone in sorted(set(np.unique(tokens)) - {".", "#", "+"}):
        rows, columns = np.nonzero(tokens == zone)
        extent = min(np.ptp(rows), np.ptp(columns)) + 1
        if extent + 1 < merge:
            where, advice = f"cell size on floor {plan.name}", "wider ones merge the zone with its neighbour"
            expected = f"at most {(extent + 1) * cell_size:g} m, as zone {zone} is {extent * cell_size:g} m wide"
            raise ModelError(where, expected, f"{merge * cell_size:g} m", advice)


def wall_facades(grid: FloorGrid) -> dict[str, NDArray[np.float64]]:
    """Share of each cell of exterior wall that belongs to each facade of a plan.

    A cell with outer faces belongs to their facades in equal parts, one behind it to those of the wall cells that are
    nearest to it on the way outside. Exterior wall that no wall joins to the outside belongs to none.

    Parameters
    ----------
    grid : FloorGrid
        Cells of a floor.

    Returns
    -------
    dict
        Shares by facade, each of the shape of the grid's tokens; they sum to 1, or to 0 for a cell of no facade.
    """
    wall, outside = grid.tokens == "#", grid.tokens == "."
    shares = np.array([wall & _beyond(outside, step) for step in FACADES.values()], dtype=float)
    known = shares.any(axis=0)
    shares[:, known] /= shares[:, known].sum(axis=0)
    while True:  # one ring of cells inwards at a time
        reached = np.sum([[_beyond(share, step) for share in shares] for step in FACADES.values()], axis=0)
        ring = wall & ~known & (reached.sum(axis=0) > 0.0)
        if not ring.any():
            return dict(zip(FACADES, shares, strict=True))
        shares[:, ring] = reached[:, ring] / reached[:, ring].sum(axis=0)
        known |= ring


def _beyond(cells: NDArray[np.generic], step: tuple[int, int]) -> NDArray[np.generic]:
    """Value of the next cell in a direction; the rim of outside cells is its own neighbour across the grid."""
    return np.roll(cells, (-step[0], -step[1]), axis=(0, 1))
