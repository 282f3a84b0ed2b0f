"""The estimation problem: errors of N-step runs of several intervals, and a prior on every parameter."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from calibration.errors import CalibrationError
from calibration.estimation.disturbance import DisturbanceModel
from calibration.evaluation.intervals import Interval, Runs, default_intervals, horizon_steps, merge
from calibration.evaluation.population import Population
from calibration.evaluation.settings import Loss, ModelSettings, calibration_settings
from calibration.fit.tuning_runs import tuning_runs
from thermal._types import FloatArray
from thermal.case.case import Case
from thermal.model.case_replay import SUDDEN, Inputs, free_runs, replay_inputs, spin_up
from thermal.model.matrices import SymbolicModel
from thermal.model.step import IMPLICIT_EULER, Scheme
from thermal.parameters import Parameter

#: Residuals of a run are taken every half hour: what lies between is almost the same number again.
RESIDUAL_SPACING = 1800.0

#: Standard deviation of a zone's prediction error before the data have told it [K].
FIRST_DEVIATION = 0.3

#: Errors beyond this many standard deviations count less under the robust loss [-]: 95 % efficient where errors are
#: normal (Huber 1981, Robust Statistics, ch. 4).
_OUTLYING = 1.345

_MEDIAN_SIZE = 0.6744897501960817  #: Median of the size of a standard normal [-].

#: First spread of a group's members about their common value on the estimation scale [-]: a third, and of a lumped
#: model's multipliers, where drawings know little of single zones and pairs, a factor of seven in 95 %.
SHRINKAGE, _LUMPED_SHRINKAGE = 0.3, 1.0

#: Of what rooms are not alike in, lumped or not, as far apart as an estimate may get [-]: one has a heated floor, the
#: next a radiator. From a third, a house with floors below and radiators above was taken for one of floors, at thrice
#: the error.
_UNLIKE = {"floor_heat_share": 3.0}


@dataclass(frozen=True)
class Problem:
    """Least squares over N-step runs of several tuning intervals.

    Parameters
    ----------
    grid : SymbolicModel
        The model on the grid.
    inputs : Inputs
        The telemetry.
    runs : tuple of Runs
        Tuning runs, one entry an interval; no two overlap.
    steps : int
        N.
    free : tuple of int
        Positions of the estimated parameters in θ; the others keep their start.
    start : ndarray, shape (n_parameter,)
        θ at the start, each in the unit of its parameter [parameter units].
    scheme : Scheme
        Time stepping.
    deviation : float
        Standard deviation of a zone's prediction error [K].
    effective : float, optional
        Effective size of the errors [-]; days times measured zones by default.
    loss : {"linear", "pseudo_huber"}
        What an error costs.
    shrinkage : mapping of str to float
        Spread of a group's members (one parameter of several facades or zones) about their common value on the
        estimation scale [-], by the group's base name; 0.3 where it says nothing.
    capped : bool
        Whether errors never count for more than one a day and zone, as where what the model lacks is common to them.
    population : Population, optional
        Of a fleet, in the place of the physical ranges of the parameters that it knows.
    """

    grid: SymbolicModel
    inputs: Inputs
    runs: tuple[Runs, ...]
    steps: int
    free: tuple[int, ...]
    start: FloatArray
    scheme: Scheme = IMPLICIT_EULER
    deviation: float = FIRST_DEVIATION
    effective: float | None = None
    loss: Loss = "linear"
    shrinkage: Mapping[str, float] = field(default_factory=dict)
    capped: bool = True
    population: Population | None = None

    @property
    def parameters(self) -> list[Parameter]:
        """Estimated parameters, in order."""
        return [self.grid.network.parameters[i] for i in self.free]

    @property
    def keep(self) -> NDArray[np.int64]:
        """Steps whose residuals count: every half hour, the last included."""
        stride = max(1, round(RESIDUAL_SPACING / self.inputs.step))
        return np.arange(self.steps, 0, -stride)[::-1]

    @property
    def whitened(self) -> bool:
        """Whether residuals are whitened, which takes a disturbance from the beginning: these are not."""
        return False

    @property
    def centre(self) -> FloatArray:
        """Centre of the prior on the estimation scale, (n_free,) [-]."""
        drawn = np.array([p.transform(p.start) for p in self.parameters])
        return drawn if self.population is None else drawn + self.population.prior(self.parameters, self._own)[1]

    @property
    def prior_deviations(self) -> FloatArray:
        """Standard deviations of the prior on the estimation scale, (n_free,) [-]."""
        ranged = np.array([p.prior_deviation for p in self.parameters])
        if self.population is None:
            return ranged
        known, _, covariance = self.population.prior(self.parameters, self._own)
        return np.where(known, np.sqrt(np.diag(covariance)), ranged)

    def at(self, model: SymbolicModel, theta: FloatArray, disturbance: DisturbanceModel | None = None) -> Problem:
        """Return the problem whose residuals are weighed by a disturbance at θ: itself, as they are not whitened.

        Parameters
        ----------
        model : SymbolicModel
            Reduced.
        theta : ndarray, shape (n_parameter,)
            Parameter values [parameter units].
        disturbance : DisturbanceModel, optional
            Unmeasured heat and sensors.
        """
        return self

    @property
    def fitted(self) -> tuple[Interval, ...]:
        """Telemetry that is fitted: from the first to the last run of each interval."""
        stamps = self.inputs.stamps
        return tuple(Interval(stamps[r.starts[0]], stamps[r.starts[-1] + self.steps]) for r in self.runs)

    @property
    def disturbance(self) -> DisturbanceModel | None:
        """What residuals are whitened by: nothing."""
        return None

    @property
    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """Physical range on the estimation scale, each (n_free,) [-]."""
        ends = [(p.transform(p.lower), p.transform(p.upper)) for p in self.parameters]
        lower, upper = np.array(ends).reshape(-1, 2).T
        return lower, upper

    def theta(self, z: FloatArray) -> FloatArray:
        """θ of a point of the estimation scale.

        Parameters
        ----------
        z : ndarray, shape (n_free,)
            Point of the estimation scale [-].
        """
        theta = self.start.copy()
        for i, p, v in zip(self.free, self.parameters, z, strict=True):
            theta[i] = p.inverse(float(v))
        return theta

    def point(self, theta: FloatArray) -> FloatArray:
        """Point of the estimation scale of θ, moved inside the range.

        Parameters
        ----------
        theta : ndarray, shape (n_parameter,)
            Parameter values [parameter units].
        """
        inside = [float(np.clip(theta[i], p.lower, p.upper)) for i, p in zip(self.free, self.parameters, strict=True)]
        return np.array([p.transform(v) for p, v in zip(self.parameters, inside, strict=True)])

    def slopes(self, theta: FloatArray) -> FloatArray:
        """Differentiate θ with respect to the estimation scale, (n_free,) [parameter units].

        Parameters
        ----------
        theta : ndarray, shape (n_parameter,)
            Parameter values [parameter units].
        """
        return np.array([p.slope(theta[i]) for i, p in zip(self.free, self.parameters, strict=True)])

    def residuals(self, model: SymbolicModel, theta: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Errors of all runs [K] and their derivatives with respect to θ; unmeasured ones left out.

        Parameters
        ----------
        model : SymbolicModel
            On the grid or reduced.
        theta : ndarray, shape (n_parameter,)
            Parameter values [parameter units].
        """
        parts = [self.errors(model, theta, runs, slopes=True) for runs in self.runs]
        slopes = [moved[np.isfinite(error)] for error, moved in parts if moved is not None]
        return np.concatenate([e[np.isfinite(e)] for e, _ in parts]), np.concatenate(slopes)

    def residuals_only(self, model: SymbolicModel, theta: FloatArray) -> FloatArray:
        """Errors of all runs [K].

        Parameters
        ----------
        model : SymbolicModel
            On the grid or reduced.
        theta : ndarray, shape (n_parameter,)
            Parameter values [parameter units].
        """
        errors = [self.errors(model, theta, runs, slopes=False)[0] for runs in self.runs]
        return np.concatenate([e[np.isfinite(e)] for e in errors])

    def errors(
        self, model: SymbolicModel, theta: FloatArray, runs: Runs, slopes: bool
    ) -> tuple[FloatArray, FloatArray | None]:
        """Errors of the zones at the kept steps of one interval's runs, and their derivatives.

        Parameters
        ----------
        model : SymbolicModel
            On the grid or reduced.
        theta : ndarray, shape (n_parameter,)
            Parameter values [parameter units].
        runs : Runs
            One of the problem's intervals.
        slopes : bool
            Also the derivatives.

        Returns
        -------
        tuple
            Errors (n_run, n_keep, n_zone) [K], NaN where nothing was measured or a step changed too much to be told,
            and their derivatives with respect to the estimated parameters (n_run, n_keep, n_zone, n_free), or None.
        """
        matrices = model.matrices(theta, slopes)
        inputs, keep = self.inputs, self.keep
        states, moved = spin_up(matrices, inputs, runs.begin, runs.starts)
        means, mean_slopes = free_runs(matrices, inputs, runs.starts, keep, states, moved, self.scheme)
        error = means - inputs.targets(runs.starts, keep, SUDDEN)
        return error, None if mean_slopes is None else mean_slopes[..., list(self.free)]

    def spread(self, error: FloatArray) -> float:
        """Take the standard deviation of errors about zero [K]; under the robust loss from their median size.

        Parameters
        ----------
        error : ndarray, shape (n,)
            Errors [K].
        """
        if self.loss == "linear":
            return float(np.sqrt(np.mean(error**2)))
        return float(np.median(np.abs(error)) / _MEDIAN_SIZE)

    def effective_size(self) -> float:
        """Independent observations in the tuning runs [-]: errors are strongly correlated in time."""
        if self.effective is not None:
            return self.effective
        zones = np.isfinite(self.inputs.zone).any(axis=0).sum()
        seconds = sum(r.starts.size for r in self.runs) * self.steps * self.inputs.step
        return float(max(1.0, seconds / 86400.0) * zones)

    def prior_covariance(self) -> FloatArray:
        """Covariance of the parameters before any data, on the estimation scale, (n_free, n_free) [-].

        A parameter's physical range is its 95 % interval. The members of a group, one parameter of several facades or
        zones, share that spread and have their own shrinkage about it (Gelman et al. 2013, Bayesian Data Analysis,
        ch. 5); strengths of an effect in several zones are independent.
        """
        parameters = self.parameters
        base = np.array([p.base for p in parameters])
        grouped = np.array([p.grouped for p in parameters])
        spread = np.array([p.prior_deviation for p in parameters])
        together = (base[:, None] == base[None, :]) & (
            grouped[:, None] & grouped[None, :] | np.eye(base.size, dtype=bool)
        )
        ranged = np.where(together, np.outer(spread, spread), 0.0) + np.diag(self._own**2)
        if self.population is None:
            return ranged
        known, _, covariance = self.population.prior(parameters, self._own)
        return np.where(np.outer(known, known), covariance, np.where(np.outer(~known, ~known), ranged, 0.0))

    @property
    def _own(self) -> FloatArray:
        """Spread of each group's members about what they have in common, (n_free,) [-]; 0 where there is no group."""
        return np.array([self.shrinkage.get(p.base, SHRINKAGE) if p.grouped else 0.0 for p in self.parameters])

    def weighted(self, model: SymbolicModel, z: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Residuals and Jacobian on the estimation scale: weighted data, then the priors.

        Parameters
        ----------
        model : SymbolicModel
            On the grid or reduced.
        z : ndarray, shape (n_free,)
            Point of the estimation scale [-].
        """
        return self.weigh(*self.residuals(model, self.theta(z)), z)

    def weigh(self, error: FloatArray, slopes: FloatArray, z: FloatArray) -> tuple[FloatArray, FloatArray]:
        """As `weighted`, of errors that are known.

        Parameters
        ----------
        error : ndarray, shape (n,)
            Errors of all runs [K].
        slopes : ndarray, shape (n, n_free)
            Their derivatives with respect to θ [K per unit of θ].
        z : ndarray, shape (n_free,)
            Their point of the estimation scale [-].
        """
        cost, moved = self._turn(error, slopes, self.theta(z))
        weight = np.sqrt(self.effective_size() / cost.size) / self.deviation
        whiten = np.linalg.inv(np.linalg.cholesky(self.prior_covariance()))
        residual = np.concatenate([weight * cost, whiten @ (z - self.centre)])
        return residual, np.vstack([weight * moved, whiten])

    def turned(self, model: SymbolicModel, theta: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Unweighted data: roots of twice what the errors cost [K], and their Jacobian on the estimation scale.

        Parameters
        ----------
        model : SymbolicModel
            On the grid or reduced.
        theta : ndarray, shape (n_parameter,)
            Parameter values [parameter units].
        """
        return self._turn(*self.residuals(model, theta), theta)

    def _turn(self, error: FloatArray, slopes: FloatArray, theta: FloatArray) -> tuple[FloatArray, FloatArray]:
        """As `turned`, of errors that are known."""
        cost, turn = self._cost(error)
        return cost, (turn[:, None] * slopes) * self.slopes(theta)

    def _cost(self, error: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Root of twice the loss, with the sign of the error [K], and its derivative [-]."""
        if self.loss == "linear":
            return error, np.ones_like(error)
        scale = _OUTLYING * self.deviation
        u = error / scale
        root = np.sqrt(1.0 + u**2)
        # sqrt(2 (sqrt(1 + u²) - 1)), written so that small errors do not cancel
        cost = u * np.sqrt(2.0 / (1.0 + root))
        return scale * cost, np.sqrt(0.5 * (1.0 + root)) / root


def tuning_problem(case: Case, tune: Sequence[Interval] = (), settings: ModelSettings | None = None) -> Problem:
    """Make the least-squares problem of a case's tuning intervals.

    Parameters
    ----------
    case : Case
        Building and telemetry.
    tune : sequence of Interval
        First two thirds of the telemetry by default.
    settings : CalibrationSettings or ModelSettings, optional
        Model, what is fixed, horizon and loss.

    Returns
    -------
    Problem
        On the grid, at the start.

    Raises
    ------
    CalibrationError
        When everything is fixed, or an interval has no usable run.
    """
    chosen = calibration_settings(settings)
    network = chosen.network(case.building)
    inputs, given = replay_inputs(case, network), network.values(chosen.fixed)
    free = tuple(i for i, p in enumerate(network.parameters) if p.name not in chosen.fixed)
    expected = "a parameter that is left to estimate"
    CalibrationError.unless(free, "fixed", expected, f"all {len(given)}", "evaluate instead")
    steps = horizon_steps(chosen.horizon, inputs.step)
    runs = tuning_runs(inputs, merge(tune) or default_intervals(case)[0], steps, chosen.spin_up_seconds)
    lumped = chosen.structure.lumped
    shrinkage = dict.fromkeys(network.groups if lumped else (), _LUMPED_SHRINKAGE) | _UNLIKE
    problem = Problem(SymbolicModel(network), inputs, runs, steps, free, given, chosen.stepping)
    return replace(
        problem, loss=chosen.loss, shrinkage=shrinkage, capped=not lumped, population=chosen.population
    )
