"""Where a solve begins and how it ends: never numbers without a status."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
import pandas as pd

from mpc.control.predictor.predictor import Rollout
from mpc.control.problem.channels import Channel
from mpc.control.problem.horizon import HorizonData
from mpc.control.problem.problem import ControlProblem, CostTerms
from mpc.loop.actuators import SUPPLY_WATER
from thermal._types import FloatArray


class Status(StrEnum):
    """How a solve ended."""

    CONVERGED = "converged"
    ITERATION_LIMIT = "iteration limit"
    TIME_LIMIT = "time limit"
    STALLED = "stalled"
    FAILED = "failed"

    @classmethod
    def of(cls, word: str, success: bool = False) -> Status:
        """Tell the status by a solver's own word.

        Parameters
        ----------
        word : str
            Of Clarabel, OSQP, cvxpy, Ipopt or fatrop; what is not known is a failure.
        success : bool
            Whether the solver said so beside.
        """
        return cls.CONVERGED if success else _WORDS.get(word, cls.FAILED)


# fatrop counts: 1 is most iterations reached, 2 a step that is too short
_WORDS = {
    "Solved": Status.CONVERGED, "AlmostSolved": Status.CONVERGED, "solved": Status.CONVERGED,
    "optimal": Status.CONVERGED, "optimal_inaccurate": Status.STALLED, "user_limit": Status.TIME_LIMIT,
    "Maximum_Iterations_Exceeded": Status.ITERATION_LIMIT, "Search_Direction_Becomes_Too_Small": Status.STALLED,
    "1": Status.ITERATION_LIMIT, "2": Status.STALLED,
}  # fmt: skip


@dataclass(frozen=True, eq=False)
class Solution:
    """Outcome of a solve.

    Parameters
    ----------
    plan : ndarray, shape (n_block, n_channel)
        Best plan found [unit of the channel].
    rollout : Rollout
        What it leads to according to the model.
    terms : CostTerms
        What it costs.
    start : float
        Cost of the plan that the solver was given [currency].
    status : Status
        How the solve ended.
    message : str
        The same in words.
    iterations : int
        Of the solver.
    seconds : float
        Wall time [s].
    solver : str
        Which one.
    """

    plan: FloatArray
    rollout: Rollout
    terms: CostTerms
    start: float
    status: Status
    message: str
    iterations: int
    seconds: float
    solver: str

    @property
    def usable(self) -> bool:
        """Whether the plan may be acted upon: all numbers finite, and no dearer than the plan it started from."""
        if self.status is Status.FAILED or not (np.isfinite(self.plan).all() and self.rollout.finite):
            return False
        return bool(np.isfinite(self.terms.total) and self.terms.total <= self.start + 1e-9 * max(1.0, abs(self.start)))


class Solver(ABC):
    """What solves a control problem, which is its attribute `problem`."""

    problem: ControlProblem
    #: What is kept from solve to solve, to be saved with a controller's state [its own]; nothing by default.
    memory: FloatArray | None = None

    def forget(self) -> None:
        """Drop what was learned in earlier solves."""
        self.memory = None

    @abstractmethod
    def solve(self, data: HorizonData, plan: FloatArray, time_limit: float | None = None) -> Solution:
        """Solve for one horizon.

        Parameters
        ----------
        data : HorizonData
            Its parameters.
        plan : ndarray, shape (n_block, n_channel)
            Where to start [unit of the channel].
        time_limit : float, optional
            Wall time after which the best plan so far is returned [s].
        """


#: Share of the cost by which a plan begun anew has to be cheaper [-]: of plans of equal cost the carried one is kept,
#: or setpoints would leap from valley to valley.
CHEAPER = 0.01


class Starts:
    """Starts of a controller's solves.

    Parameters
    ----------
    every : float
        Time between solves that begin anew too [s].

    Attributes
    ----------
    begun : pandas.Timestamp or None
        When a solve last began anew.

    Notes
    -----
    The cost has plateaus, which no slope leads off. A setpoint beyond what its coil reaches makes no difference, nor
    does water that is warmer than satisfied thermostats let through: a plan that a warm-up has led there stays. From
    water that is too cold every decision has a slope, that of comfort. Carried on alone, plans of an office's winter
    morning cost up to twice as much, and such a plan overheated the core of a medium office for a morning and more: 8.3
    K h a zone in a winter week, 1.1 with a new start every two hours.
    """

    def __init__(self, every: float) -> None:
        self.every = every
        self.begun: pd.Timestamp | None = None

    def solve(
        self,
        solver: Solver,
        data: HorizonData,
        carried: FloatArray | None,
        rules: FloatArray,
        now: pd.Timestamp,
        time_limit: float,
    ) -> tuple[Solution, bool]:
        """Solve; returns the solution, and whether one begun anew took the place of the plan carried on.

        Parameters
        ----------
        solver : Solver
            Of the problem; what it has learned stays that of the solution that counts.
        data : HorizonData
            Its parameters.
        carried : ndarray, shape (n_block, n_channel), or None
            Previous plan, shifted; None begins at the rules [unit of the channel].
        rules : ndarray, shape (n_block, n_channel)
            Plan of the rules [unit of the channel].
        now : pandas.Timestamp
            Time of the step.
        time_limit : float
            Wall time [s]; the second solve is left out where less is left than the first one took.
        """
        first = solver.solve(data, rules if carried is None else carried, time_limit)
        due = carried is None or self.begun is None or (now - self.begun).total_seconds() >= self.every
        left = time_limit - first.seconds
        if not due or left < first.seconds:
            return first, False
        self.begun, learned = now, solver.memory
        solver.forget()
        second = solver.solve(data, self.anew(solver.problem.predictor.channels, rules), left)
        gain = first.terms.total - second.terms.total
        if second.usable and (not first.usable or gain > CHEAPER * abs(first.terms.total)):
            return second, carried is not None
        solver.memory = learned
        return first, False

    @staticmethod
    def anew(channels: Sequence[Channel], rules: FloatArray) -> FloatArray:
        """Give the plan of a new start: the rules' with the coldest supply water, (n_block, n_channel).

        Parameters
        ----------
        channels : sequence of Channel
            What is decided.
        rules : ndarray, shape (n_block, n_channel)
            Plan of the rules [unit of the channel].
        """
        plan = rules.copy()
        for c, channel in enumerate(channels):
            if channel.quantity == SUPPLY_WATER:
                plan[:, c] = channel.lower
        return plan
