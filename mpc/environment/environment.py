"""The closed loop as a Gymnasium environment."""

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any, Protocol, runtime_checkable

import gymnasium
import numpy as np
from numpy.typing import NDArray

from mpc.environment.features import BLOCK_ENDS, LARGEST, Outlook, clock
from mpc.environment.layout import SUPPLY_SETPOINTS, ActionLayout, Observation, ObservationLayout
from mpc.environment.render import RenderedRun
from mpc.environment.reward import REWARDS, Reward
from mpc.environment.traced import TracedPlant, traced
from mpc.errors import MpcError
from mpc.kpi.kpis import measure_kpis
from mpc.kpi.record import PlantRecord
from mpc.loop.history import RecentSteps
from mpc.loop.plant import Plant
from mpc.scenario.forecast import Forecaster
from mpc.scenario.scenario import Scenario
from thermal._types import FloatArray


@runtime_checkable
class ScenarioPlant(Plant, Protocol):
    """A plant that says which scenario drives it; rewards and indicators need its prices, bands and people."""

    scenario: Scenario


class Course:
    """What is known of a plant's time: where an episode ends, the clock, and forecasts where there are some.

    Forecasts are known functions of the step, so they are reduced once and a step reads a row.
    """

    def __init__(self, plant: ScenarioPlant, block_ends: Sequence[float] | None) -> None:
        scenario, grid = plant.scenario, plant.scenario.grid
        self.timezone = scenario.building.location.timezone
        self.each = round(plant.control_step / grid.step)
        self.recording = hasattr(plant, "recent")  # its last steps at a cost that does not grow with the run
        forecaster = getattr(plant, "forecaster", None)
        self.forecaster: Forecaster | None = forecaster if isinstance(forecaster, Forecaster) else None
        self.outlook: Outlook | None = None
        self.last = grid.n_steps
        if block_ends is not None:
            columns = plant.forecast().table.columns if self.forecaster is None else self.forecaster.columns
            area = scenario.floor_area
            self.outlook = Outlook([str(c) for c in columns], scenario.zones, grid.step, area, block_ends)
            if self.forecaster is not None:
                self.last = grid.n_steps - self.forecaster.horizon

    @cached_property
    def ahead(self) -> FloatArray | None:
        """Observed forecasts, a row a step of the scenario; None where they are asked for one by one."""
        return None if self.outlook is None or self.forecaster is None else self.outlook.table(self.forecaster)


class ControlEnvironment(gymnasium.Env[Observation, NDArray[np.float32]]):
    """A plant in closed loop as a Gymnasium environment: an action is held for a control step.

    Actions are numbers from -1 to 1 for the setpoints, by default the paper's two: supply water and supply air, in the
    ranges of the actuators. Observations are measurements, forecast and clock, scaled by fixed physical ranges. The
    weather of a plant is its scenario's; with several plants each episode takes one. Nothing ever terminates: an
    episode is truncated where the scenario, its forecasts or `episode_steps` end.

    Parameters
    ----------
    plants : Plant or sequence of Plant
        With a scenario; several with the same measurements, actuators and control step. They are stepped one at a
        time, each from its reset on, so they may share a building model; two environments may share neither.
    reward : str or Reward
        ``economic`` (default), ``paper``, or one's own.
    actions : sequence of str
        As in `ActionLayout`.
    histograms : bool
        Whether zones and terminals are observed as histograms.
    block_ends : sequence of float or None
        Blocks of the forecast that is observed [h], as in `Outlook`; None observes none. Plants need a forecaster.
    episode_steps : int, optional
        Control steps after which an episode is truncated; by default it lasts as long as the scenario.
    ranges : mapping of str to tuple of float, optional
        Ranges of measurements in the place of `OBSERVED_RANGES` [library's units].
    render_mode : str, optional
        What `render` gives: ``rgb_array``, a picture of the last day, or ``ansi``, a table of the last control step.

    Raises
    ------
    MpcError
        When plants do not fit each other, have no scenario or no forecasts, or an option is not known.

    Notes
    -----
    ``reset(seed=...)`` makes everything that follows repeat bit for bit: which plant each episode takes, and the seed
    of its people, noise and shuffle. ``options={"plant": 0, "plant_seed": 7}`` chooses them. At the end of an episode
    ``info["kpis"]`` has its indicators.
    """

    metadata = {"render_modes": ["rgb_array", "ansi"], "render_fps": 12}  # noqa: RUF012 - Gymnasium's own form

    def __init__(
        self,
        plants: Plant | Sequence[Plant],
        *,
        reward: str | Reward = "economic",
        actions: Sequence[str] = SUPPLY_SETPOINTS,
        histograms: bool = False,
        block_ends: Sequence[float] | None = BLOCK_ENDS,
        episode_steps: int | None = None,
        ranges: Mapping[str, tuple[float, float]] | None = None,
        render_mode: str | None = None,
    ) -> None:
        modes = (None, *self.metadata["render_modes"])
        MpcError.unless(render_mode in modes, "render_mode", f"one of {modes}", repr(render_mode))
        self.render_mode = render_mode
        self.plants = _checked(plants)
        if isinstance(reward, str):
            MpcError.unless_known(reward, REWARDS, "reward", "a known one")
        self.reward = REWARDS[reward] if isinstance(reward, str) else reward
        MpcError.unless(episode_steps is None or episode_steps >= 1, "episode_steps", "1 or more", episode_steps)
        self.episode_steps = episode_steps
        first = self.plants[0]
        self.courses = [Course(plant, block_ends) for plant in self.plants]
        self.actions = ActionLayout(first.actuators, actions)
        area, outlook = first.scenario.floor_area, self.courses[0].outlook
        self.layout = ObservationLayout(first.columns, first.actuators, area, outlook, histograms, ranges)
        self.action_space = gymnasium.spaces.Box(-1.0, 1.0, (len(self.actions),), np.float32)
        self.observation_space = gymnasium.spaces.Box(-LARGEST, LARGEST, (len(self.layout),), np.float32)
        self._plant, self._course, self._step, self._done, self._begun = first, self.courses[0], 0, 0, False
        self._ahead: FloatArray | None = None

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Begin an episode.

        Parameters
        ----------
        seed : int, optional
            Of all that is random from now on; without it the sequence goes on.
        options : dict, optional
            ``plant``, number of the plant; ``plant_seed``, seed of its people and noise.

        Returns
        -------
        tuple
            First observation, and which plant and seed were taken.

        Raises
        ------
        MpcError
            When an option is not known.
        """
        super().reset(seed=seed)
        drawn = draw_episode(self.np_random, len(self.plants))
        for name in options or {}:
            MpcError.unless_known(name, drawn, "options", "a known one")
        info: dict[str, Any] = {**drawn, **(options or {})}
        known, expected = range(len(self.plants)), f"a plant from 0 to {len(self.plants) - 1}"
        MpcError.unless(info["plant"] in known, "options: plant", expected, repr(info["plant"]))
        self._plant, self._course = self.plants[info["plant"]], self.courses[info["plant"]]
        self._step, self._done, self._begun = 0, 0, True
        if self._traced is not None:
            values = self._traced.reset(info["plant"], info["plant_seed"])
            return self._observe(values, int(self._plant.scenario.grid.edges[0])), info
        seen = self._plant.reset(info["plant_seed"])
        return self._observe(seen.values_array, seen.seconds), info

    def step(self, action: NDArray[np.float32]) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Hold an action for a control step.

        Parameters
        ----------
        action : ndarray, shape (n_action,)
            From -1 to 1 [-].

        Returns
        -------
        tuple
            Observation, reward, whether the episode terminated (never) and was truncated, and its indicators at the
            end.
        """
        plant, course, begin, setpoints = self._plant, self._course, self._step, self.actions.setpoints(action)
        self._step, self._done = begin + course.each, self._done + 1
        if self._traced is not None:
            (values, reward), finished = self._traced.step(setpoints), False
            seconds = int(plant.scenario.grid.edges[self._step])
        else:
            seen = plant.step(setpoints)
            values, seconds, finished = seen.values_array, seen.seconds, plant.finished
            reward = self.reward.of_steps(_last_steps(plant, course), plant.scenario, begin)
        truncated = finished or self._step + course.each > course.last or self._done == self.episode_steps
        info: dict[str, Any] = {}
        if truncated:
            scenario = plant.scenario if self._traced is None else self._traced.scenario
            found = measure_kpis(self._record(), scenario, control_step=plant.control_step)
            info["kpis"] = found.to_dict()
        return self._observe(values, seconds, truncated), reward, False, truncated, info

    @property
    def plant(self) -> ScenarioPlant:
        """The plant of this episode, where the episode is: one whose equations are traced makes up for its steps."""
        return self._plant if not self._begun or self._traced is None else self._traced.plant()

    @cached_property
    def _traced(self) -> TracedPlant | None:
        known = all(course.outlook is None or course.forecaster is not None for course in self.courses)
        return traced(self.plants, self.reward, self.actions.names) if known else None

    @property
    def observation_names(self) -> tuple[str, ...]:
        """Names of the entries of an observation."""
        return tuple(feature.name for feature in self.layout.features)

    @property
    def action_names(self) -> tuple[str, ...]:
        """Names of the entries of an action."""
        return self.actions.chosen

    def render(self) -> Any:
        """Show the plant as `render_mode` says; None without one."""
        if self.render_mode is None:
            return None
        plant = self._plant
        run = RenderedRun(plant.zone_names, plant.scenario, self._record() if self._done else None, self._step)
        return run.table() if self.render_mode == "ansi" else run.picture()

    def _record(self) -> PlantRecord:
        return self._plant.record() if self._traced is None else self._traced.record()

    def close(self) -> None:
        """Close the plants that hold something open, such as a process of EnergyPlus."""
        for plant in self.plants:
            getattr(plant, "close", lambda: None)()

    def _observe(self, values: FloatArray, seconds: int, ended: bool = False) -> Observation:
        course = self._course
        if course.ahead is not None:
            self._ahead = course.ahead[min(self._step, len(course.ahead) - 1)]
        elif course.outlook is not None and not ended:  # at its end a plant may have nothing left to forecast
            self._ahead = course.outlook.of_forecast(self._plant.forecast())
        return self.layout.observe(values, self._ahead, clock(seconds, course.timezone))


def draw_episode(rng: np.random.Generator, plants: int) -> dict[str, int]:
    """Draw which plant an episode has, and the seed of its people and noise.

    Parameters
    ----------
    rng : numpy.random.Generator
        Of the environment.
    plants : int
        How many there are.
    """
    return {"plant": int(rng.integers(plants)), "plant_seed": int(rng.integers(2**31))}


def _checked(plants: Plant | Sequence[Plant]) -> tuple[ScenarioPlant, ...]:
    """Plants that have scenarios and fit each other."""
    several = tuple(plants) if isinstance(plants, Sequence) else (plants,)
    checked = tuple(plant for plant in several if isinstance(plant, ScenarioPlant))
    MpcError.unless(several, "environment", "a plant or more", "none")
    kinds = ", ".join(type(plant).__name__ for plant in several)
    MpcError.unless(len(checked) == len(several), "environment", "plants with a scenario", kinds)
    for k, plant in enumerate(checked):
        where, step = f"environment: plant {k}", plant.scenario.grid.step
        for what in ("columns", "actuators", "control_step"):
            same = getattr(plant, what) == getattr(checked[0], what)
            MpcError.unless(same, where, f"the same {what.replace('_', ' ')} as plant 0", "others")
        expected, found = f"a control step of whole steps of {step:g} s", f"{plant.control_step:g} s"
        MpcError.unless(plant.control_step % step == 0.0, where, expected, found)
    return checked


def _last_steps(plant: Any, course: Course) -> RecentSteps:
    """Read what a plant did in its last control step."""
    if course.recording:
        recent: RecentSteps = plant.recent(course.each)
        return recent
    whole = plant.record()
    MpcError.unless(whole.district_heating is None, "reward: plant", "electricity and gas", "district heating too")
    n = round(plant.control_step / whole.step)
    gas = np.zeros(n) if whole.gas is None else whole.gas[-n:]
    temperature, electricity = list(whole.zone_temperature[-n - 1 :]), whole.electricity[-n:].tolist()
    return RecentSteps(whole.step, temperature, electricity, gas.tolist())
