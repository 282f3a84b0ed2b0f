"""Fading sums: the past of what drives a model, as each of its modes remembers it.

The slopes of every parameter are sums over past steps, ``Σ_k a_i^(n-1-k) Σ_l M_il w_l[k]`` with a mode's decay a_i.
What does not depend on the parameter, ``Σ_k a_i^(n-1-k) w_l[k]``, is summed once for all of them.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

#: Most numbers of an array of fading sums.
_LARGEST = 4_000_000

#: Shares below which the past is forgotten: denormal numbers are slow.
_FORGOTTEN = 1e-200


def fading_sums(stay: FloatArray, drive: FloatArray, ends: NDArray[np.int64]) -> Iterator[FloatArray]:
    """``F_n[i, l] = Σ_{k<n} stay_i^(n-1-k) drive[k, l]`` for one n after another.

    Parameters
    ----------
    stay : ndarray, shape (r,)
        What a step leaves of each mode [-].
    drive : ndarray, shape (n_time, ...)
        What drives, step by step.
    ends : ndarray of int
        The numbers of steps n, increasing.

    Yields
    ------
    ndarray, shape (r, ...)
        F of one n; changed by the next.
    """
    flat = drive.reshape(len(drive), -1)
    total = np.zeros((stay.size, flat.shape[1]))
    before = 0
    for end in ends:
        age = np.arange(int(end) - before, -1, -1)
        left = stay[:, None] ** age
        left[left < _FORGOTTEN] = 0.0
        total *= left[:, :1]
        if end > before:
            total += left[:, 1:] @ flat[before:end]
        before = int(end)
        yield total.reshape(stay.size, *drive.shape[1:])


def rows_of(count: int, columns: int) -> Iterator[slice]:
    """Cut modes into parts whose fading sums stay small enough.

    Parameters
    ----------
    count : int
        Number of modes.
    columns : int
        Numbers that each has.
    """
    together = max(1, _LARGEST // max(1, columns))
    for low in range(0, count, together):
        yield slice(low, min(low + together, count))


class Stack:
    """Matrices of the parameters that have one, side by side for each mode.

    Parameters
    ----------
    matrices : sequence of ndarray or None, shape (r, n)
        One a parameter.
    """

    def __init__(self, matrices: Sequence[FloatArray | None]) -> None:
        there = [(j, m) for j, m in enumerate(matrices) if m is not None]
        self.parameters = np.array([j for j, _ in there], dtype=np.int64)
        self._stack = np.stack([m for _, m in there], axis=1) if there else None

    def add(self, out: FloatArray, rows: slice, sums: FloatArray) -> None:
        """Add what the parameters make of fading sums.

        Parameters
        ----------
        out : ndarray, shape (n_row, n_parameter, m)
            Added to.
        rows : slice
            The modes.
        sums : ndarray, shape (n_row, n, m)
            Their fading sums.
        """
        if self._stack is not None:
            out[:, self.parameters] += self._stack[rows] @ sums
