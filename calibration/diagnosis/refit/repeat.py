"""Does it repeat? An effect of a building has the same strengths in both halves of the tuning days."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.stats import chi2

from calibration.diagnosis.refit.comparison import Fit, is_strength
from calibration.fit.left_out import newton, on_runs
from calibration.fit.problem import Problem
from calibration.results import Plain
from thermal._types import FloatArray
from thermal.model.reduce import ReducedModel

#: Probability below which two halves do not agree [-].
DISAGREE = 0.01


@dataclass(frozen=True)
class Repeats(Plain):
    """An effect in the two halves of the tuning days.

    Parameters
    ----------
    probability : float
        Of strengths that differ so much, or more, where the effect is the same in both [-].
    estimates : tuple of dict
        Its strengths by name in the first half and in the second [parameter units].
    """

    probability: float
    estimates: tuple[dict[str, float], dict[str, float]]

    @property
    def agrees(self) -> bool:
        """Whether the halves agree, or cannot tell."""
        return self.probability >= DISAGREE

    def to_dict(self) -> dict[str, Any]:
        """``repeats`` of an effect in ``diagnosis.json``."""
        return {"agrees": self.agrees, "probability": self.probability, "estimates": list(self.estimates)}


def agreement(fit: Fit) -> dict[str, Repeats]:
    """Estimate the strengths of each effect from either half of the tuning days, and judge whether they agree.

    Newton steps from the estimate of all days, every parameter free, give those of each half; their difference is held
    against its covariance (Wald test). An effect whose strengths no half can tell agrees with anything.

    Parameters
    ----------
    fit : Fit
        With effects.

    Returns
    -------
    dict of str to Repeats
        By effect; none where the tuning days cannot be halved.
    """
    problem = fit.weighed
    halves = _halves(problem)
    if halves is None or not fit.effects:
        return {}
    (one, spread, known), (other, spread_of_other, of_other) = (_estimate(h, fit.model, fit.point) for h in halves)
    # what the one half tells more of than the other, that stays at its prior
    more = known - of_other
    apart, covariance = one - other, spread + spread_of_other + more @ problem.prior_covariance() @ more.T
    found, thetas = {}, [problem.theta(point) for point in (one, other)]
    for effect in fit.effects:
        strengths = (i for i, p in enumerate(problem.parameters) if p.effect == effect and is_strength(p.name, effect))
        own = [i for i in strengths if covariance[i, i] > 0.0]  # of the others no half tells anything
        block = covariance[np.ix_(own, own)] + 1e-12 * np.eye(len(own))
        chance = float(chi2.sf(apart[own] @ np.linalg.solve(block, apart[own]), len(own))) if own else 1.0
        first, second = ({problem.parameters[i].name: float(t[problem.free[i]]) for i in own} for t in thetas)
        found[effect] = Repeats(chance, (first, second))
    return found


def _halves(problem: Problem) -> tuple[Problem, Problem] | None:
    """Split the runs at the middle of the tuning runs."""
    starts = np.sort(np.concatenate([r.starts for r in problem.runs]))
    if starts.size < 2:
        return None
    middle, made = starts[starts.size // 2], []
    for late in (False, True):
        made.append(on_runs(problem, [(r.starts >= middle) == late for r in problem.runs]))
    return made[0], made[1]


def _estimate(half: Problem, model: ReducedModel, point: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Estimate of a half, the covariance that its data give it, priors holding, and how far they move it from these."""
    point = newton(half, model, point)
    data = half.weighted(model, point)[1][: -point.size]
    prior = np.linalg.inv(half.prior_covariance())
    held = np.linalg.inv(data.T @ data + prior)
    known = np.asarray(held @ (data.T @ data))
    return point, known @ held, known
