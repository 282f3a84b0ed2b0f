"""The state between two actions: the Kalman filter with the unmeasured heat of each zone, a step at a time."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from calibration.estimation.kalman import KalmanFilter
from mpc.errors import ControlError
from thermal._types import FloatArray
from thermal.errors import describe
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
        if kalman.space.order != modes.capacity.size:
            found = f"{kalman.space.order} and {modes.capacity.size} states"
            raise ControlError(describe("observer", "filter and modes of the same model", found))
        self.kalman, self.modes, self.order = kalman, modes, kalman.space.order
        self._gains: dict[bytes, FloatArray] = {}
        self._covariance, _ = kalman.steady(np.ones(kalman.space.n_zone, dtype=bool))
        self.state = np.zeros(kalman.whole.n)

    def start(self, zone: FloatArray, boundary: FloatArray) -> None:
        """Start from the steady state that holds the zones where they are.

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

    def _gain(self, reported: NDArray[np.bool_]) -> FloatArray:
        key = reported.tobytes()
        if key not in self._gains:
            seen = self.kalman.whole.observation[reported]
            reach = self._covariance @ seen.T
            innovation = seen @ reach + np.diag(self.kalman.whole.noise_variance[reported])
            self._gains[key] = np.asarray(np.linalg.solve(innovation, reach.T).T, dtype=float)
        return self._gains[key]
