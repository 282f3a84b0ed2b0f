"""Quick fits: closed forms of linear problems, bounds, and the evidence against an integral."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import trapezoid

from calibration._settings import ModelSettings
from calibration.diagnosis._bench import Bench
from calibration.diagnosis._fit import descend, evidence_of
from thermal import Building, Parameter
from thermal.pilot import MOUNTAIN_VIEW, devices, generate_office, generate_twin

FloatArray = NDArray[np.float64]


@dataclass
class Linear:
    """What `descend` asks of a problem, for errors ``A z - b`` and independent priors."""

    matrix: FloatArray
    wanted: FloatArray
    parameters: tuple[Parameter, ...]
    count: float

    @property
    def bounds(self) -> tuple[FloatArray, FloatArray]:
        return np.array([p.lower for p in self.parameters]), np.array([p.upper for p in self.parameters])

    def theta(self, z: FloatArray) -> FloatArray:
        return z

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
    found = descend(problem, problem, np.array([-40.0, 30.0]), 60)
    best = np.linalg.lstsq(problem.matrix, problem.wanted, rcond=None)[0]
    assert found.settled
    np.testing.assert_allclose(found.point, best, atol=2e-3)
    assert found.mean_square == pytest.approx(np.mean((problem.matrix @ best - problem.wanted) ** 2), rel=1e-4)


def test_a_strength_stays_in_its_range() -> None:
    problem = linear(upper=1.5, lower=0.0)
    found = descend(problem, problem, np.array([0.4, 0.4]), 30)
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
        found = descend(problem, problem, np.array([0.2]), 30)
        grid = np.linspace(0.0, 1.0, 20001)
        errors = wanted[None, :] - grid[:, None] * matrix[:, 0][None, :]
        log_likelihood = -150.0 * np.log(np.mean(errors**2, axis=1))
        prior = np.exp(-0.5 * (grid / 0.5) ** 2)
        exact = np.log(trapezoid(np.exp(log_likelihood - log_likelihood.max()) * prior, grid))
        exact += log_likelihood.max() - np.log(trapezoid(prior, grid))
        assert evidence_of(problem, found) == pytest.approx(exact, abs=0.1)
        strengths[truth] = exact + 150.0 * np.log(np.mean(wanted**2))
    assert strengths[0.3] > 0.0 > strengths[0.0]


def test_what_a_fit_finds_is_so_on_the_grid() -> None:
    """Far from where the first basis was made: it would promise errors that the grid does not have."""
    plans = generate_office(3, floor_area=120.0, zones=4, floors=1)
    building = Building("office", MOUNTAIN_VIEW, 0.0, plans, devices(plans))
    case = generate_twin(building, 5, days=9.0, step_seconds=900.0, dx=1.0, meter="exact")[0]
    bench = Bench(case, ModelSettings(dx=1.0))
    start = {"slab_coupling": 20.0, "slab_heat_capacity": 6e5, "furniture_coupling": 8.0, "window_u_value": 5.0}
    fit = bench.fit({"roof_exchange": ()}, [start])
    errors = [fit.problem.errors(fit.built.grid, fit.theta, r, slopes=False)[0].ravel() for r in fit.problem.runs]
    grid = np.concatenate(errors)
    assert fit.found.mean_square == pytest.approx(np.nanmean(grid**2), rel=0.02)
    near = bench.fit({"roof_exchange": ()}, [{}])
    assert fit.evidence == pytest.approx(near.evidence, abs=2.0)  # from wherever it starts


def test_a_descent_in_parts_comes_to_where_one_does() -> None:
    problem = linear()
    whole = descend(problem, problem, np.array([-40.0, 30.0]), 60)
    part = descend(problem, problem, np.array([-40.0, 30.0]), 1)
    while not part.settled:
        part = descend(problem, problem, part, 3)
    np.testing.assert_array_equal(part.point, whole.point)
    assert part.evaluations == whole.evaluations
