"""What the data determine: Fisher information against the priors, and in words what they leave open."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from itertools import combinations
from typing import Any, Literal

import numpy as np

from calibration.fit.estimate import Estimate
from calibration.fit.problem import Problem
from calibration.identifiability.information_search import DETERMINED, InformationSearch
from mpc.reports.identifiability import combination_words, describe
from thermal._types import FloatArray
from thermal.model.matrices import SymbolicModel
from thermal.parameters import Parameter

#: Above this ratio of posterior to prior deviation the data tell nothing of a parameter [-].
UNTOLD = 0.9

#: Correlations of errors from here on are named [-], where they are off that of the priors by as much as the second.
CORRELATED, BEYOND_PRIOR = 0.9, 0.1

Status = Literal["determined", "through_priors", "partly", "not"]


@dataclass(frozen=True)
class ParameterInformation:
    """What the data add to the prior of one parameter.

    Parameters
    ----------
    name : str
        As in the model.
    prior_deviation, posterior_deviation : float
        Standard deviations on the estimation scale: of the logarithm, or of the log odds of a probability [-].
    ratio : float
        Posterior over prior deviation; 1 when the data tell nothing [-].
    status : {"determined", "through_priors", "partly", "not"}
        Whether the data at least halve the deviation; or only because priors hold the others, so that it would not be
        so were these twice as wide; whether they take off at least a tenth, or not even that.
    """

    name: str
    prior_deviation: float
    posterior_deviation: float
    ratio: float
    status: Status


@dataclass(frozen=True)
class Direction:
    """An eigenvector of the information in units of the prior.

    Parameters
    ----------
    share : float
        Share of the prior's variance along it that the data explain, 0 to 1 [-].
    components : mapping of str to float
        How far each parameter moves along it, in deviations of its prior [-]; a unit vector unless priors are joint.
    """

    share: float
    components: Mapping[str, float]


@dataclass(frozen=True)
class Combination:
    """A product of powers that the data determine, while they do not determine all its factors.

    Parameters
    ----------
    exponents : mapping of str to float
        By parameter; that of a probability is on its odds [-].
    deviation : float
        Posterior deviation of the combination's logarithm [-].
    ratio : float
        Posterior over prior deviation [-].
    words : str
        Such as ``product a × b``.
    """

    exponents: Mapping[str, float]
    deviation: float
    ratio: float
    words: str


@dataclass(frozen=True)
class Information:
    """What the data determine, in numbers and in words.

    Parameters
    ----------
    parameters : tuple of ParameterInformation
        One an estimated parameter, in order.
    directions : tuple of Direction
        Best explained first.
    combinations : tuple of Combination
        What is determined although its factors are not.
    correlations : tuple of (str, str, float)
        Pairs whose posterior errors are correlated by 0.9 or more, not by their joint prior, strongest first [-].
    sentences : tuple of str
        All that in words.
    """

    parameters: tuple[ParameterInformation, ...]
    directions: tuple[Direction, ...]
    combinations: tuple[Combination, ...]
    correlations: tuple[tuple[str, str, float], ...]
    sentences: tuple[str, ...]

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers and texts, ready for JSON."""
        return {
            "parameters": {p.name: {k: v for k, v in asdict(p).items() if k != "name"} for p in self.parameters},
            "directions": [asdict(d) for d in self.directions],
            "combinations": [asdict(c) for c in self.combinations],
            "correlations": [list(c) for c in self.correlations],
            "sentences": list(self.sentences),
        }


def fisher_information(
    parameters: Sequence[Parameter],
    jacobian: FloatArray,
    precision: FloatArray,
    covariance: FloatArray | None = None,
    nominal: Mapping[str, tuple[float, str]] | None = None,
) -> Information:
    """Compare what the data say of the parameters with what was known before.

    The information in units of the prior, ``L^-1 J'J L^-T`` with ``Λ = L L'``, has eigenvalues λ and unit vectors u;
    the data explain the share ``λ / (1 + λ)`` of the prior's variance along u. Moving along a null direction
    ``L^-T u`` changes no prediction. What is determined are functionals perpendicular to it, ``(L u)'z`` of the other
    unit vectors. As z is a logarithm they are products of powers: equal components make a product, opposite ones a
    ratio. Those of few members are found by trying small sets of parameters, each with the functional that is known
    best when the others are known no better than their posterior.

    Parameters
    ----------
    parameters : sequence of Parameter
        The estimated ones, in the order of the columns.
    jacobian : ndarray, shape (m, p)
        Of the weighted data on the estimation scale, so that ``J'J`` is their Fisher information [-].
    precision : ndarray, shape (p, p)
        Λ of the prior on the estimation scale, positive definite [-].
    covariance : ndarray, shape (p, p), optional
        Posterior covariance, where a better one is known than ``(J'J + Λ)^-1`` [-].
    nominal : mapping of str to (float, str), optional
        Values that enter only as a product with a parameter, as `ThermalNetwork` has them, with unit [that unit].

    Returns
    -------
    Information
        Of the model linearised where the Jacobian was taken.

    Examples
    --------
    >>> from thermal.parameters import PARAMETERS
    >>> pair = [PARAMETERS[name] for name in ("exterior_wall_conductivity", "exterior_convection_coefficient")]
    >>> found = fisher_information(pair, np.array([[30.0, 30.0]]), np.diag([p.prior_deviation**-2 for p in pair]))
    >>> found.combinations[0].words
    'product exterior wall conductivity × exterior convection coefficient'
    """
    search = InformationSearch(jacobian.T @ jacobian, precision, covariance)
    known = _known(parameters, search)
    names = [p.name for p in parameters]
    directions = tuple(
        Direction(float(share), {n: float(v) for n, v in zip(names, moved, strict=True)})
        for share, moved in zip(search.share, search.moves().T, strict=True)
    )
    found = tuple(_combination(parameters, search, a) for a in search.combinations())
    correlations = _correlations(names, search.prior, search.posterior)
    sentences = describe(parameters, known, found, correlations, nominal or {})
    return Information(known, directions, found, correlations, sentences)


def information_of(found: Estimate) -> Information:
    """Say what the data of an estimate determine.

    Parameters
    ----------
    found : Estimate
        From `estimate`; its covariance counts as that of the posterior.
    """
    problem = found.problem
    data, prior = split_jacobian(problem, found.model, problem.point(found.theta))
    nominal = problem.grid.network.nominal
    return fisher_information(problem.parameters, data, prior.T @ prior, found.covariance, nominal)


def split_jacobian(problem: Problem, model: SymbolicModel, z: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Jacobian of the weighted data, and that of the priors, on the estimation scale.

    Parameters
    ----------
    problem : Problem
        Data and priors.
    model : SymbolicModel
        On the grid or reduced.
    z : ndarray, shape (n_free,)
        Point of the estimation scale [-].
    """
    jacobian = problem.weighted(model, z)[1]
    data = problem.residuals_only(model, problem.theta(z)).size  # priors follow the data
    return jacobian[:data], jacobian[data:]


def _known(parameters: Sequence[Parameter], search: InformationSearch) -> tuple[ParameterInformation, ...]:
    known = []
    for i, p in enumerate(parameters):
        ratio = float(search.ratios[i])
        rest: Status = "through_priors" if ratio < DETERMINED else "partly" if ratio < UNTOLD else "not"
        before, after = (float(np.sqrt(c[i, i])) for c in (search.prior, search.posterior))
        known.append(ParameterInformation(p.name, before, after, ratio, "determined" if search.alone[i] else rest))
    return tuple(known)


def _combination(parameters: Sequence[Parameter], search: InformationSearch, a: FloatArray) -> Combination:
    exponents = {p.name: float(e) for p, e in zip(parameters, a, strict=True) if e != 0.0}
    words = combination_words({p.name: p for p in parameters}, exponents)
    return Combination(exponents, float(np.sqrt(a @ search.posterior @ a)), search.ratio(a), words)


def _correlations(names: Sequence[str], prior: FloatArray, posterior: FloatArray) -> tuple[tuple[str, str, float], ...]:
    before, after = (c / np.sqrt(np.outer(np.diag(c), np.diag(c))) for c in (prior, posterior))
    pairs = [
        (names[i], names[j], float(after[i, j]))
        for i, j in combinations(range(len(names)), 2)
        if abs(after[i, j]) >= CORRELATED and abs(after[i, j] - before[i, j]) >= BEYOND_PRIOR
    ]
    return tuple(sorted(pairs, key=lambda p: -abs(p[2])))
