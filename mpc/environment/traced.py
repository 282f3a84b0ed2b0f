"""Plants of ours as an environment steps them: by their equations, traced once."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from mpc.batch.plant import BatchedPlant
from mpc.environment.reward import BatchReward, batch_reward
from mpc.errors import PlantError
from mpc.kpi.record import PlantRecord
from mpc.loop.simulated import SimulatedPlant
from mpc.scenario.scenario import Scenario
from thermal._types import FloatArray
from thermal.errors import ThermalError


class TracedPlant:
    """A batch of one in double precision, equal to the plants to round-off, in a quarter of their time.

    Parameters
    ----------
    plants : sequence of SimulatedPlant
        One an episode.
    reward : BatchReward
        What a step is worth.
    actions : sequence of str
        Actuators that are set, by ``ENTITY/POINT``.
    """

    def __init__(self, plants: Sequence[SimulatedPlant], reward: BatchReward, actions: Sequence[str]) -> None:
        self._batch = BatchedPlant(plants, 1, actions=actions, dtype=np.float64, score=reward.of_values)
        self._each, self._of_mean = plants[0].control_steps, reward.of_mean
        self._owed: list[Mapping[str, float]] = []
        self._begun = False
        #: The scenario, with the people of the episode.
        self.scenario: Scenario = plants[0].scenario

    def reset(self, number: int, seed: int) -> FloatArray:
        """Begin an episode; give what is measured, shape (n_column,).

        Parameters
        ----------
        number, seed : int
            Of the plant, and of its people and noise.
        """
        self._owed, self._begun = [], False
        measured = self._batch.reset([seed], [number])[:, 0]
        self.scenario = self._batch.plants[number].given.redrawn(seed)
        return measured

    def step(self, setpoints: Mapping[str, float]) -> tuple[FloatArray, float]:
        """Hold setpoints for a control step; give means of what was measured, and the reward.

        Parameters
        ----------
        setpoints : mapping of str to float
            In the order of `actions` [K] or [Pa].
        """
        self._owed.append(setpoints)
        batch, held = self._batch, np.array([*setpoints.values()])[:, None]
        measured, reward = batch.step(held)[:, 0], float(batch.rewards[0])
        if self._each > 1:
            measured = measured.copy()
            for _ in range(self._each - 1):
                measured += batch.step(held)[:, 0]
                reward += float(batch.rewards[0])
            measured /= self._each
            reward /= self._each if self._of_mean else 1
        return measured, reward

    def record(self) -> PlantRecord:
        """Give the run since the reset."""
        return self._batch.record(0)

    def plant(self) -> SimulatedPlant:
        """Give the plant itself, brought to where the episode is."""
        plant = self._batch.plants[int(self._batch.plant_of[0])]
        if not self._begun:
            plant.reset(int(self._batch.seeds[0]))
            self._begun = True
        for setpoints in self._owed:
            plant.step(setpoints)
        self._owed = []
        return plant


def traced(plants: Sequence[Any], reward: Any, actions: Sequence[str]) -> TracedPlant | None:
    """Trace plants where that is possible; None for others, which are stepped themselves.

    Parameters
    ----------
    plants : sequence of Plant
        Of an environment.
    reward : Reward
        Its reward.
    actions : sequence of str
        As in `TracedPlant`.
    """
    given = batch_reward(reward)
    if given is None or not all(type(plant) is SimulatedPlant for plant in plants):
        return None
    try:
        return TracedPlant(plants, given, actions)
    except (PlantError, ThermalError):
        return None
