"""An ordered list of swaps between cells, executed in vectorised rounds."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from thermal.errors import ModelError

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.intp]


def apply_swaps(
    temperatures: npt.ArrayLike,
    first: npt.ArrayLike,
    second: npt.ArrayLike,
    capacities: npt.ArrayLike | None = None,
) -> FloatArray:
    """Execute swaps one after the other, as a sequential loop would, bit for bit.

    Two swaps that share no cell commute. Each round therefore executes at once all swaps neither of whose cells has an
    earlier swap pending; a random list of swaps takes a number of rounds that grows with the logarithm of its length.

    Cells of equal capacity exchange their temperatures. Between cells of unequal capacity an exchange of temperatures
    would create or destroy energy; there the smaller cell's whole air changes places with an equal air mass of the
    larger one, which is then mixed: with ``m = min(C_i, C_j)``, ``T_i += m / C_i (T_j - T_i)`` and
    ``T_j += m / C_j (T_i - T_j)``, the right-hand sides taken before the exchange. Both rules conserve energy.

    Parameters
    ----------
    temperatures : array_like, shape (n_cell,)
        Temperatures before the swaps [K].
    first, second : array_like of int, shape (n_swap,)
        The two cells of each swap, in the order of execution, in [0, n_cell) [-].
    capacities : array_like, shape (n_cell,), optional
        Heat capacities of the cells [J/K], > 0 where a cell is swapped; equal everywhere when omitted.

    Returns
    -------
    ndarray, shape (n_cell,)
        Temperatures after the swaps [K]; the input is left alone.

    Raises
    ------
    ModelError
        When the shapes do not match or a swap names a cell that does not exist.
    ModelError
        When a swapped cell has no positive capacity.

    Examples
    --------
    >>> apply_swaps([20.0, 21.0, 22.0], [0, 1], [1, 2])
    array([21., 22., 20.])
    """
    result = np.array(temperatures, dtype=np.float64)
    if result.ndim != 1:
        raise ModelError(f"expected temperatures of shape (n_cell,) [K], came {result.shape}")
    swapped = [_checked_cells(cells, result.size) for cells in (first, second)]
    if swapped[0].shape != swapped[1].shape:
        raise ModelError(f"expected two cells a swap, came {swapped[0].size} and {swapped[1].size} cells")
    if capacities is None:
        return execute_swaps(result, swapped[0], swapped[1])
    stores = np.asarray(capacities, dtype=np.float64)
    if stores.shape != result.shape:
        raise ModelError(f"expected capacities of shape {result.shape} as the temperatures, came {stores.shape}")
    if not all((stores[cells] > 0.0).all() for cells in swapped):
        raise ModelError("expected positive capacities [J/K] of all swapped cells")
    return execute_swaps(result, swapped[0], swapped[1], stores)


def _checked_cells(given: npt.ArrayLike, n_cell: int) -> IntArray:
    """Return a list of cells as indices after checking that they exist."""
    cells = np.asarray(given)
    if cells.size and not np.issubdtype(cells.dtype, np.integer):
        raise ModelError(f"expected cells as integers, came {cells.dtype}")
    if cells.ndim != 1 or (cells.size and (cells.min() < 0 or cells.max() >= n_cell)):
        raise ModelError(f"expected a list of cells in [0, {n_cell}), came {cells}")
    return cells.astype(np.intp)


def execute_swaps(
    temperatures: FloatArray, first: IntArray, second: IntArray, capacities: FloatArray | None = None
) -> FloatArray:
    """Execute checked swaps in place and return the temperatures (see `apply_swaps`).

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


def _exchange(temperatures: FloatArray, left: IntArray, right: IntArray, capacities: FloatArray | None) -> None:
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
