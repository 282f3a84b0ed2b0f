"""The modes of a reduced model: decoupled states, stepped exactly or as a scheme would, and their derivatives."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.linalg as sl
from numpy.typing import NDArray

from thermal._types import FloatArray, IntArray
from thermal.errors import ModelError
from thermal.model.factor import Pencil
from thermal.model.step import EXACT, Scheme

#: Shift that keeps a building without any path to the outside regular [1/s]: three years.
SHIFT = 1e-8

#: Modes faster than this are at rest within any step [s]; massless volumes make them.
_FASTEST = 1e-3

#: Relative distance of two modes below which a difference quotient is the derivative at their middle [-]: the error of
#: either is then some 1e-11.
_CLOSE = 1e-5


@dataclass(frozen=True)
class Propagator:
    """One step of every mode: ``ξ' = end ξ + end_gain b``, mean over the step ``mean ξ + mean_gain b``.

    Parameters
    ----------
    end, mean : ndarray, shape (r,)
        Share of the start that is left at the end, and in the mean [-].
    end_gain, mean_gain : ndarray, shape (r,)
        Response to a constant modal input b [-].
    """

    end: FloatArray
    end_gain: FloatArray
    mean: FloatArray
    mean_gain: FloatArray


@dataclass(frozen=True, repr=False)
class ModalModel:
    """A reduced model at one θ in its modes: ``c dξ/dt = -k ξ + B u + H q``, diagonal c and k.

    The modes are those of the symmetric pencil (C, K + s C) with a tiny s, normalised so that ``k + s c = 1``; they
    decouple, so that a zero-order hold is exact at any step (Bathe 1996, Finite Element Procedures, ch. 9.3).

    Parameters
    ----------
    capacity : ndarray, shape (r,)
        c of every mode [s], the slowest last; c/k is its time constant.
    boundary : ndarray, shape (r, n_boundary)
        B, drive by the boundary temperatures [(W/K)^0.5].
    heating : ndarray, shape (r, n_zone)
        H, drive by the zones' heat [(K/W)^0.5].
    observation : ndarray, shape (n_zone, r)
        Zone means [(K/W)^0.5].
    uniform : ndarray, shape (r,)
        The state in which every volume is at 1 K [(W K)^0.5].
    states : ndarray, shape (n, r)
        Modes as columns in the states of the reduced model [(K/W)^0.5].
    coordinates : ndarray, shape (r, n)
        Its inverse [(W/K)^0.5].
    reading : ndarray, shape (n_zone, r), optional
        What the zones' sensors read where these lag behind [(K/W)^0.5]; see `output`.
    n_signal : int
        How many of the columns of B, the last ones, are signals of effects.
    emitted : ndarray, shape (n_signal, n_zone), optional
        Signals by the heat of the zones that devices give [W/W].

    Examples
    --------
    >>> from thermal.data import load_bundled_case
    >>> from thermal.model.reduce import reduced_model
    >>> from thermal.model.matrices import SymbolicModel
    >>> from thermal.network.build import build_network
    >>> grid = SymbolicModel(build_network(load_bundled_case().building, dx=1.0))
    >>> modes = modal_model(reduced_model(grid, [grid.network.start()]).matrices(grid.network.start()))
    >>> bool((modes.propagator(300.0).end < 1.0).all())
    True
    """

    capacity: FloatArray
    boundary: FloatArray
    heating: FloatArray
    observation: FloatArray
    uniform: FloatArray
    states: FloatArray
    coordinates: FloatArray
    reading: FloatArray | None = None
    n_signal: int = 0
    emitted: FloatArray | None = None

    def __repr__(self) -> str:
        slowest = self.time_constants.max() / 3600.0
        return f"ModalModel({self.capacity.size} modes up to {slowest:.3g} h, {len(self.observation)} zones)"

    @property
    def output(self) -> FloatArray:
        """What is compared with telemetry, shape (n_zone, r): the sensors' readings, or the zone means."""
        return self.observation if self.reading is None else self.reading

    @property
    def heated_by_devices(self) -> FloatArray:
        """Distribution of the heat that devices give, layers and surfaces included, shape (r, n_zone) [(K/W)^0.5]."""
        if self.emitted is None or not self.emitted.any():
            return self.heating
        return np.asarray(self.heating + self.boundary[:, self.boundary.shape[1] - self.n_signal :] @ self.emitted)

    @property
    def conductance(self) -> FloatArray:
        """Diagonal k of every mode [-]."""
        return 1.0 - SHIFT * self.capacity

    @property
    def time_constants(self) -> FloatArray:
        """Time constants c/k, shape (r,) [s]."""
        return np.asarray(self.capacity / self.conductance)

    def propagator(self, step: float, scheme: Scheme = EXACT) -> Propagator:
        """One step of every mode.

        Parameters
        ----------
        step : float
            Time step [s], positive.
        scheme : Scheme
            Exact zero-order hold by default.

        Raises
        ------
        ModelError
            When the step is not positive.
        """
        ModelError.unless(step > 0.0, "step", "a positive number of seconds", repr(step))
        return Propagator(*(np.asarray(f(self.capacity), dtype=float) for f in propagator_functions(step, scheme)))

    def to_control(self, inputs: list[str], outputs: list[str], step: float | None = None) -> Any:
        """Make a `control.StateSpace`, ``dξ/dt = -(k/c) ξ + [B H]/c [u; q]``, ``y = O ξ``.

        Parameters
        ----------
        inputs : list of str
            Names of the columns of B, then of H.
        outputs : list of str
            Names of the zones.
        step : float, optional
            Time step of an exact zero-order hold [s]; continuous time by default.
        """
        import control  # here: it takes a second to import

        drive = np.hstack([self.boundary, self.heating])
        if step is None:
            a, b, time = -1.0 / self.time_constants, drive / self.capacity[:, None], 0.0
        else:
            one = self.propagator(step)
            a, b, time = one.end, one.end_gain[:, None] * drive, step
        none = np.zeros((self.output.shape[0], drive.shape[1]))
        return control.StateSpace(np.diag(a), b, self.output, none, time, inputs=inputs, outputs=outputs)


#: Functions of the capacity c of a mode (with k = 1 - s c): end, end_gain, mean, mean_gain.
ModalFunction = Callable[[NDArray[np.inexact]], NDArray[np.inexact]]


def modal_model(matrices: Pencil) -> ModalModel:
    """Modes of a reduced model.

    Parameters
    ----------
    matrices : Pencil
        Of a reduced model, dense.

    Raises
    ------
    ModelError
        When the matrices are sparse, that is, on the grid.
    ModelError
        When they are not positive definite.
    """
    ModelError.unless(matrices.reduced, "modes", "a reduced model", "the grid", "see `thermal.reduced_model`")
    n = matrices.n
    capacity = 0.5 * (matrices.capacity + matrices.capacity.T)
    stiffness = matrices.flow[:, :n] + SHIFT * capacity
    stiffness = 0.5 * (stiffness + stiffness.T)
    try:
        c, states = sl.eigh(capacity, stiffness)
    except np.linalg.LinAlgError as error:
        raise ModelError(
            f"the reduced model (order {n}) is not positive definite: {error}; a parameter out of range does this"
        ) from error
    return ModalModel(
        capacity=np.maximum(c, _FASTEST),
        boundary=-states.T @ matrices.flow[:, n:],
        heating=states.T @ matrices.heating,
        observation=matrices.observation @ states,
        uniform=(states.T @ stiffness) @ matrices.uniform,
        states=states,
        coordinates=states.T @ stiffness,
        reading=None if matrices.reading is None else matrices.reading @ states,
        n_signal=matrices.n_signal,
        emitted=matrices.emitted,
    )


def propagator_functions(
    step: float, scheme: Scheme
) -> tuple[ModalFunction, ModalFunction, ModalFunction, ModalFunction]:
    """End, end gain, mean and mean gain of a step as functions of a mode's capacity c.

    They are analytic, so that a complex step differentiates them exactly.

    Parameters
    ----------
    step : float
        Time step [s].
    scheme : Scheme
        A scheme's stability function, or the exponential of the exact zero-order hold.
    """
    if scheme.stages:
        runs = [_staged(step, scheme, start, drive) for start, drive in ((1.0, 0.0), (0.0, 1.0))]
        return runs[0][0], runs[1][0], runs[0][1], runs[1][1]

    def end(c: NDArray[np.inexact]) -> NDArray[np.inexact]:
        return np.asarray(np.exp(-step * (1.0 - SHIFT * c) / c))

    def mean(c: NDArray[np.inexact]) -> NDArray[np.inexact]:
        z = step * (1.0 - SHIFT * c) / c
        small = np.abs(z) < 1e-4
        series = 1.0 - z / 2.0 + z**2 / 6.0 - z**3 / 24.0
        return np.asarray(np.where(small, series, (1.0 - np.exp(-z)) / np.where(small, 1.0, z)))

    def end_gain(c: NDArray[np.inexact]) -> NDArray[np.inexact]:
        return np.asarray(step / c * mean(c))

    def mean_gain(c: NDArray[np.inexact]) -> NDArray[np.inexact]:
        # (1 - φ1(z)) / k, by its series where a slow mode would cancel
        z = step * (1.0 - SHIFT * c) / c
        small = np.abs(z) < 1e-4
        series = 0.5 - z / 6.0 + z**2 / 24.0
        return np.asarray(step / c * np.where(small, series, (1.0 - mean(c)) / np.where(small, 1.0, z)))

    return end, end_gain, mean, mean_gain


def _staged(step: float, scheme: Scheme, start: float, drive: float) -> tuple[ModalFunction, ModalFunction]:
    """End and mean of one mode under a scheme from ``start`` with input ``drive``."""

    def trail(c: NDArray[np.inexact]) -> list[NDArray[np.inexact]]:
        k = 1.0 - SHIFT * c
        values = [np.full_like(c, start)]
        for stage in scheme.stages:
            base = sum(w * x for w, x in zip(stage.weights, values, strict=False))
            push = step * (stage.implicit + stage.explicit) * drive - step * stage.explicit * k * values[0]
            values.append(np.asarray((c * base + push) / (c + step * stage.implicit * k)))
        return values

    def mean(c: NDArray[np.inexact]) -> NDArray[np.inexact]:
        return np.asarray(sum(w * x for w, x in zip(scheme.mean, trail(c), strict=True)))

    return (lambda c: trail(c)[-1]), mean


def divided_differences(function: ModalFunction, c: FloatArray) -> FloatArray:
    """``(f(c_i) - f(c_j)) / (c_i - c_j)``, and ``f'`` where they meet, shape (r, r).

    Times ``E``, elementwise, it is the derivative of ``f(S)`` in direction E in the basis where S is diagonal (Daleckii
    and Krein 1965; Higham 2008, Functions of Matrices, th. 3.11).

    Parameters
    ----------
    function : callable
        Analytic f.
    c : ndarray, shape (r,)
        Eigenvalues [s].
    """
    value = function(c)
    gap = c[:, None] - c[None, :]
    middle = 0.5 * (c[:, None] + c[None, :])
    close = np.abs(gap) <= _CLOSE * middle
    quotient = (value[:, None] - value[None, :]) / np.where(close, 1.0, gap)
    row, column = np.nonzero(close)
    points = middle[row, column]
    tiny = 1e-30 * points
    quotient[row, column] = function(points + 1j * tiny).imag / tiny
    return np.asarray(quotient)


def run_along(
    modes: ModalModel,
    states: FloatArray,
    boundary: FloatArray,
    heat: FloatArray,
    starts: IntArray,
    keep: IntArray,
    step: float,
    scheme: Scheme,
) -> FloatArray:
    """Zone means of free runs that start at several rows of one series of inputs, by superposition.

    From its start on, a run is the path of one long run plus the difference of their states, which decays by itself:
    ``ξ(s + k) = X(s + k) + end^k (ξ(s) - X(s))``. Hourly runs of a day share 23 of 24 steps.

    Parameters
    ----------
    modes : ModalModel
        Modes of the model.
    states : ndarray, shape (n, m)
        States of the reduced model at the starts [K].
    boundary : ndarray, shape (n_time, n_boundary)
        Boundary temperatures of each step [K].
    heat : ndarray, shape (n_time, n_zone)
        Heat given to the zones in each step [W].
    starts : ndarray of int, shape (m,)
        Rows at whose stamps the runs start; the first step is driven by the row that follows.
    keep : ndarray of int
        Steps whose means are returned, from 1 on.
    step : float
        Time step [s].
    scheme : Scheme
        Time stepping; ``EXACT`` too.

    Returns
    -------
    ndarray, shape (m, n_keep, n_zone)
        Zone means over the kept steps [K].
    """
    propagator, own = modes.propagator(step, scheme), (modes.coordinates @ states).T
    means = np.empty((starts.size, keep.size, modes.output.shape[0]))
    order, longest = np.argsort(starts, kind="stable"), int(keep.max())
    # what lies between runs is not stepped
    for together in np.split(order, np.flatnonzero(np.diff(starts[order]) > longest) + 1):
        first, last = int(starts[together[0]]), int(starts[together[-1]]) + longest
        rows = slice(first + 1, last + 1)
        pushed = boundary[rows] @ modes.boundary.T + heat[rows] @ modes.heating.T
        path = np.zeros((len(pushed) + 1, pushed.shape[1]))
        path[1:] = propagator.end_gain * pushed
        for k in range(len(pushed)):
            path[k + 1] += propagator.end * path[k]
        shared = (propagator.mean * path[:-1] + propagator.mean_gain * pushed) @ modes.output.T
        at = starts[together] - first
        behind = own[together] - path[at]
        for position, k in enumerate(keep):
            fading = modes.output * (propagator.mean * propagator.end ** (k - 1))
            means[together, position] = shared[at + k - 1] + behind @ fading.T
    return means
