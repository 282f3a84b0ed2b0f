"""Coverage of intervals by the truth when the intervals come in clusters: one calibration gives many of them.

Parameters of one calibration are estimated from the same telemetry, so their intervals tend to hit or miss together,
and n intervals say less than n independent ones would. The design effect is how much less (Kish 1965): the variance of
the pooled coverage over its binomial variance. It is estimated as a ratio over clusters (Rao and Scott 1992,
Biometrics 48, 577-585), with x_i hits among n_i intervals of cluster i, n and p over all of them, K clusters:

    d = n v / (p (1 - p)),    v = K / (K - 1) Σ (x_i - n_i p)² / n²

and at least 1. The band is that of a binomial variable of n / d trials at the nominal level: an estimator whose
intervals hold what they say stays inside it in 99 of 100 studies (of 60 clusters of 13 exact posteriors: 99 where hits
come almost alone, 98 where d is 6, for d itself is estimated). A bootstrap over whole clusters (Field and Welsh
2007, doi:10.1111/j.1467-9868.2007.00593.x) gives an interval for the coverage itself, without a binomial in it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy import stats
from scipy.special import ndtr, ndtri

FloatArray = npt.NDArray[np.float64]

CONFIDENCE = 0.99  # of the band and of the bootstrap
RESAMPLES = 4000  # of the bootstrap: 20 beyond each end of a 99 % interval
BOOTSTRAP_SEED = 0


@dataclass(frozen=True)
class Coverage:
    """How often intervals of one level hold the truth.

    Parameters
    ----------
    level : float
        What they should reach [-].
    coverage : float
        What they reach [-].
    intervals, clusters : int
        Intervals, and calibrations that they come from.
    design_effect : float
        Variance of the coverage over that of independent intervals [-], at least 1.
    correlation : float
        Of hits within a cluster [-], as that design effect has it: (d - 1) / (mean intervals a cluster - 1).
    band : tuple of float
        99 % binomial band about the level, with intervals / design effect trials [-].
    bootstrap : tuple of float
        99 % interval of the coverage, from resampled clusters [-].
    """

    level: float
    coverage: float
    intervals: int
    clusters: int
    design_effect: float
    correlation: float
    band: tuple[float, float]
    bootstrap: tuple[float, float]

    @property
    def inside(self) -> bool:
        """Whether the coverage lies within the band."""
        return self.band[0] <= self.coverage <= self.band[1]


def pooled_coverage(hits: npt.NDArray[np.bool_], clusters: npt.NDArray[np.int_], level: float) -> Coverage:
    """Pool hits (n,) of intervals of one level over their clusters (n,); see the module for the equations."""
    if hits.size == 0:
        raise ValueError("coverage: expected at least one interval, found none")
    _, place = np.unique(clusters, return_inverse=True)
    sizes, counts = np.bincount(place), np.bincount(place, weights=hits)
    share = float(hits.mean())
    effect = design_effect(counts, sizes)
    trials = max(1, int(hits.size / effect))
    tail = (1.0 - CONFIDENCE) / 2.0
    band = stats.binom.ppf([tail, 1.0 - tail], trials, level) / trials
    weighted = float(np.sum(sizes**2) / np.sum(sizes))
    return Coverage(
        level=level,
        coverage=share,
        intervals=int(hits.size),
        clusters=int(sizes.size),
        design_effect=effect,
        correlation=(effect - 1.0) / (weighted - 1.0) if weighted > 1.0 else 0.0,
        band=(float(band[0]), float(band[1])),
        bootstrap=_bootstrap(counts, sizes),
    )


def design_effect(counts: FloatArray, sizes: npt.NDArray[np.int_]) -> float:
    """Design effect of hits (K,) among intervals (K,) of each cluster; 1 where nothing varies."""
    n, k = sizes.sum(), sizes.size
    share = counts.sum() / n
    if k < 2 or share in (0.0, 1.0):
        return 1.0
    variance = k / (k - 1.0) * np.sum((counts - sizes * share) ** 2) / n**2
    return max(1.0, float(variance * n / (share * (1.0 - share))))


def _bootstrap(counts: FloatArray, sizes: npt.NDArray[np.int_]) -> tuple[float, float]:
    drawn = np.random.default_rng(BOOTSTRAP_SEED).integers(sizes.size, size=(RESAMPLES, sizes.size))
    shares = counts[drawn].sum(axis=1) / sizes[drawn].sum(axis=1)
    tail = (1.0 - CONFIDENCE) / 2.0
    low, high = np.quantile(shares, [tail, 1.0 - tail])
    return float(low), float(high)


def normal_interval(
    estimate: FloatArray,
    error: FloatArray,
    level: float,
    lower: FloatArray | None = None,
    upper: FloatArray | None = None,
) -> tuple[FloatArray, FloatArray]:
    """Central intervals of normal distributions, cut at bounds where given: each tail holds (1 - level) / 2."""
    tail = (1.0 - level) / 2.0
    below = ndtr((lower - estimate) / error) if lower is not None else np.zeros_like(estimate)
    above = ndtr((upper - estimate) / error) if upper is not None else np.ones_like(estimate)
    ends = [estimate + error * ndtri(below + share * (above - below)) for share in (tail, 1.0 - tail)]
    return ends[0], ends[1]
