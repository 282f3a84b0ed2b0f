"""Coverage statistics on estimators whose coverage is known."""

from __future__ import annotations

from collections.abc import Callable
from types import ModuleType

import numpy as np
import pytest
from scipy import stats


@pytest.fixture(scope="module")
def coverage(script: Callable[[str], ModuleType]) -> ModuleType:
    return script("_coverage")


class Study:
    """Exact posteriors of a linear model: θ ~ N(0, 1), y = A θ + e, one A a cluster, 13 parameters, 8 observations.

    The data leave most of θ open and mix its parameters, so that errors within a cluster hang together; yet every
    posterior interval holds the truth with exactly the probability that it says.
    """

    def __init__(self, seed: int, clusters: int = 60, m: int = 13, shared: float = 0.0) -> None:
        rng = np.random.default_rng(seed)
        theta = rng.standard_normal((clusters, m))
        a = rng.standard_normal((clusters, 8, m)) + 2.0 * rng.standard_normal((clusters, 8, 1))
        y = np.einsum("kij,kj->ki", a, theta) + rng.standard_normal((clusters, 8))
        covariance = np.linalg.inv(np.eye(m) + np.einsum("kij,kil->kjl", a, a))
        self.estimate = np.einsum("kij,klj,kl->ki", covariance, a, y)
        self.error = np.sqrt(np.diagonal(covariance, axis1=1, axis2=2))
        # a correlation of errors beside it, which keeps each one normal of the same deviation
        z = (theta - self.estimate) / self.error
        z = np.sqrt(1.0 - shared) * z + np.sqrt(shared) * rng.standard_normal((clusters, 1))
        self.theta = self.estimate + z * self.error
        self.clusters = np.repeat(np.arange(clusters), m)

    def hits(self, coverage: ModuleType, level: float, width: float = 1.0) -> np.ndarray:
        low, high = coverage.normal_interval(self.estimate, width * self.error, level)
        return ((low <= self.theta) & (self.theta <= high)).ravel()


@pytest.mark.parametrize("shared", [0.0, 0.5])
@pytest.mark.parametrize("level", [0.5, 0.9, 0.95])
def test_an_estimator_that_keeps_its_word_is_inside_the_band(coverage: ModuleType, level: float, shared: float) -> None:
    study = Study(1, shared=shared)
    found = coverage.pooled_coverage(study.hits(coverage, level), study.clusters, level)
    assert found.inside
    assert (found.intervals, found.clusters) == (60 * 13, 60)
    assert found.bootstrap[0] < found.coverage < found.bootstrap[1]


@pytest.mark.parametrize("width", [0.5, 0.8, 1.4])
def test_intervals_of_a_wrong_width_are_outside_of_it(coverage: ModuleType, width: float) -> None:
    study = Study(1)
    found = coverage.pooled_coverage(study.hits(coverage, 0.9, width), study.clusters, 0.9)
    assert not found.inside
    assert (found.coverage < 0.9) == (width < 1.0)
    assert not found.bootstrap[0] <= 0.9 <= found.bootstrap[1]


@pytest.mark.parametrize("shared", [0.0, 0.8])
def test_the_band_holds_nearly_all_honest_studies(
    coverage: ModuleType, shared: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And without the design effect it would not, where hits come in clusters."""
    monkeypatch.setattr(coverage, "RESAMPLES", 1)  # of a bootstrap that nobody asks for here
    clustered, plain = [], []
    tails = stats.binom.ppf([0.005, 0.995], 780, 0.9) / 780
    for seed in range(400):
        study = Study(1000 + seed, shared=shared)
        found = coverage.pooled_coverage(study.hits(coverage, 0.9), study.clusters, 0.9)
        clustered.append(found.inside)
        plain.append(tails[0] <= found.coverage <= tails[1])
    assert np.mean(clustered) > (0.95 if shared else 0.97)
    assert np.mean(plain) < 0.9 if shared else np.mean(plain) > 0.95


def test_the_design_effect_of_equal_clusters_by_hand(coverage: ModuleType) -> None:
    """All or nothing in clusters of 4: one cluster is one trial, but for the K / (K - 1) of a sample."""
    hits = np.repeat([True, True, True, False], 4)
    found = coverage.pooled_coverage(hits, np.repeat([5, 6, 7, 9], 4), 0.9)
    assert found.coverage == 0.75
    assert found.design_effect == pytest.approx(4.0 * 4.0 / 3.0)
    # as many hits in each: less spread than binomial, which counts as none
    even = coverage.pooled_coverage(np.tile([True, True, True, False], 4), np.repeat(np.arange(4), 4), 0.9)
    assert (even.design_effect, even.correlation) == (1.0, 0.0)


def test_the_design_effect_of_simulated_clusters(coverage: ModuleType) -> None:
    """Beta-binomial hits in clusters of unequal size: d = 1 + (m - 1) ρ with ρ = 1 / (a + b + 1)."""
    rng = np.random.default_rng(2)
    sizes = rng.integers(5, 16, 40_000)
    counts = rng.binomial(sizes, rng.beta(3.6, 0.4, sizes.size)).astype(float)
    weighted = np.sum(sizes**2) / sizes.sum()
    assert coverage.design_effect(counts, sizes) == pytest.approx(1.0 + (weighted - 1.0) / 5.0, rel=0.02)


def test_everything_hit_is_too_much(coverage: ModuleType) -> None:
    found = coverage.pooled_coverage(np.ones(600, dtype=bool), np.repeat(np.arange(60), 10), 0.9)
    assert found.design_effect == 1.0
    assert not found.inside
    few = coverage.pooled_coverage(np.ones(10, dtype=bool), np.arange(10), 0.9)
    assert few.inside, "ten hits of ten are no evidence against 90 %"


def test_intervals_cut_at_bounds(coverage: ModuleType) -> None:
    estimate, error = np.array([0.0, 1.0, -2.0]), np.array([1.0, 0.5, 3.0])
    lower, upper = np.array([-1.0, -9.0, -2.0]), np.array([2.0, 1.0, 4.0])
    low, high = coverage.normal_interval(estimate, error, 0.9, lower, upper)
    for k in range(3):
        a, b = (lower[k] - estimate[k]) / error[k], (upper[k] - estimate[k]) / error[k]
        expected = stats.truncnorm(a, b, loc=estimate[k], scale=error[k]).ppf([0.05, 0.95])
        assert [low[k], high[k]] == pytest.approx(expected)
    free = coverage.normal_interval(estimate, error, 0.9)
    assert free[1] - free[0] == pytest.approx(2.0 * 1.6448536 * error)


def test_no_interval_is_refused(coverage: ModuleType) -> None:
    with pytest.raises(ValueError, match="at least one interval"):
        coverage.pooled_coverage(np.empty(0, dtype=bool), np.empty(0, dtype=int), 0.9)
