"""Profile likelihood: parabolas in closed form, bounds, several optima, coverage, and a real case."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from calibration import CalibrationError, Profile, profile_likelihood
from calibration.evaluation.settings import CalibrationSettings
from calibration.fit.estimate import Estimate, estimate
from calibration.fit.problem import tuning_problem
from mpc.reports.identifiability import profile_sentence
from thermal import Parameter, load_bundled_case, reduced_model

FloatArray = NDArray[np.float64]
Q90, Q95 = 1.6448536, 1.9599640  # roots of the chi-square quantiles of one degree


@dataclass
class Toy:
    """A problem with residuals of our own, and the interface of `Problem`."""

    parameters: list[Parameter]
    data: Callable[[FloatArray], tuple[FloatArray, FloatArray]]
    calls: int = 0

    def theta(self, z: FloatArray) -> FloatArray:
        return np.array([p.inverse(v) for p, v in zip(self.parameters, z, strict=True)])

    def point(self, theta: FloatArray) -> FloatArray:
        return np.array([p.transform(v) for p, v in zip(self.parameters, theta, strict=True)])

    @property
    def bounds(self) -> tuple[FloatArray, FloatArray]:
        ends = np.array([(p.transform(p.lower), p.transform(p.upper)) for p in self.parameters])
        return ends[:, 0], ends[:, 1]

    def residuals_only(self, model: object, theta: FloatArray) -> FloatArray:
        return self.data(self.point(theta))[0]

    def weighted(self, model: object, z: FloatArray) -> tuple[FloatArray, FloatArray]:
        self.calls += 1
        residual, jacobian = self.data(z)
        spread = np.array([p.prior_deviation for p in self.parameters])
        centre = np.array([p.transform(p.start) for p in self.parameters])
        return np.concatenate([residual, (z - centre) / spread]), np.vstack([jacobian, np.diag(1.0 / spread)])


def parameters(count: int, spread: float = 1.0) -> list[Parameter]:
    return [Parameter(f"p{i}", "W/m/K", 1.0, np.exp(-2.0 * spread), np.exp(2.0 * spread), "") for i in range(count)]


def linear(jacobian: FloatArray, measured: FloatArray, spread: float = 1.0) -> Toy:
    return Toy(parameters(jacobian.shape[1], spread), lambda z: (jacobian @ z - measured, jacobian))


def started(toy: Toy, z: FloatArray | None = None) -> Estimate:
    z = np.zeros(len(toy.parameters)) if z is None else z
    found: Any = SimpleNamespace(problem=toy, model=None, theta=toy.theta(z))
    return found


def least(toy: Toy, jacobian: FloatArray, measured: FloatArray, with_prior: bool) -> tuple[FloatArray, FloatArray]:
    """Minimum and covariance of a linear problem."""
    precision = jacobian.T @ jacobian + (np.eye(jacobian.shape[1]) if with_prior else 0.0)
    covariance = np.linalg.inv(precision)
    return covariance @ jacobian.T @ measured, covariance


@pytest.mark.parametrize("with_prior", [True, False])
def test_profile_of_a_linear_problem_is_a_parabola(with_prior: bool) -> None:
    """D = (x - x̂)² / P_jj, whatever the others do; ends at x̂ ± 1.645 and 1.960 standard errors."""
    rng = np.random.default_rng(0)
    jacobian, measured = 4.0 * rng.standard_normal((12, 3)), rng.standard_normal(12)
    toy = linear(jacobian, measured)
    best, covariance = least(toy, jacobian, measured, with_prior)
    for j, found in enumerate(profile_likelihood(started(toy), with_prior=with_prior)):
        z, error = np.log(found.values), np.sqrt(covariance[j, j])
        np.testing.assert_allclose(found.deviance, ((z - best[j]) / error) ** 2, atol=0.06)
        assert np.log(found.estimate) == pytest.approx(best[j], abs=0.1 * error)
        for interval, root in zip(found.intervals, (Q90, Q95), strict=True):
            assert not interval.open_lower
            assert not interval.open_upper
            assert np.log(interval.lower) == pytest.approx(best[j] - root * error, abs=0.04 * error)
            assert np.log(interval.upper) == pytest.approx(best[j] + root * error, abs=0.04 * error)
        assert found.unconverged == 0


def test_the_others_follow_the_one_that_is_held() -> None:
    rng = np.random.default_rng(1)
    jacobian, measured = 6.0 * rng.standard_normal((9, 3)), rng.standard_normal(9)
    toy = linear(jacobian, measured)
    best, covariance = least(toy, jacobian, measured, True)
    (found,) = profile_likelihood(started(toy), ["p1"])
    for theta in found.thetas:
        z = np.log(theta)
        wanted = best + covariance[:, 1] / covariance[1, 1] * (z[1] - best[1])
        np.testing.assert_allclose(z, wanted, atol=0.15 * np.sqrt(covariance.diagonal()).max())


def test_what_the_data_leave_open_is_open() -> None:
    """Only the product is in the data: neither factor has an end of its own within the range, though the prior has."""
    jacobian = np.array([[10.0, 10.0]])
    toy = linear(jacobian, np.array([0.0]))
    (found,) = profile_likelihood(started(toy), ["p0"], with_prior=False)
    interval = found.intervals[0]
    assert (interval.open_lower, interval.open_upper) == (True, True)
    assert (interval.lower, interval.upper) == pytest.approx((np.exp(-2.0), np.exp(2.0)))
    assert "nothing between 0.135 W/m/K and 7.39 W/m/K, its physical range, is excluded" in profile_sentence(found)
    assert found.deviance.max() < 0.1
    (held,) = profile_likelihood(started(toy), ["p0"])
    assert held.intervals[0].upper == pytest.approx(np.exp(Q90 * np.sqrt(0.5)), rel=0.03)


def test_an_estimate_at_its_bound_is_open_to_that_side() -> None:
    """The data want more than the range has."""
    toy = linear(np.array([[5.0]]), np.array([15.0]))
    (found,) = profile_likelihood(started(toy), with_prior=False)
    interval = found.intervals[0]
    assert found.estimate == pytest.approx(np.exp(2.0), rel=1e-3)
    assert interval.open_upper
    assert not interval.open_lower
    edge = 3.0 - np.sqrt(1.0 + Q90**2 / 25.0)  # deviance counts from the bound: 25 (3 - z)² - 25
    assert np.log(interval.lower) == pytest.approx(edge, abs=0.01)
    assert "at least" in profile_sentence(found)
    assert "no upper limit within its physical range" in profile_sentence(found)


def test_a_curved_likelihood_has_an_interval_to_one_side() -> None:
    """One parameter with r = 5 (e^z - 1): D = 25 (e^z - 1)², so the ends are log(1 ± 1.645/5)."""
    toy = Toy(parameters(1, 2.0), lambda z: (5.0 * (np.exp(z) - 1.0), 5.0 * np.exp(z)[None]))
    (found,) = profile_likelihood(started(toy), with_prior=False)
    low, high = np.log([found.intervals[0].lower, found.intervals[0].upper])
    assert low == pytest.approx(np.log(1.0 - Q90 / 5.0), abs=0.015)
    assert high == pytest.approx(np.log(1.0 + Q90 / 5.0), abs=0.015)
    assert -low > 1.2 * high


def test_a_lower_optimum_on_the_way_becomes_the_optimum() -> None:
    """Two minima, at z = -1 and 0.8, the second lower; it starts at the first."""

    def double_well(z: FloatArray) -> tuple[FloatArray, FloatArray]:
        u = z[0]
        return (
            np.array([1.5 * (u + 1.0) * (u - 0.8), 0.6 * (u - 1.0)]),
            np.array([[1.5 * (2.0 * u + 0.2)], [0.6]]),
        )

    toy = Toy(parameters(1), double_well)
    (found,) = profile_likelihood(started(toy, np.array([-1.0])), with_prior=False, levels=(0.9,))
    assert np.log(found.estimate) == pytest.approx(0.8, abs=0.1)
    assert found.estimate_deviance == pytest.approx(1.44, abs=0.1)
    assert found.deviance.min() == 0.0


def test_an_optimum_that_one_parameter_meets_counts_for_all() -> None:
    """The first parameter's profile stays in the upper of two valleys of the second; both count from the lower."""

    def double_well(z: FloatArray) -> tuple[FloatArray, FloatArray]:
        u = z[1]
        return (
            np.array([4.0 * z[0], 1.5 * (u + 1.0) * (u - 0.8), 0.6 * (u - 1.0)]),
            np.array([[4.0, 0.0], [0.0, 1.5 * (2.0 * u + 0.2)], [0.0, 0.6]]),
        )

    toy = Toy(parameters(2), double_well)
    first, second = profile_likelihood(started(toy, np.array([0.0, -1.0])), with_prior=False, levels=(0.9,))
    assert first.estimate_deviance == second.estimate_deviance == pytest.approx(1.44, abs=0.1)
    assert first.deviance.min() == 0.0


def test_points_are_many_enough_and_few() -> None:
    rng = np.random.default_rng(2)
    toy = linear(5.0 * rng.standard_normal((30, 8)), rng.standard_normal(30))
    profiles = profile_likelihood(started(toy))
    assert all(5 <= p.values.size <= 12 for p in profiles)
    assert all((np.diff(p.values) > 0.0).all() for p in profiles)
    assert toy.calls < 8 * 40


def test_coverage_of_the_data_alone() -> None:
    """Wilks: 90 % intervals hold the truth in nine of ten data sets, here within the 99 % binomial band."""
    rng = np.random.default_rng(3)
    jacobian, truth = 3.0 * rng.standard_normal((8, 2)), np.array([0.2, -0.1])
    inside = 0
    trials = 120
    for _ in range(trials):
        toy = linear(jacobian, jacobian @ truth + rng.standard_normal(8))
        (found,) = profile_likelihood(started(toy), ["p0"], with_prior=False, levels=(0.9,))
        inside += found.intervals[0].lower < np.exp(truth[0]) < found.intervals[0].upper
    assert abs(inside / trials - 0.9) < 2.58 * np.sqrt(0.09 / trials)


def test_bad_names_and_levels_are_refused() -> None:
    toy = linear(np.eye(2), np.zeros(2))
    with pytest.raises(CalibrationError, match=r"'p7' is not estimated; the nearest valid one is 'p"):
        profile_likelihood(started(toy), ["p7"])
    for levels in ((), (0.0,), (0.9, 1.0)):
        with pytest.raises(CalibrationError, match="levels: expected confidence levels between 0 and 1"):
            profile_likelihood(started(toy), levels=levels)


def test_progress_and_json() -> None:
    toy, told = linear(np.diag([3.0, 4.0]), np.zeros(2)), []
    profiles = profile_likelihood(started(toy), progress=lambda *a: told.append(a))
    assert told == [("profile", 1, 2), ("profile", 2, 2)]
    content = json.loads(json.dumps(profiles[0].to_dict()))
    assert content["name"] == "p0"
    assert content["intervals"][0]["level"] == 0.9
    assert len(content["values"]) == len(content["deviance"])
    assert profile_sentence(profiles[0]).startswith("P0: 0.")


@cache
def bundled() -> tuple[Estimate, Profile]:
    problem = tuning_problem(load_bundled_case(), settings=CalibrationSettings(dx=1.5))
    found = estimate(problem, problem.point(problem.start))
    return found, profile_likelihood(found, ["interior_film_coefficient"])[0]


def test_a_real_profile_agrees_with_the_standard_error() -> None:
    found, profile = bundled()
    problem = found.problem
    j = [p.name for p in problem.parameters].index(profile.name)
    error = float(np.sqrt(found.covariance[j, j]))
    interval = profile.intervals[0]
    width = np.log(interval.upper / interval.lower)
    assert width == pytest.approx(2.0 * Q90 * error, rel=0.3)
    assert interval.lower < found.theta[problem.free[j]] < interval.upper


def test_a_real_profile_is_that_of_models_reduced_at_each_point() -> None:
    found, profile = bundled()
    problem = found.problem
    costs = [
        float(np.sum(problem.weighted(reduced_model(problem.grid, [theta]), problem.point(theta))[0] ** 2))
        for theta in profile.thetas
    ]
    np.testing.assert_allclose(np.array(costs) - min(costs), profile.deviance, atol=0.15)
