"""What a plan is expected to lead to on the control steps, and what the rule would cost from the same state."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from mpc.control.predictor.predictor import Rollout
from mpc.control.problem.horizon import HorizonData
from mpc.control.problem.problem import ControlProblem
from mpc.control.rule_estimate import RuleEstimate
from mpc.control.solvers.solution import Solution
from mpc.scenario.grid import means_of_steps
from mpc.scenario.rates import KILOWATT_HOUR
from thermal._types import FloatArray


@dataclass(frozen=True, eq=False)
class PlanOutlook:
    """What is expected of a plan.

    Parameters
    ----------
    problem : ControlProblem
        That was solved.
    data : HorizonData
        Of the horizon, its comfort bands as they are asked for.
    solution : Solution
        A usable one.
    by_rule : ndarray, shape (n_block, n_channel)
        Plan of the rule [unit of the channel].
    """

    problem: ControlProblem
    data: HorizonData
    solution: Solution
    by_rule: FloatArray

    @property
    def step(self) -> float:
        """Control step [s]."""
        return self.problem.predictor.horizon.control_step

    @cached_property
    def _edges(self) -> FloatArray:
        """Edges of the control steps within the horizon, from now [s]."""
        whole = int(self.problem.predictor.horizon.edges[-1] / self.step + 1e-9)
        return np.arange(whole + 1, dtype=float) * self.step

    @property
    def zone(self) -> FloatArray:
        """Expected temperatures at the edges of the control steps, shape (n + 1, n_zone) [K]."""
        edges = self.problem.predictor.horizon.edges
        zones = [np.interp(self._edges, edges, one) for one in self.solution.rollout.zone.T]
        return np.asarray(np.column_stack(zones), dtype=float)

    @property
    def power(self) -> FloatArray:
        """Expected electricity and fuel over the control steps, shape (n, 2) [W]."""
        bought = np.column_stack([self.solution.rollout.electric, self.solution.rollout.fuel])
        return means_of_steps(self.problem.predictor.horizon.edges, bought, self._edges)

    @cached_property
    def rule(self) -> RuleEstimate:
        """What plan and rule cost; heat that they leave behind counts at the price of fuel, where the rule burns any.

        Neither has discomfort, nor emissions but at their price: it is what is bought.
        """
        planned, ruled = self.solution.rollout, self.problem.predictor.rollout(self.data, self.by_rule)
        content = self.problem.predictor.heat_content
        left = (content(planned.end_state) - content(ruled.end_state)) / KILOWATT_HOUR
        price = float(self.data.gas_price.mean()) if ruled.fuel.any() else 0.0
        return RuleEstimate(self._bought(planned), self._bought(ruled), left * price)

    def _bought(self, rollout: Rollout) -> float:
        terms = self.problem.terms(self.data, rollout)
        return terms.electricity + terms.gas + terms.demand
