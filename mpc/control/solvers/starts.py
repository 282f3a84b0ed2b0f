"""Where solves begin: at the plan carried on, and now and then anew as well."""

from __future__ import annotations

from collections.abc import Sequence

import pandas as pd

from mpc.control.problem.channels import Channel
from mpc.control.problem.data import HorizonData
from mpc.control.solvers.solution import Solution, Solver
from mpc.loop.actuators import SUPPLY_WATER
from thermal._types import FloatArray

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
