"""What a plan is expected to lead to: the roll-out's energy on control steps, and the rule's cost from the same state."""

from __future__ import annotations

import numpy as np
import pytest

from mpc.control.controller.outlook import PlanOutlook
from mpc.control.problem.horizon import Horizon
from mpc.control.solvers.solution import Solution, Status


def outlook(problem, data, plan, by_rule) -> PlanOutlook:
    rollout = problem.predictor.rollout(data, plan)
    solution = Solution(
        plan, rollout, problem.terms(data, rollout), 0.0, Status.CONVERGED, "", iterations=0, seconds=0.0, solver="none"
    )
    return PlanOutlook(problem, data, solution, by_rule)


def test_energy_and_temperatures_are_those_of_the_rollout(make_problem, make_data) -> None:
    ahead = Horizon.growing([(1.0, 300.0), (2.0, 900.0)], [1.0, 1.0, 1.0], 900.0)
    problem = make_problem(ahead)
    data, plan = make_data(problem), np.array([[288.0, 335.0], [290.0, 325.0], [289.0, 330.0]])
    found = outlook(problem, data, plan, plan)
    rollout = found.solution.rollout
    assert found.step == 900.0 and found.power.shape == (12, 2) and found.zone.shape[0] == 13
    for k, power in enumerate((rollout.electric, rollout.fuel)):
        assert found.power[:, k].sum() * 900.0 == pytest.approx(float(power @ ahead.steps), rel=1e-12)
    np.testing.assert_allclose(found.zone[[0, 1, 4, 12]], rollout.zone[[0, 3, 12, -1]], rtol=1e-12)


def test_a_plan_that_is_the_rule_saves_nothing_and_another_what_it_does_not_buy(make_problem, make_data) -> None:
    problem = make_problem()
    data = make_data(problem)
    rule = np.tile([290.0, 350.0], (problem.shape[0], 1))
    assert outlook(problem, data, rule, rule).rule.saving == 0.0
    colder = np.tile([286.0, 315.0], (problem.shape[0], 1))
    found = outlook(problem, data, colder, rule)
    told, hours = found.rule, problem.hours
    ruled = problem.predictor.rollout(data, rule)
    for cost, rollout in ((told.plan, found.solution.rollout), (told.rule, ruled)):
        bought = data.electricity_price * rollout.electric + data.gas_price * rollout.fuel
        assert cost == pytest.approx(float(bought @ hours) / 1000.0, rel=1e-12)
    left = problem.predictor.heat_content(found.solution.rollout.end_state - ruled.end_state) / 3.6e6
    assert left < 0.0 and told.stored == pytest.approx(0.05 * left)
    assert told.saving == pytest.approx((told.rule - told.plan + 0.05 * left) / told.rule)
