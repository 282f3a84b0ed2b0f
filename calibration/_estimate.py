"""The estimation problem: residuals of N-step runs and a prior on every parameter, solved on a reduced model."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from calibration._evaluate import Progress
from calibration._intervals import Runs
from calibration._least_squares import LeastSquaresResult, solve_least_squares
from thermal import Inputs, Parameter, SymbolicModel, free_runs, reduced_model, spin_up
from thermal.model import IMPLICIT_EULER, Scheme

FloatArray = NDArray[np.float64]

#: Residuals of a run are taken every half hour: what lies between is almost the same number again.
RESIDUAL_SPACING = 1800.0

#: Standard deviation of a zone's prediction error before the data have told it [K].
FIRST_DEVIATION = 0.3

#: Rounds of reduction and re-weighting, and the change of the estimation scale that ends them [-].
ROUNDS = 8
ROUND_TOLERANCE = 0.05


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
        Tuning runs, one entry an interval.
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
    """

    grid: SymbolicModel
    inputs: Inputs
    runs: tuple[Runs, ...]
    steps: int
    free: tuple[int, ...]
    start: FloatArray
    scheme: Scheme = IMPLICIT_EULER
    deviation: float = FIRST_DEVIATION

    @property
    def parameters(self) -> list[Parameter]:
        """Estimated parameters, in order."""
        return [self.grid.network.parameters[i] for i in self.free]

    @property
    def keep(self) -> NDArray[np.int64]:
        """Steps whose residuals count: every half hour, the last included."""
        stride = max(1, round(RESIDUAL_SPACING / self.inputs.step))
        return np.arange(self.steps, 0, -stride)[::-1]

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

    def residuals(self, model: SymbolicModel, theta: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Errors of all runs [K] and their derivatives with respect to θ; unmeasured ones left out.

        Parameters
        ----------
        model : SymbolicModel
            On the grid or reduced.
        theta : ndarray, shape (n_parameter,)
            Parameter values [parameter units].
        """
        errors, slopes = self._errors(model, theta, slopes=True)
        return errors, slopes[:, list(self.free)]

    def residuals_only(self, model: SymbolicModel, theta: FloatArray) -> FloatArray:
        """Errors of all runs [K].

        Parameters
        ----------
        model : SymbolicModel
            On the grid or reduced.
        theta : ndarray, shape (n_parameter,)
            Parameter values [parameter units].
        """
        return self._errors(model, theta, slopes=False)[0]

    def _errors(self, model: SymbolicModel, theta: FloatArray, slopes: bool) -> tuple[FloatArray, FloatArray]:
        """Errors of the measured zones at the kept steps of all runs, (n,) [K], and derivatives (n, n_parameter)."""
        matrices = model.matrices(theta, slopes)
        inputs, keep = self.inputs, self.keep
        errors, derivatives = [], [np.empty((0, theta.size))]
        for runs in self.runs:
            states, moved = spin_up(matrices, inputs, runs.begin, runs.starts)
            means, mean_slopes = free_runs(
                matrices, model.network, inputs, runs.starts, self.steps, states, moved, self.scheme, keep
            )
            error = means - inputs.zone[runs.starts[:, None] + keep[None, :]]
            seen = np.isfinite(error) & np.isfinite(inputs.bridged[runs.starts])[:, None, :]
            errors.append(error[seen])
            if mean_slopes is not None:
                derivatives.append(mean_slopes[seen])
        return np.concatenate(errors), np.concatenate(derivatives)

    def effective_size(self) -> float:
        """Independent observations in the tuning runs [-]: days times measured zones, since errors are correlated."""
        zones = np.isfinite(self.inputs.zone).any(axis=0).sum()
        seconds = sum(r.starts.size for r in self.runs) * self.steps * self.inputs.step
        return float(max(1.0, seconds / 86400.0) * zones)

    def weighted(self, model: SymbolicModel, z: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Residuals and Jacobian on the estimation scale: weighted data, then the priors.

        Parameters
        ----------
        model : SymbolicModel
            On the grid or reduced.
        z : ndarray, shape (n_free,)
            Point of the estimation scale [-].
        """
        theta = self.theta(z)
        error, slopes = self.residuals(model, theta)
        weight = np.sqrt(self.effective_size() / error.size) / self.deviation
        scale = np.array([p.slope(theta[i]) for i, p in zip(self.free, self.parameters, strict=True)])
        spread = np.array([p.prior_deviation for p in self.parameters])
        centre = np.array([p.transform(p.start) for p in self.parameters])
        residual = np.concatenate([weight * error, (z - centre) / spread])
        return residual, np.vstack([weight * slopes * scale, np.diag(1.0 / spread)])


@dataclass(frozen=True)
class Estimate:
    """Outcome of one start.

    Parameters
    ----------
    theta : ndarray, shape (n_parameter,)
        θ found [parameter units].
    solve : LeastSquaresResult
        Last solve, on the estimation scale.
    problem : Problem
        With the deviation that was found.
    model : SymbolicModel
        Reduced model at θ.
    iterations : int
        Ipopt iterations over all rounds.
    covariance : ndarray, shape (n_free, n_free)
        Posterior covariance on the estimation scale [-].
    """

    theta: FloatArray
    solve: LeastSquaresResult
    problem: Problem
    model: SymbolicModel
    iterations: int
    covariance: FloatArray


def estimate(problem: Problem, z: FloatArray, progress: Progress | None = None) -> Estimate:
    """Solve the problem from one start.

    Each round reduces the grid model at the current θ, solves by Ipopt, and takes the deviation of the errors it finds
    for the next; the rounds end when θ no longer moves, so the reduced model was accurate where the answer lies.

    Parameters
    ----------
    problem : Problem
        What to fit.
    z : ndarray, shape (n_free,)
        Start on the estimation scale [-].
    progress : callable, optional
        Called with stage, done, total.
    """
    lower = np.array([p.transform(p.lower) for p in problem.parameters])
    upper = np.array([p.transform(p.upper) for p in problem.parameters])
    iterations = 0
    solve: LeastSquaresResult | None = None
    model = reduced_model(problem.grid, [problem.theta(z)])
    for round_ in range(ROUNDS):
        current, small = problem, model

        def weighted(
            x: FloatArray, current: Problem = current, small: SymbolicModel = small
        ) -> tuple[FloatArray, FloatArray]:
            return current.weighted(small, x)

        solve = solve_least_squares(weighted, z, lower, upper, tolerance=1e-2 if round_ == 0 else 1e-3)
        iterations += solve.iterations
        covariance = np.asarray(np.linalg.inv(solve.jacobian.T @ solve.jacobian), dtype=float)
        # distance in units of what the data leave open, so that flat directions do not keep the rounds going
        moved = float(np.sqrt((solve.x - z) @ np.linalg.solve(covariance, solve.x - z)))
        z = solve.x
        if progress is not None:
            progress("calibrate", round_ + 1, ROUNDS)
        theta = problem.theta(z)
        if round_ and solve.success and moved < ROUND_TOLERANCE * np.sqrt(z.size):
            break
        model = reduced_model(problem.grid, [theta])
        error = problem.residuals_only(model, theta)
        problem = replace(problem, deviation=float(max(0.02, np.sqrt(np.mean(error**2)))))
    if solve is None:  # pragma: no cover - ROUNDS is at least one
        raise RuntimeError
    return Estimate(problem.theta(z), solve, problem, model, iterations, covariance)


def random_starts(problem: Problem, count: int, seed: int) -> list[FloatArray]:
    """Draw starts on the estimation scale: the given θ first, then draws from the prior at half its spread.

    Parameters
    ----------
    problem : Problem
        With priors.
    count : int
        Number of starts.
    seed : int
        Seed of the draws.
    """
    rng = np.random.default_rng(seed)
    spread = np.array([p.prior_deviation for p in problem.parameters])
    centre = np.array([p.transform(p.start) for p in problem.parameters])
    further = [centre + 0.5 * spread * rng.standard_normal(spread.size) for _ in range(count - 1)]
    return [problem.point(problem.start), *further]


def thin(runs: Sequence[Runs], steps: int, step: float) -> tuple[Runs, ...]:
    """Keep runs that tile the data: each stamp lies in one run.

    Parameters
    ----------
    runs : sequence of Runs
        Hourly runs, one entry an interval.
    steps : int
        N.
    step : float
        Step [s].
    """
    thinned = []
    for r in runs:
        kept: list[int] = []
        for start in r.starts:
            if not kept or start >= kept[-1] + steps:
                kept.append(int(start))
        thinned.append(Runs(r.begin, np.array(kept, dtype=np.int64), r.skipped))
    return tuple(thinned)
