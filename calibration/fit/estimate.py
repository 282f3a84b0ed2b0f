"""Estimation: rounds of solving on a reduced model, re-weighing the data, and reducing anew, from several starts."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from calibration.estimation.disturbance import DisturbanceModel
from calibration.estimation.innovations import TuningSettings, air_volumes, tune_disturbance
from calibration.fit.least_squares import INTERRUPTED, LeastSquaresResult, solve_damped, solve_least_squares
from calibration.fit.precision import Precision, precision, unexplained
from calibration.fit.problem import FIRST_DEVIATION, Problem
from calibration.progress import Progress, count_iterations
from thermal._types import FloatArray
from thermal.model.reduce import ReducedModel, reduced_model

#: Most rounds, and the change of the estimate in standard errors that ends them [-].
ROUNDS = 8
ROUND_TOLERANCE = 0.05

#: Drift of a reduced model beyond which it is made anew at the new θ [K].
DRIFT_TOLERANCE = 0.005

#: Relative change of the effective sample size beyond which a round with the new one follows [-].
_SIZE_TOLERANCE = 0.1

#: Share by which numbers of the disturbance change in a round below which they are kept from there on [-].
_SAME_DISTURBANCE = 0.05

#: Share of the cost by which a step of a solve after the first round must lower it to go on [-]: of a thousand
#: independent errors a tenth of a standard error.
_LEAST_GAIN = 1e-5

#: Share of its gain below which it is done as well [-], as the next weighs anew: six lumped fits changed by under 1 %.
_ENOUGH = 0.03

#: Times by which gradients of whitened residuals may be larger at convergence [-]: an effective sample a hundred times
#: as large makes them so at the same distance in standard errors.
_WHITENED_SLACK = 10.0

#: Least standard deviation of an error [K]: sensors do not resolve less.
_LEAST_DEVIATION = 0.02

#: Zones beyond which a building is large: a basis is made at one θ, as one of two is twice as slow, and the disturbance
#: tuned on a model of the order that follows; 123 zones take minutes with the five hundred states of a calibration.
MOST_ZONES, TUNING_ORDER = 40, 300

#: Finds the unmeasured heat and the sensors' noise at θ, from what is known of them.
Tuner = Callable[[Problem, ReducedModel, FloatArray, DisturbanceModel | None], DisturbanceModel]


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
        With the deviation and the effective size of the errors that were found.
    model : ReducedModel
        Reduced model that is accurate at θ.
    iterations : int
        Ipopt iterations over all rounds.
    evaluations : int
        Evaluations of the errors with their derivatives, over all rounds.
    covariance : ndarray, shape (n_free, n_free)
        Of the estimate, on the estimation scale [-].
    disturbance : DisturbanceModel or None
        Unmeasured heat and sensor noise, where they were tuned.
    excess : float
        Mean square of the errors over that which the disturbance makes [-]; 1 where it was not tuned.
    settled : bool
        Whether the rounds ended because nothing moved any more.
    """

    theta: FloatArray
    solve: LeastSquaresResult
    problem: Problem
    model: ReducedModel
    iterations: int
    evaluations: int
    covariance: FloatArray
    disturbance: DisturbanceModel | None
    excess: float
    settled: bool

    @property
    def point(self) -> FloatArray:
        """The estimate on the estimation scale, (n_free,) [-]."""
        return self.problem.point(self.theta)

    def better_than(self, other: Estimate) -> bool:
        """Whether its cost is less, errors weighed as the other has them.

        Parameters
        ----------
        other : Estimate
            From another start.
        """
        own, _ = other.problem.weighted(self.model, self.point)
        return 0.5 * float(own @ own) < other.solve.cost


def estimate(
    problem: Problem,
    z: FloatArray,
    progress: Progress | None = None,
    model: ReducedModel | None = None,
    tuner: Tuner | None = None,
    close: bool = False,
) -> Estimate:
    """Solve the problem from one start.

    Each round solves on a reduced model, the first by Ipopt and those that begin close by with damped Gauss-Newton
    steps, then takes the deviation of the errors (and, with a tuner, how many independent observations they hold) for
    the next, and reduces anew where θ has moved too far from the basis; the rounds end when nothing moves.

    Parameters
    ----------
    problem : Problem
        What to fit.
    z : ndarray, shape (n_free,)
        Start on the estimation scale [-].
    progress : callable, optional
        Called with stage, done, total.
    model : ReducedModel, optional
        Made at the start; saves reducing there.
    tuner : callable, optional
        Finds the disturbance model that standard errors follow, and weights where it finds fewer independent errors
        than one a day and zone. It never makes them count more: disturbances of zones are independent, while what a
        model lacks is common to them, and priors must hold against it.
    close : bool
        Whether the start is close by, such as the estimate of a simpler model.

    Returns
    -------
    Estimate
        The best so far, with the solver's status, also after Ctrl-C.
    """
    rounds = _Rounds(problem, model or reduced_model(problem.grid, [problem.theta(z)]), tuner, close)
    rounds.counted = count_iterations(progress)
    if rounds.large and problem.deviation == FIRST_DEVIATION and not problem.whitened:
        rounds.weigh(problem.theta(z))
    rounds.whiten(problem.theta(z))
    for number in range(ROUNDS):
        z = rounds.solve(z, 1e-2 if number == 0 else 1e-3)
        if rounds.interrupted or (rounds.next_round(z, number) and number):
            break
    return rounds.result(z)


class _Rounds:
    """State of the rounds: how errors are weighed, the reduced model in use, and what was counted."""

    def __init__(self, problem: Problem, model: ReducedModel, tuner: Tuner | None, close: bool) -> None:
        self.problem, self.model, self.tuner, self.close = problem, model, tuner, close
        self.iterations = self.evaluations = 0
        self.counted: Callable[[], None] = count_iterations(None)  # told of every evaluation with derivatives
        self.moved, self.settled, self.interrupted = np.inf, False, False
        self.disturbance: DisturbanceModel | None = None
        self.excess, self.retune = 1.0, True
        self.last: LeastSquaresResult | None = None
        self.known: Precision | None = None  # at the θ of the last solve
        self.most = replace(problem, effective=None).effective_size() if problem.capped else np.inf
        self.large = problem.inputs.zone.shape[1] > MOST_ZONES

    def weigh(self, theta: FloatArray) -> None:
        """Weigh errors by what they are at θ, where that is more than is usual.

        Far from the optimum priors then hold what data would carry away, which saves three of four evaluations. With
        few errors the priors would win for good: a measured house of three days then errs by 2.6 K in place of 0.4 K.
        """
        spread = self.problem.spread(self.problem.residuals_only(self.model, theta))
        self.problem = replace(self.problem, deviation=max(FIRST_DEVIATION, spread))

    def whiten(self, theta: FloatArray) -> None:
        """Tune the disturbance at θ and whiten by it, where residuals are whitened."""
        if not self.problem.whitened or self.tuner is None:
            return
        if self.disturbance is None or self.retune:
            tuned = self.tuner(self.problem, self.model, theta, self.disturbance)
            self.retune = self.disturbance is None or not tuned.near(self.disturbance, _SAME_DISTURBANCE)
            self.disturbance = tuned
        self.problem = self.problem.at(self.model, theta, self.disturbance)

    def solve(self, z: FloatArray, tolerance: float) -> FloatArray:
        """One solve; returns the point found."""
        problem, model = self.problem, self.model
        self.known = None

        def weighted(x: FloatArray) -> tuple[FloatArray, FloatArray]:
            self.evaluations += 1
            self.counted()
            return problem.weighted(model, x)

        if (self.last is None and not self.close) or problem.whitened:
            slack = _WHITENED_SLACK if problem.whitened else 1.0
            found = solve_least_squares(weighted, z, *problem.bounds, tolerance=slack * tolerance)
        else:  # close by, where Ipopt would take six evaluations for its barrier
            try:
                least = _LEAST_GAIN * max(1.0, problem.effective_size())
                found = solve_damped(weighted, z, problem.bounds, problem.prior_deviations, least, _ENOUGH)
            except KeyboardInterrupt:
                if self.last is None:
                    raise
                found = replace(self.last, success=False, status=INTERRUPTED, interrupted=True)
        self.iterations += found.iterations
        self.interrupted = found.interrupted
        # in units of what the data leave open, so that flat directions do not keep the rounds going
        self.moved = float(np.linalg.norm(found.jacobian @ (found.x - z)))
        self.last = found
        return found.x

    def next_round(self, z: FloatArray, number: int) -> bool:
        """Weigh and reduce anew; True when another round would change nothing."""
        theta = self.problem.theta(z)
        still = self.moved < ROUND_TOLERANCE * np.sqrt(z.size) and self.last is not None and self.last.success
        if not self.model.is_accurate(theta, DRIFT_TOLERANCE):
            # both ends of a move where it does not come to rest: the optimum can jump to and fro between two bases
            both = number > 2 and not self.large
            self.model = reduced_model(self.problem.grid, [theta, self.model.theta] if both else [theta])
            still = False
        if not still:
            self.whiten(theta)
        error = self.problem.residuals_only(self.model, theta)
        before = self.problem.effective_size()
        deviation = max(_LEAST_DEVIATION, self.problem.spread(error))
        self.problem = replace(self.problem, deviation=deviation, shrinkage=_shrinkage(self.problem, z, self.last))
        begun = self.disturbance is not None or (number > 0 and not self.problem.capped)
        if self.tuner is not None and (still or begun):
            if self.disturbance is None or (self.retune and not self.problem.capped):
                tuned = self.tuner(self.problem, self.model, theta, self.disturbance)
                self.retune = self.disturbance is None or not tuned.near(self.disturbance, _SAME_DISTURBANCE)
                self.disturbance = tuned
            self.excess = max(1.0, unexplained(self.problem, self.model, theta, self.disturbance))
            self.known = precision(self.problem, self.model, theta, self.disturbance)
            size = min(self.most, self.known.effective(deviation) / self.excess)
            self.problem = replace(self.problem, effective=size)
            still = still and abs(self.problem.effective_size() - before) < _SIZE_TOLERANCE * before
        self.settled = bool(still)
        return self.settled

    def result(self, z: FloatArray) -> Estimate:
        """Collect what was found, with its covariance."""
        if self.last is None:  # pragma: no cover - there is at least one round
            raise RuntimeError
        if self.interrupted and not self.model.is_accurate(self.problem.theta(z), DRIFT_TOLERANCE):
            self.model = reduced_model(self.problem.grid, [self.problem.theta(z)])
        jacobian = self.last.jacobian
        covariance = np.asarray(np.linalg.inv(jacobian.T @ jacobian), dtype=float)
        theta = self.problem.theta(z)
        if self.disturbance is not None:
            known = self.known or precision(self.problem, self.model, theta, self.disturbance)
            weight = self.problem.effective_size() / (known.errors * self.problem.deviation**2)
            covariance = replace(known, score=self.excess * known.score).covariance(weight)
        return Estimate(
            theta, self.last, self.problem, self.model, self.iterations, self.evaluations, covariance,
            self.disturbance, self.excess, self.settled,
        )  # fmt: skip


def _shrinkage(problem: Problem, z: FloatArray, solve: LeastSquaresResult | None) -> dict[str, float]:
    """Spread of every group's members about their mean: what is seen and what is still open (empirical Bayes)."""
    groups: dict[str, list[int]] = {}
    for i, p in enumerate(problem.parameters):
        if p.grouped:
            groups.setdefault(p.base, []).append(i)
    if not groups or solve is None:
        return dict(problem.shrinkage)
    covariance = np.linalg.inv(solve.jacobian.T @ solve.jacobian)
    found = {}
    for base, members in groups.items():
        own = z[members] - z[members].mean()
        n = len(members)
        centre = np.eye(n) - 1.0 / n
        still_open = np.trace(centre @ covariance[np.ix_(members, members)] @ centre)
        found[base] = float(np.sqrt(np.clip((own @ own + still_open) / max(1, n - 1), 0.02**2, 9.0)))
    return found


def tune(
    problem: Problem, model: ReducedModel, theta: FloatArray, known: DisturbanceModel | None = None
) -> DisturbanceModel:
    """Unmeasured heat in proportion to the zones' air and sensor noise, by the likelihood of a filter's innovations.

    Parameters
    ----------
    problem : Problem
        What is fitted.
    model : ReducedModel
        That is accurate at θ.
    theta : ndarray, shape (n_parameter,)
        Parameter values [parameter units].
    known : DisturbanceModel, optional
        Where to start, such as what was found at a θ close by.
    """
    large = len(model.network.zones) > MOST_ZONES
    settings = TuningSettings(
        problem.scheme,
        covariance="steady",  # where sensors come and go exact gains take ten times as long
        weights=air_volumes(model.network),
        start=known,
        curvature=False,
    )
    small = reduced_model(problem.grid, [theta], order=TUNING_ORDER) if large else model
    return tune_disturbance(small, theta, problem.inputs, problem.fitted, settings).disturbance
