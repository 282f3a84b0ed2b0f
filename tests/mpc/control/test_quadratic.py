"""Quadratic programmes against their closed forms, by both solvers."""

from __future__ import annotations

import numpy as np
import pytest

from mpc.control.solvers.convex import solve_quadratic


@pytest.mark.parametrize("solver", ["clarabel", "osqp"])
def test_closed_forms(solver) -> None:
    rng = np.random.default_rng(0)
    root = rng.standard_normal((6, 6))
    hessian, gradient = root @ root.T + np.eye(6), rng.standard_normal(6)
    free = solve_quadratic(hessian, gradient, np.eye(6), np.full(6, -1e3), np.full(6, 1e3), solver)
    assert free.solved
    np.testing.assert_allclose(free.x, -np.linalg.solve(hessian, gradient), atol=1e-6)
    # a diagonal one with bounds decouples
    boxed = solve_quadratic(np.diag([1.0, 2.0]), np.array([-3.0, 1.0]), np.eye(2), -np.ones(2), np.ones(2), solver)
    np.testing.assert_allclose(boxed.x, [1.0, -0.5], atol=1e-6)


@pytest.mark.parametrize("solver", ["clarabel", "osqp"])
def test_what_has_no_solution_is_not_solved(solver) -> None:
    rows = np.array([[1.0], [1.0]])
    none = solve_quadratic(np.eye(1), np.zeros(1), rows, np.array([1.0, -np.inf]), np.array([np.inf, 0.0]), solver)
    assert not none.solved
