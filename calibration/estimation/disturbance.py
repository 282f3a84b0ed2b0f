"""Heat that nobody measures: one autocorrelated state a zone beside a state space, and the steady covariances.

Steady covariances are found by doubling: each iteration doubles the number of steps, without eigenvalues.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import scipy.linalg as sl
from numpy.typing import NDArray
from scipy.signal import lfilter

from calibration.errors import FilterError
from calibration.estimation.state_space import StateSpace
from thermal._types import FloatArray

#: What a random walk's deviation is the growth over [s]: a day.
RANDOM_WALK_TIME = 86400.0

#: Doublings: 2^60 steps are longer than any building remembers.
_DOUBLINGS = 60

#: Growth of each variance in a doubling below which it is steady [-].
_STEADY = 1e-13


@dataclass(frozen=True)
class DisturbanceModel:
    """Unmeasured heat in each zone and noise of its sensor.

    The heat d is constant during a step and autocorrelated, ``d' = φ d + w`` with ``φ = exp(-Δt / τ)`` and
    ``Var w = σ² (1 - φ²)``: an Ornstein-Uhlenbeck process, sampled exactly at any step (Gillespie 1996,
    doi:10.1103/PhysRevE.54.2084). An infinite τ makes it a random walk, whose σ is its growth over a day.

    Parameters
    ----------
    deviation : float or ndarray, shape (n_zone,)
        Stationary standard deviation σ of the heat [W], 0 or more; one number is common to the zones.
    time_constant : float
        Correlation time τ [s], positive; infinite for a random walk.
    sensor_deviation : float or ndarray, shape (n_zone,)
        Standard deviation of the white noise of a sensor's mean over a step [K], positive.

    Raises
    ------
    FilterError
        When a value is out of its range.

    Examples
    --------
    >>> keep, deviation = DisturbanceModel(100.0, 3600.0, 0.05).discrete(300.0)
    >>> round(keep, 3), deviation.round(1).tolist()
    (0.92, [39.2])
    """

    deviation: FloatArray | float
    time_constant: float
    sensor_deviation: FloatArray | float

    def __post_init__(self) -> None:
        for name in ("deviation", "sensor_deviation"):
            object.__setattr__(self, name, np.atleast_1d(np.asarray(getattr(self, name), dtype=float)))
        heat, noise = np.asarray(self.deviation), np.asarray(self.sensor_deviation)
        if heat.ndim > 1 or not (np.isfinite(heat) & (heat >= 0)).all():
            raise FilterError(f"deviation: expected watts of 0 or more, one or one a zone, got {heat}")
        if noise.ndim > 1 or not (np.isfinite(noise) & (noise > 0)).all():
            raise FilterError(f"sensor_deviation: expected positive kelvins, one or one a zone, got {noise}")
        FilterError.unless(self.time_constant > 0, "time_constant", "positive seconds", repr(self.time_constant))

    @property
    def random_walk(self) -> bool:
        """Whether the heat never returns to zero by itself."""
        return bool(np.isinf(self.time_constant))

    def discrete(self, step: float) -> tuple[float, FloatArray]:
        """φ [-] and the standard deviation of w [W] at a step.

        Parameters
        ----------
        step : float
            Step [s].
        """
        heat = np.asarray(self.deviation)
        if self.random_walk:
            return 1.0, heat * np.sqrt(step / RANDOM_WALK_TIME)
        # 1 - φ² by expm1: the step may be a millionth of the time constant
        return float(np.exp(-step / self.time_constant)), heat * np.sqrt(-np.expm1(-2.0 * step / self.time_constant))

    def drawn(self, step: float, n_steps: int, n_zone: int, rng: np.random.Generator) -> FloatArray:
        """Draw the heat, shape (n_steps, n_zone) [W]; a random walk begins at 0.

        Parameters
        ----------
        step : float
            Step [s].
        n_steps, n_zone : int
            How many.
        rng : numpy.random.Generator
            Makes the draw.

        Examples
        --------
        >>> heat = DisturbanceModel(100.0, 3600.0, 0.05).drawn(300.0, 100_000, 1, np.random.default_rng(0))
        >>> round(heat.std())
        100
        """
        keep, added = self.discrete(step)
        shocks = rng.standard_normal((n_steps, n_zone))
        shocks[0] *= 0.0 if self.random_walk else self.deviation
        shocks[1:] *= added
        return np.asarray(lfilter([1.0], [1.0, -keep], shocks, axis=0))

    def near(self, other: DisturbanceModel, limit: float) -> bool:
        """Whether every number is within a share of another disturbance's.

        Parameters
        ----------
        other : DisturbanceModel
            Of the same zones.
        limit : float
            Largest relative difference [-].
        """
        pairs = [(getattr(self, name), getattr(other, name)) for name in self.__dataclass_fields__]
        return all(np.allclose(own, theirs, rtol=limit, atol=0.0) for own, theirs in pairs)

    def to_dict(self) -> dict[str, Any]:
        """Values for a file; one that is common to the zones as a single number."""
        heat, noise = (np.unique(np.asarray(v)) for v in (self.deviation, self.sensor_deviation))
        return {
            "deviation": float(heat[0]) if heat.size == 1 else np.asarray(self.deviation).tolist(),
            "time_constant": self.time_constant,
            "sensor_deviation": float(noise[0]) if noise.size == 1 else np.asarray(self.sensor_deviation).tolist(),
        }


@dataclass(frozen=True)
class DisturbedSpace:
    """A state space with the disturbances as further states, ``z = [x; d]``: ``z' = Ā z + ...``, ``y = C̄ z + ...``.

    Parameters
    ----------
    space : StateSpace
        The building.
    disturbance : DisturbanceModel
        Its unmeasured heat and sensors.

    Raises
    ------
    FilterError
        When the disturbance is of another number of zones.
    """

    space: StateSpace
    disturbance: DisturbanceModel

    def __post_init__(self) -> None:
        for name in ("deviation", "sensor_deviation"):
            size = np.size(getattr(self.disturbance, name))
            expected = f"one {name} or one for each of {self.space.n_zone} zones"
            FilterError.unless(size in (1, self.space.n_zone), "disturbance", expected, size)

    @property
    def n(self) -> int:
        """Number of states, r + n_zone."""
        return self.space.order + self.space.n_zone

    @cached_property
    def _coupling(self) -> FloatArray:
        return np.ascontiguousarray(self.space.heat_drive)

    @cached_property
    def keep(self) -> float:
        """φ, share of the disturbance that a step leaves [-]."""
        return self.disturbance.discrete(self.space.step)[0]

    @cached_property
    def heat_variance(self) -> FloatArray:
        """Variance of what a step adds to each disturbance, shape (n_zone,) [W²]."""
        return np.broadcast_to(self.disturbance.discrete(self.space.step)[1] ** 2, (self.space.n_zone,))

    @cached_property
    def noise_variance(self) -> FloatArray:
        """Variance of each sensor, shape (n_zone,) [K²]."""
        return np.broadcast_to(np.asarray(self.disturbance.sensor_deviation) ** 2, (self.space.n_zone,))

    @cached_property
    def observation(self) -> FloatArray:
        """C̄ = [C, D of the heat], shape (n_zone, n)."""
        return np.hstack([self.space.observation, self.space.heat_feedthrough])

    def advance(self, states: FloatArray) -> FloatArray:
        """Multiply states in columns, ``Ā z``.

        Parameters
        ----------
        states : ndarray, shape (n,) or (n, m)
            States [(W K)^0.5 and W].
        """
        r, out = self.space.order, np.empty(states.shape)
        out[:r] = self.space.advance(states[:r])
        out[:r] += self._coupling @ states[r:]
        out[r:] = self.keep * states[r:]
        return out

    def retreat(self, costates: FloatArray) -> FloatArray:
        """Multiply vectors in columns by the transpose, ``Ā' z``.

        Parameters
        ----------
        costates : ndarray, shape (n,) or (n, m)
            Vectors of the dual space [(W K)^-0.5 and 1/W].
        """
        r, out = self.space.order, np.empty(costates.shape)
        out[:r] = self.space.retreat(costates[:r])
        out[r:] = self.keep * costates[r:]
        out[r:] += self._coupling.T @ costates[:r]
        return out

    def corrected(self, reach: FloatArray, weight: FloatArray) -> FloatArray:
        """``Ā (I - P C̄' F^-1 C̄)``: a step of which the measurements have corrected the state, shape (n, n).

        Parameters
        ----------
        reach : ndarray, shape (n, n_zone)
            ``P C̄'`` [states times K].
        weight : ndarray, shape (n_zone, n_zone)
            ``F^-1`` [1/K²].
        """
        return self.advance(np.eye(self.n) - reach @ weight @ self.observation)

    def propagate(self, covariance: FloatArray) -> FloatArray:
        """``Ā P Ā' + Q``: a covariance one step on.

        Parameters
        ----------
        covariance : ndarray, shape (n, n)
            P, symmetric [products of states].
        """
        out = self.advance(np.ascontiguousarray(self.advance(covariance).T))
        disturbance = np.arange(self.space.order, self.n)
        out[disturbance, disturbance] += self.heat_variance
        return out

    def dense(self) -> FloatArray:
        """Ā as a matrix, shape (n, n)."""
        return self.advance(np.eye(self.n))

    def steady(self, measured: NDArray[np.bool_]) -> tuple[FloatArray, FloatArray]:
        """Steady covariance P of the one-step prediction, and the information that a long future holds about z.

        Parameters
        ----------
        measured : ndarray of bool, shape (n_zone,)
            Zones with a sensor.

        Returns
        -------
        tuple of ndarray, shape (n, n)
            ``P = Ā (P - P C̄' (C̄ P C̄' + R)^-1 C̄ P) Ā' + Q`` [products of states], and the solution Y of the dual
            equation, ``Y = Ā' Y (I + Q Y)^-1 Ā + C̄' R^-1 C̄``.

        Raises
        ------
        FilterError
            When there is none: a random walk in a zone without a sensor grows for ever.
        """
        blind = ~measured & (self.heat_variance > 0)
        if self.disturbance.random_walk and blind.any():
            raise FilterError(
                f"disturbance: expected sensors wherever it is a random walk, got none in zones "
                f"{np.flatnonzero(blind).tolist()}; give these a deviation of 0, or all a finite time constant"
            )
        # in units of what each state does to the zones, so that the two Gramians are of like size
        heat = np.sqrt(np.maximum(self.heat_variance, 1e-12))
        unit = np.concatenate([np.full(self.space.order, np.median(heat) * np.sqrt(self.space.step)), heat])
        seen = self.observation[measured] * unit
        information = seen.T @ (seen / self.noise_variance[measured, None])
        spread = np.zeros((self.n, self.n))
        np.fill_diagonal(spread[self.space.order :, self.space.order :], self.heat_variance / heat**2)
        covariance, dual = doubled_riccati(self.dense() / unit[:, None] * unit, information, spread)
        return covariance * np.outer(unit, unit), dual / np.outer(unit, unit)


def doubled_riccati(
    transition: FloatArray, information: FloatArray, spread: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Solve a filter's Riccati equation and its dual by structure-preserving doubling.

    ``P = A (P - P C' (C P C' + R)^-1 C P) A' + Q`` and ``Y = A' Y (I + Q Y)^-1 A + C' R^-1 C`` (Chu, Fan, Lin and Wang
    2004, doi:10.1080/00207170410001714988). A building of 123 zones and 621 states takes 1.3 s on one core, 16 s by the
    eigenvalues of SciPy, whose residual is some thousand times as large.

    Parameters
    ----------
    transition : ndarray, shape (n, n)
        A [-].
    information : ndarray, shape (n, n)
        ``C' R^-1 C``, what a step's measurements tell [-].
    spread : ndarray, shape (n, n)
        Q, what a step adds [-].

    Returns
    -------
    tuple of ndarray, shape (n, n)
        P and Y.

    Raises
    ------
    FilterError
        When it does not converge.
    """
    a, g, h = transition.T.copy(), information, spread
    eye = np.eye(len(a))
    with np.errstate(over="ignore", invalid="ignore"):  # what grows for ever is told below
        for _ in range(_DOUBLINGS):
            factor = sl.lu_factor(eye + g @ h, check_finite=False)
            across = sl.lu_solve(factor, np.hstack([a, g @ a.T]), check_finite=False)
            first, second = across[:, : len(a)], across[:, len(a) :]
            added = a.T @ (h @ first)
            g = g + a @ second
            h, a = h + 0.5 * (added + added.T), a @ first
            g = 0.5 * (g + g.T)
            if not np.isfinite(h).all():
                break
            if (np.diag(added) <= _STEADY * np.diag(h)).all():
                return h, g
    raise FilterError(
        f"steady filter: the Riccati equation of {len(a)} states did not converge; "
        "a deviation, time constant or sensor deviation out of proportion does this"
    )


def summed_stein(transition: FloatArray, source: FloatArray) -> FloatArray:
    """Sum of ``L'^j X L^j`` over all j, the solution of ``Y = L' Y L + X``, by doubling (Smith 1968).

    Parameters
    ----------
    transition : ndarray, shape (n, n)
        L, stable [-].
    source : ndarray, shape (n, n)
        X, symmetric [-].
    """
    total, power = source, transition
    for _ in range(_DOUBLINGS):
        added = power.T @ total @ power
        total = total + 0.5 * (added + added.T)
        if np.abs(np.diag(added)).max() <= _STEADY * np.abs(np.diag(total)).max():
            break
        power = power @ power
    return total
