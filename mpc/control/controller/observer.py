"""State and unmeasured heat between two actions: a Kalman filter, or a moving horizon with bounds."""

from typing import NamedTuple

import numpy as np

from calibration.estimation.kalman import KalmanFilter
from mpc.control.solvers.convex import solve_quadratic
from mpc.control.solvers.solution import Status
from mpc.errors import ControlError
from thermal._types import BoolArray, FloatArray
from thermal.model.modal import ModalModel
from thermal.units import REFERENCE_TEMPERATURE


class Observer:
    """Corrects the predicted state by what was measured over a step, and predicts on; offset-free.

    Parameters
    ----------
    kalman : KalmanFilter
        Its steady covariance is used; its step is the time between two actions.
    modes : ModalModel
        That the filter's state space was made of.

    Raises
    ------
    ControlError
        When filter and modes are not of the same model.

    Notes
    -----
    With the unmeasured heat as a state that the predictor carries on, a constant error of the model leaves no steady
    error of the zones. Sensors that did not report are left out of the correction; gains are kept by pattern.
    """

    def __init__(self, kalman: KalmanFilter, modes: ModalModel) -> None:
        orders = kalman.space.order, modes.capacity.size
        ControlError.unless(orders[0] == orders[1], "observer", "filter and modes of the same model", orders)
        self.kalman, self.modes, self.order = kalman, modes, kalman.space.order
        self._gains: dict[bytes, FloatArray] = {}
        self._covariance, _ = kalman.steady(np.ones(kalman.space.n_zone, dtype=bool))
        self.state = np.zeros(kalman.whole.n)

    def start(self, zone: FloatArray, boundary: FloatArray) -> None:
        """Start from the steady state that holds the zones where they are, without unmeasured heat.

        Parameters
        ----------
        zone : ndarray, shape (n_zone,)
            Temperatures [K].
        boundary : ndarray, shape (n_boundary,)
            Boundary temperatures, then signals of effects [signal unit].
        """
        modes, at_rest = self.modes, 1.0 / self.modes.conductance
        outside = modes.boundary @ self._counted(boundary)
        gain = modes.observation @ (at_rest[:, None] * modes.heating)
        missing = zone - REFERENCE_TEMPERATURE - modes.observation @ (at_rest * outside)
        self.state = np.zeros(self.kalman.whole.n)
        self.state[: self.order] = at_rest * (outside + modes.heating @ np.linalg.solve(gain, missing))

    def with_emitted(self, boundary: FloatArray, heat: FloatArray) -> FloatArray:
        """Boundary temperatures and signals with those of emitters, which follow from the heat of devices.

        Parameters
        ----------
        boundary : ndarray, shape (n_boundary,)
            As in `start` [signal unit].
        heat : ndarray, shape (n_zone,)
            Heat that devices give to the zones [W].
        """
        emitted = self.modes.emitted
        if emitted is None or not emitted.any():
            return boundary
        found = np.array(boundary, dtype=float)
        found[found.size - self.modes.n_signal :] += emitted @ heat
        return found

    def update(self, zone: FloatArray, heat: FloatArray, boundary: FloatArray) -> FloatArray:
        """Take in a step that has ended.

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
        reported = np.isfinite(error)
        corrected = self.state
        if reported.any():
            corrected = self.state + self._gain(reported) @ error[reported]
        self.state = self.kalman.whole.advance(corrected)
        self.state[: self.order] += self.kalman.space.drive @ u
        return error

    def _innovation(self, zone: FloatArray, heat: FloatArray, boundary: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Give the inputs of a step, and what was measured in it minus what the state predicts [K]."""
        u = np.concatenate([self._counted(boundary), heat])
        predicted = self.kalman.whole.observation @ self.state + self.kalman.space.feedthrough @ u
        return u, np.asarray(zone - REFERENCE_TEMPERATURE - predicted)

    @property
    def innovation_deviation(self) -> FloatArray:
        """Standard deviation of the innovations according to the filter, all sensors reporting, shape (n_zone,) [K]."""
        seen = self.kalman.whole.observation
        variance = np.einsum("zi,ij,zj->z", seen, self._covariance, seen) + self.kalman.whole.noise_variance
        return np.asarray(np.sqrt(variance))

    @property
    def memory(self) -> FloatArray:
        """Everything that the next estimates depend on, to be saved with a controller's state [its own]."""
        return self.state.copy()

    @memory.setter
    def memory(self, kept: FloatArray) -> None:
        self.state = np.array(kept)

    @property
    def modal_state(self) -> FloatArray:
        """State of the modes now, shape (r,) [(W K)^0.5]."""
        return self.state[: self.order]

    @property
    def disturbance(self) -> FloatArray:
        """Unmeasured heat now, shape (n_zone,) [W]."""
        return self.state[self.order :]

    def _counted(self, boundary: FloatArray) -> FloatArray:
        counted = np.array(boundary, dtype=float)
        counted[: counted.size - self.modes.n_signal] -= REFERENCE_TEMPERATURE
        return counted

    def _gain(self, reported: BoolArray) -> FloatArray:
        key = reported.tobytes()
        if key not in self._gains:
            self._gains[key] = self._correction(self._covariance, reported)[0]
        return self._gains[key]

    def _correction(self, covariance: FloatArray, reported: BoolArray) -> tuple[FloatArray, FloatArray]:
        """Gain of the sensors that reported, and covariance of state and readings, shape (n, n_reported) each."""
        seen = self.kalman.whole.observation[reported]
        cross = covariance @ seen.T
        innovation = seen @ cross + np.diag(self.kalman.whole.noise_variance[reported])
        return np.asarray(np.linalg.solve(innovation, cross.T).T, dtype=float), cross


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
            raise ControlError("moving horizon", "a step or more, and lower bounds below upper ones", found)
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

    def _carried(self, covariance: FloatArray, reported: BoolArray) -> FloatArray:
        """Covariance of the prediction one step on, after those sensors that reported."""
        gain, cross = self._correction(covariance, reported)
        left = covariance - gain @ cross.T
        return self.kalman.whole.propagate(0.5 * (left + left.T))

    def trajectory(self) -> FloatArray:
        """Estimate of the window: states at its edges, shape (h + 1, n) [(W K)^0.5 and W].

        The last one is the prediction from all that was measured; those before it are smoothed.
        """
        whole, n, zones, count = self.kalman.whole, self.kalman.whole.n, self.kalman.space.n_zone, len(self._window)
        values, vectors = np.linalg.eigh(self._arrival)
        root = vectors * np.sqrt(np.maximum(values, 0.0))
        states = np.zeros((count + 1, n))  # without noise
        response = np.zeros((count + 1, n, n + count * zones))  # to the arrival and to what each step adds
        states[0] = self._window[0].prior
        for k in range(count + 1):
            response[k, :, :n] = self._powers[k] @ root
            for j in range(k):
                added = self._powers[k - 1 - j][:, self.order :] * self._noise
                response[k, :, n + j * zones : n + (j + 1) * zones] = added
        for k, step in enumerate(self._window):
            states[k + 1] = whole.advance(states[k])
            states[k + 1, : self.order] += self.kalman.space.drive @ step.u
        return states + response @ self._whitened(states, response)

    def _whitened(self, states: FloatArray, response: FloatArray) -> FloatArray:
        """Solve for arrival and noise, in their own deviations."""
        whole, space = self.kalman.whole, self.kalman.space
        rows, left = [], []
        for k, step in enumerate(self._window):
            reported = np.isfinite(step.zone)
            weight = 1.0 / np.sqrt(whole.noise_variance[reported])
            predicted = whole.observation @ states[k] + space.feedthrough @ step.u
            rows.append(weight[:, None] * (whole.observation[reported] @ response[k]))
            left.append(weight * (step.zone - predicted)[reported])
        seen, missing = np.vstack(rows), np.concatenate(left)
        # by the smaller of the two: as many equations as measurements
        free = seen.T @ np.linalg.solve(np.eye(missing.size) + seen @ seen.T, missing)
        heat, moved = states[:, self.order :], response[:, self.order :]
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
        if not outcome.solved:
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
