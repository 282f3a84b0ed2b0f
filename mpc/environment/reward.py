"""Rewards of a control step, from what the plant did on its own steps."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import pairwise
from typing import ClassVar, Protocol, runtime_checkable

from mpc.errors import MpcError
from mpc.kpi.rewards import PaperReward, StageCost, StepValues
from mpc.loop.history import RecentSteps
from mpc.scenario.scenario import Scenario
from thermal._types import FloatArray
from thermal.components.operations import Value


@runtime_checkable
class BatchReward(Protocol):
    """A reward that many plants can be given at once: the mean, or the sum, of what each of their steps is worth."""

    @property
    def of_mean(self) -> bool:
        """Whether a control step counts as the mean of its steps, not their sum."""

    def of_values(self, step: StepValues) -> Value:
        """Reward a step of the plant.

        Parameters
        ----------
        step : StepValues
            Traced: without branches on values.
        """


def batch_reward(reward: object) -> BatchReward | None:
    """Take a reward for many plants at once; None where it cannot be given to many, or says something else of them.

    Parameters
    ----------
    reward : object
        Any; a class that writes one of ``of_values`` and ``of_steps`` anew and inherits the other says two things.
    """
    kind = type(reward)
    by = [next((c for c in kind.__mro__ if name in vars(c)), None) for name in ("of_values", "of_steps")]
    return reward if isinstance(reward, BatchReward) and by[0] is by[1] else None


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
    of_mean: ClassVar[bool] = False

    def of_values(self, step: StepValues) -> Value:
        """Reward a step of the plant [currency]; see `BatchReward`.

        Parameters
        ----------
        step : StepValues
            What happened.
        """
        stage, carbon = self.stage, self.stage.carbon_price
        electricity, gas = (price + carbon * c for price, c in zip(step.prices, step.carbons, strict=True))
        energy = stage.energy(*step.powers, electricity, gas, step.step)
        return -(energy + stage.discomfort(step.start, step.end, step.lower, step.upper, step.step))

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
    of_mean: ClassVar[bool] = True

    def of_values(self, step: StepValues) -> Value:
        """Reward a step of the plant [-]; see `BatchReward`.

        Parameters
        ----------
        step : StepValues
            What happened.
        """
        band = step.lower, step.upper
        return self.terms.terms(step.end, band, step.people, step.powers, step.prices, step.carbons).reward

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
