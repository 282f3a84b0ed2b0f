"""Random shuffle of the paper: air cells of a zone swap places."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from thermal._types import BoolArray, FloatArray
from thermal.errors import ModelError

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


def execute_swaps(
    temperatures: FloatArray, first: IndexArray, second: IndexArray, capacities: FloatArray | None = None
) -> FloatArray:
    """Execute swaps in place, one after the other as a sequential loop would, bit for bit.

    Two swaps that share no cell commute. Each round therefore executes at once all swaps neither of whose cells has an
    earlier swap pending; a random list of swaps takes a number of rounds that grows with the logarithm of its length.

    Cells of equal capacity exchange their temperatures. Between cells of unequal capacity an exchange of temperatures
    would create or destroy energy; there the smaller cell's whole air changes places with an equal air mass of the
    larger one, which is then mixed: with ``m = min(C_i, C_j)``, ``T_i += m / C_i (T_j - T_i)`` and
    ``T_j += m / C_j (T_i - T_j)``, the right-hand sides taken before the exchange. Both rules conserve energy.

    Parameters
    ----------
    temperatures : ndarray, shape (n_cell,)
        Temperatures [K], overwritten.
    first, second : ndarray of int, shape (n_swap,)
        The two cells of each swap [-], in the order of execution.
    capacities : ndarray, shape (n_cell,), optional
        Heat capacities of the cells [J/K], > 0 where a cell is swapped.

    Returns
    -------
    ndarray, shape (n_cell,)
        The same array of temperatures [K].

    Examples
    --------
    >>> execute_swaps(np.array([20.0, 21.0, 22.0]), np.array([0, 1]), np.array([1, 2]))
    array([21., 22., 20.])
    """
    # Latest swap first: of several writes to one place numpy keeps the last, which is then the earliest pending swap.
    effective = np.flatnonzero(first != second)[::-1]
    left, right = first[effective], second[effective]
    ranks = np.arange(left.size)
    rank_of_both = np.repeat(ranks, 2)
    both = np.empty((left.size, 2), dtype=np.intp)
    next_swap = np.empty(temperatures.size, dtype=np.intp)
    while left.size:
        n = left.size
        both[:n, 0], both[:n, 1] = left, right
        next_swap[both[:n].ravel()] = rank_of_both[: 2 * n]
        ready = (next_swap[left] == ranks[:n]) & (next_swap[right] == ranks[:n])
        now = np.flatnonzero(ready)
        _exchange(temperatures, left[now], right[now], capacities)
        later = np.flatnonzero(~ready)
        left, right = left[later], right[later]
    return temperatures


def _exchange(temperatures: FloatArray, left: IndexArray, right: IndexArray, capacities: FloatArray | None) -> None:
    """Exchange air between pairs of cells of which no two pairs share a cell, in place."""
    T_left, T_right = temperatures[left], temperatures[right]
    if capacities is None:
        temperatures[left], temperatures[right] = T_right, T_left
        return
    smaller = np.minimum(capacities[left], capacities[right])
    for cells, own, other in ((left, T_left, T_right), (right, T_right, T_left)):
        share = smaller / capacities[cells]
        # a share of exactly one is a plain swap: written as such it stays free of round-off
        temperatures[cells] = np.where(share == 1.0, other, own + share * (other - own))


class RandomShuffle:
    """Randomized shuffling of air within zones (Goldfeder and Sipple 2023, "Building Thermal Model").

    At each step every cell of a zone decides with the shuffle probability to swap its temperature with a uniformly
    random cell of the same zone within the reach (itself included, which changes nothing); the swaps of all cells are
    executed in random order. Temperatures of cells outside the zones are left alone.

    In google/sbsim the configured ``distance`` is compared with the *squared* distance in cells, so that its reach is
    ``sqrt(distance)`` cells, and ``distance = -1`` stands for the whole zone. Here the reach is the distance in metres.

    Parameters
    ----------
    zone_cells : sequence of array_like of int, each of shape (n_zone_cell,)
        Air cells of each zone, indices in [0, n_cell) [-]; a cell belongs to one zone at most.
    positions : array_like, shape (n_cell, 2)
        Cell centres [m]; finite for the cells of the zones. Zones on different floors may lie above each other.
    probability : float
        Shuffle probability of a cell in one step [-], in [0, 1].
    reach : float or None
        Largest distance between the two cells of a swap [m], > 0; None for the whole zone.
    seed : int or numpy.random.Generator
        Seed (runs of equal seed are equal bit for bit) or the generator to draw from [-].
    capacities : array_like, shape (n_cell,), optional
        Heat capacities [J/K], > 0 for the cells of the zones. Needed only where they differ within a zone: a swap of
        temperatures would not conserve energy there, so that equal air masses are exchanged (see `execute_swaps`).

    Raises
    ------
    ModelError
        When the probability, the reach or a capacity is out of its range.
    ModelError
        When a cell does not exist, belongs to two zones or has no position, or shapes do not match.

    Examples
    --------
    >>> shuffle = RandomShuffle([[0, 1, 2]], [[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]], 1.0, None, seed=3)
    >>> sorted(shuffle.apply([293.0, 294.0, 295.0]).tolist())
    [293.0, 294.0, 295.0]
    """

    def __init__(
        self,
        zone_cells: Sequence[npt.ArrayLike],
        positions: npt.ArrayLike,
        probability: float,
        reach: float | None,
        seed: int | np.random.Generator,
        capacities: npt.ArrayLike | None = None,
    ) -> None:
        if not 0.0 <= probability <= 1.0:
            raise ModelError(f"expected a shuffle probability in [0, 1], got {probability}")
        if reach is not None and not (0.0 < reach < np.inf):
            raise ModelError(f"expected a positive finite reach [m], or None for whole zones, got {reach}")
        points = np.asarray(positions, dtype=np.float64)
        if points.ndim != 2 or points.shape[1] != 2:
            raise ModelError(f"expected positions of shape (n_cell, 2) [m], got {points.shape}")
        zones = [cells for cells in _checked_zones(zone_cells, points) if cells.size > 1]
        self._probability = float(probability)
        self._n_cell = len(points)
        self._cells: IndexArray = np.concatenate(zones) if zones else np.empty(0, dtype=np.intp)
        self._partners = PartnerSampler([points[cells] for cells in zones], reach)
        self._capacities = None if capacities is None else _unequal_capacities(capacities, zones, self._n_cell)
        self._rng = np.random.default_rng(seed)

    def apply(self, temperatures: npt.ArrayLike) -> FloatArray:
        """Shuffle the temperatures once.

        Parameters
        ----------
        temperatures : array_like, shape (n_cell,)
            Temperatures of all cells before the shuffle [K].

        Returns
        -------
        ndarray, shape (n_cell,)
            A new array, the temperatures after the shuffle [K].

        Raises
        ------
        ModelError
            When the shape is not ``(n_cell,)``.
        """
        shuffled = np.array(temperatures, dtype=np.float64)
        if shuffled.shape != (self._n_cell,):
            raise ModelError(f"expected temperatures of shape ({self._n_cell},) [K], got {shuffled.shape}")
        return execute_swaps(shuffled, *self.draw_swaps(), self._capacities)

    def draw_swaps(self) -> tuple[IndexArray, IndexArray]:
        """Draw the swaps of one step, as `apply` does.

        Returns
        -------
        first, second : ndarray of int, each of shape (n_swap,)
            The deciding cells and their partners [-], in the order of execution.
        """
        deciding = np.flatnonzero(self._rng.random(self._cells.size) < self._probability)
        deciding = self._rng.permutation(deciding)
        partners = self._partners.draw(self._rng, deciding)
        return self._cells[deciding], self._cells[partners]

    @property
    def state(self) -> dict[str, Any]:
        """Copy of the generator's state [-], to be saved with a simulation and given to `restore`."""
        return dict(self._rng.bit_generator.state)

    def restore(self, state: Mapping[str, Any]) -> None:
        """Continue from a saved state, bit for bit.

        Parameters
        ----------
        state : mapping
            What `state` returned [-].

        Raises
        ------
        ModelError
            When the state is not one of this generator.
        """
        try:
            self._rng.bit_generator.state = dict(state)
        except (KeyError, TypeError, ValueError) as error:
            name = type(self._rng.bit_generator).__name__
            raise ModelError(f"expected a state of {name} as RandomShuffle.state returns it: {error}") from error


def _checked_zones(zone_cells: Sequence[npt.ArrayLike], points: FloatArray) -> list[IndexArray]:
    """Return the zones' cells as index arrays after checking them against the positions."""
    zones: list[IndexArray] = []
    taken = np.zeros(len(points), dtype=np.bool_)
    for zone, given in enumerate(zone_cells):
        cells = np.asarray(given)
        if cells.size == 0:
            continue
        if cells.ndim != 1 or not np.issubdtype(cells.dtype, np.integer):
            raise ModelError(f"expected the cells of zone {zone} as a list of integers, got {cells!r}")
        if cells.min() < 0 or cells.max() >= len(points):
            found = f"{cells.min()} to {cells.max()}"
            raise ModelError(f"expected the cells of zone {zone} in [0, {len(points)}), got {found}")
        if np.unique(cells).size < cells.size:
            raise ModelError(f"expected each cell once in zone {zone}, got repeated cells")
        if taken[cells].any():
            cell = cells[taken[cells]][0]
            raise ModelError(f"expected each cell in one zone, cell {cell} of zone {zone} is in another")
        if not np.isfinite(points[cells]).all():
            raise ModelError(f"expected finite positions [m] of the cells of zone {zone}, got NaN or infinity")
        taken[cells] = True
        zones.append(cells.astype(np.intp))
    return zones


def _unequal_capacities(capacities: npt.ArrayLike, zones: Sequence[IndexArray], n_cell: int) -> FloatArray | None:
    """Return the capacities [J/K] where they differ within some zone, None where plain swaps conserve energy."""
    stores = np.array(capacities, dtype=np.float64)
    if stores.shape != (n_cell,):
        raise ModelError(f"expected capacities of shape ({n_cell},) [J/K], got {stores.shape}")
    for cells in zones:
        if not (np.isfinite(stores[cells]).all() and (stores[cells] > 0.0).all()):
            raise ModelError("expected positive finite capacities [J/K] of all air cells; massless cells hold none")
    return stores if any(np.ptp(stores[cells]) > 0.0 for cells in zones) else None
