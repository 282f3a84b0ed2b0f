"""What the data determine: Fisher information against the priors, and functionals of few parameters that it tells."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from itertools import combinations
from math import comb
from typing import Any, ClassVar, Literal

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.linalg import solve_triangular

from calibration.fit.estimate import Estimate
from calibration.fit.problem import Problem
from calibration.results import Axes, Plain, Result, draw_rows, plain
from thermal._types import FloatArray
from thermal.model.matrices import SymbolicModel
from thermal.parameters import Parameter

#: A parameter, or a combination, is determined when the data at least halve the deviation of its prior [-]; above the
#: second ratio of posterior to prior deviation the data tell nothing of a parameter [-].
DETERMINED, UNTOLD = 0.5, 0.9

#: It is the priors that hold a parameter when its ratio of deviations would grow by the second factor, to where it is
#: not determined, if the priors of all others were wider by the first [-]. Of five that only occur as ratios to each
#: other each is known to 45 % of its prior, and the data tell nothing of it.
WIDENED, HELD = 2.0, 1.4

#: A further member of a combination must lower the ratio of deviations at least to this share [-].
WORTHWHILE = 0.5

#: Every member has at least this component of a named functional, a unit vector in units of the prior, and at least
#: this much of it is perpendicular to those named before [-].
LEAST_COMPONENT = 0.25

#: An eigenvector is told when at least this much of it is perpendicular to what is named already [-].
NEW = 0.5

#: Members of a combination whose exponents are this near to each other make a product or a ratio [-].
WHOLE = 0.15

#: Sets of parameters are tried up to this size, and as long as there are no more of one size than that.
MOST_MEMBERS, MOST_SETS = 4, 50_000

#: Correlations of errors from here on are named [-], where they are off that of the priors by as much as the second.
CORRELATED, BEYOND_PRIOR = 0.9, 0.1

Status = Literal["determined", "through_priors", "partly", "not"]


@dataclass(frozen=True)
class ParameterInformation(Plain):
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
    key: ClassVar[str] = "name"


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
    """

    exponents: Mapping[str, float]
    deviation: float
    ratio: float


@dataclass(frozen=True, repr=False)
class Information(Result):
    """What the data determine.

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
    estimated : tuple of Parameter
        The parameters themselves.
    nominal : mapping of str to (float, str)
        Values that enter only as a product with a parameter, with unit [that unit].
    """

    parameters: tuple[ParameterInformation, ...]
    directions: tuple[Direction, ...]
    combinations: tuple[Combination, ...]
    correlations: tuple[tuple[str, str, float], ...]
    estimated: tuple[Parameter, ...]
    nominal: Mapping[str, tuple[float, str]]

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers, ready for JSON."""
        return {k: plain(getattr(self, k)) for k in ("parameters", "directions", "combinations", "correlations")}

    def to_frame(self) -> pd.DataFrame:
        """Prior and posterior deviations [-] and what they say, a row a parameter."""
        return pd.DataFrame([asdict(p) for p in self.parameters]).set_index("name")

    def _summary(self) -> str:
        told = sum(p.status == "determined" for p in self.parameters)
        return f"{told} of {len(self.parameters)} parameters determined, {len(self.combinations)} combinations"

    def _draw(self, axes: Axes) -> None:
        draw_rows(axes, self.to_frame()[["ratio", "ratio", "ratio"]], "posterior over prior deviation [-]")
        axes.axvline(DETERMINED, linestyle="--", color="grey")
        axes.set_xlim(0.0, 1.05)


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
    >>> found.combinations[0].exponents
    {'exterior_wall_conductivity': 1.0, 'exterior_convection_coefficient': 1.0}
    """
    search = InformationSearch(jacobian.T @ jacobian, precision, covariance)
    known = _known(parameters, search)
    names = [p.name for p in parameters]
    directions = tuple(
        Direction(float(share), {n: float(v) for n, v in zip(names, moved, strict=True)})
        for share, moved in zip(search.share, search.moves().T, strict=True)
    )
    found = tuple(_combination(names, search, a) for a in search.combinations())
    correlations = _correlations(names, search.prior, search.posterior)
    return Information(known, directions, found, correlations, tuple(parameters), nominal or {})


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
    """Jacobian of the weighted data, and that of the priors, on the estimation scale at a point z of it."""
    jacobian, count = problem.weighted(model, z)[1], len(problem.parameters)
    return jacobian[:-count], jacobian[-count:]  # priors follow the data


def _known(parameters: Sequence[Parameter], search: InformationSearch) -> tuple[ParameterInformation, ...]:
    known = []
    deviations = np.sqrt([np.diag(search.prior), np.diag(search.posterior)]).T.tolist()
    for p, (before, after), ratio, alone in zip(parameters, deviations, search.ratios, search.alone, strict=True):
        rest: Status = "through_priors" if ratio < DETERMINED else "partly" if ratio < UNTOLD else "not"
        known.append(ParameterInformation(p.name, before, after, float(ratio), "determined" if alone else rest))
    return tuple(known)


def _combination(names: Sequence[str], search: InformationSearch, a: FloatArray) -> Combination:
    exponents = {name: float(e) for name, e in zip(names, a, strict=True) if e != 0.0}
    return Combination(exponents, float(np.sqrt(a @ search.posterior @ a)), search.ratio(a))


def _correlations(names: Sequence[str], prior: FloatArray, posterior: FloatArray) -> tuple[tuple[str, str, float], ...]:
    before, after = (c / np.sqrt(np.outer(np.diag(c), np.diag(c))) for c in (prior, posterior))
    pairs = [
        (names[i], names[j], float(after[i, j]))
        for i, j in combinations(range(len(names)), 2)
        if abs(after[i, j]) >= CORRELATED and abs(after[i, j] - before[i, j]) >= BEYOND_PRIOR
    ]
    return tuple(sorted(pairs, key=lambda p: -abs(p[2])))


class InformationSearch:
    """Fisher information, prior and posterior of a linearised problem on the estimation scale z.

    Parameters
    ----------
    fisher : ndarray, shape (p, p)
        ``J'J`` of the weighted data [-].
    precision : ndarray, shape (p, p)
        Λ of the prior, positive definite [-].
    posterior : ndarray, shape (p, p), optional
        Posterior covariance; ``(J'J + Λ)^-1`` by default [-].

    Attributes
    ----------
    values, share : ndarray, shape (p,)
        Information in units of the prior, falling, and the share of the prior's variance that the data explain [-].
    vectors : ndarray, shape (p, p)
        Their unit vectors in columns [-].
    alone : ndarray of bool, shape (p,)
        Which parameters are determined by themselves.
    """

    def __init__(self, fisher: FloatArray, precision: FloatArray, posterior: FloatArray | None = None) -> None:
        self.root = np.linalg.cholesky(precision)
        half = solve_triangular(self.root, fisher, lower=True)
        values, vectors = np.linalg.eigh(solve_triangular(self.root, half.T, lower=True))
        self.values, self.vectors = np.maximum(values[::-1], 0.0), vectors[:, ::-1]
        self.share = self.values / (1.0 + self.values)
        self.prior = self._product(np.ones_like(self.values))
        # from its eigenvectors: inverting J'J + Λ loses the priors' digits when the data are very precise
        ours = self._product(1.0 / (1.0 + self.values))
        self.posterior = ours if posterior is None else posterior
        self.spread = np.sqrt(np.diag(self.prior))
        self.ratios = np.sqrt(np.diag(self.posterior)) / self.spread
        wide = np.diag(self._product(1.0 / (WIDENED**-2 + self.values))) / np.diag(self.prior)
        beside = 1.0 / np.sqrt(1.0 / wide + 1.0 - WIDENED**-2)  # its own prior as it was
        held = (beside >= DETERMINED) & (beside >= HELD * np.sqrt(np.diag(ours)) / self.spread)
        self.alone = (self.ratios < DETERMINED) & ~held

    def _product(self, variance: FloatArray) -> FloatArray:
        """Covariance on the estimation scale of given variances along the eigenvectors."""
        sides = solve_triangular(self.root, self.vectors, lower=True, trans="T") * np.sqrt(variance)
        return np.asarray(sides @ sides.T)

    def moves(self) -> FloatArray:
        """How far the parameters move along each direction, (p, p) in columns, in deviations of their priors [-]."""
        moved = solve_triangular(self.root, self.vectors, lower=True, trans="T")
        return np.asarray(moved / self.spread[:, None])

    def ratio(self, a: FloatArray) -> float:
        """Posterior over prior deviation of a functional ``a'z`` [-].

        Parameters
        ----------
        a : ndarray, shape (p,)
            Coefficients [-].
        """
        return float(np.sqrt((a @ self.posterior @ a) / (a @ self.prior @ a)))

    def combinations(self) -> list[FloatArray]:
        """Coefficients (p,) of what is determined beyond single parameters, fewest members first.

        None follows from those before it. What no small set tells is told by the eigenvectors, shortened to as many
        members as it takes.
        """
        known = [self._whitened(row) for row in np.eye(self.alone.size)[self.alone]]
        basis = np.linalg.qr(np.array(known).T)[0] if known else np.empty((self.alone.size, 0))
        found: list[FloatArray] = []
        for a in self._candidates():
            unit = self._whitened(a)
            rest = unit - basis @ (basis.T @ unit)
            if np.linalg.norm(rest) >= LEAST_COMPONENT:
                basis = np.column_stack([basis, rest / np.linalg.norm(rest)])
                found.append(a)
        for u in self.vectors[:, self.share > 1.0 - DETERMINED**2].T:
            rest = u - basis @ (basis.T @ u)
            short = self._shortened(self.root @ rest) if np.linalg.norm(rest) >= NEW else None
            if short is not None:
                basis = np.column_stack([basis, rest / np.linalg.norm(rest)])
                found.append(short)
        return [self._rounded(a) for a in found]

    def _whitened(self, a: FloatArray) -> FloatArray:
        """Express a functional as a unit vector in units of the prior."""
        w = solve_triangular(self.root, a, lower=True)
        return np.asarray(w / np.linalg.norm(w))

    def _candidates(self) -> Iterator[FloatArray]:
        """Best functional of each small set that gains from its last member, the best of each size first."""
        p = self.alone.size
        least: dict[tuple[int, ...], float] = {(i,): float(r) for i, r in enumerate(self.ratios)}
        for size in range(2, MOST_MEMBERS + 1):
            if comb(p, size) > MOST_SETS:
                return
            sets = np.array(list(combinations(range(p), size)), dtype=np.int64).reshape(-1, size)
            ratios, functionals = self._best(sets)
            for row in np.argsort(ratios, kind="stable"):
                members, ratio = tuple(map(int, sets[row])), float(ratios[row])
                fewer = min(least[s] for s in combinations(members, size - 1))
                least[members] = min(ratio, fewer)
                if ratio < min(DETERMINED, WORTHWHILE * fewer) and not self.alone[sets[row]].all():
                    a = np.zeros(p)
                    a[sets[row]] = functionals[row]
                    weight = np.abs(a) * self.spread
                    if weight[sets[row]].min() >= LEAST_COMPONENT * np.linalg.norm(weight):
                        yield a

    def _best(self, sets: NDArray[np.int64]) -> tuple[FloatArray, FloatArray]:
        """Least ratio (n,) of posterior to prior deviation within each set (n, k), and its functional (n, k)."""
        rows, columns = sets[:, :, None], sets[:, None, :]
        root = np.linalg.cholesky(self.prior[rows, columns])
        half = np.linalg.solve(root, self.posterior[rows, columns])
        values, vectors = np.linalg.eigh(np.linalg.solve(root, half.transpose(0, 2, 1)))
        functionals = np.linalg.solve(root.transpose(0, 2, 1), vectors[:, :, :1])[:, :, 0]
        return np.sqrt(np.maximum(values[:, 0], 0.0)), functionals

    def _shortened(self, a: FloatArray) -> FloatArray | None:
        """Keep the largest members of a functional, as few as leave it determined; None when it is not, or just one."""
        weight = np.abs(a) * self.spread
        order = np.argsort(-weight)
        for size in range(1, a.size + 1):
            short = np.zeros_like(a)
            short[order[:size]] = a[order[:size]]
            if self.ratio(short) < DETERMINED:
                return short if size > 1 else None
        return None

    def _rounded(self, a: FloatArray) -> FloatArray:
        """Scale to a largest exponent of one; whole exponents, or two decimals, where that is still determined."""
        members = a != 0.0
        scaled = a / a[np.argmax(np.abs(a))]
        whole: FloatArray = np.sign(scaled / scaled[members][0])
        short: FloatArray = np.round(scaled, 2)
        if np.abs(scaled[members]).min() >= 1.0 - WHOLE and self.ratio(whole) < DETERMINED:
            return whole
        return short if short[members].all() and self.ratio(short) < DETERMINED else scaled
