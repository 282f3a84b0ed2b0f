"""Whitening: a Kalman filter at one θ turns what a model leaves unexplained into innovations of variance 1."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibration.estimation.disturbance import DisturbanceModel, DisturbedSpace
from calibration.estimation.filtered import filter_interval, rows_of
from calibration.estimation.gains import Covariance, Gain
from calibration.evaluation.intervals import Interval
from thermal._types import FloatArray
from thermal.model.matrices import SymbolicModel
from thermal.model.replay import Inputs
from thermal.model.step import Scheme

#: Relative change of a variance in a step below which it counts as steady [-]: log-likelihoods are then right to a
#: tenth.
_TOLERANCE = 1e-5


@dataclass(frozen=True)
class Whitening:
    """The filter of one interval, with its gains, as a linear map on errors of an uncorrected run.

    A Kalman filter is linear: its innovations are those that it makes of the errors of a free run from the same start,
    as if these were the measurements of a building without any input. Divided by the Cholesky factors of their
    covariances they are ``Σ^-1/2 e``, where Σ is the covariance of the run's errors under the disturbance, without Σ
    ever being formed (Durbin and Koopman 2012, Time Series Analysis by State Space Methods, ch. 4.13).

    Parameters
    ----------
    begin, at, stop : int
        Row at which the spin-up begins, row at whose stamp the free run starts, and last row.
    whole : DisturbedSpace
        Building and disturbances.
    corrections : ndarray, shape (n_gain, n, n_zone)
        What an innovation adds to the states, by every gain that is used [states per K].
    gain_of : ndarray of int, shape (n_time,)
        Which of them a step uses.
    roots : ndarray, shape (n_gain, n_zone, n_zone)
        Inverse Cholesky factors of the innovations' covariances, zero where nothing is measured [1/K].
    measured : ndarray of bool, shape (n_time, n_zone)
        What is measured.
    log_likelihood : float
        Of the measurements at the θ that the filter was made at [-].
    """

    begin: int
    at: int
    stop: int
    whole: DisturbedSpace
    corrections: FloatArray
    gain_of: NDArray[np.int64]
    roots: FloatArray
    measured: NDArray[np.bool_]
    log_likelihood: float

    def __call__(self, errors: FloatArray) -> FloatArray:
        """Whiten columns of errors, (n_count, m) [-], where n_count are the measurements.

        Parameters
        ----------
        errors : ndarray, shape (n_time, n_zone, m)
            Errors of a free run, or their derivatives [K]; what is not measured is passed over.
        """
        whole, observe = self.whole, self.whole.observation
        seen = np.where(self.measured[..., None], errors, 0.0)
        gaps: NDArray[np.bool_] = np.asarray(~self.measured.all(axis=1))
        z = np.zeros((whole.n, errors.shape[2]))
        for k, number in enumerate(self.gain_of):
            innovation = seen[k] - observe @ z
            if gaps[k]:
                innovation[~self.measured[k]] = 0.0
            seen[k] = innovation
            z = whole.advance(z + self.corrections[number] @ innovation)
        order = np.argsort(self.gain_of, kind="stable")
        for rows in np.split(order, np.flatnonzero(np.diff(self.gain_of[order])) + 1):
            seen[rows] = self.roots[self.gain_of[rows[0]]] @ seen[rows]
        return np.asarray(seen[self.measured])


def whitening(
    model: SymbolicModel,
    theta: FloatArray,
    inputs: Inputs,
    interval: Interval,
    disturbance: DisturbanceModel,
    scheme: Scheme,
    covariance: Covariance,
    spin_up_seconds: float,
) -> Whitening:
    """Make the filter of one interval at θ.

    Parameters
    ----------
    model : SymbolicModel
        Reduced.
    theta : ndarray, shape (n_parameter,)
        Parameter values [parameter units].
    inputs : Inputs
        The telemetry.
    interval : Interval
        What is filtered, see `filter_interval`.
    disturbance : DisturbanceModel
        Unmeasured heat and sensors.
    scheme : Scheme
        Time stepping.
    covariance : {"exact", "steady"}
        See `KalmanFilter`.
    spin_up_seconds : float
        Telemetry before the interval that the spin-up may use [s].

    Raises
    ------
    FilterError
        When the model is not reduced, or the interval too short.
    """
    filtered = filter_interval(
        model, theta, inputs, interval, disturbance,
        scheme=scheme, covariance=covariance, spin_up_seconds=spin_up_seconds, tolerance=_TOLERANCE,
    )  # fmt: skip
    begin, at, stop = rows_of(inputs, interval, spin_up_seconds, covariance)
    return Whitening(
        begin,
        at,
        stop,
        filtered.kalman.whole,
        np.array([gain.reach @ gain.weight for gain in filtered.gains]),
        filtered.gain_of,
        np.array([_root(gain, filtered.kalman.whole.noise_variance) for gain in filtered.gains]),
        np.isfinite(inputs.zone[at + 1 : stop + 1]),
        filtered.log_likelihood,
    )


def _root(gain: Gain, noise: FloatArray) -> FloatArray:
    """Inverse Cholesky factor of the covariance of what a gain's step measures, zero elsewhere."""
    chosen = np.flatnonzero(np.diag(gain.weight) > 0.0)
    block = np.ix_(chosen, chosen)
    root = np.zeros_like(gain.weight)
    root[block] = np.linalg.inv(np.linalg.cholesky((gain.seen + np.diag(noise))[block]))
    return root
