"""What a solver gives back: never numbers without a status."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Protocol

import numpy as np

from mpc.control.predictor.predictor import Rollout
from mpc.control.problem.data import HorizonData
from mpc.control.problem.problem import ControlProblem, CostTerms
from thermal._types import FloatArray


class Status(StrEnum):
    """How a solve ended."""

    CONVERGED = "converged"
    ITERATION_LIMIT = "iteration limit"
    TIME_LIMIT = "time limit"
    STALLED = "stalled"
    FAILED = "failed"


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


class Solver(Protocol):
    """What solves a control problem."""

    @property
    def problem(self) -> ControlProblem:
        """The problem that it was built for."""

    @property
    def memory(self) -> FloatArray | None:
        """What it keeps from solve to solve, to be saved with a controller's state [its own]."""

    @memory.setter
    def memory(self, kept: FloatArray | None) -> None: ...

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

    def forget(self) -> None:
        """Drop what was learned in earlier solves."""
