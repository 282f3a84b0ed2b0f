"""Where the parameters may be, beyond what a curvature says: estimates from randomised data and priors.

Valleys of the cost are curved (conductivities against films, capacities against couplings), and a parameter may
saturate. Each sample is the estimate that the same method finds when the errors' gradient and the priors' centres are
moved at random by as much as they are uncertain: for a linear problem they follow the estimate's distribution exactly,
for others they follow the valley (randomised maximum likelihood: Kitanidis 1995, doi:10.1029/95WR01945; Bardsley et al.
2014, doi:10.1137/140964023).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from calibration._precision import Precision
from calibration._problem import Problem
from thermal import SymbolicModel

FloatArray = NDArray[np.float64]

#: Pairs of samples of opposite moves.
_PAIRS = 12

#: Gauss-Newton steps of a sample from the estimate, the longest of them, and the shortest that another follows, in
#: standard errors [-].
_STEPS, _LONGEST, _SHORTEST = 3, 3.0, 0.05


def randomised(
    problem: Problem, model: SymbolicModel, z: FloatArray, known: Precision, weight: float, seed: int = 0
) -> FloatArray:
    """Estimates from randomised gradients and priors, (n_sample, n_free) [-].

    Parameters
    ----------
    problem : Problem
        What was fitted.
    model : SymbolicModel
        That serves the estimate.
    z : ndarray, shape (n_free,)
        The estimate, on the estimation scale [-].
    known : Precision
        Covariance of the gradient.
    weight : float
        w² that the estimate was found with [1/K²].
    seed : int
        Seed of the moves.
    """
    rng = np.random.default_rng(seed)
    p = z.size
    values, vectors = np.linalg.eigh(weight**2 * known.score)
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    there = problem.weighted(model, z)
    samples = []
    for _ in range(_PAIRS):
        pull, prior = root @ rng.standard_normal(p), rng.standard_normal(p)
        samples += [_refit(problem, model, z, there, sign * pull, sign * prior) for sign in (1.0, -1.0)]
    return np.array(samples)


def _refit(
    problem: Problem,
    model: SymbolicModel,
    z: FloatArray,
    there: tuple[FloatArray, FloatArray],
    pull: FloatArray,
    prior: FloatArray,
) -> FloatArray:
    """Minimum of the cost with another gradient and other centres of the priors, near the estimate."""
    lower, upper = problem.bounds
    x, (residual, jacobian) = z, there
    for number in range(_STEPS):
        if number:
            residual, jacobian = problem.weighted(model, x)
        moved = np.concatenate([residual[: -z.size], residual[-z.size :] + prior])
        step, length = _step(jacobian.T @ jacobian, jacobian.T @ moved + pull, x <= lower, x >= upper)
        x = np.clip(x + step * min(1.0, _LONGEST / max(length, 1e-12)), lower, upper)
        if length < _SHORTEST:
            break
    return x


def _step(
    hessian: FloatArray, gradient: FloatArray, low: NDArray[np.bool_], high: NDArray[np.bool_]
) -> tuple[FloatArray, float]:
    """Gauss-Newton step that leaves on its bound what lies there and would go beyond, and its length [-]."""
    free = np.ones(gradient.size, dtype=bool)
    for _ in range(gradient.size + 1):
        step = np.zeros(gradient.size)
        step[free] = -np.linalg.solve(hessian[np.ix_(free, free)], gradient[free])
        blocked = free & ((low & (step < 0.0)) | (high & (step > 0.0)))
        if not blocked.any():
            break
        free &= ~blocked
    return step, float(np.sqrt(step @ hessian @ step))
