"""The least-squares solver against scipy.optimize.least_squares."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import least_squares

from calibration.fit.least_squares import solve_least_squares

FloatArray = NDArray[np.float64]
Residuals = Callable[[FloatArray], tuple[FloatArray, FloatArray]]


@dataclass(frozen=True)
class Case:
    """A problem: residuals with Jacobian, start and bounds."""

    function: Residuals
    start: tuple[float, ...]
    lower: tuple[float, ...]
    upper: tuple[float, ...]


def rosenbrock(x: FloatArray) -> tuple[FloatArray, FloatArray]:
    return np.array([10.0 * (x[1] - x[0] ** 2), 1.0 - x[0]]), np.array([[-20.0 * x[0], 10.0], [-1.0, 0.0]])


def chained(x: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Rosenbrock over eight variables, residuals raised by 3: far from a zero-residual problem."""
    n = x.size
    r = np.concatenate([10.0 * (x[1:] - x[:-1] ** 2) + 3.0, 1.0 - x[:-1]])
    jacobian = np.zeros((2 * n - 2, n))
    rows = np.arange(n - 1)
    jacobian[rows, rows], jacobian[rows, rows + 1] = -20.0 * x[:-1], 10.0
    jacobian[n - 1 + rows, rows] = -1.0
    return r, jacobian


TIMES = np.linspace(0.0, 4.0, 60)
DECAY = 2.0 * np.exp(-0.7 * TIMES) + 1.0 + 0.8 * np.sin(9.0 * TIMES)  # a misfit that no parameter explains


def decay(x: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Amplitude, rate and offset of a decay, estimated on the log scale."""
    a, k, c = np.exp(x)
    e = np.exp(-k * TIMES)
    return a * e + c - DECAY, np.column_stack([a * e, -a * k * TIMES * e, np.full(TIMES.size, c)])


def osborne(x: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Strong curvature and large residuals: Gauss-Newton alone diverges here (Brown and Dennis's function)."""
    t = np.arange(1, 21) / 5.0
    u, v = x[0] + t * x[1] - np.exp(t), x[2] + x[3] * np.sin(t) - np.cos(t)
    jacobian = np.column_stack([2 * u, 2 * u * t, 2 * v, 2 * v * np.sin(t)])
    return (u**2 + v**2) / 100.0, jacobian / 100.0


wide = {n: ((-50.0,) * n, (50.0,) * n) for n in (2, 3, 4, 8)}
CASES = {
    "rosenbrock": Case(rosenbrock, (-1.2, 1.0), *wide[2]),
    "rosenbrock, bound active": Case(rosenbrock, (-1.2, 0.2), (-2.0, -2.0), (0.5, 2.0)),
    "rosenbrock, start outside": Case(rosenbrock, (9.0, 9.0), (-2.0, -2.0), (0.5, 2.0)),
    "chained, large residuals": Case(chained, (-1.2, 1.0) * 4, *wide[8]),
    "decay, large residuals": Case(decay, (0.0, 0.0, 0.0), (-5.0,) * 3, (5.0,) * 3),
    "decay, bound active": Case(decay, (0.0, 0.0, -1.5), (-5.0, -5.0, -5.0), (5.0, 5.0, -0.5)),
    "brown and dennis": Case(osborne, (25.0, 5.0, -5.0, -1.0), *wide[4]),
}


@pytest.mark.parametrize("name", CASES)
def test_optimum_is_that_of_scipy(name: str) -> None:
    """Cost to 1e-6 of scipy's best, and the point where it is well determined; the status says success."""
    case = CASES[name]
    start, lower, upper = (np.array(v) for v in (case.start, case.lower, case.upper))
    found = solve_least_squares(case.function, start, lower, upper, tolerance=1e-7, iterations=200)
    inside = np.clip(start, lower + 1e-9, upper - 1e-9)
    wanted = least_squares(
        lambda x: case.function(x)[0], inside, lambda x: case.function(x)[1], bounds=(lower, upper), xtol=1e-14, ftol=1e-14,
        gtol=1e-12, max_nfev=2000,
    )  # fmt: skip
    assert found.success
    assert found.status == "Solve_Succeeded"
    assert found.cost <= wanted.cost + 1e-6 * max(wanted.cost, 1.0)
    np.testing.assert_allclose(found.x, wanted.x, atol=2e-3 * max(1.0, np.abs(wanted.x).max()))
    residual, jacobian = case.function(found.x)
    assert found.cost == pytest.approx(0.5 * residual @ residual)
    np.testing.assert_allclose(found.jacobian, jacobian)
    assert 0 < found.iterations <= 200


@pytest.mark.parametrize("name", CASES)
def test_answer_is_inside_the_bounds(name: str) -> None:
    case = CASES[name]
    seen: list[FloatArray] = []

    def watched(x: FloatArray) -> tuple[FloatArray, FloatArray]:
        seen.append(x.copy())
        return case.function(x)

    start, lower, upper = (np.array(v) for v in (case.start, case.lower, case.upper))
    found = solve_least_squares(watched, start, lower, upper, tolerance=1e-6)
    for x in (*seen, found.x):
        assert (x >= lower - 1e-7).all()
        assert (x <= upper + 1e-7).all()
    assert (found.x >= lower).all()
    assert (found.x <= upper).all()


def test_linear_problem_is_solved_exactly_and_its_jacobian_returned() -> None:
    rng = np.random.default_rng(0)
    matrix, rhs = rng.standard_normal((12, 4)), rng.standard_normal(12)
    found = solve_least_squares(
        lambda x: (matrix @ x - rhs, matrix), np.zeros(4), np.full(4, -9.0), np.full(4, 9.0), 1e-9
    )
    np.testing.assert_allclose(found.x, np.linalg.lstsq(matrix, rhs, rcond=None)[0], atol=1e-7)
    assert found.success


def test_few_evaluations_are_needed_where_residuals_are_large() -> None:
    """The secant term pays: a solve of the estimation's kind takes tens of evaluations, not hundreds."""
    count = 0

    def counted(x: FloatArray) -> tuple[FloatArray, FloatArray]:
        nonlocal count
        count += 1
        return osborne(x)

    solve_least_squares(counted, np.array([25.0, 5.0, -5.0, -1.0]), np.full(4, -50.0), np.full(4, 50.0), 1e-4, 100)
    assert count < 80


class Unplugged(Exception):
    """An error of the caller's own."""


@pytest.mark.parametrize("after", [0, 1, 3, 5])
def test_exceptions_of_the_residuals_come_back_unchanged(after: int) -> None:
    calls = 0
    error = Unplugged("the sensor is unplugged")

    def failing(x: FloatArray) -> tuple[FloatArray, FloatArray]:
        nonlocal calls
        calls += 1
        if calls > after:
            raise error
        return rosenbrock(x)

    with pytest.raises(Unplugged) as caught:
        solve_least_squares(failing, np.array([-1.2, 1.0]), np.full(2, -5.0), np.full(2, 5.0))
    assert caught.value is error


def test_solver_that_stops_early_says_so_and_returns_its_best() -> None:
    found = solve_least_squares(
        rosenbrock, np.array([-1.2, 1.0]), np.full(2, -5.0), np.full(2, 5.0), 1e-9, iterations=3
    )
    assert not found.success
    assert found.status == "Maximum_Iterations_Exceeded"
    start = 0.5 * float(np.sum(rosenbrock(np.array([-1.2, 1.0]))[0] ** 2))
    assert found.cost <= start
    residual, jacobian = rosenbrock(found.x)
    assert found.cost == pytest.approx(0.5 * residual @ residual)
    np.testing.assert_allclose(found.jacobian, jacobian)


def test_residuals_that_are_not_finite_are_no_success() -> None:
    def nowhere(x: FloatArray) -> tuple[FloatArray, FloatArray]:
        return np.full(2, np.nan), np.zeros((2, 2))

    found = solve_least_squares(nowhere, np.zeros(2), np.full(2, -5.0), np.full(2, 5.0))
    assert not found.success
