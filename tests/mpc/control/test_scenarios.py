"""Scenarios: gradients of the tree, one scenario is the plain problem, cost and violations on errors drawn anew."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from scipy.stats import binom

from mpc.control.predictor.heat import HeatChannel, HeatPredictor
from mpc.control.problem.channels import Channel
from mpc.control.problem.horizon import Horizon
from mpc.control.problem.problem import ControlProblem
from mpc.control.solvers.ipopt import IpoptSolver
from mpc.control.solvers.sequential import SequentialSolver
from mpc.control.solvers.uncertainty import ScenarioSolver, _Tree, outdoor_scenarios
from mpc.errors import ControlError
from mpc.scenario.forecast import ErrorGrowth

GROWTH = ErrorGrowth(4.0, 3 * 3600.0)


def draw_of(problem, count: int, seed: int = 0):
    rng = np.random.default_rng(seed)
    return partial(outdoor_scenarios, horizon=problem.predictor.horizon, growth=GROWTH, count=count, rng=rng)


def test_scenarios_have_the_errors_of_the_forecast(make_problem, make_data) -> None:
    problem = make_problem()
    data, edges = make_data(problem), problem.predictor.horizon.edges[1:]
    drawn = draw_of(problem, 2001)(data)
    assert len(drawn) == 2001 and drawn[0] is data
    errors = np.array([one.outdoor_temperature for one in drawn[1:]]) - data.outdoor_temperature
    np.testing.assert_allclose(errors.mean(axis=0), 0.0, atol=1e-12)
    np.testing.assert_allclose(errors.std(axis=0), [GROWTH.after(t) for t in edges], rtol=0.1)
    np.testing.assert_allclose(drawn[5].boundary[:, 0], drawn[5].outdoor_temperature)


def test_slopes_of_the_tree_are_those_of_differences(make_problem, make_data) -> None:
    problem = make_problem()
    solver = ScenarioSolver(problem, draw_of(problem, 3), 3, common=2)
    whole = solver._solver.problem
    data = _Tree.of(draw_of(problem, 3)(make_data(problem, 280.0)))
    assert whole.shape == (2 + 3 * 2, 2)
    shares = np.random.default_rng(1).uniform(0.2, 0.8, 16)
    rollout = whole.predictor.rollout(data, whole.plan(shares))
    found = whole.gradient(data, rollout, whole.predictor.sensitivity(data, rollout))
    for j in range(16):
        step = np.eye(16)[j] * 1e-4
        sides = [whole.terms(data, whole.predictor.rollout(data, whole.plan(shares + s))).total for s in (step, -step)]
        assert found[j] == pytest.approx((sides[0] - sides[1]) / 2e-4, rel=5e-3, abs=3e-4)


def test_equal_scenarios_are_the_plain_problem(make_problem, make_data) -> None:
    problem = make_problem()
    data, plan = make_data(problem, 280.0), np.tile([288.0, 330.0], (4, 1))
    plain = IpoptSolver(problem).solve(data, plan)
    found = ScenarioSolver(problem, lambda one: (one, one), 2).solve(data, plan)
    assert found.usable and found.solver == "scenarios, sequential"
    assert found.terms.total <= 1.005 * plain.terms.total


def test_common_blocks_and_rates_of_every_branch(make_problem, make_data) -> None:
    channels = (
        Channel("supply_air_temperature_setpoint", 285.0, 300.0, 6.0), Channel("supply_water_temperature_setpoint", 310.0, 355.0, 40.0),
    )  # fmt: skip
    problem = make_problem(channels=channels)
    solver, data = ScenarioSolver(problem, draw_of(problem, 3), 3), make_data(problem, 300.0, 297.0)
    kept = []
    inner = solver._solver.solve
    solver._solver.solve = lambda *a: (kept.append(inner(*a)), kept[-1])[1]
    found = solver.solve(data, np.tile([290.0, 345.0], (4, 1)))
    assert found.usable
    for blocks in solver._tree.blocks:
        branch = kept[0].plan[blocks]
        np.testing.assert_array_equal(branch[0], found.plan[0])
        changes = np.abs(np.diff(np.vstack([data.previous, branch]), axis=0)).ravel() / problem.span
        assert (changes <= problem.most_change + 1e-6).all()


@pytest.fixture(scope="module")
def heated(modes) -> ControlProblem:
    """One block: nothing can be corrected later."""
    horizon = Horizon.regular(1.5, 900.0, 1)
    predictor = HeatPredictor(modes, horizon, [HeatChannel("heating", z, 2e4) for z in range(5)])
    return ControlProblem(predictor, softness=0.005, terminal_time=0.0, move_weight=0.0)


def test_bands_are_missed_as_rarely_as_the_number_of_scenarios_says(heated, make_data) -> None:
    """The worst of n independent draws is passed by a further one with probability 1/(n + 1)."""
    data = make_data(heated, 274.0, 294.0, previous=np.zeros(5), comfort_price=np.full((6, 5), 300.0))
    last = np.arange(6) == 5
    data = replace(data, lower=np.where(last[:, None], 294.15, 288.15) * np.ones((6, 5)))
    count, missed, tries, rng = 9, 0, 0, np.random.default_rng(2)
    step = heated.predictor

    def independent(given):
        pairs = outdoor_scenarios(given, heated.predictor.horizon, GROWTH, 2 * count, rng)
        return pairs[::2]

    for _ in range(25):
        found = ScenarioSolver(heated, independent, count, solver=partial(SequentialSolver, tolerance=1e-5)).solve(
            data, np.full((1, 5), 2000.0)
        )
        assert found.usable
        for one in outdoor_scenarios(data, step.horizon, GROWTH, 40, rng)[::2]:
            missed += int((step.rollout(one, found.plan).zone[-1] < 294.15 - 0.01).any())
            tries += 1
    assert tries == 500
    # all zones feel the same weather: one constraint. The plan of a set is shared by its 20 draws, which widens the band
    low, high = binom.ppf([0.001, 0.999], 100, 1.0 / (count + 1)) / 100
    assert low <= missed / tries <= high


def test_what_does_not_fit_is_named(make_problem, make_data) -> None:
    problem = make_problem()
    with pytest.raises(ControlError, match="1 to 4 common blocks"):
        ScenarioSolver(problem, draw_of(problem, 3), 3, common=5)
    with pytest.raises(ControlError, match="2 or more"):
        draw_of(problem, 1)(make_data(problem))
    with pytest.raises(ControlError, match="expected 4, found 3"):
        ScenarioSolver(problem, draw_of(problem, 3), 4).solve(make_data(problem), np.tile([288.0, 330.0], (4, 1)))
