"""A reduced model while some of its zones are held: their means are a constraint, the rest decouples in turn.

With decay ``a_i`` of mode i in a step and ``F_i[x](k) = Σ_t<=k a_i^(k-t) x_t``, slopes need ``F_i`` of the path of each
other mode. That path ``ζ_j(t) = a_j ζ_j(t-1) + g_j(t)`` is itself such a sum, of inputs, so that
``Σ_t<=k a_i^(k-t) ζ_j(t-1) = (a_i^k ζ_j(0) + F_i[g_j](k) - ζ_j(k)) / (a_i - a_j)``: the inputs' sums serve all
parameters, and none of them costs a product over all steps. Modes that decay alike are summed step by step.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Protocol

import numpy as np
import scipy.linalg as sl
from numpy.typing import NDArray

from thermal.model._modal import SHIFT, ModalModel

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

#: Difference of two modes' decays below which their sums are made step by step [-]: the quotient loses five digits.
_ALIKE = 1e-5

#: Most steps whose weights are made together.
_TOGETHER = 2048


class _Derivatives(Protocol):
    """Derivatives of a reduced model's matrices in its modes: see `thermal.model._modal_runs`."""

    capacity: list[FloatArray | None]
    stiffness: list[FloatArray | None]
    boundary: list[FloatArray | None]

    def __len__(self) -> int: ...


class HeldFrame:
    """States with given means of the held zones, ``ξ = lift y + basis ζ``, where C is diagonal in ζ."""

    def __init__(self, modes: ModalModel, held: NDArray[np.bool_]) -> None:
        self.held = held
        observe = modes.observation[held]
        count = observe.shape[0]
        q, upper = sl.qr(observe.T)
        self.lift = sl.solve_triangular(upper[:count], q[:, :count].T).T if count else observe.T
        null = q[:, count:]
        self.capacity, turn = np.linalg.eigh(null.T @ (modes.capacity[:, None] * null))
        self.basis = null @ turn
        self.coupling = self.basis.T @ (modes.capacity[:, None] * self.lift)


class HeldRun:
    """Implicit Euler steps with some zones held: ``ζ(t) = stay ζ(t-1) + gain x_t``.

    The series x are boundary temperatures, heat of the free zones, held means, and by how much these changed.

    Parameters
    ----------
    modes : ModalModel
        Modes of the model.
    frame : HeldFrame
        Of the zones that are held.
    start : ndarray, shape (r,)
        Modal state at the start.
    boundary, heat, zone : ndarray, shape (n_time, n_boundary), (n_time, n_zone), (n_time, n_zone)
        Boundary temperatures [K], metered heat of the zones that are left free [W] and zone means [K] of each step.
    step : float
        Time step [s].
    """

    def __init__(
        self,
        modes: ModalModel,
        frame: HeldFrame,
        start: FloatArray,
        boundary: FloatArray,
        heat: FloatArray,
        zone: FloatArray,
        step: float,
    ) -> None:
        self.frame, self.step = frame, step
        held, capacity = frame.held, frame.capacity
        self.observe = modes.observation[held]
        self.wanted = np.vstack([self.observe @ start, zone[:, held]])
        self.series = np.hstack([boundary, heat[:, ~held], self.wanted[1:], np.diff(self.wanted, axis=0)])
        self.system = capacity + step * (1.0 - SHIFT * capacity)
        self.stay = capacity / self.system
        drive = step * (frame.basis.T @ np.hstack([modes.boundary, modes.heating[:, ~held]]))
        self.gain = np.hstack([drive, step * SHIFT * frame.coupling, -frame.coupling]) / self.system[:, None]
        self.path = np.empty((len(zone) + 1, capacity.size))
        self.path[0] = frame.basis.T @ (start - frame.lift @ self.wanted[0])
        self.path[1:] = self.series @ self.gain.T
        for k in range(len(zone)):
            self.path[k + 1] += self.stay * self.path[k]

    def states(self, keep: IntArray) -> FloatArray:
        """Modal states after some steps, shape (r, n_keep).

        Parameters
        ----------
        keep : ndarray of int
            Steps, counted from 0.
        """
        frame = self.frame
        return np.asarray(frame.lift @ self.wanted[keep + 1].T + frame.basis @ self.path[keep + 1].T)

    def slopes(self, derivatives: _Derivatives, part: range, begin: FloatArray, keep: IntArray) -> FloatArray:
        """Differentiate ζ after some steps with respect to some parameters, shape (n_keep, n_part, q).

        Parameters
        ----------
        derivatives : object
            ``capacity``, ``stiffness`` and ``boundary``: derivatives of the matrices in the modes, by parameter.
        part : range
            Numbers of the parameters.
        begin : ndarray, shape (r, n_part)
            Derivatives of the modal state at the start.
        keep : ndarray of int
            Steps, counted from 0.
        """
        frame, stay = self.frame, self.stay[:, None]
        row, column, alike = self._alike(keep)
        gap = stay - self.stay
        gap[row, column] = np.inf
        weights, start, rest = [], [], []
        for j in part:
            path, given = self._sources(derivatives, j)
            apart = path / gap
            weights.append(apart @ self.gain + given)
            start.append(apart @ self.path[0])
            close = np.add.reduceat(path[row, column] * alike, np.flatnonzero(np.diff(row, prepend=-1)), axis=1)
            rest.append(close - self.path[keep + 1] @ apart.T)
        lifted = self.observe @ begin  # of the held means at the start, nothing from there on
        jump = (frame.coupling @ lifted).T / self.system
        first = (frame.basis.T @ (begin - frame.lift @ lifted)).T + np.array(start) / self.system
        weight, out = np.array(weights), np.array(rest).transpose(1, 0, 2) / self.system
        for position, total in enumerate(_sums(self.stay, self.series, keep)):
            steps = int(keep[position]) + 1
            out[position] += np.einsum("jiu,iu->ji", weight, total) / self.system
            out[position] += self.stay**steps * first + self.stay ** (steps - 1) * jump
        return np.asarray(out)

    def _sources(self, derivatives: _Derivatives, j: int) -> tuple[FloatArray, FloatArray]:
        """Source of one parameter's slopes per path of the step before (q, q) and per series (q, n_series)."""
        basis, lift, step, n_held = self.frame.basis, self.frame.lift, self.step, self.frame.lift.shape[1]
        path, given = np.zeros((basis.shape[1],) * 2), np.zeros_like(self.gain)
        held, change = slice(given.shape[1] - 2 * n_held, given.shape[1] - n_held), slice(given.shape[1] - n_held, None)
        capacity, stiffness, boundary = derivatives.capacity[j], derivatives.stiffness[j], derivatives.boundary[j]
        now = np.zeros_like(path)  # per path at the end of the step, which is that before it and the series
        if capacity is not None:
            turned = basis.T @ capacity
            now -= turned @ basis
            path -= now
            given[:, change] -= turned @ lift
        if stiffness is not None:
            turned = step * (basis.T @ stiffness)
            now -= turned @ basis
            given[:, held] -= turned @ lift
        if boundary is not None:
            given[:, : boundary.shape[1]] += step * (basis.T @ boundary)
        return path + now * self.stay, given + now @ self.gain

    def _alike(self, keep: IntArray) -> tuple[IntArray, IntArray, FloatArray]:
        """Pairs of modes that decay alike, ordered by the first, and their sums after some steps, (n_keep, n_pair)."""
        row, column = np.nonzero(np.abs(self.stay[:, None] - self.stay) <= _ALIKE)
        stay, total, position = self.stay[row], np.zeros(row.size), 0
        kept = np.empty((keep.size, row.size))
        for k in range(int(keep[-1]) + 1):
            total = stay * total + self.path[k, column]
            if k == keep[position]:
                kept[position] = total
                position += 1
        return row, column, kept


def _sums(stay: FloatArray, series: FloatArray, keep: IntArray) -> Iterator[FloatArray]:
    """``Σ_t<=k stay^(k-t) series_t`` of every mode and series at each kept step k in turn, (q, n_series)."""
    total, done = np.zeros((stay.size, series.shape[1])), 0
    for k in keep:
        for first in range(done, int(k) + 1, _TOGETHER):
            part = series[first : min(first + _TOGETHER, int(k) + 1)]
            weights = stay[:, None] ** np.arange(len(part) - 1, -1, -1)
            total = stay[:, None] ** len(part) * total + weights @ part
        done = int(k) + 1
        yield total
