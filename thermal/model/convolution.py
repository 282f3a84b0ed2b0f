"""Fading sums: the past of what drives a model, as each of its modes remembers it.

The slopes of every parameter are sums over past steps, ``Σ_k a_i^(n-1-k) Σ_l M_il w_l[k]`` with a mode's decay a_i.
What does not depend on the parameter, ``Σ_k a_i^(n-1-k) w_l[k]``, is summed once for all of them.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from thermal._types import FloatArray

#: Most numbers of an array of fading sums: they are gone over again and again, so that they should fit the cache.
_LARGEST = 2**18

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
    before, left = 0, np.ones((stay.size, 1))
    for end in ends:
        if int(end) - before + 1 != left.shape[1]:
            left = stay[:, None] ** np.arange(int(end) - before, -1, -1)
            left[left < _FORGOTTEN] = 0.0
        total *= left[:, :1]
        if end > before:
            total += left[:, 1:] @ flat[before:end]
        before = int(end)
        yield total.reshape(stay.size, *drive.shape[1:])


def all_fading_sums(stay: FloatArray, drive: FloatArray, ends: NDArray[np.int64]) -> FloatArray:
    """Fading sums of every n at once, shape (r, n_drive, n_end).

    Parameters
    ----------
    stay : ndarray, shape (r,)
        What a step leaves of each mode [-].
    drive : ndarray, shape (n_time, n_drive)
        What drives, step by step.
    ends : ndarray of int
        The numbers of steps n, increasing.
    """
    sums = np.empty((stay.size, ends.size, drive.shape[1]))
    for position, one in enumerate(fading_sums(stay, drive, ends)):
        sums[:, position] = one
    return sums.transpose(0, 2, 1)


def rows_of(count: int, columns: int, least: int = 1) -> Iterator[slice]:
    """Cut modes into parts whose fading sums stay small enough.

    Parameters
    ----------
    count : int
        Number of modes.
    columns : int
        Numbers that each has.
    least : int
        Fewest modes of a part, where what they are added to is large itself.
    """
    together = max(1, least, _LARGEST // max(1, columns))
    for low in range(0, count, together):
        yield slice(low, min(low + together, count))
