"""What a controller hands out, and what it is told once."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from enum import StrEnum

import pandas as pd

from mpc.control.controller.rules import ResetRule
from mpc.control.problem.assembly import ComfortOperation
from mpc.control.problem.back_off import BackOff, Margin
from mpc.control.solvers.solution import Solution
from mpc.kpi.rewards import DISCOMFORT_PRICE
from mpc.scenario.tariff import DemandCharge


class Source(StrEnum):
    """Where an action comes from."""

    OPTIMAL = "optimal plan"
    PREVIOUS = "previous plan"
    RULES = "rules"


@dataclass(frozen=True, eq=False)
class Action(Mapping[str, float]):
    """Setpoints for the next control step, by ``ENTITY/POINT``, and why.

    Parameters
    ----------
    setpoints : dict of str to float
        Finite, within the ranges of their channels [K or Pa].
    source : Source
        Optimal plan, previous plan or rules.
    reasons : tuple of str
        In words: what failed, what was missing, whether a plan begun anew took the place of the one carried on, where
        comfort is not met and what stands in its way.
    solution : Solution or None
        Of the solver; None where it did not run or broke.
    stamp : pandas.Timestamp
        When the action begins.
    """

    setpoints: dict[str, float]
    source: Source
    reasons: tuple[str, ...]
    solution: Solution | None
    stamp: pd.Timestamp

    def __getitem__(self, name: str) -> float:
        return self.setpoints[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self.setpoints)

    def __len__(self) -> int:
        return len(self.setpoints)


@dataclass(frozen=True)
class ControllerSettings:
    """What a controller pays for, and how long it may think.

    Parameters
    ----------
    comfort_price : float
        Of a zone's kelvin outside of its band for an hour [currency/K/h].
    carbon_price : float
        Of emissions [currency/kg].
    heat_value : float
        Of heat that the building holds at the end [currency/kWh].
    time_limit : float
        Wall time of a solve [s].
    second_start : float
        Time between solves that begin anew as well as at the plan that is carried on [s], see `Starts`; infinite is
        never.
    operation : ComfortOperation
        Schedules of the building's automation.
    rule : ResetRule
        First guess, and what is done when there is no plan.
    demand : tuple of DemandCharge
        Of the tariff.
    back_off : BackOff or Margin, optional
        Narrows the comfort bands by what is uncertain; none by default.
    false_alarm, resolution : float
        Of the recognition of stuck sensors, see `StuckSensors` [-], [K].
    """

    comfort_price: float = DISCOMFORT_PRICE
    carbon_price: float = 0.0
    heat_value: float = 0.0
    time_limit: float = 60.0
    second_start: float = 7200.0
    operation: ComfortOperation = field(default_factory=ComfortOperation)
    rule: ResetRule = field(default_factory=ResetRule)
    demand: tuple[DemandCharge, ...] = ()
    back_off: BackOff | Margin | None = None
    false_alarm: float = 1e-5
    resolution: float = 0.1
