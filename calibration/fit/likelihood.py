"""The estimation problem by the likelihood of innovations: errors of one long run, whitened by a Kalman filter.

Under the disturbance the measurements are normal about the free run from the spin-up's state, ``y ~ N(μ(θ), Σ)``. For a
given Σ the innovations' log-likelihood is ``-½ |Σ^-1/2 (y - μ(θ))|²`` but for a constant, least squares whose Jacobian
``Σ^-1/2 dμ/dθ`` is exact and whose information is J'J. Σ is made anew at the θ of every round and with a disturbance
tuned there: iterated generalised least squares (Carroll and Ruppert 1988, Transformation and Weighting in Regression,
ch. 2). What Σ itself would tell of θ is left unused: how unmeasured heat fluctuates is an assumption, and no parameter
of the building may rest on it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from calibration.estimation.disturbance import DisturbanceModel, DisturbedSpace
from calibration.estimation.filtered import FilterSettings, filter_interval, rows_of
from calibration.estimation.gains import Gain
from calibration.estimation.innovations import DISTURBANCE_PRIORS, ROUGH_TOLERANCE
from calibration.evaluation.intervals import Interval
from calibration.fit.problem import Problem
from thermal._types import FloatArray
from thermal.model.case_replay import SPIN_UP, Inputs, free_runs, spin_up
from thermal.model.matrices import SymbolicModel

#: Zones beyond which the gains are those of the steady covariance, as in the tuning of the disturbance.
_MANY_ZONES = 40

#: Length of telemetry whose gradients count as independent of those of the next [s]: innovations that are not white,
#: as physics that is missing makes them, are correlated over the course of a day.
_INDEPENDENT = 86400.0


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
    settings: FilterSettings,
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
    settings : FilterSettings
        Time stepping, covariance and spin-up.

    Raises
    ------
    FilterError
        When the model is not reduced, or the interval too short.
    """
    filtered = filter_interval(model, theta, inputs, interval, disturbance, settings)
    whole, (begin, at, stop) = filtered.kalman.whole, rows_of(inputs, interval, settings)
    return Whitening(
        begin,
        at,
        stop,
        whole,
        np.array([gain.reach @ gain.weight for gain in filtered.gains]),
        filtered.gain_of,
        np.array([_root(gain, whole.noise_variance) for gain in filtered.gains]),
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


@dataclass(frozen=True)
class InnovationsProblem(Problem):
    """Least squares over whitened innovations of several tuning intervals.

    Parameters
    ----------
    grid, inputs, runs, steps, free, scheme, loss
        As in `Problem`.
    start : ndarray, shape (n_parameter,)
        θ at the start, each in the unit of its parameter [parameter units].
    deviation : float
        Standard deviation of a whitened innovation [-].
    effective : float, optional
        Effective sample size [-]; the number of innovations by default.
    shrinkage : mapping of str to float
        As in `Problem` [-].
    intervals : tuple of Interval
        The tuning intervals.
    whitenings : tuple of Whitening
        Their filters; `at` makes them.
    spin_up_seconds : float
        Telemetry before an interval that its spin-up may use [s].
    """

    deviation: float = 1.0
    intervals: tuple[Interval, ...] = ()
    whitenings: tuple[Whitening, ...] = ()
    spin_up_seconds: float = SPIN_UP

    @property
    def whitened(self) -> bool:
        """Whether residuals are whitened, which takes a disturbance from the beginning."""
        return True

    @property
    def fitted(self) -> tuple[Interval, ...]:
        """Telemetry that is fitted: the tuning intervals."""
        return self.intervals

    @property
    def disturbance(self) -> DisturbanceModel | None:
        """What the innovations are whitened by, once `at` was called."""
        return self.whitenings[0].whole.disturbance if self.whitenings else None

    def at(
        self, model: SymbolicModel, theta: FloatArray, disturbance: DisturbanceModel | None = None
    ) -> InnovationsProblem:
        """Whiten by the filter at θ.

        Parameters
        ----------
        model : SymbolicModel
            Reduced.
        theta : ndarray, shape (n_parameter,)
            Parameter values [parameter units].
        disturbance : DisturbanceModel, optional
            Unmeasured heat and sensors; the medians of their priors by default.
        """
        known = disturbance or DisturbanceModel(**{name: p.median for name, p in DISTURBANCE_PRIORS.items()})
        large = self.inputs.zone.shape[1] > _MANY_ZONES
        settings = FilterSettings(self.scheme, "steady" if large else "exact", self.spin_up_seconds, ROUGH_TOLERANCE)
        made = (whitening(model, theta, self.inputs, i, known, settings) for i in self.intervals)
        return replace(self, whitenings=tuple(made))

    def residuals(self, model: SymbolicModel, theta: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Whitened innovations of all intervals [-] and their derivatives with respect to the estimated parameters.

        Parameters
        ----------
        model : SymbolicModel
            On the grid or reduced.
        theta : ndarray, shape (n_parameter,)
            Parameter values [parameter units].
        """
        parts = np.concatenate([self._whitened(model, theta, w, slopes=True) for w in self.whitenings])
        return parts[:, 0], parts[:, 1:]

    def residuals_only(self, model: SymbolicModel, theta: FloatArray) -> FloatArray:
        """Whitened innovations of all intervals [-].

        Parameters
        ----------
        model : SymbolicModel
            On the grid or reduced.
        theta : ndarray, shape (n_parameter,)
            Parameter values [parameter units].
        """
        return np.concatenate([self._whitened(model, theta, w, slopes=False)[:, 0] for w in self.whitenings])

    def _whitened(self, model: SymbolicModel, theta: FloatArray, white: Whitening, slopes: bool) -> FloatArray:
        """Innovations of an interval and their derivatives as columns."""
        matrices, inputs = model.matrices(theta, slopes), self.inputs
        starts = np.array([white.at])
        states, moved = spin_up(matrices, inputs, white.begin, starts)
        means, mean_slopes = free_runs(matrices, inputs, starts, white.stop - white.at, states, moved, self.scheme)
        columns = [(means[0] - inputs.zone[white.at + 1 : white.stop + 1])[..., None]]
        if mean_slopes is not None:
            columns.append(mean_slopes[0][..., list(self.free)])
        return white(np.concatenate(columns, axis=-1))

    def spread(self, error: FloatArray) -> float:
        """Return the standard deviation of whitened innovations, 1 [-]: what they exceed it by is in the weight.

        Parameters
        ----------
        error : ndarray, shape (n,)
            Whitened innovations [-].
        """
        return 1.0

    def effective_size(self) -> float:
        """Independent observations in the tuning intervals [-]: every innovation, unless fewer were found."""
        return float(sum(w.measured.sum() for w in self.whitenings)) if self.effective is None else self.effective

    def independent(self) -> NDArray[np.int64]:
        """Tell which independent interval of telemetry every residual belongs to, shape (n,)."""
        steps = max(1, round(_INDEPENDENT / self.inputs.step))
        rows = [np.broadcast_to(w.at + np.arange(len(w.measured))[:, None], w.measured.shape) for w in self.whitenings]
        return np.concatenate([r[w.measured] // steps for r, w in zip(rows, self.whitenings, strict=True)])
