"""Doubling against the quadratic formula, SciPy and python-control."""

from __future__ import annotations

import control
import numpy as np
import pytest
import scipy.linalg as sl
from numpy.typing import NDArray

from calibration.errors import FilterError
from calibration.estimation.disturbance import doubled_riccati, summed_stein

FloatArray = NDArray[np.float64]


def stable(seed: int, n: int, radius: float = 0.98) -> FloatArray:
    a = np.random.default_rng(seed).standard_normal((n, n))
    return np.asarray(radius * a / np.abs(np.linalg.eigvals(a)).max())


@pytest.mark.parametrize(("a", "q", "r"), [(0.9, 1.0, 2.0), (1.0, 0.01, 5.0), (1.2, 3.0, 0.1)])
def test_scalar_equation_by_the_quadratic_formula(a: float, q: float, r: float) -> None:
    """p = a² p r / (p + r) + q, so p² + (r - a² r - q) p - q r = 0."""
    found, dual = doubled_riccati(np.array([[a]]), np.array([[1.0 / r]]), np.array([[q]]))
    b = r - a**2 * r - q
    assert found[0, 0] == pytest.approx(0.5 * (-b + np.sqrt(b**2 + 4.0 * q * r)), rel=1e-10)
    # y = a² y / (1 + q y) + 1/r
    y = dual[0, 0]
    assert y == pytest.approx(a**2 * y / (1.0 + q * y) + 1.0 / r, rel=1e-10)


@pytest.mark.parametrize("n", [3, 20])
def test_against_scipy_and_python_control(n: int) -> None:
    rng = np.random.default_rng(n)
    a, c, g = stable(n, n), rng.standard_normal((2, n)), rng.standard_normal((n, 2))
    q, r = g @ g.T, np.diag([0.1, 0.3])
    found, _ = doubled_riccati(a, c.T @ np.linalg.solve(r, c), q)
    np.testing.assert_allclose(found, sl.solve_discrete_are(a.T, c.T, q, r), rtol=1e-7, atol=1e-9)
    gain, p, _ = control.dlqe(a, g, c, np.eye(2), r)
    np.testing.assert_allclose(found, p, rtol=1e-6, atol=1e-8)
    np.testing.assert_allclose(a @ found @ c.T @ np.linalg.inv(c @ found @ c.T + r), gain, rtol=1e-6, atol=1e-8)


def test_sum_of_congruences_against_scipy() -> None:
    a, x = stable(1, 12), np.random.default_rng(2).standard_normal((12, 12))
    wanted = sl.solve_discrete_lyapunov(a.T, x + x.T)
    np.testing.assert_allclose(summed_stein(a, x + x.T), wanted, rtol=1e-9, atol=1e-9 * np.abs(wanted).max())


def test_no_steady_state_is_said() -> None:
    with pytest.raises(FilterError, match="did not converge"):
        doubled_riccati(np.array([[1.1]]), np.array([[0.0]]), np.array([[1.0]]))
