"""What controllers are compared on: a building as plant, its models, its weeks, and who may control it."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from pathlib import Path
from typing import ClassVar, Literal

from mpc.environment.environment import ControlEnvironment, ScenarioPlant
from mpc.environment.reward import EconomicReward
from mpc.kpi.rewards import StageCost
from mpc.loop.plant import Controller

POLICIES = Path(__file__).parent / "policies"

#: Where a policy is trained, and what a plant is: the building itself, or a model of it.
World = Literal["plant", "before", "after"]
#: First day, and the seed of what is random.
Week = tuple[str, int]


class Site(ABC):
    """A building that controllers are compared on.

    Attributes
    ----------
    key : str
        For files.
    hours_a_step : float
        Time between two actions [h].
    block_ends : tuple of float
        Blocks of the forecast that a policy sees [h].
    actions : tuple of str
        What all set, as in `mpc.environment.layout.ActionLayout`.
    discomfort_price : float
        Of a kelvin hour of a zone, of training and of the stage cost that all are judged by [currency/K/h].
    reward_scale : float
        Of policies: returns come to some ten [1/currency].
    rules, optimal, sampling, peers : tuple of str
        Names of controllers that do not learn; sampling ones are run at one price of discomfort, peers for a day of
        each week only.
    test_weeks, validation_weeks, training_weeks : mapping of str to tuple
        By name: weeks that all are judged on, that training curves are judged on, and that policies are trained on.
    budget : mapping of str to int
        Control steps of a training, by algorithm.
    """

    key: ClassVar[str]
    hours_a_step: ClassVar[float]
    block_ends: ClassVar[tuple[float, ...]]
    actions: ClassVar[tuple[str, ...]]
    discomfort_price: ClassVar[float]
    reward_scale: ClassVar[float]
    rules: ClassVar[tuple[str, ...]]
    optimal: ClassVar[tuple[str, ...]]
    sampling: ClassVar[tuple[str, ...]] = ()
    peers: ClassVar[tuple[str, ...]]
    test_weeks: ClassVar[Mapping[str, Week]]
    validation_weeks: ClassVar[Mapping[str, Week]]
    training_weeks: ClassVar[Mapping[str, Week]]
    budget: ClassVar[Mapping[str, int]]

    @property
    @abstractmethod
    def name(self) -> str:
        """For tables."""

    @property
    @abstractmethod
    def days(self) -> int:
        """Length of the weeks [d]."""

    @property
    def policies(self) -> Path:
        """Folder of what was learned here, and of the models."""
        return POLICIES / self.key

    @property
    def steps_a_day(self) -> int:
        """Actions a day."""
        return round(24.0 / self.hours_a_step)

    @abstractmethod
    def plant(self, week: Week, world: World = "plant", *, bound: bool = False) -> ScenarioPlant:
        """Make the plant of a week.

        Parameters
        ----------
        week : tuple of str and int
            First day and seed.
        world : str
            The building itself, or a model of it.
        bound : bool
            Whether it is that of the bound: exact sensors, weather and people known.
        """

    @abstractmethod
    def controller(self, name: str, price: float, plant: ScenarioPlant) -> Controller:
        """Make a controller that does not learn.

        Parameters
        ----------
        name : str
            Of `rules`, `optimal`, `sampling` or `peers`.
        price : float
            Of discomfort, without effect on rules [currency/K/h].
        plant : ScenarioPlant
            Of `plant`.
        """

    @abstractmethod
    def make_models(self, work: Path) -> None:
        """Record telemetry, calibrate and diagnose; keeps the models in `policies`.

        Parameters
        ----------
        work : Path
            Folder for what is made on the way.
        """

    def environment(self, world: World, weeks: Mapping[str, Week]) -> ControlEnvironment:
        """Make the environment of some weeks in a world.

        Parameters
        ----------
        world : str
            The building itself, or a model of it.
        weeks : mapping of str to tuple
            Each is a plant of the environment.
        """
        return self.world_of(*(self.plant(week, world) for week in weeks.values()))

    def world_of(self, *plants: ScenarioPlant) -> ControlEnvironment:
        """Make the environment of plants.

        Parameters
        ----------
        *plants : ScenarioPlant
            Of `plant`.
        """
        reward = EconomicReward(StageCost(self.discomfort_price))
        return ControlEnvironment(plants, reward=reward, actions=self.actions, block_ends=self.block_ends)
