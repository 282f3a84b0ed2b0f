"""What the data of one building say of its parameters, apart from the priors: a normal likelihood, linearised.

A fleet learns its population from it, and must not count the priors of single buildings again for each of them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from calibration.fit.estimate import Estimate
from calibration.fit.problem import SHRINKAGE
from thermal._types import FloatArray


@dataclass(frozen=True)
class Told:
    """Likelihood ``exp(pull'u - u'Iu/2)`` of the estimated parameters u, on the estimation scale from the drawing on.

    Parameters
    ----------
    names : tuple of str
        Of the estimated parameters of the baseline; effects are no property of a population of buildings.
    point : ndarray, shape (p,)
        Estimate less the start of the drawing, on the estimation scale [-].
    covariance : ndarray, shape (p, p)
        Of the estimate [-].
    information : ndarray, shape (p, p)
        ``I``, of the weighted data alone [-].
    pull : ndarray, shape (p,)
        ``I u`` less the gradient of the data's cost at the estimate u [-].
    own_deviation : ndarray, shape (p,)
        Spread of a group's members about what they have in common [-]; 0 for a parameter of the whole building.
    prior_deviation : ndarray, shape (p,)
        Of the physical range [-].
    """

    names: tuple[str, ...]
    point: FloatArray
    covariance: FloatArray
    information: FloatArray
    pull: FloatArray
    own_deviation: FloatArray
    prior_deviation: FloatArray

    def rows(self) -> dict[str, dict[str, Any]]:
        """Columns of the table ``parameters`` by parameter; a list is its row of the matrix, in the order of names."""
        return {
            name: {
                "point": float(self.point[i]),
                "own_deviation": float(self.own_deviation[i]),
                "prior_deviation": float(self.prior_deviation[i]),
                "pull": float(self.pull[i]),
                "covariance": self.covariance[i].tolist(),
                "information": self.information[i].tolist(),
            }
            for i, name in enumerate(self.names)
        }


def told_by(found: Estimate) -> Told:
    """Take from an estimate what its data say.

    Parameters
    ----------
    found : Estimate
        From `estimate`.
    """
    problem = found.problem
    chosen = np.array([i for i, p in enumerate(problem.parameters) if p.effect is None], dtype=np.int64)
    parameters = [problem.parameters[i] for i in chosen]
    residual, jacobian = problem.weighted(found.model, found.point)
    count = len(problem.parameters)  # priors follow the data
    data, slopes = residual[:-count], jacobian[:-count, chosen]
    point = found.point[chosen] - np.array([p.transform(p.start) for p in parameters])
    information = slopes.T @ slopes
    own = [problem.shrinkage.get(p.base, SHRINKAGE) if p.grouped else 0.0 for p in parameters]
    return Told(
        tuple(p.name for p in parameters), point,
        found.covariance[np.ix_(chosen, chosen)], information, information @ point - slopes.T @ data, np.array(own),
        np.array([p.prior_deviation for p in parameters]),
    )  # fmt: skip
