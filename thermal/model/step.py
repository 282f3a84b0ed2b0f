"""Time stepping: schemes as stages of one form, and a stepper with one factorisation for many runs at once.

Every stage solves ``(C + a Δt K) T = C (Σ_i w_i T_i) + a Δt (flow-in of the inputs) - b Δt K T_0 ...``; see `Stage`.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from thermal._types import FloatArray
from thermal.errors import ModelError
from thermal.model.factor import Matrix, Pencil, factorise
from thermal.units import AIR_HEAT_CAPACITY

SchemeName = Literal["implicit_euler", "tr_bdf2", "exact"]

_GAMMA = 2.0 - np.sqrt(2.0)


@dataclass(frozen=True)
class Stage:
    """``C (T - Σ w_i T_i) = Δt (implicit F(T) + explicit F(T_0))`` with ``F(T) = B u + H q - K T``.

    Parameters
    ----------
    weights : tuple of float
        ``w_i`` of the earlier states (the step's start, then earlier stages); they sum to 1 [-].
    implicit, explicit : float
        Coefficients [-].
    """

    weights: tuple[float, ...]
    implicit: float
    explicit: float


@dataclass(frozen=True)
class Scheme:
    """A one-step method whose stages share one matrix.

    Parameters
    ----------
    name : str
        ``implicit_euler`` (first order), ``tr_bdf2`` (second order, L-stable; Bank et al. 1985,
        doi:10.1109/T-ED.1985.22232) or ``exact`` (zero-order hold of a reduced model's modes).
    stages : tuple of Stage
        In order; the last gives the state at the end of the step. None for ``exact``.
    mean : tuple of float
        Quadrature weights of the step's mean over start and stages [-]; they sum to 1. None for ``exact``.
    """

    name: SchemeName
    stages: tuple[Stage, ...]
    mean: tuple[float, ...]

    @property
    def implicit(self) -> float:
        """Coefficient of the matrix ``C + implicit Δt K`` [-]."""
        return self.stages[0].implicit


#: First order, as in the paper; with piecewise constant inputs its mean over a step is the trapezoid's.
IMPLICIT_EULER = Scheme("implicit_euler", (Stage((1.0,), 1.0, 0.0),), (0.5, 0.5))

#: Second order and L-stable.
TR_BDF2 = Scheme(
    "tr_bdf2",
    (
        Stage((1.0,), _GAMMA / 2.0, _GAMMA / 2.0),
        Stage((-((1.0 - _GAMMA) ** 2) / (_GAMMA * (2.0 - _GAMMA)), 1.0 / (_GAMMA * (2.0 - _GAMMA))), _GAMMA / 2.0, 0.0),
    ),
    (_GAMMA / 2.0, 0.5, (1.0 - _GAMMA) / 2.0),
)

#: Zero-order hold without any error of time stepping: for the modes of a reduced model, not on the grid.
EXACT = Scheme("exact", (), ())

#: Schemes of the grid by name.
SCHEMES: dict[str, Scheme] = {s.name: s for s in (IMPLICIT_EULER, TR_BDF2)}


class Stepper:
    """Steps ``C dT/dt = -K T + B u + H (q + M(t) T_zone)`` and its derivatives with respect to θ.

    ``M(t)`` are the directed airflows: not part of the symmetric K, they act between zone means and enter each solve
    exactly, as a
    correction of the rank of the zones (Woodbury), so that a flow that changes every step needs no new factorisation.

    Parameters
    ----------
    matrices : Pencil
        The model at one θ; with sensitivities when sensitivities are wanted.
    step : float
        Time step [s].
    scheme : Scheme
        Implicit Euler by default.

    Raises
    ------
    ModelError
        When the matrix of the step cannot be factorised.
    """

    def __init__(self, matrices: Pencil, step: float, scheme: Scheme = IMPLICIT_EULER) -> None:
        self.matrices, self.step, self.scheme = matrices, step, scheme
        n = matrices.n
        self._stiffness = matrices.flow[:, :n]
        self._exchange = matrices.flow[:, n:]
        self._solve = factorise(matrices.capacity + scheme.implicit * step * self._stiffness)
        self.n_parameter = len(matrices.flow_sensitivities)

    @cached_property
    def _stacks(self) -> tuple[tuple[list[int], Matrix], tuple[list[int], Matrix]]:
        """dC/dθ and d[K, -B]/dθ, each as the parameters that it depends on and their matrices stacked."""
        return _stacked(self.matrices.capacity_sensitivities), _stacked(self.matrices.flow_sensitivities)

    @cached_property
    def response(self) -> tuple[FloatArray, FloatArray]:
        """End of a stage per joule in each zone [K/J]: states (n, n_zone) and zone means (n_zone, n_zone)."""
        heating = self.matrices.heating
        states = self._solve(heating.toarray() if sp.issparse(heating) else np.asarray(heating))
        return states, np.asarray(self.matrices.observation @ states)

    def advance(
        self,
        states: FloatArray,
        boundary: FloatArray,
        heat: FloatArray,
        airflow: FloatArray | None = None,
        sensitivities: FloatArray | None = None,
    ) -> tuple[FloatArray, FloatArray, FloatArray | None, FloatArray | None]:
        """One step of m independent runs.

        Parameters
        ----------
        states : ndarray, shape (n, m)
            Temperatures at the start of the step [K].
        boundary : ndarray, shape (n_boundary, m)
            Boundary temperatures during the step [K].
        heat : ndarray, shape (n_zone, m)
            Heat given to the zones during the step [W].
        airflow : ndarray, shape (n_airflow, m), optional
            Directed airflows during the step [kg/s].
        sensitivities : ndarray, shape (n, n_parameter m), optional
            Derivatives of ``states`` with respect to θ, parameter by parameter [K per unit of θ].

        Returns
        -------
        tuple
            States at the end (n, m); zone means over the step (n_zone, m); and their derivatives, or None.
        """
        scheme, m = self.scheme, self.matrices
        mixing = self._mixing(airflow)
        trail = [states]
        moved_trail = [] if sensitivities is None else [sensitivities]
        source = m.heating @ heat
        for stage in scheme.stages:
            base = _combine(stage.weights, trail)
            rhs = m.capacity @ base + (stage.implicit + stage.explicit) * self.step * source
            rhs -= stage.implicit * self.step * (self._exchange @ boundary)
            if stage.explicit:
                rhs += stage.explicit * self.step * self._flow_in(states, boundary, mixing)
            new = self._solve_mixed(rhs, mixing, stage.implicit)
            if sensitivities is not None:
                moved_trail.append(self._stage_sensitivities(stage, base, new, states, moved_trail, boundary, mixing))
            trail.append(new)
        mean = np.asarray(m.output @ _combine(scheme.mean, trail))
        if sensitivities is None:
            return trail[-1], mean, None, None
        return trail[-1], mean, moved_trail[-1], np.asarray(m.output @ _combine(scheme.mean, moved_trail))

    def hold(
        self,
        states: FloatArray,
        boundary: FloatArray,
        zone: FloatArray,
        sensitivities: FloatArray | None = None,
        heat: FloatArray | None = None,
    ) -> tuple[FloatArray, FloatArray | None, FloatArray]:
        """One implicit Euler step with zone means held at given temperatures by whatever heat that takes.

        Parameters
        ----------
        states : ndarray, shape (n, 1)
            Temperatures at the start of the step [K].
        boundary : ndarray, shape (n_boundary, 1)
            Boundary temperatures [K].
        zone : ndarray, shape (n_zone, 1)
            Zone means at the end of the step [K]; NaN leaves a zone free.
        sensitivities : ndarray, shape (n, n_parameter), optional
            Derivatives of ``states`` [K per unit of θ].
        heat : ndarray, shape (n_zone, 1), optional
            Metered heat, for the zones that are left free [W]; zero by default.

        Returns
        -------
        tuple
            States at the end (n, 1), their derivatives or None, and the heat that held the zones (n_zone,) [W].

        Raises
        ------
        ModelError
            When the scheme is not implicit Euler.
        """
        m = self.matrices
        if self.scheme.implicit != 1.0:
            raise ModelError(f"hold: expected a stepper with scheme implicit_euler, got {self.scheme.name}")
        held = np.isfinite(zone[:, 0])
        rhs = m.capacity @ states - self.step * (self._exchange @ boundary)
        if heat is not None and not held.all():
            rhs += self.step * (m.heating @ np.where(held[:, None], 0.0, heat))
        free = self._solve(rhs)
        missing = zone - m.observation @ free
        missing[~held] = 0.0
        response, gain = self.response
        holding = np.zeros_like(missing)
        holding[held] = np.linalg.solve(gain if held.all() else gain[np.ix_(held, held)], missing[held])
        new = free + response @ holding
        watts = holding[:, 0] / self.step
        if sensitivities is None:
            return new, None, watts
        source = self._sensitivity_source(new - states, np.vstack([new, boundary]))
        moved = self._solve(m.capacity @ sensitivities + source)
        return new, moved - self._lift(held) @ (m.observation @ moved)[held], watts

    def hold_many(
        self,
        states: FloatArray,
        boundary: FloatArray,
        zone: FloatArray,
        keep: NDArray[np.int64],
        sensitivities: FloatArray | None = None,
        heat: FloatArray | None = None,
        progress: Callable[[int], None] | None = None,
    ) -> tuple[FloatArray, FloatArray | None]:
        """Hold the zones over many steps and keep the states at some of them.

        Parameters
        ----------
        states : ndarray, shape (n, 1)
            Temperatures at the start [K].
        boundary : ndarray, shape (n_time, n_boundary)
            Boundary temperatures of each step [K].
        zone : ndarray, shape (n_time, n_zone)
            Zone means at the end of each step [K]; a zone that is NaN throughout stays free.
        keep : ndarray of int, shape (m,)
            Steps (counted from 0) after which states are kept, increasing.
        sensitivities : ndarray, shape (n, n_parameter), optional
            Derivatives of ``states`` [K per unit of θ].
        heat : ndarray, shape (n_time, n_zone), optional
            Metered heat of each step, for the zones that are left free [W]; zero by default.
        progress : callable, optional
            Called with the number of steps done.

        Returns
        -------
        tuple
            Kept states (n, m) and derivatives (n, n_parameter m) parameter by parameter, or None.
        """
        n, p = self.matrices.n, self.n_parameter
        kept, kept_sensitivities = np.empty((n, keep.size)), np.empty((n, p, keep.size))
        wanted = {int(k): i for i, k in enumerate(keep)}
        for k in range(int(keep[-1]) + 1):
            given = heat[k][:, None] if heat is not None else None
            states, sensitivities, _ = self.hold(states, boundary[k][:, None], zone[k][:, None], sensitivities, given)
            if k in wanted:
                kept[:, wanted[k]] = states[:, 0]
                if sensitivities is not None:
                    kept_sensitivities[:, :, wanted[k]] = sensitivities
            if progress is not None:
                progress(k + 1)
        return kept, kept_sensitivities.reshape(n, p * keep.size) if sensitivities is not None else None

    def _lift(self, held: NDArray[np.bool_]) -> FloatArray:
        """States per kelvin of each held zone mean, shape (n, n_held) [K/K]."""
        response, gain = self.response
        return np.asarray(np.linalg.solve(gain[np.ix_(held, held)].T, response[:, held].T).T)

    def _sensitivity_source(self, change: FloatArray, full: FloatArray) -> FloatArray:
        """Source of the sensitivities in a stage, (n, n_parameter m): ``-dC (T - T_base) - Δt d[K, -B] [T; u]``."""
        capacity, flow = self._stacks
        n, m = change.shape
        sparse = sp.issparse(self._stiffness)
        # what solves wants its columns whole if sparse, parameter by parameter, and its rows whole if dense
        out = np.zeros((self.n_parameter, m, n)).transpose(2, 0, 1) if sparse else np.zeros((n, self.n_parameter, m))
        for (which, matrix), x in ((capacity, -change), (flow, -self.step * full)):
            if which:
                product = np.asarray(matrix @ x)
                moved = product.reshape(len(which), n, m).transpose(1, 0, 2) if sparse else product
                out[:, which] += moved.reshape(n, len(which), m)
        return out.reshape(n, -1)

    def _mixing(self, airflow: FloatArray | None) -> FloatArray | None:
        """M for each run, shape (m, n_zone, n_zone) [W/K]: air that enters a zone at another zone's temperature."""
        if airflow is None or not self.matrices.airflows:
            return None
        n_zone = self.matrices.observation.shape[0]
        mixing = np.zeros((airflow.shape[1], n_zone, n_zone))
        for flow, (source, target) in zip(airflow, self.matrices.airflows, strict=True):
            mixing[:, target, source] += AIR_HEAT_CAPACITY * flow
            mixing[:, target, target] -= AIR_HEAT_CAPACITY * flow
        return mixing

    def _solve_mixed(self, rhs: FloatArray, mixing: FloatArray | None, implicit: float) -> FloatArray:
        """Solve ``(C + a Δt (K - H M O)) T = rhs``; columns of ``rhs`` cycle through the runs."""
        free = self._solve(rhs)
        if mixing is None:
            return free
        response, gain = self.response
        m, n_zone = mixing.shape[:2]
        scale = implicit * self.step
        closed = mixing @ np.linalg.inv(np.eye(n_zone) - scale * (gain @ mixing))
        zone = np.asarray(self.matrices.observation @ free).reshape(n_zone, -1, m).transpose(2, 0, 1)
        heat = (closed @ zone).transpose(1, 2, 0).reshape(n_zone, -1)
        return np.asarray(free + scale * (response @ heat))

    def _flow_in(self, states: FloatArray, boundary: FloatArray, mixing: FloatArray | None) -> FloatArray:
        """Heat into each volume without the zone heat [W]."""
        m = self.matrices
        flow = -(self._stiffness @ states) - (self._exchange @ boundary)
        return flow + m.heating @ self._mixed_heat(states, mixing) if mixing is not None else np.asarray(flow)

    def _mixed_heat(self, states: FloatArray, mixing: FloatArray) -> FloatArray:
        m, n_zone = mixing.shape[:2]
        zone = np.asarray(self.matrices.observation @ states).reshape(n_zone, -1, m).transpose(2, 0, 1)
        return np.asarray((mixing @ zone).transpose(1, 2, 0).reshape(n_zone, -1))

    def _stage_sensitivities(
        self,
        stage: Stage,
        base: FloatArray,
        new: FloatArray,
        start: FloatArray,
        trail: list[FloatArray],
        boundary: FloatArray,
        mixing: FloatArray | None,
    ) -> FloatArray:
        """Differentiate one stage with respect to θ."""
        m = self.matrices
        full = stage.implicit * np.vstack([new, boundary]) + stage.explicit * np.vstack([start, boundary])
        rhs = m.capacity @ _combine(stage.weights, trail) + self._sensitivity_source(new - base, full)
        if stage.explicit:
            rhs -= stage.explicit * self.step * (self._stiffness @ trail[0])
            if mixing is not None:
                rhs += stage.explicit * self.step * (m.heating @ self._mixed_heat(trail[0], mixing))
        return self._solve_mixed(rhs, mixing, stage.implicit)


def _stacked(sensitivities: list[Matrix]) -> tuple[list[int], Matrix]:
    """Which sensitivities are not zero, and these on top of each other; row by row where they are dense."""
    sparse = bool(sensitivities) and sp.issparse(sensitivities[0])
    which = [j for j, m in enumerate(sensitivities) if (m.nnz if sparse else np.any(m))]
    chosen = [sensitivities[j] for j in which]
    if not chosen:
        return which, np.empty((0, 0))
    return which, sp.vstack(chosen).tocsr() if sparse else np.stack(chosen, axis=1).reshape(-1, chosen[0].shape[1])


def _combine(weights: tuple[float, ...], trail: list[FloatArray]) -> FloatArray:
    """Weighted sum of states."""
    total = weights[0] * trail[0]
    for w, x in zip(weights[1:], trail[1:], strict=False):
        total = total + w * x
    return np.asarray(total)
