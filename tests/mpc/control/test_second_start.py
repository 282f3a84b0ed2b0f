"""Where solves begin: plateaus that a plan carried on does not leave, and what a new start may take."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
import pandas as pd
import pytest

from mpc.control.predictor.predictor import Predictor
from mpc.control.problem.channels import Channel, supply_channels
from mpc.control.problem.horizon import Horizon, HorizonData
from mpc.control.problem.problem import ControlProblem, CostTerms
from mpc.control.solvers.sequential import SequentialSolver
from mpc.control.solvers.solution import CHEAPER, Solution, Starts
from thermal.components.heater import Heater
from thermal.system.smooth import SmoothHvac
from thermal.system.system import vav_system

NOW = pd.Timestamp("2023-01-16 10:00", tz="Etc/GMT+8")
HOUR = pd.Timedelta(hours=1)


@pytest.fixture(scope="module")
def plateau(modes, system, make_data) -> tuple[ControlProblem, HorizonData]:
    """Rooms too warm, and a heater in the air handler that never reaches what it is asked for."""
    handler = system.air_handlers[0]
    small = replace(handler, heating=Heater(1006.0 * handler.supply_fan.design_flow))
    horizon = Horizon.growing([(1.0, 300.0), (2.0, 900.0)], [0.5, 0.5, 1.0, 1.0])
    hvac = SmoothHvac(vav_system((small,), system.loop, system.terminals, system.thermostat), 0.005)
    channels = (Channel("supply_air_temperature_setpoint", 283.15, 313.15),)
    problem = ControlProblem(Predictor(modes, hvac, horizon, channels, 6 * 3600.0))
    return problem, make_data(problem, outdoor=283.0, zone=299.5, previous=np.array([313.15]))


def test_a_plan_that_asks_for_more_than_the_coil_gives_is_left(plateau) -> None:
    """There is no slope there; a plan of what the coil reaches costs the same and has one."""
    problem, data = plateau
    carried = np.full(problem.shape, 313.0)
    rollout = problem.predictor.rollout(data, carried)
    assert np.abs(problem.gradient(data, rollout, problem.predictor.sensitivity(data, rollout))).max() < 1e-4
    near = problem.predictor.reached(data, rollout)
    np.testing.assert_allclose(near[0, 0], rollout.air[problem.predictor.horizon.block_of == 0].max())
    there = problem.predictor.rollout(data, near)
    assert problem.terms(data, there).total == pytest.approx(problem.terms(data, rollout).total, rel=1e-2)
    assert problem.gradient(data, there, problem.predictor.sensitivity(data, there)).max() > 1e-2
    found = SequentialSolver(problem).solve(data, carried)
    assert found.terms.total < 0.1 * found.start


def test_a_new_start_has_the_rules_air_and_the_coldest_water() -> None:
    """From there every decision has a slope, that of comfort."""
    rules = np.array([[290.0, 350.0], [291.0, 340.0]])
    np.testing.assert_array_equal(Starts.anew(supply_channels(), rules), [[290.0, 310.0], [291.0, 310.0]])
    np.testing.assert_array_equal(rules[:, 1], [350.0, 340.0])
    np.testing.assert_array_equal(Starts.anew(supply_channels()[:1], rules[:, :1]), rules[:, :1])


@dataclass
class Told:
    """A solver that says what it is told to, by the first setpoint that it is given."""

    problem: ControlProblem
    costs: dict[float, float]
    like: Solution
    seconds: float = 1.0
    memory: float | None = None
    asked: list[float] = field(default_factory=list)

    def solve(self, data: HorizonData, plan: np.ndarray, time_limit: float | None = None) -> Solution:
        at = float(plan[0, 0])
        self.asked.append(at)
        self.memory = at
        cost = self.costs[at]
        terms = CostTerms(electricity=cost, gas=0.0, demand=0.0, comfort=0.0, moves=0.0, storage=0.0)
        return replace(self.like, plan=plan, terms=terms, start=np.inf, seconds=self.seconds)

    def forget(self) -> None:
        self.memory = None


@pytest.fixture(scope="module")
def like(plateau) -> Solution:
    problem, data = plateau
    return SequentialSolver(problem, iterations=1).solve(data, np.full(problem.shape, 288.0))


@pytest.mark.parametrize(
    ("first", "second", "taken"),
    [
        (1.0, 1.0 - 2.0 * CHEAPER, True),
        (1.0, 1.0 - 0.5 * CHEAPER, False),
        (1.0, 1.5, False),
        (np.nan, 1.5, True),  # the plan carried on leads to no number at all
    ],
)
def test_the_second_counts_where_it_is_cheaper_by_enough(plateau, like, first, second, taken) -> None:
    problem, data = plateau
    carried, rules = np.full(problem.shape, 300.0), np.full(problem.shape, 288.0)
    solver = Told(problem, {300.0: first, 288.0: second}, like)
    found, changed = Starts(7200.0).solve(solver, data, carried, rules, NOW, 60.0)
    assert changed is taken and found.plan[0, 0] == (288.0 if taken else 300.0)
    assert solver.memory == found.plan[0, 0]  # what was learned on the way to the plan that counts


def test_when_the_second_is_asked(plateau, like) -> None:
    """At first, then every two hours, if there is time."""
    problem, data = plateau
    carried, rules = np.full(problem.shape, 300.0), np.full(problem.shape, 288.0)
    starts, solver = Starts(7200.0), Told(problem, {300.0: 1.0, 288.0: 1.0}, like)
    starts.solve(solver, data, None, rules, NOW, 60.0)
    for hours in (0.5, 1.9, 2.0, 3.0):
        starts.solve(solver, data, carried, rules, NOW + hours * HOUR, 60.0)
    assert solver.asked == [288.0, 288.0, 300.0, 300.0, 300.0, 288.0, 300.0]
    assert starts.begun == NOW + 2 * HOUR
    slow = Told(problem, {300.0: 1.0, 288.0: 0.5}, like, seconds=40.0)
    found, changed = Starts(7200.0).solve(slow, data, carried, rules, NOW, 60.0)
    assert slow.asked == [300.0] and not changed and found.terms.total == 1.0  # 20 s are left, 40 would be needed
