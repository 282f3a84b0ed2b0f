"""Rewards of a control step, from what the plant did on its own steps."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Protocol

from mpc.errors import MpcError
from mpc.kpi.rewards import PaperReward, StageCost
from mpc.loop.history import RecentSteps
from mpc.scenario.scenario import Scenario
from thermal._types import FloatArray


class Reward(Protocol):
    """What an agent is rewarded for."""

    def of_steps(self, done: RecentSteps, scenario: Scenario, first_step: int) -> float:
        """Reward a control step.

        Parameters
        ----------
        done : RecentSteps
            What the plant did in its steps.
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
        Prices of discomfort and of emissions.
    """

    stage: StageCost = field(default_factory=StageCost)

    def of_steps(self, done: RecentSteps, scenario: Scenario, first_step: int) -> float:
        """Reward a control step [currency].

        Parameters
        ----------
        done : RecentSteps
            What the plant did in its steps.
        scenario : Scenario
            Bands, prices and emissions.
        first_step : int
            Step of the scenario in which it began.
        """
        costs = [float(self.stage.of_step(scenario, *step)) for step in _steps(done, scenario, first_step)]
        return -sum(costs) * done.step / scenario.grid.step


@dataclass(frozen=True)
class PaperStepReward:
    """The paper's weighted sum of regrets, mean over the plant's steps of a control step [-].

    Parameters
    ----------
    terms : PaperReward
        Weights and scales.
    """

    terms: PaperReward = field(default_factory=PaperReward)

    def of_steps(self, done: RecentSteps, scenario: Scenario, first_step: int) -> float:
        """Reward a control step, -1 to 0 [-].

        Parameters
        ----------
        done : RecentSteps
            What the plant did in its steps.
        scenario : Scenario
            Bands, people, prices and emissions.
        first_step : int
            Step of the scenario in which it began.
        """
        rewards = [
            float(self.terms.of_step(scenario, k, end, *powers).reward)
            for k, _, end, *powers in _steps(done, scenario, first_step)
        ]
        return sum(rewards) / len(rewards)


#: Rewards by name.
REWARDS: dict[str, Reward] = {"economic": EconomicReward(), "paper": PaperStepReward()}


def _steps(
    done: RecentSteps, scenario: Scenario, first_step: int
) -> Iterator[tuple[int, FloatArray, FloatArray, float, float]]:
    """Give step of the scenario, zones before and after, electricity and gas of each of the plant's steps."""
    each = round(scenario.grid.step / done.step)
    length, expected = each * done.step, f"steps that divide the scenario's {scenario.grid.step:g} s"
    MpcError.unless(abs(length - scenario.grid.step) <= 1e-6, "reward: plant", expected, f"{done.step:g} s")
    steps = zip(pairwise(done.zone_temperature), done.electricity, done.gas, strict=True)
    for k, ((before, after), electricity, gas) in enumerate(steps):
        yield first_step + k // each, before, after, electricity, gas
