"""Linear predictive control: the convex programme against the nonlinear solvers, compiled once, stopped, refused."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mpc.control.predictor.heat import HeatChannel, HeatPredictor
from mpc.control.problem.horizon import Horizon, PeakData
from mpc.control.problem.problem import ControlProblem
from mpc.control.solvers.convex import LinearSolver
from mpc.control.solvers.ipopt import IpoptSolver
from mpc.control.solvers.sequential import SequentialSolver
from mpc.control.solvers.solution import Status
from mpc.errors import ControlError


@pytest.fixture(scope="module")
def problem(modes) -> ControlProblem:
    n = modes.output.shape[0]
    horizon = Horizon.growing([(1.0, 300.0), (3.0, 900.0)], [0.5, 0.5, 1.0, 1.0, 1.0])
    channels = [HeatChannel("heating", zone, 2500.0) for zone in range(n)]
    channels += [HeatChannel("cooling", zone, 2000.0) for zone in range(n)]
    return ControlProblem(HeatPredictor(modes, horizon, channels, disturbance_time=6 * 3600.0))


@pytest.fixture(scope="module")
def solver(problem) -> LinearSolver:
    return LinearSolver(problem)


def horizon_of(make_data, problem, outdoor=274.0, zone=292.0, **other):
    return make_data(problem, outdoor, zone, previous=np.full(problem.shape[1], 100.0), **other)


@pytest.mark.parametrize(("outdoor", "zone"), [(274.0, 292.0), (306.0, 298.0)])
def test_costs_what_the_nonlinear_solvers_find(problem, solver, make_data, outdoor, zone) -> None:
    data = horizon_of(make_data, problem, outdoor, zone, heat_value=0.01)
    plan = np.full(problem.shape, 200.0)
    found = solver.solve(data, plan)
    assert found.status is Status.CONVERGED and found.solver == "linear" and found.usable
    for other in (SequentialSolver(problem, tolerance=1e-5, iterations=100), IpoptSolver(problem, iterations=500)):
        reference = other.solve(data, plan)
        assert found.terms.total == pytest.approx(reference.terms.total, rel=5e-3)
        assert found.terms.total <= reference.terms.total + 1e-4


def test_no_move_is_better_nearby(problem, solver, make_data) -> None:
    """Optimality by the definition: costs do not fall along any feasible direction."""
    data = horizon_of(make_data, problem)
    found = solver.solve(data, np.full(problem.shape, 200.0))
    rng = np.random.default_rng(0)
    for _ in range(30):
        shares = np.clip(problem.shares(found.plan) + 0.02 * rng.standard_normal(problem.span.size), 0.0, 1.0)
        moved = problem.predictor.rollout(data, problem.plan(shares))
        assert problem.terms(data, moved).total >= found.terms.total - 1e-6


def test_demand_charges_and_rates(problem, modes, make_data) -> None:
    n = modes.output.shape[0]
    channels = [HeatChannel("cooling", zone, 2000.0, rate=1500.0) for zone in range(n)]
    slow = ControlProblem(HeatPredictor(modes, problem.predictor.horizon, channels))
    count = len(slow.predictor.horizon)
    peaks = PeakData(
        np.eye(count), np.zeros(count), np.zeros(count, dtype=np.int64), np.array([8.0]), np.array([300.0])
    )
    data = make_data(slow, 306.0, 298.0, previous=np.full(n, 100.0), peaks=peaks)
    plan = np.full(slow.shape, 100.0)
    found, free = (
        LinearSolver(slow).solve(data, plan),
        LinearSolver(slow).solve(replace(data, peaks=PeakData.none(count)), plan),
    )
    reference = IpoptSolver(slow, iterations=500).solve(data, plan)
    assert found.terms.total == pytest.approx(reference.terms.total, rel=5e-3)
    assert found.rollout.electric.max() < 0.9 * free.rollout.electric.max()
    changes = np.abs(np.diff(np.vstack([data.previous, found.plan]), axis=0)) / 2000.0
    assert (changes.ravel() <= slow.most_change + 1e-6).all()


def test_it_is_compiled_once(problem, solver, make_data, monkeypatch) -> None:
    plan = np.full(problem.shape, 200.0)
    solver.solve(horizon_of(make_data, problem), plan)
    programme = next(iter(solver._built.values()))._programme
    assert programme.is_dcp(dpp=True)
    import cvxpy.reductions.chain as chain

    monkeypatch.setattr(chain.Chain, "apply", lambda *_: pytest.fail("the programme was compiled again"))
    warmer = solver.solve(horizon_of(make_data, problem, 285.0), plan)
    assert warmer.status is Status.CONVERGED


def test_out_of_time_it_hands_back_what_it_was_given(problem, solver, make_data) -> None:
    plan = np.full(problem.shape, 200.0)
    found = solver.solve(horizon_of(make_data, problem), plan, time_limit=1e-9)
    assert found.status is Status.TIME_LIMIT and found.usable
    np.testing.assert_array_equal(found.plan, plan)


def test_slopes_are_those_of_differences(problem, make_data) -> None:
    data, plan = horizon_of(make_data, problem), np.full(problem.shape, 200.0)
    predictor = problem.predictor
    slopes = predictor.sensitivity(data, predictor.rollout(data, plan))
    for j in (0, 7, plan.size - 1):
        other = plan.copy()
        other.ravel()[j] += 1.0
        moved, here = predictor.rollout(data, other), predictor.rollout(data, plan)
        for name in ("zone", "electric", "fuel", "end_state"):
            np.testing.assert_allclose(
                getattr(slopes, name)[..., j], getattr(moved, name) - getattr(here, name), atol=1e-9
            )


def test_what_does_not_fit_is_named(make_problem, modes) -> None:
    with pytest.raises(ControlError, match="HeatPredictor"):
        LinearSolver(make_problem())
    with pytest.raises(ControlError, match="each once"):
        HeatPredictor(modes, Horizon.regular(1.0, 300.0, 2), [HeatChannel("heating", 99, 100.0)])
    with pytest.raises(ControlError, match="'cooling'"):
        HeatChannel("colling", 0, 100.0)  # type: ignore[arg-type]
