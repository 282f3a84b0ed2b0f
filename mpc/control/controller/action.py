"""What a controller hands out, what it is told once, and its rules."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np
import pandas as pd

from mpc.control.predictor.predictor import Predictor
from mpc.control.problem.assembly import ComfortOperation
from mpc.control.problem.channels import Channel
from mpc.control.solvers.solution import Solution
from mpc.control.solvers.uncertainty import BackOff, Margin
from mpc.kpi.rewards import DISCOMFORT_PRICE
from mpc.loop.actuators import SUPPLY_AIR, SUPPLY_WATER
from mpc.scenario.tariff import DemandCharge
from thermal._types import FloatArray


@dataclass(frozen=True)
class ResetRule:
    """Outdoor reset: straight lines between a cold and a warm day.

    Parameters
    ----------
    cold, warm : float
        Outdoor temperatures between which the setpoints move [K]: defaults -7 and 16 degC.
    air, water : tuple of float
        Setpoints on the cold and on the warm day [K]. Defaults 18 to 13 degC for air (ASHRAE 90.1's reset of 5 K) and
        80 to 50 degC for water.
    """

    cold: float = 266.15
    warm: float = 289.15
    air: tuple[float, float] = (291.15, 286.15)
    water: tuple[float, float] = (353.15, 323.15)

    def setpoints(self, channels: Sequence[Channel], outdoor: float) -> FloatArray:
        """Setpoints at an outdoor temperature, shape (n_channel,) [unit of the channel].

        Parameters
        ----------
        channels : sequence of Channel
            What is decided; pressures and zones get the middle of their range.
        outdoor : float
            Outdoor temperature [K]; what is not finite counts as half-way.
        """
        share = np.clip((outdoor - self.cold) / (self.warm - self.cold), 0.0, 1.0) if np.isfinite(outdoor) else 0.5
        by_rule = {SUPPLY_AIR: self.air, SUPPLY_WATER: self.water}
        values = []
        for channel in channels:
            first, last = by_rule.get(channel.quantity, (0.5 * (channel.lower + channel.upper),) * 2)
            values.append(np.clip(first + share * (last - first), channel.lower, channel.upper))
        return np.array(values)

    def plan(self, predictor: Predictor, outdoor: FloatArray) -> FloatArray:
        """Plan by rule, shape (n_block, n_channel) [unit of the channel].

        Parameters
        ----------
        predictor : Predictor
            Of the horizon.
        outdoor : ndarray, shape (N,)
            Outdoor temperature over each step [K].
        """
        horizon = predictor.horizon
        means = [outdoor[horizon.block_of == b].mean() for b in range(horizon.n_block)]
        return np.stack([self.setpoints(predictor.channels, float(mean)) for mean in means])


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
