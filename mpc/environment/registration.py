"""The environment under a name: the pilot's office of twelve zones, or of any size."""

from __future__ import annotations

from collections.abc import Sequence

import gymnasium
import pandas as pd

from mpc.environment.environment import ControlEnvironment
from mpc.environment.outlook import BLOCK_ENDS
from mpc.environment.reward import Reward
from mpc.loop.make import pilot_weather, simulated_plant
from mpc.loop.noise import SensorNoise
from thermal.pilot.building import pilot_building

#: Id of the environment in Gymnasium's registry; ``gymnasium.make("mpc.environment:buildingmpc/Office-v0")``.
ENVIRONMENT_ID = "buildingmpc/Office-v0"


def office_environment(
    *,
    zones: int = 12,
    floor_area: float = 600.0,
    floors: int = 2,
    building_seed: int = 1,
    starts: Sequence[str] = ("2023-01-09",),
    days: int = 7,
    control_steps: int = 1,
    reward: str | Reward = "economic",
    histograms: bool = False,
    noise: bool = True,
    episode_steps: int | None = None,
) -> ControlEnvironment:
    """Make the environment of a generated office on its reduced model.

    Parameters
    ----------
    zones, floors : int
        Of the office.
    floor_area : float
        Of all floors together [m2].
    building_seed : int
        Of its plan; each start has weather of a seed of its own.
    starts : sequence of str
        Local days at which an episode may begin, ISO 8601.
    days : int
        Length of an episode [d]; the scenario is six hours longer, for the last forecast.
    control_steps : int
        Steps of 5 minutes that an action is held.
    reward : str or Reward
        As in `ControlEnvironment`.
    histograms : bool
        As in `ControlEnvironment`.
    noise : bool
        Whether sensors have the errors of `SensorNoise`.
    episode_steps : int, optional
        As in `ControlEnvironment`.

    Returns
    -------
    ControlEnvironment
        To be reset.
    """
    building = pilot_building(building_seed, floor_area=floor_area, zones=zones, floors=floors, name="office")
    horizon = round(BLOCK_ENDS[-1] * 12.0)
    plants = []
    for k, start in enumerate(starts):
        end = pd.Timestamp(start) + pd.Timedelta(days=days, hours=BLOCK_ENDS[-1])
        weather = pilot_weather(building_seed + k, start, days + 1.0)
        plant = simulated_plant(
            building, weather, start, end.isoformat(), dx=1.0, horizon=horizon, control_steps=control_steps,
            noise=SensorNoise() if noise else None,
        )  # fmt: skip
        plants.append(plant)
    return ControlEnvironment(plants, reward=reward, histograms=histograms, episode_steps=episode_steps)


def register() -> None:
    """Put the environment in Gymnasium's registry, once; importing the package does it."""
    if ENVIRONMENT_ID not in gymnasium.registry:
        gymnasium.register(ENVIRONMENT_ID, entry_point="mpc.environment.registration:office_environment")
