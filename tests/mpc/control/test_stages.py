"""Problems in stages: the linear-quadratic one against Riccati's recursion, fatrop against Ipopt, what goes wrong."""

from __future__ import annotations

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest

from mpc.control.solvers.solution import Status
from mpc.control.solvers.stages import StageData, StageProblem, StageSolver
from mpc.errors import ControlError

N = 15


def quadratic_problem() -> StageProblem:
    """Two states, a decision that no bound stops."""
    x, u, p = ca.SX.sym("x", 2), ca.SX.sym("u"), ca.SX.sym("p")
    following = ca.vertcat(0.9 * x[0] + 0.1 * x[1] + 0.2 * u, 0.05 * x[0] + 0.93 * x[1])
    cost = ca.sumsqr(x) + 0.5 * u**2
    return StageProblem(x, u, p, following, cost, 3.0 * ca.sumsqr(x), x[0], np.array([-50.0]), np.array([50.0]))


def bilinear_problem() -> StageProblem:
    """A zone with a slab, heated by an airflow at a temperature, both decided."""
    x, u, p = ca.SX.sym("x", 2), ca.SX.sym("u", 2), ca.SX.sym("p", 2)
    heat = 2.0 * u[0] * (1.5 * u[1] - 0.1 * x[0])
    following = ca.vertcat(0.85 * x[0] + 0.1 * x[1] + 0.05 * p[0] + heat, 0.03 * x[0] + 0.97 * x[1])
    cost = p[1] * u[0] * (1.5 * u[1] + 1.0) + 0.2 * u[0] ** 2
    return StageProblem(x, u, p, following, cost, ca.SX(0), x[0], np.zeros(2), np.array([1.0, 2.0]))


def no_band(start: np.ndarray, n_parameter: int = 1) -> StageData:
    edges = np.ones((N + 1, 1))
    return StageData(start, np.zeros((N, n_parameter)), -np.inf * edges, np.inf * edges, edges)


def riccati_cost(problem: StageProblem, start: np.ndarray) -> float:
    a = np.array(ca.evalf(ca.jacobian(problem.next_state, problem.state)))
    b = np.array(ca.evalf(ca.jacobian(problem.next_state, problem.decision)))
    value = 3.0 * np.eye(2)
    for _ in range(N):
        gain = np.linalg.solve(0.5 + b.T @ value @ b, b.T @ value @ a)
        value = np.eye(2) + 0.5 * gain.T @ gain + (a - b @ gain).T @ value @ (a - b @ gain)
    return float(start @ value @ start)


@pytest.mark.parametrize("method", ["fatrop", "ipopt"])
def test_linear_quadratic_problem_costs_what_riccati_says(method) -> None:
    problem, start = quadratic_problem(), np.array([3.0, -1.0])
    data = no_band(start)
    decisions = np.zeros((N, 1))
    found = StageSolver(problem, N, method, 1e-8).solve(data, problem.follow(data, decisions), decisions)
    assert found.status is Status.CONVERGED
    assert found.cost == pytest.approx(riccati_cost(problem, start), rel=1e-6)


def test_fatrop_and_ipopt_cost_the_same() -> None:
    problem, edges = bilinear_problem(), np.ones((N + 1, 1))
    prices = np.column_stack([np.linspace(-8.0, -2.0, N), np.where(np.arange(N) < 7, 0.1, 0.3)])
    data = StageData(np.array([-1.0, -0.5]), prices, np.where(np.arange(N + 1) > 4, 1.0, -2.0)[:, None], 4.0 * edges,
                     0.5 * edges)  # fmt: skip
    decisions = np.full((N, 2), 0.5)
    costs = []
    for method in ("fatrop", "ipopt"):
        found = StageSolver(problem, N, method, 1e-6).solve(data, problem.follow(data, decisions), decisions)
        assert found.status is Status.CONVERGED and found.solver == method
        assert (found.decisions >= problem.lower - 1e-6).all() and (found.decisions <= problem.upper + 1e-6).all()
        np.testing.assert_allclose(problem.follow(data, found.decisions), found.states, atol=1e-6)
        costs.append(found.cost)
    assert costs[0] == pytest.approx(costs[1], rel=5e-3)
    outside = np.maximum(data.lower - found.states[:, :1], 0.0) * data.price
    spent = prices[:, 1] * found.decisions[:, 0] * (1.5 * found.decisions[:, 1] + 1.0)
    by_hand = outside.sum() + (spent + 0.2 * found.decisions[:, 0] ** 2).sum()
    assert found.cost == pytest.approx(by_hand, rel=1e-6)


def test_a_stopped_solve_says_so() -> None:
    problem = bilinear_problem()
    data = replace(no_band(np.array([-1.0, -0.5]), 2), lower=np.ones((N + 1, 1)))
    decisions = np.full((N, 2), 0.5)
    for method in ("fatrop", "ipopt"):
        found = StageSolver(problem, N, method, 1e-8, iterations=1).solve(
            data, problem.follow(data, decisions), decisions
        )
        assert found.status is Status.ITERATION_LIMIT and found.message


def test_what_does_not_fit_is_named() -> None:
    problem = bilinear_problem()
    with pytest.raises(ControlError, match="nearest valid one is 'fatrop'"):
        StageSolver(problem, N, "fatrip")  # type: ignore[arg-type]
    with pytest.raises(ControlError, match="16 steps|15 steps"):
        StageSolver(problem, N).solve(
            StageData(np.zeros(2), np.zeros((3, 2)), np.zeros((4, 1)), np.zeros((4, 1)), np.zeros((4, 1))),
            np.zeros((N + 1, 2)), np.zeros((N, 2)),
        )  # fmt: skip
    with pytest.raises(ControlError, match="ranges of 2 decisions"):
        replace(problem, lower=np.zeros(3))
