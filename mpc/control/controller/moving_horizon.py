"""Moving-horizon estimation: state and unmeasured heat from the last hours, within bounds."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from calibration.estimation.kalman import KalmanFilter
from mpc.control.controller.observer import Observer
from mpc.control.solvers.quadratic import solve_quadratic
from mpc.control.solvers.solution import Status
from mpc.errors import ControlError
from thermal._types import FloatArray
from thermal.errors import describe
from thermal.model.modal import ModalModel
from thermal.units import REFERENCE_TEMPERATURE

_ROUND_OFF = 1e-6  # W: bounds that are missed by less are met


class _Step(NamedTuple):
    """A step of the window: prediction of its start when it began, its measurements and inputs."""

    prior: FloatArray
    zone: FloatArray
    u: FloatArray


class MovingHorizonObserver(Observer):
    """An `Observer` that looks back over a window of steps and keeps the unmeasured heat within bounds.

    Parameters
    ----------
    kalman : KalmanFilter
        Model of disturbance and sensors; its step is the time between two actions.
    modes : ModalModel
        That the filter's state space was made of.
    steps : int
        Length of the window, 1 or more.
    lower, upper : float or ndarray, shape (n_zone,)
        Bounds of the unmeasured heat [W]; infinite by default.

    Raises
    ------
    ControlError
        When filter and modes are not of the same model, the window has no step, or bounds are empty.

    Notes
    -----
    Over the window's h steps, with ``z = [x; d]``, ``w`` what a step adds to the heat and ``v`` a sensor's noise,

    ``min |z_0 - z̄|²_(P^-1) + Σ |w_k|²_(q^-1) + Σ |v_k|²_(R^-1)``,  ``z_k+1 = Ā z_k + B u_k + [0; w_k]``,
    ``y_k = C̄ z_k + D u_k + v_k``,  ``lower <= d_k <= upper``

    (Rao, Rawlings and Lee 2001, doi:10.1016/S0005-1098(01)00115-7). The arrival cost has the observer's own prediction
    of the window's first state and the Kalman filter's covariance of it, carried on by the pattern of sensors that
    reported. Without an active bound the estimate is the Kalman filter's, whatever the window. All unknowns are counted
    in their own deviations, so that no covariance is inverted.
    """

    def __init__(
        self,
        kalman: KalmanFilter,
        modes: ModalModel,
        steps: int = 12,
        lower: FloatArray | float = -np.inf,
        upper: FloatArray | float = np.inf,
    ) -> None:
        super().__init__(kalman, modes)
        n, zones = kalman.whole.n, kalman.space.n_zone
        self.lower, self.upper = (np.broadcast_to(np.asarray(b, dtype=float), (zones,)) for b in (lower, upper))
        if steps < 1 or not (self.lower < self.upper).all():
            found = f"{steps} steps, bounds from {self.lower.max():g} to {self.upper.min():g} W"
            raise ControlError(describe("moving horizon", "a step or more, and lower bounds below upper ones", found))
        self.steps = steps
        #: How the last estimate was found.
        self.status = Status.CONVERGED
        self._window: list[_Step] = []
        self._arrival = self._covariance
        # responses of the state to itself and to what a step adds to the heat, after 0, 1, ... steps
        self._powers = [np.eye(n)]
        for _ in range(steps):
            self._powers.append(kalman.whole.advance(self._powers[-1]))
        self._noise = np.sqrt(kalman.whole.heat_variance)

    def start(self, zone: FloatArray, boundary: FloatArray) -> None:
        """Start from the steady state that holds the zones where they are, see `Observer.start`.

        Parameters
        ----------
        zone : ndarray, shape (n_zone,)
            Temperatures [K].
        boundary : ndarray, shape (n_boundary,)
            Boundary temperatures, then signals of effects [signal unit].
        """
        super().start(zone, boundary)
        self._window, self._arrival, self.status = [], self._covariance, Status.CONVERGED

    def update(self, zone: FloatArray, heat: FloatArray, boundary: FloatArray) -> FloatArray:
        """Take in a step that has ended, see `Observer.update`.

        Parameters
        ----------
        zone : ndarray, shape (n_zone,)
            Measured means over the step [K]; NaN where missing.
        heat : ndarray, shape (n_zone,)
            Known heat into the zones over the step [W].
        boundary : ndarray, shape (n_boundary,)
            As in `start` [signal unit].

        Returns
        -------
        ndarray, shape (n_zone,)
            Innovations: measured minus predicted [K]; NaN where missing.
        """
        u, error = self._innovation(zone, heat, boundary)
        if len(self._window) == self.steps:
            self._arrival = self._carried(self._arrival, np.isfinite(self._window[0].zone))
            self._window.pop(0)
        self._window.append(_Step(self.state, np.asarray(zone - REFERENCE_TEMPERATURE), u))
        self.state = self.trajectory()[-1]
        return error

    def _carried(self, covariance: FloatArray, reported: NDArray[np.bool_]) -> FloatArray:
        """Covariance of the prediction one step on, after those sensors that reported."""
        whole = self.kalman.whole
        seen = whole.observation[reported]
        reach = covariance @ seen.T
        innovation = seen @ reach + np.diag(whole.noise_variance[reported])
        left = covariance - reach @ np.linalg.solve(innovation, reach.T)
        return whole.propagate(0.5 * (left + left.T))

    def trajectory(self) -> FloatArray:
        """Estimate of the window: states at its edges, shape (h + 1, n) [(W K)^0.5 and W].

        The last one is the prediction from all that was measured; those before it are smoothed.
        """
        whole, n, zones, count = self.kalman.whole, self.kalman.whole.n, self.kalman.space.n_zone, len(self._window)
        values, vectors = np.linalg.eigh(self._arrival)
        root = vectors * np.sqrt(np.maximum(values, 0.0))
        states = np.zeros((count + 1, n))  # without noise
        slopes = np.zeros((count + 1, n, n + count * zones))  # by the arrival and by what each step adds
        states[0] = self._window[0].prior
        for k, step in enumerate(self._window):
            states[k + 1] = whole.advance(states[k])
            states[k + 1, : self.order] += self.kalman.space.drive @ step.u
            slopes[k, :, :n] = self._powers[k] @ root
            for j in range(k):
                part = self._powers[k - 1 - j][:, self.order :] * self._noise
                slopes[k, :, n + j * zones : n + (j + 1) * zones] = part
        slopes[count, :, :n] = self._powers[count] @ root
        for j in range(count):
            part = self._powers[count - 1 - j][:, self.order :] * self._noise
            slopes[count, :, n + j * zones : n + (j + 1) * zones] = part
        return states + slopes @ self._whitened(states, slopes)

    def _whitened(self, states: FloatArray, slopes: FloatArray) -> FloatArray:
        """Solve for arrival and noise, in their own deviations."""
        whole, space = self.kalman.whole, self.kalman.space
        rows, left = [], []
        for k, step in enumerate(self._window):
            reported = np.isfinite(step.zone)
            weight = 1.0 / np.sqrt(whole.noise_variance[reported])
            predicted = whole.observation @ states[k] + space.feedthrough @ step.u
            rows.append(weight[:, None] * (whole.observation[reported] @ slopes[k]))
            left.append(weight * (step.zone - predicted)[reported])
        seen, missing = np.vstack(rows), np.concatenate(left)
        # by the smaller of the two: as many equations as measurements
        free = seen.T @ np.linalg.solve(np.eye(missing.size) + seen @ seen.T, missing)
        heat, moved = states[:, self.order :], slopes[:, self.order :]
        found = heat + moved @ free
        self.status = Status.CONVERGED
        if (found >= self.lower - _ROUND_OFF).all() and (found <= self.upper + _ROUND_OFF).all():
            return np.asarray(free)
        bounded = np.flatnonzero(np.isfinite(self.lower) | np.isfinite(self.upper))
        limited = moved[:, bounded].reshape(-1, free.size)
        at = heat[:, bounded].ravel()
        lower, upper = (np.tile(b[bounded], len(heat)) - at for b in (self.lower, self.upper))
        size = np.abs(limited).max(axis=1).clip(1e-12)
        outcome = solve_quadratic(
            np.eye(free.size) + seen.T @ seen, -(seen.T @ missing), limited / size[:, None], lower / size, upper / size
        )
        if not (outcome.solved and np.isfinite(outcome.x).all()):
            self.status = Status.FAILED  # the unbounded estimate stands
            return np.asarray(free)
        return outcome.x

    @property
    def memory(self) -> FloatArray:
        """Everything that the next estimates depend on, to be saved with a controller's state [its own]."""
        steps = [np.concatenate(step) for step in self._window]
        return np.concatenate([[len(steps)], self.state, self._arrival.ravel(), *steps])

    @memory.setter
    def memory(self, kept: FloatArray) -> None:
        n, zones, count = self.state.size, self.kalman.space.n_zone, int(kept[0])
        self.state = np.array(kept[1 : n + 1])
        self._arrival = np.array(kept[n + 1 : n + 1 + n * n]).reshape(n, n)
        parts = kept[n + 1 + n * n :].reshape(count, -1) if count else np.zeros((0, 0))
        self._window = [_Step(p[:n].copy(), p[n : n + zones].copy(), p[n + zones :].copy()) for p in parts]
