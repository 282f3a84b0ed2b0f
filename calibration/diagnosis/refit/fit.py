"""A quick fit: Gauss-Newton within bounds on the errors' own scale, and the evidence of what it finds.

Diagnosis fits dozens of models that differ in one effect and starts each where its tangents point, so a few steps are
enough. Errors count as one a day and zone, with the deviation that they have: the cost is
``n/2 log(mean e²) + ½ |Λ^½ (z - z_0)|²``.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.special import log_ndtr

from calibration.fit.estimate import DRIFT_TOLERANCE
from calibration.fit.least_squares import bounded_step
from calibration.fit.problem import Problem
from thermal._types import FloatArray
from thermal.model.matrices import SymbolicModel
from thermal.model.reduce import FEW_SHIFTS, ReducedModel, reduced_model

#: Longest change of a parameter in a step, in deviations of its prior [-].
_LONGEST = 1.5

#: Length of a step in standard errors a parameter below which another would change nothing [-].
_SHORTEST = 0.1

#: Evaluations on a basis before it is judged, and fall of the cost that the next one must confirm for the
#: descent to go on [-].
_TOGETHER, _CONFIRMED = 2, 0.5

#: Independent errors beyond which lengths and falls count in proportion: where evidence is in the hundreds, half a unit
#: decides nothing and takes minutes [-].
_MANY = 300.0

#: How many times what its next step promises a fit may still gain: after the second evaluation it was 1.2 times at the
#: most, in 18 fits of masses and losses by zone of three practice cases [-].
_HOPED = 2.0

#: Share of a step below which it is given up, and least share with which the next one begins [-].
_GIVEN_UP, _LEAST_PACE = 1.0 / 16.0, 0.3

#: Evaluations in which a step that is too long is shortened until it is given up.
_SHORTENED = 6


@dataclass(frozen=True)
class Found:
    """Where a fit came to rest.

    Parameters
    ----------
    point : ndarray, shape (n_parameter,)
        On the estimation scale [-].
    mean_square : float
        Of the errors [K²].
    cost : float
        See the module [-].
    residual, jacobian : ndarray
        Weighted errors and priors there, and their derivatives [-].
    evaluations : int
        Of the errors with their derivatives.
    converged : bool
        Whether it did within the evaluations allowed.
    pace : float
        Share of the next step with which to begin [-]: where the cost along the last one was lowest. In directions
        that hardly matter whole steps overshoot one after another.
    """

    point: FloatArray
    mean_square: float
    cost: float
    residual: FloatArray
    jacobian: FloatArray
    evaluations: int
    converged: bool
    pace: float = 1.0


def solve(
    problem: Problem, grid: SymbolicModel, theta: FloatArray, evaluations: int, model: ReducedModel | None = None,
    least: float = -np.inf,
) -> tuple[ReducedModel, Found]:  # fmt: skip
    """Descend on reduced models, each made anew where the last one is no longer accurate.

    A reduced model is exact where it was made. What a few steps gain on one counts as far as the next, made where they
    lead, confirms it: without that, a fit goes where its basis is wrong.

    Parameters
    ----------
    problem : Problem
        What to fit.
    grid : SymbolicModel
        To be reduced.
    theta : ndarray, shape (n_parameter,)
        Start [parameter units].
    evaluations : int
        Most evaluations of errors with derivatives.
    model : ReducedModel, optional
        Made at the start, where it is at hand.
    least : float
        Evidence below which nobody asks for the rest of the fit: it is given up where that is out of reach [-].

    Returns
    -------
    tuple
        The model that is accurate at the estimate, and the estimate.
    """
    model = model or reduced_model(grid, [theta], shifts=FEW_SHIFTS)
    enough = _CONFIRMED * _slack(problem)
    here, together = _descend(problem, model, problem.point(theta), 1), _TOGETHER
    while not here.converged and here.evaluations < evaluations:
        ahead = _descend(problem, model, here, min(together, evaluations - here.evaluations))
        together = _TOGETHER if ahead.cost < here.cost else _SHORTENED
        if _is_hopeless(problem, ahead, least):
            return model, ahead
        if ahead.cost == here.cost or model.is_accurate(problem.theta(ahead.point), DRIFT_TOLERANCE):
            here = ahead
            continue
        if ahead.cost > here.cost - (enough - _CONFIRMED):  # never in a small building
            return model, replace(here, converged=True)
        anew = reduced_model(grid, [problem.theta(ahead.point)], shifts=FEW_SHIFTS)
        there = _descend(problem, anew, ahead.point, 1)
        there = replace(there, evaluations=ahead.evaluations + 1, pace=ahead.pace)
        if there.cost > here.cost - enough:
            model, here = (model, here) if here.cost <= there.cost else (anew, there)
            return model, replace(here, converged=True)
        model, here = anew, there
    return model, here


def _is_hopeless(problem: Problem, found: Found, least: float) -> bool:
    """Whether evidence stays below what is asked for, though the fit gained twice what its next step promises.

    A basis that is no longer accurate flatters, so that what looks hopeless on one is.
    """
    if least == -np.inf:
        return False
    size = found.point.size
    lower, upper = problem.bounds
    step = bounded_step(found.residual, found.jacobian, lower - found.point, upper - found.point)
    ahead = found.residual + found.jacobian @ step
    errors = float(np.log(np.sum(ahead[:-size] ** 2) / np.sum(found.residual[:-size] ** 2)))
    priors = float(np.sum(ahead[-size:] ** 2) - np.sum(found.residual[-size:] ** 2))
    promised = -0.5 * (problem.effective_size() * errors + priors)
    return evidence_of(problem, found) + _HOPED * promised < least


def _descend(problem: Problem, model: SymbolicModel, start: FloatArray | Found, evaluations: int) -> Found:
    """Fit by Gauss-Newton steps.

    Parameters
    ----------
    problem : Problem
        What to fit.
    model : SymbolicModel
        Reduced.
    start : ndarray, shape (n_parameter,), or Found
        On the estimation scale [-]; what is known there already is not evaluated again.
    evaluations : int
        Most evaluations of errors with derivatives from here on.
    """
    lower, upper = problem.bounds
    reach = _LONGEST * np.array([p.prior_deviation for p in problem.parameters])
    if isinstance(start, Found):
        z, cost, mean, residual, jacobian = start.point, start.cost, start.mean_square, start.residual, start.jacobian
        used, before, pace = start.evaluations, start.evaluations, start.pace
    else:
        z, (cost, mean, residual, jacobian) = start, _at(problem, model, start)
        used, before, pace = 1, 0, 1.0
    converged, share = False, None
    step, shortest = np.zeros_like(z), _SHORTEST * _slack(problem) * np.sqrt(z.size)
    while used - before < evaluations:
        if share is None:
            low, high = np.maximum(lower - z, -reach), np.minimum(upper - z, reach)
            step = bounded_step(residual, jacobian, low, high)
            if np.linalg.norm(jacobian @ step) < shortest:
                converged = True
                break
            share = pace
        trial = np.clip(z + share * step, lower, upper)
        new = _at(problem, model, trial)
        used += 1
        best = share * _lowest(float(residual @ jacobian @ step), (new[0] - cost) / share)
        if new[0] < cost:
            z, (cost, mean, residual, jacobian) = trial, new
            share, pace = None, float(np.clip(best, _LEAST_PACE, 1.0))
        elif share <= _GIVEN_UP:
            converged = True
            break
        else:
            share = float(np.clip(best, 0.1 * share, 0.5 * share))
    return Found(z, mean, cost, residual, jacobian, used, converged, pace)


def _lowest(slope: float, secant: float) -> float:
    """Where a parabola is lowest, in lengths of a secant from where it has a slope [-]."""
    bend = secant - slope
    return -slope / (2.0 * bend) if bend > 0.0 else np.inf


def evidence_of(problem: Problem, found: Found) -> float:
    """Logarithm of the marginal likelihood of a fit's errors, but for a constant [-].

    Laplace's approximation about the estimate (Kass and Raftery 1995, doi:10.1080/01621459.1995.10476572):
    ``-cost - ½ log |H| + ½ log |Λ|`` with ``H = J'J + Λ``, and for every strength the share of the posterior within its
    range over that of the prior.

    Parameters
    ----------
    problem : Problem
        What was fitted.
    found : Found
        The fit.
    """
    z, size = found.point, found.point.size
    hessian = found.jacobian.T @ found.jacobian
    value = -found.cost + np.linalg.slogdet(found.jacobian[-size:])[1] - 0.5 * np.linalg.slogdet(hessian)[1]
    spread = np.sqrt(np.diag(np.linalg.inv(hessian)))
    lower, upper = problem.bounds
    for i, p in enumerate(problem.parameters):
        if p.scale == "linear":
            deviation = p.prior_deviation
            value += _log_inside((lower[i] - z[i]) / spread[i], (upper[i] - z[i]) / spread[i])
            value -= _log_inside((lower[i] - p.start) / deviation, (upper[i] - p.start) / deviation)
    return float(value)


def _at(problem: Problem, model: SymbolicModel, z: FloatArray) -> tuple[float, float, FloatArray, FloatArray]:
    """Cost, mean square, weighted residuals with the priors', and their Jacobian."""
    theta = problem.theta(z)
    error, slopes = problem.residuals(model, theta)
    mean = float(np.mean(error**2))
    count = problem.effective_size()
    weight = np.sqrt(count / error.size / mean)
    whiten = np.linalg.inv(np.linalg.cholesky(problem.prior_covariance()))
    prior = whiten @ (z - np.array([p.transform(p.start) for p in problem.parameters]))
    residual = np.concatenate([weight * error, prior])
    jacobian = np.vstack([weight * slopes * problem.slopes(theta), whiten])
    return 0.5 * count * np.log(mean) + 0.5 * float(prior @ prior), mean, residual, jacobian


def _slack(problem: Problem) -> float:
    """How much more than in a small building a change of the cost must be to matter [-]."""
    return max(1.0, problem.effective_size() / _MANY)


def _log_inside(low: float, high: float) -> float:
    """Logarithm of the share of a standard normal between two points."""
    return float(log_ndtr(high) + np.log1p(-np.exp(min(log_ndtr(low) - log_ndtr(high), -1e-12))))
