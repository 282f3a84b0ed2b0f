"""Which of several calibrated structures the data prefer: likelihood ratio, evidence, and days held out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from itertools import combinations
from typing import Any

import numpy as np
import pandas as pd
from scipy.stats import chi2, norm, t

from calibration.evaluation.case_model import CHECK_TOLERANCE
from calibration.evaluation.settings import ModelSettings
from calibration.fit.cross_validation import local_days
from mpc.reports.identifiability import listed
from thermal._types import FloatArray

#: Confidence of the interval of a difference of held-out errors [-].
LEVEL = 0.90

#: Resamples of the days, and fewest days that are resampled at all.
RESAMPLES, LEAST_DAYS = 4000, 5

#: Least difference of held-out errors that counts [K]: reduced models may be off by as much.
LEAST_DIFFERENCE = CHECK_TOLERANCE

#: A likelihood ratio prefers the larger structure below this probability [-].
SIGNIFICANT = 0.05

#: Evidence prefers a structure from this difference of logarithms on [-]: odds of 20 to 1 (Kass and Raftery 1995).
STRONG = 3.0


@dataclass(frozen=True)
class Candidate:
    """A structure, calibrated.

    Parameters
    ----------
    name : str
        As given.
    settings : ModelSettings
        How its model was built and run.
    parameters : int
        Number of estimated ones.
    tuning_error : float
        Root mean square of the tuning residuals [K].
    information : ndarray, shape (n_free,)
        Eigenvalues of the information of one observation in units of the prior [-].
    prior_cost : float
        Squared distance of the estimate from the prior's centre, in its deviations [-].
    held_out_mae : float
        Mean over runs and zones on the days held out [K].
    success : bool
        Whether the solver converged.
    effective_size : float
        Independent observations that the tuning residuals are worth [-].
    residuals : int
        Number of them.
    errors : Series
        Held-out error of each run by the stamp of its target [K].
    """

    name: str
    settings: ModelSettings
    parameters: int
    tuning_error: float
    information: FloatArray
    prior_cost: float
    held_out_mae: float
    success: bool
    effective_size: float
    residuals: int
    errors: pd.Series[float] = field(repr=False, compare=False)

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers and texts, ready for JSON."""
        names = ("parameters", "tuning_error", "held_out_mae", "success", "effective_size", "residuals")
        return {**{k: getattr(self, k) for k in names}, "settings": self.settings.to_dict()}

    def log_evidence(self, size: float) -> float:
        """Laplace's approximation of the logarithm of the evidence, without ``n log(2π) / 2`` [-].

        Parameters
        ----------
        size : float
            Independent observations n that the residuals are taken for [-].
        """
        gain = float(np.sum(np.log1p(size * self.information)))
        return -size * float(np.log(self.tuning_error)) - 0.5 * (size + self.prior_cost + gain)


@dataclass(frozen=True)
class HeldOutDifference:
    """Held-out error of one structure less that of another, on the same runs.

    Parameters
    ----------
    first, second : str
        Names.
    mae : float
        Mean of first less second [K].
    lower, upper : float
        90 % interval by a block bootstrap over days; NaN with fewer than five days [K].
    days : int
        Days held out.
    """

    first: str
    second: str
    mae: float
    lower: float
    upper: float
    days: int

    @property
    def told(self) -> bool:
        """Whether the interval excludes zero, and the difference is large enough to count."""
        return bool((self.lower > 0.0 or self.upper < 0.0) and abs(self.mae) >= LEAST_DIFFERENCE)


@dataclass(frozen=True)
class LikelihoodRatio:
    """Tuning data of a structure and of one that it contains.

    Parameters
    ----------
    small, large : str
        Names.
    statistic : float
        ``n log(σ_small² / σ_large²)`` with n the effective number of observations [-].
    degrees : int
        Difference of the numbers of parameters.
    p_value : float
        Probability of so much where the small one is true; too large rather than too small, as what the large one
        adds is at the bound of its range there [-].
    """

    small: str
    large: str
    statistic: float
    degrees: int
    p_value: float


@dataclass(frozen=True)
class Selection:
    """Which structure the data prefer.

    Parameters
    ----------
    candidates : tuple of Candidate
        In the order given.
    differences : tuple of HeldOutDifference
        Of all others less the one with the least held-out error.
    ratios : tuple of LikelihoodRatio
        Of all nested pairs.
    effective_size : float
        Independent observations n that the tuning residuals of all candidates are taken for: the least that any finds
        them worth [-].
    preferred : str or None
        None where the data cannot tell.
    verdict : str
        That in words.
    """

    candidates: tuple[Candidate, ...]
    differences: tuple[HeldOutDifference, ...]
    ratios: tuple[LikelihoodRatio, ...]
    effective_size: float
    preferred: str | None
    verdict: str

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers and texts, ready for JSON."""
        return {
            "effective_size": self.effective_size,
            "candidates": {
                c.name: c.to_dict() | {"log_evidence": c.log_evidence(self.effective_size)} for c in self.candidates
            },
            "held_out_differences": [asdict(d) for d in self.differences],
            "likelihood_ratios": [asdict(r) for r in self.ratios],
            "preferred": self.preferred,
            "verdict": self.verdict,
        }


def compare_candidates(candidates: Sequence[Candidate], seed: int = 0) -> Selection:
    """Say which of several calibrated structures the data prefer.

    Parameters
    ----------
    candidates : sequence of Candidate
        Calibrated and judged on the same data.
    seed : int
        Seed of the bootstrap.
    """
    best = min(candidates, key=lambda c: c.held_out_mae)
    differences = tuple(_difference(c, best, seed) for c in candidates if c is not best)
    pairs = [(a, b) for pair in combinations(candidates, 2) for a, b in (pair, pair[::-1]) if _nested(a, b)]
    size = min(c.effective_size for c in candidates)
    ratios = tuple(_likelihood_ratio(small, large, size) for small, large in pairs)
    against = {d.first: _held_out_words(d) for d in differences if d.told}
    tied = [c for c in candidates if c.name not in against]
    for one in tied:
        others = sorted((c for c in tied if c is not one), key=lambda c: -c.log_evidence(size))
        reasons = (_tuning_words(one, other, ratios, size) for other in others)
        reason = next(filter(None, reasons), None)
        if reason is not None:
            against[one.name] = reason
    left = [c for c in candidates if c.name not in against]
    preferred = left[0].name if len(left) == 1 else None
    verdict = _verdict(left, against, differences, size)
    return Selection(tuple(candidates), differences, ratios, size, preferred, verdict)


def _difference(first: Candidate, second: Candidate, seed: int) -> HeldOutDifference:
    """Paired difference with its interval."""
    paired = first.errors - second.errors
    day = local_days(pd.DatetimeIndex(paired.index))
    grouped = paired.groupby(day)
    sums, counts = (np.array(part, dtype=np.float64) for part in (grouped.sum(), grouped.count()))
    lower, upper = _day_bootstrap(sums, counts, seed)
    return HeldOutDifference(first.name, second.name, float(paired.mean()), lower, upper, int(sums.size))


def _day_bootstrap(sums: FloatArray, counts: FloatArray, seed: int = 0) -> tuple[float, float]:
    """Interval of a mean over runs by a circular block bootstrap over days.

    Parameters
    ----------
    sums, counts : ndarray, shape (n_day,)
        Sum over the runs of a day [K], and their number [-], in the order of time.
    seed : int
        Seed of the resampling.

    Returns
    -------
    tuple of float
        Ends of the 90 % interval [K]; NaN with fewer than five days. Blocks grow with the cube root of their number.
    """
    days = sums.size
    if days < LEAST_DAYS:
        return float("nan"), float("nan")
    length = max(1, round(days ** (1.0 / 3.0)))
    blocks = days / length
    # few blocks spread too little: quantiles further out, as Student's are (Hesterberg 2015)
    tail = float(norm.cdf(-np.sqrt(blocks / (blocks - 1.0)) * t.ppf(0.5 * (1.0 + LEVEL), blocks - 1.0)))
    rng = np.random.default_rng(seed)
    begins = rng.integers(0, days, size=(RESAMPLES, -(-days // length)))
    rows = ((begins[:, :, None] + np.arange(length)) % days).reshape(RESAMPLES, -1)[:, :days]
    means = sums[rows].sum(axis=1) / counts[rows].sum(axis=1)
    lower, upper = np.quantile(means, [tail, 1.0 - tail])
    return float(lower), float(upper)


def _nested(small: Candidate, large: Candidate) -> bool:
    """Whether the large structure with some capacity at zero, or with equal values everywhere, is the small one."""
    a, b = small.settings, large.settings
    inside = replace(
        b.structure,
        furniture=b.structure.furniture and a.structure.furniture,
        slab_nodes=0 if a.structure.slab_nodes == 0 else b.structure.slab_nodes,
    )
    scopes = all(b.scopes.get(name) == scope for name, scope in a.scopes.items())
    rest = replace(a, structure=b.structure, scopes=b.scopes) == b
    return small.parameters < large.parameters and inside == a.structure and scopes and rest


def _likelihood_ratio(small: Candidate, large: Candidate, size: float) -> LikelihoodRatio:
    statistic = 2.0 * size * float(np.log(small.tuning_error / large.tuning_error))
    degrees = large.parameters - small.parameters
    return LikelihoodRatio(small.name, large.name, statistic, degrees, float(chi2.sf(max(0.0, statistic), degrees)))


def _held_out_words(difference: HeldOutDifference) -> str:
    d = difference
    return f"the days held out, by {d.mae:.3f} K more than {d.second} ({d.lower:.3f} to {d.upper:.3f} K)"


def _tuning_words(one: Candidate, other: Candidate, ratios: Sequence[LikelihoodRatio], size: float) -> str | None:
    """Say what the tuning data hold against one: nested ones by their likelihood ratio, others by the evidence."""
    for r in ratios:
        if {r.small, r.large} == {one.name, other.name}:
            if r.small != one.name or r.p_value >= SIGNIFICANT:
                return None
            return (
                f"the tuning data, by a likelihood ratio of {r.statistic:.1f} for the {r.degrees} more parameters of "
                f"{other.name} (p = {r.p_value:.2g})"
            )
    odds = other.log_evidence(size) - one.log_evidence(size)
    return f"the tuning data, by a log evidence {odds:.1f} below that of {other.name}" if odds >= STRONG else None


def _verdict(
    left: Sequence[Candidate], against: Mapping[str, str], differences: Sequence[HeldOutDifference], size: float
) -> str:
    days = differences[0].days
    if len(left) == 1:
        sentences = [f"The structure {left[0].name} is preferred."]
    else:
        plural, few = "s"[: days != 1], ", which is too few," if days < LEAST_DAYS else ""
        simplest = min(left, key=lambda c: c.parameters)
        sentences = [
            f"Cannot tell {listed(c.name for c in left)} apart, by {days} day{plural} held out{few} or by the tuning "
            f"data: the simplest of them, {simplest.name}, is enough."
        ]
    sentences += [f"Against {name} speak {reason}." for name, reason in against.items()]
    return " ".join([*sentences, f"({days} days held out, {size:.0f} effective observations tuned on.)"])
