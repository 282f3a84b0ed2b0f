"""Random shuffle of the paper: air cells of a zone swap places."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from thermal._types import FloatArray
from thermal.errors import ModelError
from thermal.shuffle.partners import IndexArray, PartnerSampler


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
            raise ModelError(f"expected a shuffle probability in [0, 1], came {probability}")
        if reach is not None and not (0.0 < reach < np.inf):
            raise ModelError(f"expected a positive finite reach [m], or None for whole zones, came {reach}")
        points = np.asarray(positions, dtype=np.float64)
        if points.ndim != 2 or points.shape[1] != 2:
            raise ModelError(f"expected positions of shape (n_cell, 2) [m], came {points.shape}")
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
            raise ModelError(f"expected temperatures of shape ({self._n_cell},) [K], came {shuffled.shape}")
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
            raise ModelError(f"expected the cells of zone {zone} as a list of integers, came {cells!r}")
        if cells.min() < 0 or cells.max() >= len(points):
            raise ModelError(
                f"expected the cells of zone {zone} in [0, {len(points)}), came {cells.min()} to {cells.max()}"
            )
        if np.unique(cells).size < cells.size:
            raise ModelError(f"expected each cell once in zone {zone}, came repeated cells")
        if taken[cells].any():
            raise ModelError(
                f"expected each cell in one zone, cell {cells[taken[cells]][0]} of zone {zone} is in another"
            )
        if not np.isfinite(points[cells]).all():
            raise ModelError(f"expected finite positions [m] of the cells of zone {zone}, came NaN or infinity")
        taken[cells] = True
        zones.append(cells.astype(np.intp))
    return zones


def _unequal_capacities(capacities: npt.ArrayLike, zones: Sequence[IndexArray], n_cell: int) -> FloatArray | None:
    """Return the capacities [J/K] where they differ within some zone, None where plain swaps conserve energy."""
    stores = np.array(capacities, dtype=np.float64)
    if stores.shape != (n_cell,):
        raise ModelError(f"expected capacities of shape ({n_cell},) [J/K], came {stores.shape}")
    for cells in zones:
        if not (np.isfinite(stores[cells]).all() and (stores[cells] > 0.0).all()):
            raise ModelError("expected positive finite capacities [J/K] of all air cells; massless cells hold none")
    return stores if any(np.ptp(stores[cells]) > 0.0 for cells in zones) else None
