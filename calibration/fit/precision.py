"""How precise an estimate from multi-step errors is: their correlation, from unmeasured heat and sensor noise.

Errors of a run grow from the same unmeasured heat, so that thousands of them hold far fewer independent ones.
Least squares then is a composite likelihood: its curvature is not its precision. With B = J'J and M = J'ΣJ, where Σ is
the covariance of the errors under a disturbance model, the weight w² = tr(A B) / tr(A M), A = (w²B + Λ)^-1, gives the
data their information in the directions that they determine (Pauli, Racugno and Ventura 2011,
www3.stat.sinica.edu.tw/statistica/j21n1/j21n17/j21n17.html; Ribatet, Cooley and Davison 2012), and the estimate's
covariance with prior precision Λ is ``H^-1 (w⁴M + Λ) H^-1``, H = w²B + Λ (Godambe 1960, doi:10.1214/aoms/1177705693).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from calibration.estimation.disturbance import DisturbanceModel
from calibration.fit.likelihood import InnovationsProblem
from calibration.fit.problem import Problem
from thermal._types import FloatArray
from thermal.model.case_replay import SUDDEN, Inputs
from thermal.model.matrices import SymbolicModel

#: Least standard deviation of daily means before the telemetry [K].
_LEAST_SWING = 0.2


@dataclass(frozen=True)
class Precision:
    """What the errors tell.

    Parameters
    ----------
    curvature : ndarray, shape (n_free, n_free)
        B, of the squared errors on the estimation scale [K²].
    score : ndarray, shape (n_free, n_free)
        M, covariance of the errors' gradient [K⁴].
    prior : ndarray, shape (n_free, n_free)
        Λ, precision of the prior [-].
    errors : int
        Number of errors.
    """

    curvature: FloatArray
    score: FloatArray
    prior: FloatArray
    errors: int

    def weight(self) -> float:
        """w², what a squared error counts [1/K²]."""
        weight = float(np.trace(self.curvature) / np.trace(self.score))
        for _ in range(50):
            shrink = np.linalg.inv(weight * self.curvature + self.prior)
            new = float(np.trace(shrink @ self.curvature) / np.trace(shrink @ self.score))
            if abs(new - weight) < 1e-6 * weight:
                break
            weight = new
        return weight

    def effective(self, deviation: float) -> float:
        """Effective size of the errors [-].

        Parameters
        ----------
        deviation : float
            Standard deviation of an error [K].
        """
        return self.weight() * self.errors * deviation**2

    def covariance(self, weight: float) -> FloatArray:
        """Covariance of the estimate on the estimation scale, (n_free, n_free) [-].

        Parameters
        ----------
        weight : float
            w² that the estimate was found with [1/K²].
        """
        inverse = np.linalg.inv(weight * self.curvature + self.prior)
        return np.asarray(inverse @ (weight**2 * self.score + self.prior) @ inverse)


def precision(problem: Problem, model: SymbolicModel, theta: FloatArray, disturbance: DisturbanceModel) -> Precision:
    """Curvature of the squared errors and covariance of their gradient under a disturbance model.

    The gradient is linear in the unmeasured heat, the sensors' noise and what walls and slabs remember of the days
    before the telemetry, so an adjoint run a parameter gives its covariance exactly, across runs too. Directed airflows
    are left out of the heat's way through the building.

    Parameters
    ----------
    problem : Problem
        What was fitted.
    model : SymbolicModel
        Reduced.
    theta : ndarray, shape (n_parameter,)
        Where [parameter units].
    disturbance : DisturbanceModel
        Heat and noise.
    """
    prior = np.asarray(np.linalg.inv(problem.prior_covariance()), dtype=float)
    if isinstance(problem, InnovationsProblem):  # whitened: their curvature is their information too
        white = problem.turned(model, theta)[1]
        return Precision(white.T @ white, white.T @ white, prior, len(white))
    inputs, keep, p = problem.inputs, problem.keep, len(problem.free)
    n_zone = inputs.zone.shape[1]
    heat = np.broadcast_to(np.asarray(disturbance.deviation), (n_zone,))
    noise = np.broadcast_to(np.asarray(disturbance.sensor_deviation), (n_zone,))
    modal = model.matrices(theta).modal
    scale = problem.slopes(theta)
    curvature, score, errors = np.zeros((p, p)), np.zeros((p, p)), 0
    reach = np.zeros((len(inputs), n_zone, p))
    held: NDArray[np.bool_] = np.asarray(np.isfinite(inputs.held).all(axis=0))
    last = max(int(runs.starts[-1]) for runs in problem.runs) + problem.steps + 1  # nothing of what comes after
    seen = np.hstack([inputs.boundary[:last, :1], inputs.held[:last, held]])
    unknown = _swing(seen, inputs)
    for runs in problem.runs:
        error, slopes = problem.errors(model, theta, runs, slopes=True)
        jacobian = np.where(np.isfinite(error)[..., None], np.asarray(slopes) * scale, 0.0)
        curvature += np.einsum("rkzi,rkzj->ij", jacobian, jacobian, optimize=True)
        score += np.einsum("rkzi,rkzj,z->ij", jacobian, jacobian, noise**2, optimize=True)
        errors += int(np.isfinite(error).sum())
        weights = np.zeros((p, problem.steps, n_zone, runs.starts.size))
        weights[:, keep - 1] = jacobian.transpose(3, 1, 2, 0)
        by_heat, by_start = modal.backward(weights, inputs.step, problem.scheme)
        rows = runs.starts + np.arange(1, problem.steps + 1)[:, None]
        reach[rows] += by_heat.transpose(1, 3, 2, 0)
        entry = modal.held_response(held, inputs.step)
        start = np.einsum("inr,nz->irz", by_start, entry) * noise[held]
        score += np.einsum("irz,jrz->ij", start, start)
        memory = modal.history_response(held, inputs.step, runs.starts - runs.begin) * unknown
        forgotten = np.einsum("inr,nrh->ih", by_start, memory)
        score += forgotten @ forgotten.T
    reach *= heat[:, None]
    stay, _ = disturbance.discrete(inputs.step)
    score += _autocorrelated(reach, stay)
    return Precision(curvature, score, prior, errors)


def _swing(values: FloatArray, inputs: Inputs) -> FloatArray:
    """Take the standard deviation of daily means, as what the days before the telemetry may have differed by."""
    day = max(1, round(86400.0 / inputs.step))
    whole = values[: max(1, len(values) // day) * day]
    means = np.array([part.mean(axis=0) for part in np.array_split(whole, max(1, len(values) // day))])
    return np.asarray(np.maximum(means.std(axis=0), _LEAST_SWING))


def _autocorrelated(reach: FloatArray, stay: float) -> FloatArray:
    """``Σ_z Σ_ts reach_t reach_s' φ^|t-s|`` by one pass, (p, p)."""
    total = np.einsum("tzi,tzj->ij", reach, reach, optimize=True)
    before = np.zeros_like(reach)
    for t in range(1, len(reach)):
        before[t] = stay * (before[t - 1] + reach[t - 1])
    cross = np.einsum("tzi,tzj->ij", before, reach, optimize=True)
    return np.asarray(total + cross + cross.T)


def unexplained(
    problem: Problem, model: SymbolicModel, theta: FloatArray, disturbance: DisturbanceModel, seed: int = 0
) -> float:
    """Mean square of the errors over that which a disturbance model makes [-]: above 1 where the model lacks physics.

    Parameters
    ----------
    problem : Problem
        What was fitted.
    model : SymbolicModel
        Reduced.
    theta : ndarray, shape (n_parameter,)
        Where [parameter units].
    disturbance : DisturbanceModel
        Heat and noise.
    seed : int
        Seed of the heat that is drawn.
    """
    if isinstance(problem, InnovationsProblem):
        return _repeated(problem, model, theta)
    observed = problem.residuals_only(model, theta)
    (made,) = drawn_errors(problem, model, theta, disturbance, 1, seed)
    return float(np.mean(observed**2) / np.mean(made**2))


def drawn_errors(
    problem: Problem, model: SymbolicModel, theta: FloatArray, disturbance: DisturbanceModel, draws: int, seed: int = 0
) -> FloatArray:
    """Draw errors of the tuning runs that unmeasured heat and sensor noise make, shape (n_draw, n_error) [K].

    Heat goes on from run to run; each run starts from zones that are as wrong as their readings.

    Parameters
    ----------
    problem : Problem
        What was fitted.
    model : SymbolicModel
        Reduced.
    theta : ndarray, shape (n_parameter,)
        Where [parameter units].
    disturbance : DisturbanceModel
        Heat and noise.
    draws, seed : int
        Number of draws, and their seed.
    """
    inputs, keep, step = problem.inputs, problem.keep, problem.inputs.step
    n_zone, rng = inputs.zone.shape[1], np.random.default_rng(seed)
    stay, push = disturbance.discrete(step)
    size, kick, noise = (
        np.broadcast_to(np.asarray(v), (n_zone,)) for v in (disturbance.deviation, push, disturbance.sensor_deviation)
    )
    matrices = model.matrices(theta)
    held: NDArray[np.bool_] = np.asarray(np.isfinite(inputs.held).all(axis=0))
    entry = matrices.modal.held_response(held, step)
    parts = []
    for runs in problem.runs:
        seen = np.isfinite(inputs.targets(runs.starts, keep, SUDDEN))
        rows, m = runs.starts + np.arange(1, problem.steps + 1)[:, None], runs.starts.size
        first, length = int(rows.min()), int(rows.max() - rows.min()) + 1
        still = np.zeros((problem.steps, matrices.n_boundary, m))
        made = np.empty((draws, int(seen.sum())))
        for d in range(draws):
            shocks = kick * rng.standard_normal((length, n_zone))
            shocks[0] = size * rng.standard_normal(n_zone)
            heat = lfilter([1.0], [1.0, -stay], shocks, axis=0)[rows - first].transpose(0, 2, 1)
            start = entry @ (noise[held, None] * rng.standard_normal((int(held.sum()), m)))
            error, _ = matrices.modal.run(start, still, heat, keep, step, problem.scheme)
            made[d] = (error + noise * rng.standard_normal(error.shape))[seen]
        parts.append(made)
    return np.concatenate(parts, axis=1)


def _repeated(problem: InnovationsProblem, model: SymbolicModel, theta: FloatArray) -> float:
    """Covariance of the gradient, day by day, over that of white innovations [-].

    1 where the disturbance is right; above, innovations are larger than the filter says, or not white, so that they
    repeat within the day what they pull at. Directions count as far as the data determine them.
    """
    residual, jacobian = problem.turned(model, theta)
    parts, index = np.unique(problem.independent(), return_inverse=True)
    if len(parts) < 2:
        return float(np.mean(residual**2))
    pulls = np.zeros((len(parts), jacobian.shape[1]))
    np.add.at(pulls, index, residual[:, None] * jacobian)
    curvature = jacobian.T @ jacobian
    # each interval has pulled the estimate towards itself
    score = pulls.T @ pulls * len(parts) / (len(parts) - 1)
    prior = np.asarray(np.linalg.inv(problem.prior_covariance()), dtype=float)
    return 1.0 / Precision(curvature, score, prior, residual.size).weight()
