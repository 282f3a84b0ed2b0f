"""Quick fits: closed forms of linear problems, bounds, and the evidence against an integral."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import trapezoid

from calibration.diagnosis.refit.fit import _descend, _lowest, evidence_of, solve
from thermal import Parameter

FloatArray = NDArray[np.float64]


@dataclass
class Linear:
    """What a fit asks of a problem, for errors ``A z - b`` and independent priors."""

    matrix: FloatArray
    wanted: FloatArray
    parameters: tuple[Parameter, ...]
    count: float

    @property
    def bounds(self) -> tuple[FloatArray, FloatArray]:
        return np.array([p.lower for p in self.parameters]), np.array([p.upper for p in self.parameters])

    def theta(self, z: FloatArray) -> FloatArray:
        return z

    def point(self, theta: FloatArray) -> FloatArray:
        return theta

    def slopes(self, theta: FloatArray) -> FloatArray:
        return np.ones_like(theta)

    def residuals(self, model: object, theta: FloatArray) -> tuple[FloatArray, FloatArray]:
        return self.matrix @ theta - self.wanted, self.matrix

    def effective_size(self) -> float:
        return self.count

    def prior_covariance(self) -> FloatArray:
        return np.diag([p.prior_deviation**2 for p in self.parameters])


def parameter(name: str, upper: float, lower: float = 0.0) -> Parameter:
    return Parameter(name, "1", 0.0, lower, upper, "made up", "linear", "made_up")


def linear(upper: float = 1e3, lower: float = -1e3) -> Any:
    rng = np.random.default_rng(3)
    matrix = rng.standard_normal((400, 2))
    wanted = matrix @ np.array([2.0, 0.5]) + 0.3 * rng.standard_normal(400)
    return Linear(matrix, wanted, (parameter("a", upper, lower), parameter("b", upper, lower)), 400.0)


def test_least_squares_are_found_from_afar() -> None:
    problem = linear()
    found = _descend(problem, problem, np.array([-40.0, 30.0]), 60)
    best = np.linalg.lstsq(problem.matrix, problem.wanted, rcond=None)[0]
    assert found.converged
    np.testing.assert_allclose(found.point, best, atol=2e-3)
    assert found.mean_square == pytest.approx(np.mean((problem.matrix @ best - problem.wanted) ** 2), rel=1e-4)


def test_a_parabola_is_lowest_where_its_slope_ends() -> None:
    for bottom, length in ((0.4, 1.0), (0.4, 0.3), (3.0, 0.5)):
        slope, end = -2.0 * bottom, (length - bottom) ** 2 - bottom**2  # of (t - bottom)^2
        assert length * _lowest(slope * length, end) == pytest.approx(bottom)
    assert _lowest(-1.0, -1.5) == np.inf


class Bent(Linear):
    """Errors whose second derivatives Gauss and Newton do not see: whole steps overshoot again and again."""

    def residuals(self, model: object, theta: FloatArray) -> tuple[FloatArray, FloatArray]:
        error = np.concatenate([theta - 1.0, 0.6 * theta**2 + 2.0])
        return error, np.vstack([np.eye(2), 1.2 * np.diag(theta)])


def test_a_fit_that_overshoots_slows_down(monkeypatch: pytest.MonkeyPatch) -> None:
    plain = linear(4.0, -4.0)
    problem: Any = Bent(plain.matrix, plain.wanted, plain.parameters, 400.0)
    found = _descend(problem, problem, np.array([1.5, -1.0]), 60)
    monkeypatch.setattr("calibration.diagnosis.refit.fit._LEAST_PACE", 1.0)
    hasty = _descend(problem, problem, np.array([1.5, -1.0]), 60)
    assert found.converged and found.pace < 1.0 == hasty.pace
    assert found.evaluations < hasty.evaluations
    assert found.cost <= hasty.cost + 1e-3


def test_a_strength_stays_in_its_range() -> None:
    problem = linear(upper=1.5, lower=0.0)
    found = _descend(problem, problem, np.array([0.4, 0.4]), 30)
    assert found.point[0] == pytest.approx(1.5, abs=1e-6)
    assert 0.0 <= found.point[1] <= 1.5


def test_evidence_is_the_integral_over_the_prior() -> None:
    """One strength of a known deviation of the errors, against quadrature; what both models share cancels."""
    rng = np.random.default_rng(5)
    matrix = rng.standard_normal((300, 1))
    strengths = {}
    for truth in (0.0, 0.3):
        wanted = truth * matrix[:, 0] + rng.standard_normal(300)
        problem: Any = Linear(matrix, wanted, (parameter("a", 1.0),), 300.0)
        found = _descend(problem, problem, np.array([0.2]), 30)
        grid = np.linspace(0.0, 1.0, 20001)
        errors = wanted[None, :] - grid[:, None] * matrix[:, 0][None, :]
        log_likelihood = -150.0 * np.log(np.mean(errors**2, axis=1))
        prior = np.exp(-0.5 * (grid / 0.5) ** 2)
        exact = np.log(trapezoid(np.exp(log_likelihood - log_likelihood.max()) * prior, grid))
        exact += log_likelihood.max() - np.log(trapezoid(prior, grid))
        assert evidence_of(problem, found) == pytest.approx(exact, abs=0.1)
        strengths[truth] = exact + 150.0 * np.log(np.mean(wanted**2))
    assert strengths[0.3] > 0.0 > strengths[0.0]


@dataclass
class Basis:
    """A model that is exact where it was made, and promises smaller errors the farther away it is used."""

    theta: FloatArray

    def is_accurate(self, theta: FloatArray, tolerance: float) -> bool:
        return bool(np.linalg.norm(theta - self.theta) <= tolerance)

    serves = is_accurate  # its name in models before the rooms are merged


class Flattered(Linear):
    def residuals(self, model: Any, theta: FloatArray) -> tuple[FloatArray, FloatArray]:
        error, slopes = super().residuals(model, theta)
        away = theta - model.theta
        less = np.exp(-0.5 * away @ away)
        return less * error, less * (slopes - np.outer(error, away))


@pytest.fixture
def made(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """Reduced models that a fit makes, in order."""
    bases: list[Any] = []

    def reduced(_: Any, thetas: list[FloatArray], shifts: Sequence[float]) -> Any:
        bases.append(Basis(np.array(thetas[0])))
        return bases[-1]

    monkeypatch.setattr("calibration.diagnosis.refit.fit.reduced_model", reduced)
    return bases


def test_a_fit_counts_what_the_next_basis_confirms(made: list[Any]) -> None:
    plain = linear(4.0, -4.0)
    problem: Any = Flattered(plain.matrix, plain.wanted, plain.parameters, plain.count)
    start = np.array([-3.0, 3.0])
    model, found = solve(problem, problem, start, 60)
    exact = np.mean(plain.residuals(None, found.point)[0] ** 2)
    assert len(made) > 2
    assert model is made[-1] or model is made[-2]
    assert found.mean_square == pytest.approx(exact, rel=1e-9)
    assert exact < np.mean(plain.residuals(None, start)[0] ** 2) / 10.0
    basis: Any = Basis(start)
    one = _descend(problem, basis, start, 60)  # a single basis runs away
    assert np.mean(plain.residuals(None, one.point)[0] ** 2) > 10.0 * one.mean_square


def test_a_descent_in_parts_comes_to_where_one_does() -> None:
    problem = linear()
    whole = _descend(problem, problem, np.array([-40.0, 30.0]), 60)
    part = _descend(problem, problem, np.array([-40.0, 30.0]), 1)
    while not part.converged:
        part = _descend(problem, problem, part, 3)
    np.testing.assert_array_equal(part.point, whole.point)
    assert part.evaluations == whole.evaluations


def test_where_much_is_measured_a_fit_ends_within_a_share_of_its_evidence(made: list[Any]) -> None:
    plain = linear(4.0, -4.0)
    best = np.mean(plain.residuals(None, np.linalg.lstsq(plain.matrix, plain.wanted, rcond=None)[0])[0] ** 2)
    needed = []
    for count in (300.0, 30000.0):  # as many errors, worth more days
        problem: Any = Flattered(plain.matrix, plain.wanted, plain.parameters, count)
        made.clear()
        _, found = solve(problem, problem, np.array([-3.0, 3.0]), 60)
        needed.append(len(made))
        assert found.converged
        assert 0.5 * count * np.log(found.mean_square / best) < 0.01 * count
    assert needed[1] < needed[0]


def test_a_fit_ends_early_where_the_evidence_asked_for_is_out_of_reach(made: list[Any]) -> None:
    plain = linear(4.0, -4.0)
    problem: Any = Flattered(plain.matrix, plain.wanted, plain.parameters, plain.count)
    start = np.array([-3.0, 3.0])
    _, whole = solve(problem, problem, start, 60)
    reached = evidence_of(problem, whole)
    _, within = solve(problem, problem, start, 60, least=reached - 1.0)
    np.testing.assert_array_equal(within.point, whole.point)
    _, beyond = solve(problem, problem, start, 60, least=reached + 5000.0)
    assert beyond.evaluations < whole.evaluations
    assert evidence_of(problem, beyond) < reached + 5000.0
