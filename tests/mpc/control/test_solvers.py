"""The sequential solver against Ipopt, limits and peaks kept, and what happens when they are stopped."""

from __future__ import annotations

import numpy as np
import pytest

from mpc.control.problem.channels import Channel
from mpc.control.problem.horizon import PeakData
from mpc.control.solvers.ipopt import IpoptSolver
from mpc.control.solvers.sequential import SequentialSolver
from mpc.control.solvers.solution import Status


def charged(problem, rate: float = 6.0, so_far: float = 1000.0) -> PeakData:
    """A peak over windows of one step, from the third block on."""
    first, count = int(problem.predictor.horizon.first_steps[2]), len(problem.predictor.horizon)
    none = np.zeros(count - first)
    return PeakData(np.eye(count)[first:], none, none.astype(int), np.array([rate]), np.array([so_far]))


@pytest.mark.parametrize("outdoor", [270.0, 285.0, 303.0])
def test_within_half_a_percent_of_ipopt(make_problem, make_data, outdoor: float) -> None:
    problem = make_problem()
    data = make_data(problem, outdoor, 293.5 if outdoor < 290.0 else 297.0)
    plan = np.tile([288.0, 330.0], (4, 1))
    found = SequentialSolver(problem, tolerance=1e-4, iterations=60).solve(data, plan)
    reference = IpoptSolver(problem).solve(data, plan)
    assert found.status is Status.CONVERGED and reference.status is Status.CONVERGED
    assert found.terms.total <= 1.005 * reference.terms.total
    assert found.terms.total < found.start


@pytest.mark.parametrize("quadratic", ["clarabel", "osqp"])
def test_demand_charges_and_limits_on_changes(make_problem, make_data, quadratic) -> None:
    channels = (
        Channel("supply_air_temperature_setpoint", 285.0, 300.0, 6.0), Channel("supply_water_temperature_setpoint", 310.0, 355.0, 40.0),
    )  # fmt: skip
    problem = make_problem(channels=channels)
    data = make_data(problem, 303.0, 297.0, peaks=charged(problem))
    plan = np.tile([288.0, 330.0], (4, 1))
    found = SequentialSolver(problem, tolerance=1e-4, iterations=60, quadratic=quadratic).solve(data, plan)
    reference = IpoptSolver(problem).solve(data, plan)
    assert reference.status is Status.CONVERGED
    assert found.usable and found.terms.total <= 1.005 * reference.terms.total
    for solution in (found, reference):
        changes = np.abs(np.diff(np.vstack([data.previous, solution.plan]), axis=0))
        assert (changes <= problem.most_change.reshape(4, 2) * [15.0, 45.0] + 1e-4).all()
    free = SequentialSolver(problem, tolerance=1e-4).solve(make_data(problem, 303.0, 297.0), plan)
    late = problem.predictor.horizon.first_steps[2]
    assert found.rollout.electric[late:].max() < free.rollout.electric[late:].max() - 5.0


def test_a_shifted_plan_is_a_warm_start(make_problem, make_data) -> None:
    problem = make_problem()
    solver = SequentialSolver(problem)
    first = solver.solve(make_data(problem), np.tile([288.0, 330.0], (4, 1)))
    again = solver.solve(make_data(problem), first.plan)
    assert again.iterations <= first.iterations and again.terms.total <= first.terms.total + 1e-9
    kept = solver.memory
    solver.forget()
    assert solver.memory is None
    solver.memory = kept
    np.testing.assert_array_equal(solver.memory, kept)


def test_time_is_kept(make_problem, make_data) -> None:
    problem = make_problem()
    plan = np.tile([288.0, 330.0], (4, 1))
    for solver in (SequentialSolver(problem), IpoptSolver(problem)):
        stopped = solver.solve(make_data(problem), plan, time_limit=0.0)
        assert stopped.status in (Status.TIME_LIMIT, Status.FAILED)
        assert np.isfinite(stopped.plan).all() and stopped.terms.total <= stopped.start + 1e-9
