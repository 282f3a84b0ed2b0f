r"""Population of a fleet's parameters: empirical Bayes from what the data of each building say.

Building b says of its parameters u (on the estimation scale, counted from its drawing on) what a normal likelihood of
information :math:`I_b` and pull :math:`h_b` does. With :math:`u \sim N(m, T)` the posterior of a building is
:math:`S_b = (I_b + T^{-1})^{-1}`, :math:`e_b = S_b (h_b + T^{-1} m)`, and expectation maximisation repeats

.. math:: m = \Big(T_0^{-1} + \sum_b w_b (1 + I_b T)^{-1} I_b\Big)^{-1} \sum_b w_b (1 + I_b T)^{-1} h_b, \qquad
   T = \frac{\nu T_0 + \sum_b w_b \left(S_b + (e_b - m)(e_b - m)^\top\right)}{\nu + \sum_b w_b}

(Dempster, Laird and Rubin 1977, doi:10.1111/j.2517-6161.1977.tb01600.x; Gelman et al. 2013, Bayesian Data Analysis,
ch. 5). So the buildings' own uncertainty is taken out of T, and their own priors are not in it at all. :math:`T_0`, the
physical ranges, counts as ν buildings. Buildings unlike the others count less,
:math:`w_b = (\kappa + d) / (\kappa + \delta_b^2)` with the squared distance :math:`\delta_b^2` of what their data say
(multivariate t, Lange, Little and Taylor 1989, doi:10.2307/2290063).

Such a likelihood is one of its building's own neighbourhood. Where that building's data say next to nothing, as of an
outside film before a wall that insulates more, the next building's neighbourhood says it a little otherwise, and a
thousand of them together are sure of what none of them knows. So the population is learned in the directions of which a
building's data say something: in deviations of the ranges, the eigenvectors of the mean of :math:`(1 + I_b)^{-1} I_b`.
In the others each building has its own value, which its range says and which is integrated out.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from operator import itemgetter
from typing import Any

import numpy as np

from calibration.errors import CalibrationError
from calibration.evaluation.population import Population
from calibration.fleet.data_set import Folder, read_table
from thermal._types import FloatArray

#: Buildings that the physical ranges count as in T [-]: as one building more than none, so that T is never singular.
RANGE_BUILDINGS = 1.0

#: Degrees of freedom κ of the weights [-]: Lange, Little and Taylor estimate 2 to 10 on data with outliers.
TAILS = 5.0

#: Most rounds, and the relative change of variances that ends them [-].
_ROUNDS, _STILL = 3000, 1e-4

#: Share of what its range and its data say together that a building's data say of a direction, on an average, below
#: which that is left to the range [-]. Of 1,000 small offices (`benchmarks/fleet_priors.py`) two of 13 directions have
#: less than 0.01 and the others 0.10 and more; from 0.02 to 0.2 the population is about the same.
LEAST_TOLD = 0.05

#: Share of the largest information below which a direction counts as untold [-].
_SMALL = 1e-10


@dataclass(frozen=True)
class Member:
    """What the data of one building say of the parameters that a fleet has in common.

    Parameters
    ----------
    case : str
        Name of the building.
    names : tuple of str
        Of the parameters, without facade or zone.
    information : ndarray, shape (p, p)
        Of the data on the estimation scale [-].
    pull : ndarray, shape (p,)
        Information times the estimate of the data alone, where that exists [-].
    """

    case: str
    names: tuple[str, ...]
    information: FloatArray
    pull: FloatArray


def member(case: str, rows: Sequence[Mapping[str, Any]]) -> Member | None:
    """Take from the rows of a building in the table ``parameters`` what its data say of what a fleet has in common.

    A group's members, parameters of single facades or zones, are what they have in common and an own deviation, which
    is integrated out.

    Parameters
    ----------
    case : str
        Name of the building.
    rows : sequence of mapping
        Its rows, in the order of the table.

    Returns
    -------
    Member or None
        None where there are no estimated parameters.
    """
    told = [row for row in rows if row.get("information") is not None]
    if not told:
        return None
    information, pull = (np.array([row[k] for row in told], dtype=float) for k in ("information", "pull"))
    own = np.diag(np.array([row["own_deviation"] for row in told], dtype=float) ** 2)
    names = tuple(dict.fromkeys(str(row["base"]) for row in told))
    together = np.array([[float(row["base"] == name) for name in names] for row in told])
    out = np.linalg.inv(np.eye(len(told)) + information @ own)
    reduced = together.T @ out @ information @ together
    return Member(case, names, 0.5 * (reduced + reduced.T), together.T @ out @ pull)


def learn_population(members: Sequence[Member], ranges: Mapping[str, float]) -> Population:
    """Learn the population that buildings come from.

    Parameters
    ----------
    members : sequence of Member
        At least two.
    ranges : mapping of str to float
        Deviation of the prior that a parameter's physical range makes, by name [-].

    Returns
    -------
    Population
        Of the next building: T, and what is unknown of m.

    Raises
    ------
    CalibrationError
        When there are fewer than two members.
    """
    CalibrationError.unless(len(members) > 1, "priors", "at least two calibrated buildings", str(len(members)))
    names = tuple(sorted({name for m in members for name in m.names}))
    index = {name: i for i, name in enumerate(names)}
    count, size = len(members), len(names)
    information, pull = np.zeros((count, size, size)), np.zeros((count, size))
    for b, m in enumerate(members):
        at = [index[name] for name in m.names]
        information[b][np.ix_(at, at)], pull[b][at] = m.information, m.pull
    spread = np.array([ranges[name] for name in names])
    told = spread[:, None] * _directions(information * np.outer(spread, spread))
    untold = np.diag(spread**2) - told @ told.T
    out = np.linalg.inv(np.eye(size) + information @ untold)
    mean, covariance, weights = _learn(told.T @ out @ information @ told, np.einsum("ik,bij,bj->bk", told, out, pull))
    cases = tuple(m.case for m in members)
    return Population(names, told @ mean, told @ covariance @ told.T + untold, cases, weights)


def _directions(information: FloatArray) -> FloatArray:
    """Directions that buildings say something of, in deviations of ranges: columns (n_parameter, n_direction)."""
    said = np.linalg.solve(np.eye(information.shape[-1]) + information, information).sum(axis=0)
    have = np.sqrt(np.maximum(np.count_nonzero(np.einsum("bii->bi", information), axis=0), 1))
    shares, directions = np.linalg.eigh(0.5 * (said + said.T) / np.outer(have, have))
    return np.asarray(directions[:, shares >= LEAST_TOLD])


def _learn(information: FloatArray, pull: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Mean and covariance of the next building in deviations of the ranges, and what each building counts."""
    count, size = pull.shape
    mean, covariance, total, weights = np.zeros(size), np.eye(size), np.eye(size), np.ones(count)
    if size == 0:
        return mean, covariance, weights
    ranks = np.linalg.matrix_rank(information, _SMALL, hermitian=True)  # directions of which its data say anything
    for _ in range(_ROUNDS):
        # what the data say of the mean: of information K = (1 + I T)^-1 I, buildings' own deviations integrated out
        out = np.linalg.inv(np.eye(size) + information @ covariance)
        apart = pull - information @ mean
        around = information + information @ covariance @ information
        distance = np.einsum("bi,bij,bj->b", apart, np.linalg.pinv(around, _SMALL, hermitian=True), apart)
        weights = np.minimum((TAILS + ranks) / (TAILS + np.maximum(distance, 0.0)), 1.0)  # nearer says no more
        total = np.einsum("b,bij->ij", weights, out @ information) + np.eye(size)
        mean = np.linalg.solve(total, np.einsum("b,bij,bj->i", weights, out, pull))
        precision = np.linalg.inv(covariance)
        open_ = np.linalg.inv(information + precision)
        off = np.einsum("bij,bj->bi", open_, pull + precision @ mean) - mean
        seen = np.einsum("b,bij->ij", weights, open_) + np.einsum("b,bi,bj->ij", weights, off, off)
        new = (RANGE_BUILDINGS * np.eye(size) + seen) / (RANGE_BUILDINGS + weights.sum())
        moved, covariance = np.abs(np.diag(new) / np.diag(covariance) - 1.0).max(), new
        if moved < _STILL:
            break
    return mean, covariance + np.linalg.inv(total), weights  # with what is unknown of the mean


def population_of(folder: Folder) -> Population:
    """Learn the population of a fleet from the data set of its calibrations.

    Parameters
    ----------
    folder : Folder
        Of the results, see `calibration.fleet.data_set`; read part by part.

    Raises
    ------
    CalibrationError
        When there are fewer than two buildings with estimated parameters.
    """
    members, ranges = list[Member](), dict[str, float]()
    for part in read_table(folder, "parameters"):
        for case, rows in groupby(part.to_pylist(), key=itemgetter("case")):
            listed = list(rows)
            if (made := member(str(case), listed)) is not None:
                members.append(made)
                ranges |= {r["base"]: r["prior_deviation"] for r in listed if r["information"] is not None}
    return learn_population(members, ranges)
