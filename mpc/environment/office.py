"""Environments of a generated office in one call: one, or many that are stepped together."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import gymnasium
import numpy as np
import pandas as pd

from mpc.environment.environment import ControlEnvironment
from mpc.environment.features import BLOCK_ENDS
from mpc.environment.reward import Reward
from mpc.environment.vector import VectorEnvironment
from mpc.loop.make import PlantSettings, pilot_weather, simulated_plant
from mpc.loop.noise import SensorNoise
from mpc.loop.simulated import SimulatedPlant
from thermal.pilot.building import pilot_building


@dataclass(frozen=True)
class Office:
    """A generated office, as `thermal.pilot.building.pilot_building` draws it.

    Parameters
    ----------
    zones, floors : int
        On all floors together; number of storeys.
    floor_area : float
        Of all floors together [m2].
    seed : int
        Of its plan, and of the first weather.
    """

    zones: int = 12
    floors: int = 2
    floor_area: float = 600.0
    seed: int = 1


def office_environment(
    *,
    office: Office | None = None,
    plant: PlantSettings | None = None,
    starts: Sequence[str] = ("2023-01-09",),
    days: int = 7,
    reward: str | Reward = "economic",
    histograms: bool = False,
    episode_steps: int | None = None,
    render_mode: str | None = None,
) -> ControlEnvironment:
    """Make the environment of an office on its reduced model.

    Parameters
    ----------
    office : Office, optional
        Of twelve zones and 600 m2 by default.
    plant : PlantSettings, optional
        How it is simulated; control volumes of 1 m and the errors of `SensorNoise` by default. Forecasts are as long
        as what is observed of them.
    starts : sequence of str
        Local days at which an episode may begin, ISO 8601; each has weather of a seed of its own.
    days : int
        Length of an episode [d]; the scenario is six hours longer, for the last forecast.
    reward : str or Reward
        As in `ControlEnvironment`.
    histograms : bool
        As in `ControlEnvironment`.
    episode_steps : int, optional
        As in `ControlEnvironment`.
    render_mode : str, optional
        As in `ControlEnvironment`.

    Returns
    -------
    ControlEnvironment
        To be reset.
    """
    plants = office_plants(office, plant, starts, days)
    return ControlEnvironment(
        plants, reward=reward, histograms=histograms, episode_steps=episode_steps, render_mode=render_mode
    )


def office_plants(
    office: Office | None, plant: PlantSettings | None, starts: Sequence[str], days: int
) -> list[SimulatedPlant]:
    """Make the plants of an office, one for each start.

    Parameters
    ----------
    office, plant, starts, days
        As in `office_environment` [d].
    """
    drawn = office or Office()
    building = pilot_building(**asdict(drawn), name="office")
    given = plant or PlantSettings(dx=1.0, noise=SensorNoise())
    given = replace(given, horizon=round(BLOCK_ENDS[-1] * 3600.0 / given.step_seconds))
    plants = []
    for k, start in enumerate(starts):
        end = pd.Timestamp(start) + pd.Timedelta(days=days, hours=BLOCK_ENDS[-1])
        weather = pilot_weather(drawn.seed + k, start, days + 1.0)
        plants.append(simulated_plant(building, weather, start, end.isoformat(), given))
    return plants


def office_vector_environment(
    num_envs: int = 1,
    *,
    autoreset_mode: gymnasium.vector.AutoresetMode = gymnasium.vector.AutoresetMode.NEXT_STEP,
    dtype: Any = np.float32,
    compiled: bool = False,
    **options: Any,
) -> VectorEnvironment:
    """Make many environments of an office that are stepped together.

    Parameters
    ----------
    num_envs : int
        How many.
    autoreset_mode, dtype, compiled
        As in `VectorEnvironment` [-].
    **options
        As in `office_environment`.

    Returns
    -------
    VectorEnvironment
        To be reset.
    """
    single = office_environment(**options)
    return VectorEnvironment(single, num_envs, autoreset_mode=autoreset_mode, dtype=dtype, compiled=compiled)
