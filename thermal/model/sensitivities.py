"""Derivatives of a reduced model's matrices with respect to θ, in its modes: few parameters turn them, most only push.

A conductance or a heat capacity turns all modes, which takes a whole matrix; the strength of a source moves single
columns of B. Matrices lie side by side for each mode, as its convolution sums are multiplied with all of them.

The sensitivities to every parameter are sums over past steps, ``Σ_k a_i^(n-1-k) Σ_l M_il w_l[k]`` with a mode's decay
a_i. What does not depend on the parameter, ``Σ_k a_i^(n-1-k) w_l[k]``, is summed once for all of them.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from thermal._types import FloatArray, IntArray
from thermal.model.factor import Matrix, Pencil
from thermal.model.modal import SHIFT, ModalModel

#: Most numbers of an array of convolution sums: they are gone over again and again, so that they should fit the cache.
_LARGEST = 2**18

#: Shares below which the past is forgotten: denormal numbers are slow.
_FORGOTTEN = 1e-200


def convolution_sums(stay: FloatArray, drive: FloatArray, ends: NDArray[np.int64]) -> Iterator[FloatArray]:
    """``F_n[i, l] = Σ_{k<n} stay_i^(n-1-k) drive[k, l]`` for one n after another.

    Parameters
    ----------
    stay : ndarray, shape (r,)
        What a step leaves of each mode [-].
    drive : ndarray, shape (n_time, ...)
        What drives, step by step [any].
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


def all_convolution_sums(stay: FloatArray, drive: FloatArray, ends: NDArray[np.int64]) -> FloatArray:
    """Convolution sums of every n at once, shape (r, n_drive, n_end).

    Parameters
    ----------
    stay : ndarray, shape (r,)
        What a step leaves of each mode [-].
    drive : ndarray, shape (n_time, n_drive)
        What drives, step by step [any].
    ends : ndarray of int
        The numbers of steps n, increasing.
    """
    sums = np.empty((stay.size, ends.size, drive.shape[1]))
    for position, one in enumerate(convolution_sums(stay, drive, ends)):
        sums[:, position] = one
    return sums.transpose(0, 2, 1)


def rows_of(count: int, columns: int, least: int = 1) -> Iterator[slice]:
    """Cut modes into parts whose convolution sums stay small enough.

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


@dataclass(frozen=True)
class _Stack:
    """Matrices of the parameters that have one, side by side for each mode.

    Parameters
    ----------
    parameters : ndarray of int, shape (n_stack,)
        Their numbers, increasing.
    values : ndarray, shape (r, n_stack, r)
        Row by row.
    """

    parameters: IntArray
    values: FloatArray


@dataclass(frozen=True)
class _Columns:
    """Single columns of the parameters' matrices; all others are zero.

    Parameters
    ----------
    ends : ndarray of int, shape (n_parameter + 1,)
        Where the columns of every parameter begin and end.
    columns : ndarray of int, shape (n_column,)
        Which they are, one parameter after the other.
    values : ndarray, shape (r, n_column)
        Their numbers.
    """

    ends: IntArray
    columns: IntArray
    values: FloatArray

    def spread(self, values: FloatArray, places: IntArray, size: int) -> sp.csr_matrix:
        """Spread what became of the columns: for every row one parameter after another, (n_row n_parameter, size).

        Parameters
        ----------
        values : ndarray, shape (n_row, n_column)
            What became of `values`.
        places : ndarray of int, shape (n_row,)
            Where the first column of every row lies in what it is multiplied with.
        size : int
            Rows of that.
        """
        n_row, n_column = values.shape
        ends = self.ends[1:] + n_column * np.arange(n_row)[:, None]
        columns = self.columns + places[:, None]
        rows = np.concatenate([[0], ends.ravel()])
        return sp.csr_matrix((values.ravel(), columns.ravel(), rows), shape=(rows.size - 1, size))


class ModalSensitivities:
    """Derivatives of a reduced model's matrices with respect to θ, in its modes.

    Parameters
    ----------
    matrices : Pencil
        Of the reduced model, with sensitivities.
    modes : ModalModel
        Its modes.

    Attributes
    ----------
    capacity, stiffness : _Stack
        dC and d(K + s C).
    boundary : _Columns
        dB.
    """

    def __init__(self, matrices: Pencil, modes: ModalModel) -> None:
        t, n = modes.states, matrices.n
        self._capacities, self._count = modes.capacity, len(matrices.flow_sensitivities)
        sensitivities = list(zip(matrices.capacity_sensitivities, matrices.flow_sensitivities, strict=True))
        heavy = [j for j, (capacity, _) in enumerate(sensitivities) if np.any(capacity)]
        stiff = [j for j, (_, flow) in enumerate(sensitivities) if j in heavy or np.any(flow[:, :n])]
        self.capacity = _stack(heavy, (sensitivities[j][0] for j in heavy), t)
        self.stiffness = _stack(stiff, (sensitivities[j][1][:, :n] + SHIFT * sensitivities[j][0] for j in stiff), t)
        self.boundary = _columns([flow[:, n:] for _, flow in sensitivities], t)
        self._heavy = np.searchsorted(stiff, heavy)

    def __len__(self) -> int:
        return self._count

    @property
    def turning(self) -> IntArray:
        """Parameters that turn the modes, increasing; the others move B alone, as sources do."""
        return self.stiffness.parameters

    def turned(self, rows: slice, quotient: FloatArray, gain: FloatArray | None = None) -> FloatArray:
        """Differentiate f(S), or g(S) (K + s C)^-1, with respect to every parameter that turns the modes.

        Parameters
        ----------
        rows : slice
            The modes.
        quotient : ndarray, shape (r, r)
            `divided_differences` of f or g [their units per s].
        gain : ndarray, shape (r,), optional
            g of the modes [-]; f by default.

        Returns
        -------
        ndarray, shape (n_row, n_turning, r)
            ``(dC - d(K + s C) c) ∘ f[c_i, c_j]``, less ``g(c_i) d(K + s C)``.
        """
        factor = -quotient[rows] * self._capacities
        if gain is not None:
            factor -= gain[rows, None]
        turned = self.stiffness.values[rows] * factor[:, None]
        turned[:, self._heavy] += self.capacity.values[rows] * quotient[rows][:, None]
        return np.asarray(turned)

    def summed_by_parts(self, rows: slice, step: float) -> tuple[FloatArray, FloatArray]:
        """Differentiate runs of implicit Euler: what the past of their states, and the last one, is multiplied with.

        A step ``(c + Δt k) dx' = c dx - dC (x' - x) - Δt dK x'`` gives sums over both of its ends. Those over x' are
        those over x, with the last state and less the first, so that one sum over the past is left:
        ``dx_n = a^n (dx_0 - A x_0) + A x_n + T Σ_k a^(n-1-k) x_k``.

        Parameters
        ----------
        rows : slice
            The modes.
        step : float
            Time step [s].

        Returns
        -------
        tuple of ndarray, shape (n_row, n_turning, r)
            T and A, without the part of B.
        """
        c = self._capacities[rows, None, None]
        system = c + step * (1.0 - SHIFT * c)
        stiffness, capacity = self.stiffness.values[rows], self.capacity.values[rows]
        past, ahead = (-step * c / system**2) * stiffness, (-step / system) * stiffness
        past[:, self._heavy] += (step / system**2) * capacity
        ahead[:, self._heavy] -= ((1.0 - step * SHIFT) / system) * capacity
        return past, ahead


def _stack(parameters: list[int], matrices: Iterable[Matrix], states: FloatArray) -> _Stack:
    """Matrices in the modes."""
    r = states.shape[1]
    values = np.empty((r, len(parameters), r))
    for k, matrix in enumerate(matrices):
        np.matmul(states.T, matrix @ states, out=values[:, k])
    return _Stack(np.array(parameters, dtype=np.int64), values)


def _columns(matrices: list[Matrix], states: FloatArray) -> _Columns:
    """Columns of -B that are not zero, as those of B in the modes."""
    there = [np.flatnonzero(m.any(axis=0)) for m in matrices]
    ends = np.cumsum([0, *(columns.size for columns in there)])
    moved = np.hstack([m[:, columns] for m, columns in zip(matrices, there, strict=True)])
    return _Columns(ends, np.concatenate(there), -states.T @ moved)
