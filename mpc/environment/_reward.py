"""Rewards of a control step, from what the plant did on its own steps."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from mpc.errors import EnvironmentSetupError
from mpc.kpi import PaperReward, PlantRecord, StageCost
from mpc.scenario import Scenario
from thermal.errors import describe


class Reward(Protocol):
    """What an agent is rewarded for."""

    def of_steps(self, record: PlantRecord, scenario: Scenario, first_step: int) -> float:
        """Reward a control step.

        Parameters
        ----------
        record : PlantRecord
            Of the plant's steps in it.
        scenario : Scenario
            Bands, people, prices and emissions.
        first_step : int
            Step of the scenario in which it began.
        """


@dataclass(frozen=True)
class EconomicReward:
    """Minus the stage cost of optimal control: energy, emissions at their price, discomfort [currency].

    Summed over a run it is minus ``A cost_tot + p_c A emis_tot + p_d n_zone tdis_tot`` of `measure_kpis`, to round-off.

    Parameters
    ----------
    stage : StageCost
        Prices of discomfort and of emissions. The default discomfort price is that of `mpc.control`'s controller.
    """

    stage: StageCost = field(default_factory=lambda: StageCost(0.2))

    def of_steps(self, record: PlantRecord, scenario: Scenario, first_step: int) -> float:
        """Reward a control step [currency].

        Parameters
        ----------
        record : PlantRecord
            Of the plant's steps in it.
        scenario : Scenario
            Bands, prices and emissions.
        first_step : int
            Step of the scenario in which it began.
        """
        each, temperature = _steps_each(record, scenario), record.zone_temperature
        gas = _gas(record)
        costs = [
            float(self.stage.of_step(scenario, first_step + k // each, temperature[k], temperature[k + 1],
                                     record.electricity[k], gas[k]))
            for k in range(record.n_steps)
        ]  # fmt: skip
        return -sum(costs) / each


@dataclass(frozen=True)
class PaperStepReward:
    """The paper's weighted sum of regrets, mean over the plant's steps of a control step [-].

    Parameters
    ----------
    terms : PaperReward
        Weights and scales.
    """

    terms: PaperReward = field(default_factory=PaperReward)

    def of_steps(self, record: PlantRecord, scenario: Scenario, first_step: int) -> float:
        """Reward a control step, -1 to 0 [-].

        Parameters
        ----------
        record : PlantRecord
            Of the plant's steps in it.
        scenario : Scenario
            Bands, people, prices and emissions.
        first_step : int
            Step of the scenario in which it began.
        """
        each, gas = _steps_each(record, scenario), _gas(record)
        rewards = [
            float(self.terms.of_step(scenario, first_step + k // each, record.zone_temperature[k + 1],
                                     record.electricity[k], gas[k]).reward)
            for k in range(record.n_steps)
        ]  # fmt: skip
        return sum(rewards) / len(rewards)


#: Rewards by name.
REWARDS: dict[str, Reward] = {"economic": EconomicReward(), "paper": PaperStepReward()}


def _steps_each(record: PlantRecord, scenario: Scenario) -> int:
    """Count the steps of the plant in a step of the scenario."""
    each = round(scenario.grid.step / record.step)
    if abs(each * record.step - scenario.grid.step) > 1e-6 or record.district_heating is not None:
        expected = f"steps that divide the scenario's {scenario.grid.step:g} s, no district heating"
        raise EnvironmentSetupError(describe("reward: record", expected, f"{record.step:g} s"))
    return each


def _gas(record: PlantRecord) -> np.ndarray:
    return np.zeros(record.n_steps) if record.gas is None else record.gas
