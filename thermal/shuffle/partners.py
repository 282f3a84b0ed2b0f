"""Random partners of cells: uniform over the cells of the same zone within a reach, without a table of neighbours."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import numpy.typing as npt

from thermal._types import BoolArray, FloatArray

#: Positions in an array, in the machine's own integers.
IndexArray = npt.NDArray[np.intp]
#: Relative slack of "within the reach", so that 3 x 0.1 m is within 0.3 m in spite of round-off [-].
REACH_SLACK = 1e-9
#: Deviation of cell centres from a regular grid that is still round-off, as a share of the spacing [-].
GRID_SLACK = 1e-6
#: A zone whose bounding box holds more than this many places per cell is treated as having no grid [-].
BOX_LIMIT = 64


def disc_offsets(reach: float, spacing: tuple[float, float]) -> IndexArray:
    """List the grid offsets within a reach, the null offset among them.

    Parameters
    ----------
    reach : float
        Largest distance [m], > 0, finite.
    spacing : tuple of float
        Distance of neighbouring cell centres along both axes [m], > 0.

    Returns
    -------
    ndarray of int, shape (n_offset, 2)
        Offsets in cells [-].
    """
    limit = reach * (1.0 + REACH_SLACK)
    spans = [np.arange(-int(limit // size), int(limit // size) + 1) for size in spacing]
    columns, rows = np.meshgrid(*spans, indexing="ij")
    inside = np.hypot(columns * spacing[0], rows * spacing[1]) <= limit
    return np.stack([columns[inside], rows[inside]], axis=1).astype(np.intp)


class PartnerSampler:
    """Draws for each given cell a uniformly random cell of its zone within the reach; the cell itself is among them.

    Cells are numbered zone after zone ("slots"). Where all cells of a zone are within the reach a partner is one random
    integer. Elsewhere candidates are proposed and rejected until all are accepted, which is uniform over the accepted
    ones: a random offset of the disc is rejected when it leaves the zone, or, where the zone has fewer cells than the
    disc or its cells lie on no regular grid, a random cell of the zone is rejected when it is out of reach.

    Parameters
    ----------
    positions : sequence of ndarray, each of shape (n, 2)
        Cell centres of each zone [m].
    reach : float or None
        Largest distance of a partner [m], > 0; None for the whole zone.
    """

    def __init__(self, positions: Sequence[FloatArray], reach: float | None) -> None:
        self._sizes = np.array([len(points) for points in positions], dtype=np.intp)
        self._starts = np.cumsum(self._sizes) - self._sizes
        self._zones = np.repeat(np.arange(len(positions)), self._sizes)
        self._slots = np.arange(self._zones.size)
        self._proposals: list[tuple[BoolArray, Callable[..., IndexArray]]] = []
        diagonals = [float(np.hypot(*np.ptp(points, axis=0))) for points in positions]
        if reach is None or all(diagonal <= reach for diagonal in diagonals):
            return
        self._squared_reach = (reach * (1.0 + REACH_SLACK)) ** 2
        self._points = np.concatenate(positions)
        partial = np.array([diagonal > reach for diagonal in diagonals])
        on_grid = np.zeros_like(partial)
        spacing = _spacing(positions)
        # cells off any grid seem to have a tiny spacing: list no disc that is larger than every zone anyway
        if (2.0 * reach / spacing[0] + 1.0) * (2.0 * reach / spacing[1] + 1.0) < 2.0 * self._sizes.max():
            self._offsets = disc_offsets(reach, spacing)
            on_grid = partial & (self._sizes > len(self._offsets)) & self._build_grids(positions, spacing)
        for zones, propose in ((partial & ~on_grid, self._from_zone_in_reach), (on_grid, self._from_disc)):
            if zones.any():
                self._proposals.append((zones[self._zones], propose))

    def draw(self, rng: np.random.Generator, slots: IndexArray) -> IndexArray:
        """Draw one partner for each slot.

        Parameters
        ----------
        rng : numpy.random.Generator
            Source of randomness.
        slots : ndarray of int, shape (n,)
            Cells, numbered zone after zone [-].

        Returns
        -------
        ndarray of int, shape (n,)
            Slots of the partners [-].
        """
        partners = self._from_zone(rng, slots)
        for concerned, propose in self._proposals:
            pending = np.flatnonzero(concerned[slots])
            while pending.size:
                candidates = propose(rng, slots[pending])
                accepted = candidates >= 0
                partners[pending[accepted]] = candidates[accepted]
                pending = pending[~accepted]
        return partners

    def _from_zone(self, rng: np.random.Generator, slots: IndexArray) -> IndexArray:
        """Propose any cell of the same zone."""
        zones = self._zones[slots]
        return self._starts[zones] + (rng.random(slots.size) * self._sizes[zones]).astype(np.intp)

    def _from_zone_in_reach(self, rng: np.random.Generator, slots: IndexArray) -> IndexArray:
        """Propose any cell of the same zone; -1 where it is out of reach."""
        candidates = self._from_zone(rng, slots)
        difference = self._points[candidates] - self._points[slots]
        return np.where(np.square(difference).sum(axis=1) <= self._squared_reach, candidates, -1)

    def _from_disc(self, rng: np.random.Generator, slots: IndexArray) -> IndexArray:
        """Propose any place of the disc; -1 where the zone has no cell there."""
        chosen = (rng.random(slots.size) * len(self._offsets)).astype(np.intp)
        columns, rows = self._offsets[:, 0][chosen], self._offsets[:, 1][chosen]
        return self._slot_at[self._keys[slots] + columns * self._strides[slots] + rows]

    def _build_grids(self, positions: Sequence[FloatArray], spacing: tuple[float, float]) -> BoolArray:
        """Map the places of each zone's bounding box, with a margin of the reach, to slots; tell which zones have one.

        A place's key is ``column * stride + row``. The margin keeps every offset from every cell inside the table; the
        margin after a row is also the one before the next.
        """
        regular = np.zeros(len(positions), dtype=np.bool_)
        self._keys, self._strides = np.zeros_like(self._zones), np.zeros_like(self._zones)
        margin = self._offsets.max(axis=0)
        tables: list[IndexArray] = []
        for zone, points in enumerate(positions):
            exact = (points - points.min(axis=0)) / spacing
            places = np.rint(exact).astype(np.intp)
            n_column, stride = places.max(axis=0) + 1 + (2 * margin[0], margin[1])
            size = n_column * stride + margin[1]
            keys = (places[:, 0] + margin[0]) * stride + places[:, 1] + margin[1]
            off_grid = np.abs(exact - places).max() > GRID_SLACK * stride
            if off_grid or size > BOX_LIMIT * len(points) or np.unique(keys).size < len(points):
                continue
            own = slice(self._starts[zone], self._starts[zone] + len(points))
            table = np.full(size, -1, dtype=np.intp)
            table[keys] = self._slots[own]
            regular[zone], self._strides[own] = True, stride
            self._keys[own] = keys + sum(earlier.size for earlier in tables)
            tables.append(table)
        self._slot_at: IndexArray = np.concatenate(tables) if tables else np.empty(0, dtype=np.intp)
        return regular


def _spacing(positions: Sequence[FloatArray]) -> tuple[float, float]:
    """Return the smallest distance of neighbouring columns and of neighbouring rows within a zone [m]."""
    steps = []
    for axis in (0, 1):
        extent = max(float(np.ptp(points[:, axis])) for points in positions)
        gaps = np.concatenate([np.diff(np.unique(points[:, axis])) for points in positions])
        gaps = gaps[gaps > GRID_SLACK * extent]
        steps.append(float(gaps.min()) if gaps.size else max(extent, 1.0))
    return steps[0], steps[1]
