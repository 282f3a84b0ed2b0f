"""Choice between baseline structures: each is calibrated, then judged by tuning data and days held out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import asdict, dataclass, field, replace
from itertools import combinations
from typing import Any, ClassVar

import numpy as np
import pandas as pd
from scipy.stats import chi2, norm, t

from calibration.errors import CalibrationError
from calibration.evaluation.case_model import CHECK_TOLERANCE
from calibration.evaluation.intervals import Interval
from calibration.evaluation.settings import INTERVALS, CalibrationSettings, ModelSettings, calibration_settings
from calibration.fit.calibrate import calibrate
from calibration.fit.cross_validation import in_order, local_days, run_errors
from calibration.fit.least_squares import INTERRUPTED
from calibration.fit.precision import precision
from calibration.fit.problem import tuning_problem
from calibration.identifiability.information import InformationSearch, split_jacobian
from calibration.progress import Progress
from calibration.results import Axes, Plain, Result, draw_rows, plain
from thermal._types import FloatArray
from thermal.case.case import Case
from thermal.model.reduce import reduced_model
from thermal.network.structure import Structure

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
class Candidate(Plain):
    """A structure, calibrated.

    Parameters
    ----------
    name : str
        As given.
    settings : ModelSettings
        Of its model.
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
        Effective size of the tuning residuals [-].
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
    key: ClassVar[str] = "name"

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers and texts, ready for JSON."""
        names = ("parameters", "tuning_error", "held_out_mae", "success", "effective_size", "residuals", "settings")
        return {k: plain(getattr(self, k)) for k in names}

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
        Probability of so much where the small one is true; rather too large, as what is added is at a bound there [-].
    """

    small: str
    large: str
    statistic: float
    degrees: int
    p_value: float


#: What speaks against a structure: days held out, the likelihood ratio, or, by its name, one with more evidence.
Reason = HeldOutDifference | LikelihoodRatio | str


@dataclass(frozen=True, repr=False)
class Selection(Result):
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
        Independent observations n in the tuning residuals, the least that any candidate finds [-].
    preferred : str or None
        None where the data cannot tell.
    against : mapping of str to HeldOutDifference, LikelihoodRatio or str
        What speaks against each structure that is neither preferred nor tied.
    """

    candidates: tuple[Candidate, ...]
    differences: tuple[HeldOutDifference, ...]
    ratios: tuple[LikelihoodRatio, ...]
    effective_size: float
    preferred: str | None
    against: Mapping[str, Reason]

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers and texts, ready for JSON."""
        evidence = {c.name: {"log_evidence": c.log_evidence(self.effective_size)} for c in self.candidates}
        return {
            "effective_size": self.effective_size,
            "candidates": {c.name: c.to_dict() | evidence[c.name] for c in self.candidates},
            "held_out_differences": plain(self.differences),
            "likelihood_ratios": plain(self.ratios),
            "preferred": self.preferred,
        }

    def to_frame(self) -> pd.DataFrame:
        """Errors [K] and evidence of each candidate."""
        table = pd.DataFrame.from_dict(self.to_dict()["candidates"], orient="index")
        return table.rename_axis("candidate").drop(columns="settings")

    def _summary(self) -> str:
        return f"{self.preferred or 'none'} preferred of {', '.join(c.name for c in self.candidates)}"

    def _draw(self, axes: Axes) -> None:
        table = pd.DataFrame([asdict(d) for d in self.differences]).set_index("first")[["mae", "lower", "upper"]]
        draw_rows(axes, table, f"held-out MAE above that of {self.differences[0].second} [K]")
        axes.axvline(0.0, color="grey")


def select_structure(
    case: Case,
    structures: Mapping[str, Structure | Mapping[str, Any]],
    tune: Sequence[Interval] = (),
    hold_out: Sequence[Interval] = (),
    settings: ModelSettings | Mapping[str, Any] | None = None,
    *,
    seed: int = 0,
    executor: Executor | None = None,
    progress: Progress | None = None,
) -> Selection:
    """Calibrate each structure and say which one the data prefer, or that they cannot tell.

    Held-out errors decide where their paired difference is told from zero, by a circular block bootstrap over days
    (Politis and Romano 1992). Where it is not, the tuning data may: nested structures by the likelihood ratio
    ``n log(σ_small² / σ_large²)``, chi-square with the difference of parameters (Wilks 1938), others by the evidence
    ``-n log σ - n/2 - (z - c)'Λ(z - c)/2 - log|I + Λ^-1 J'J|/2`` (Laplace; MacKay 1992). σ is the root mean square of
    each one's residuals; n is their effective sample size, the least of all candidates'
    (`Problem.effective_size`, with the disturbance that the calibration found).

    Parameters
    ----------
    case : Case
        Building and telemetry.
    structures : mapping of str to Structure or mapping
        By name: a structure, or settings of `calibrate` that make the difference, such as scopes.
    tune, hold_out : sequence of Interval
        As `calibrate` takes them.
    settings : CalibrationSettings, or mapping of str to Any, optional
        That all have in common, or these by name.
    seed : int
        Seed of the bootstrap.
    executor : Executor, optional
        Where to calibrate, any of `concurrent.futures`; it is left open. One after the other by default.
    progress : callable, optional
        Called with stage, done, total after each structure.

    Raises
    ------
    CalibrationError
        When there are fewer than two structures, a setting is unknown, or they are not judged on the same data.

    Examples
    --------
    >>> from thermal.data import load_bundled_case
    >>> structures = {"the paper's": Structure.paper(), "with interior mass": Structure()}
    >>> select_structure(load_bundled_case(), structures).preferred  # doctest: +SKIP
    """
    CalibrationError.unless(len(structures) >= 2, "structures", "at least two to choose from", list(structures))
    parts = tuple(tune), tuple(hold_out)
    tasks = [(case, name, *parts, _settings(settings, own)) for name, own in structures.items()]
    candidates = in_order(_candidate, tasks, executor, "select", progress)
    first = candidates[0]
    for other in candidates[1:]:
        if not first.errors.index.equals(other.errors.index) or first.residuals != other.residuals:
            raise CalibrationError(
                f"structures: {first.name!r} and {other.name!r} are not judged on the same runs; "
                "expected the same horizon and spin-up for all"
            )
    return compare_candidates(candidates, seed)


def _settings(
    common: ModelSettings | Mapping[str, Any] | None, own: Structure | Mapping[str, Any]
) -> CalibrationSettings:
    """Check and join the settings of one structure."""
    own = {"structure": own} if isinstance(own, Structure) else own
    for name in (*(common if isinstance(common, Mapping) else ()), *own):
        if name in INTERVALS:
            raise CalibrationError(f"structures: {name!r} is the same for all; give it beside the structures")
    return calibration_settings(common, own)


def _candidate(
    case: Case, name: str, tune: Sequence[Interval], hold_out: Sequence[Interval], settings: CalibrationSettings
) -> Candidate:
    """Calibrate one structure, in whatever process."""
    result = calibrate(case, tune, hold_out, settings=settings)
    if result.solver.status == INTERRUPTED:  # the best so far is no candidate
        raise KeyboardInterrupt
    problem = tuning_problem(case, result.tuning, replace(settings, loss="linear"))
    model, z = reduced_model(problem.grid, [result.theta]), problem.point(result.theta)
    error = problem.residuals_only(model, result.theta)
    deviation, size = float(np.sqrt(np.mean(error**2))), problem.effective_size()
    if result.disturbance is not None:
        known = precision(problem, model, result.theta, result.disturbance)
        size = min(size, known.effective(deviation) / result.excess)
    data, prior = split_jacobian(replace(problem, deviation=deviation, effective=1.0), model, z)
    held_out = result.calibrated["held_out"]
    return Candidate(
        name,
        result.settings,
        len(problem.free),
        deviation,
        InformationSearch(data.T @ data, prior.T @ prior).values,
        float(np.sum((prior @ (z - problem.centre)) ** 2)),
        held_out.metrics.mae,
        result.solver.success,
        size,
        error.size,
        run_errors(held_out),
    )


def compare_candidates(candidates: Sequence[Candidate], seed: int = 0) -> Selection:
    """Say which of several structures, calibrated and judged on the same data, these prefer."""
    best = min(candidates, key=lambda c: c.held_out_mae)
    differences = tuple(_difference(c, best, seed) for c in candidates if c is not best)
    pairs = [(a, b) for pair in combinations(candidates, 2) for a, b in (pair, pair[::-1]) if _nested(a, b)]
    size = min(c.effective_size for c in candidates)
    ratios = tuple(_likelihood_ratio(small, large, size) for small, large in pairs)
    against: dict[str, Reason] = {d.first: d for d in differences if d.told}
    tied = [c for c in candidates if c.name not in against]
    for one in tied:
        for other in sorted((c for c in tied if c is not one), key=lambda c: -c.log_evidence(size)):
            reason = _against(one, other, ratios, size)
            if reason is not None:
                against.setdefault(one.name, reason)
    left = [c.name for c in candidates if c.name not in against]
    preferred = left[0] if len(left) == 1 else None
    return Selection(tuple(candidates), differences, ratios, size, preferred, against)


def _difference(first: Candidate, second: Candidate, seed: int) -> HeldOutDifference:
    """Paired difference with its interval."""
    paired = first.errors - second.errors
    day = local_days(pd.DatetimeIndex(paired.index))
    grouped = paired.groupby(day)
    sums, counts = (np.array(part, dtype=np.float64) for part in (grouped.sum(), grouped.count()))
    lower, upper = _day_bootstrap(sums, counts, seed)
    return HeldOutDifference(first.name, second.name, float(paired.mean()), lower, upper, int(sums.size))


def _day_bootstrap(sums: FloatArray, counts: FloatArray, seed: int = 0) -> tuple[float, float]:
    """90 % interval [K] of a mean over runs by a circular block bootstrap over days; NaN with fewer than five.

    Of each day it takes the sum over its runs [K] and their number. Blocks grow with the cube root of the days.
    """
    days = sums.size
    if days < LEAST_DAYS:
        return float("nan"), float("nan")
    length = max(1, round(days ** (1.0 / 3.0)))
    blocks = days / length
    # few blocks spread too little: quantiles further out, as Student's are (Hesterberg 2015)
    tail = float(norm.cdf(-np.sqrt(blocks / (blocks - 1.0)) * t.ppf(0.5 * (1.0 + LEVEL), blocks - 1.0)))
    begins = np.random.default_rng(seed).integers(0, days, size=(RESAMPLES, -(-days // length)))
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


def _against(one: Candidate, other: Candidate, ratios: Sequence[LikelihoodRatio], size: float) -> Reason | None:
    """Find what the tuning data hold against one: nested ones by their likelihood ratio, others by the evidence."""
    for r in ratios:
        if {r.small, r.large} == {one.name, other.name}:
            return r if r.small == one.name and r.p_value < SIGNIFICANT else None
    return other.name if other.log_evidence(size) - one.log_evidence(size) >= STRONG else None
