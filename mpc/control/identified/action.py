"""What a controller of an identified plant sets, and what it expects of it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cached_property

import numpy as np
import pandas as pd

from mpc.control.rule_estimate import RuleEstimate
from mpc.control.solvers.stages import StageSolution
from thermal._types import FloatArray


class PlannedAction(dict[str, float]):
    """Values by ``ENTITY/POINT``, and what was expected of them.

    Parameters
    ----------
    values : mapping of str to float
        [unit of each actuator].
    stamp : Timestamp
        When the action begins.
    source, reasons : str and tuple of str
        ``optimal plan`` or ``rules``, and why.

    Attributes
    ----------
    solution : StageSolution or None
        Of the solver.
    zone, power : ndarray
        Expected at the edges of the steps, shape (N + 1, n_zone) [K], and electricity and other carriers over them,
        shape (N, 2) [W].
    compare : callable or None
        Makes `rule`; None where electricity is decided too.
    """

    def __init__(self, values: Mapping[str, float], stamp: pd.Timestamp, source: str, reasons: tuple[str, ...]) -> None:
        super().__init__(values)
        self.stamp, self.source, self.reasons = stamp, source, reasons
        self.step, self.seconds = 900.0, 0.0
        self.solution: StageSolution | None = None
        self.zone: FloatArray = np.empty((0, 0))
        self.power: FloatArray = np.empty((0, 2))
        self.compare: Callable[[], RuleEstimate] | None = None

    @cached_property
    def rule(self) -> RuleEstimate | None:
        """What the plan and the rule cost over the horizon, made when it is asked for."""
        return None if self.compare is None else self.compare()
