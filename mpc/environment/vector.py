"""Many environments that are stepped together: Gymnasium's vector environment on batched plants."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import gymnasium
import numpy as np
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode
from gymnasium.vector.utils import batch_space
from numpy.typing import ArrayLike, NDArray

from mpc.batch.alike import checked_plants
from mpc.batch.inputs import DrivingRows
from mpc.batch.plant import BatchedPlant, record_of
from mpc.environment.environment import ControlEnvironment, Course, draw_episode
from mpc.environment.features import LARGEST, clock
from mpc.environment.layout import ManyObservations, Observation
from mpc.environment.render import RenderedRun
from mpc.environment.reward import batch_reward
from mpc.errors import MpcError
from mpc.kpi.kpis import measure_kpis
from mpc.loop.simulated import SimulatedPlant
from mpc.loop.view import seen_through
from thermal._types import FloatArray

Infos = dict[str, Any]


class EpisodeKpis(Mapping[str, Any]):
    """Indicators of an episode, as `measure_kpis` gives them in a dict; measured when they are first asked for.

    Parameters
    ----------
    plant : SimulatedPlant
        Of the episode.
    history : tuple of ndarray
        Of all members, as `BatchedPlant.history`.
    member, steps, seed : int
        Which member, how many steps, and the seed of its people.
    """

    def __init__(
        self, plant: SimulatedPlant, history: tuple[NDArray[Any], NDArray[Any]], member: int, steps: int, seed: int
    ) -> None:
        self._of, self._found = (plant, history, member, steps, seed), dict[str, Any]()

    def _measured(self) -> dict[str, Any]:
        if not self._found:
            plant, history, member, steps, seed = self._of
            record = record_of(history, member, steps, float(plant.scenario.grid.step))
            scenario = plant.given.redrawn(seed)
            self._found = measure_kpis(record, scenario, control_step=plant.control_step).to_dict()
        return self._found

    def __getitem__(self, name: str) -> Any:
        return self._measured()[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._measured())

    def __len__(self) -> int:
        return len(self._measured())


class VectorEnvironment(gymnasium.vector.VectorEnv[Observation, NDArray[np.float32], NDArray[np.float32]]):
    """As many environments as `ControlEnvironment`, stepped together by one batched plant.

    Spaces, seeds, rewards and infos are those of the single one: with ``reset(seed=7)`` member k does what the single
    environment does after ``reset(seed=7 + k)``, and goes on as it does.

    Parameters
    ----------
    single : ControlEnvironment
        What a member is; its plants are on reduced buildings, and may differ in what `BatchedPlant` says. They may be
        seen through other points (`mpc.loop.view`).
    num_envs : int
        How many.
    autoreset_mode : gymnasium.vector.AutoresetMode
        ``NEXT_STEP`` (default): the step after an episode's last one resets. ``SAME_STEP``: an episode's last step
        does, and ``infos["final_obs"]`` and ``infos["final_info"]`` have what it saw.
    dtype : type
        Precision of the plants, ``numpy.float32`` (default) or ``numpy.float64``; observations are in single precision.
    compiled : bool
        As in `thermal.batch.program.Program` (extra ``[fast]``).

    Raises
    ------
    MpcError
        When a reward cannot be given to many plants at once, or an option is not known.
    PlantError
        When plants cannot be stepped together.

    Notes
    -----
    Infos hold an entry a member and a mask, as Gymnasium's vectors do: ``plant`` and ``plant_seed`` after a reset,
    ``kpis`` at an episode's end, which are measured when they are looked at.
    """

    def __init__(
        self,
        single: ControlEnvironment,
        num_envs: int = 1,
        *,
        autoreset_mode: AutoresetMode = AutoresetMode.NEXT_STEP,
        dtype: Any = np.float32,
        compiled: bool = False,
    ) -> None:
        MpcError.unless(num_envs >= 1, "num_envs", "1 or more", repr(num_envs))
        modes = AutoresetMode.NEXT_STEP, AutoresetMode.SAME_STEP
        MpcError.unless(autoreset_mode in modes, "autoreset_mode", "NEXT_STEP or SAME_STEP", repr(autoreset_mode))
        given, found = batch_reward(single.reward), type(single.reward).__name__
        if given is None:
            expected = "one whose class has both of_values, for many plants at once, and of_steps"
            raise MpcError("reward", expected, found, "see BatchReward")
        self.single, self.num_envs, self.render_mode = single, num_envs, single.render_mode
        self.metadata = {**single.metadata, "autoreset_mode": autoreset_mode}
        self.single_action_space, self.single_observation_space = single.action_space, single.observation_space
        self.action_space = batch_space(single.action_space, num_envs)
        self.observation_space = batch_space(single.observation_space, num_envs)
        #: Whether a control step counts as the mean of the plant's steps.
        self.reward_of_mean = bool(given.of_mean)
        stepped, view = seen_through(single.plants)
        held = {} if view is None else view.held
        self._held = np.array(list(held.values()), dtype=float)[:, None]
        #: What the plants are seen through; None where by points of their own.
        self.view = view
        #: The plants, stepped together.
        self.batch = BatchedPlant(
            checked_plants(stepped), num_envs, actions=(*single.actions.names, *held), dtype=dtype,
            score=given.of_values, compiled=compiled,
        )  # fmt: skip
        self._observations = ManyObservations(
            single.layout, len(stepped[0].columns), num_envs, self.batch.dtype, compiled, self.view
        )
        courses = single.courses
        tables = [seen_rows(course, plant) for course, plant in zip(courses, self.batch.plants, strict=True)]
        self._seen = DrivingRows(tables, num_envs, (), np.float32)
        self._look = np.zeros((self._seen.width, num_envs if self._seen.each else 1), dtype=np.float32)
        each = courses[0].each
        ends = [course.last - course.last % each for course in courses]
        if single.episode_steps is not None:
            ends = [min(end, single.episode_steps * each) for end in ends]
        #: Steps of the plant in a control step, and those after which an episode of each plant is over.
        self.each, self.ends = each, np.array(ends)
        self._same_step = autoreset_mode is AutoresetMode.SAME_STEP
        self._rngs = [seeding.np_random(None)[0] for _ in range(num_envs)]
        self._ended = np.zeros(num_envs, dtype=bool)

    @property
    def observation_names(self) -> tuple[str, ...]:
        """Names of the entries of an observation."""
        return self.single.observation_names

    @property
    def action_names(self) -> tuple[str, ...]:
        """Names of the entries of an action."""
        return self.single.action_names

    def setpoints(self, actions: ArrayLike) -> NDArray[np.float64]:
        """Give what actions set, shape (n_actuator, n) [K or Pa], as `BatchedPlant.step` takes it.

        Parameters
        ----------
        actions : ndarray, shape (n, n_action)
            From -1 to 1 [-].
        """
        acted = self.single.actions.setpoints_of_many(actions)
        held = np.broadcast_to(self._held, (len(self._held), acted.shape[1]))
        return np.concatenate([acted, held]) if len(held) else acted

    def rows(self) -> NDArray[Any]:
        """Give forecasts and clock as they are observed, shape (n_steps, width, member or 1)."""
        return self._seen.table()

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: Infos | None = None
    ) -> tuple[Observation, Infos]:
        """Begin an episode in all members.

        Parameters
        ----------
        seed : int or sequence of int, optional
            Of the first member, the next ones count on from it, or one each; without it sequences go on.
        options : dict, optional
            ``plant`` and ``plant_seed`` for all members, as in `ControlEnvironment.reset`, a number or one a member.

        Returns
        -------
        tuple
            First observations, a row a member, and which plant and seed each has.

        Raises
        ------
        MpcError
            When an option is not known, or there are not as many seeds as members.
        """
        seeds = [seed + k for k in range(self.num_envs)] if isinstance(seed, int) else seed
        MpcError.unless(seeds is None or len(seeds) == self.num_envs, "seed", f"one or {self.num_envs}", "others")
        for k, one in enumerate(seeds or ()):
            if one is not None:
                self._rngs[k] = seeding.np_random(one)[0]
        for name in options or {}:
            MpcError.unless_known(name, ("plant", "plant_seed"), "options", "a known one")
        self._ended[:] = False
        infos = self._begin(np.arange(self.num_envs), options)
        return self._observe(self.batch.measured), infos

    def step(
        self, actions: NDArray[np.float32]
    ) -> tuple[Observation, Any, Any, Any, Infos]:
        """Hold an action a member for a control step.

        Parameters
        ----------
        actions : ndarray, shape (num_envs, n_action)
            From -1 to 1 [-].

        Returns
        -------
        tuple
            Observations, rewards, whether episodes terminated (never) and were truncated, infos.
        """
        starting = np.flatnonzero(self._ended) if not self._same_step else np.zeros(0, dtype=np.intp)
        rewards, measured = np.zeros(self.num_envs), self.batch.measured
        if starting.size < self.num_envs:
            rewards, measured = self._advance(actions)
        infos: Infos = {}
        if starting.size:
            infos = self._begin(starting)
            rewards[starting] = 0.0
            if measured is not self.batch.measured:
                measured[:, starting] = self.batch.measured[:, starting]
        truncated = self.batch.now >= self.ends[self.batch.plant_of]
        self._ended = truncated
        seen = self._observe(measured)
        terminated, over = np.zeros(self.num_envs, dtype=bool), np.flatnonzero(truncated)
        if over.size:
            ending = self._at_end(over)
            if not self._same_step:
                infos |= ending
            else:
                final = np.full(self.num_envs, None, dtype=object)
                for k in over:
                    final[k] = seen[k].copy()
                infos = {"final_obs": final, "_final_obs": truncated.copy(), "final_info": ending,
                         "_final_info": truncated.copy(), **self._begin(over)}  # fmt: skip
                seen = self._observe(np.where(truncated, self.batch.measured, measured))
        return seen, rewards, terminated, truncated, infos

    def render(self) -> tuple[Any, ...] | None:
        """Show all members as `render_mode` says, one after the other; None without one."""
        if self.render_mode is None:
            return None
        shown, batch = [], self.batch
        for k in range(self.num_envs):
            plant = batch.plants[int(batch.plant_of[k])]
            record = batch.record(k) if batch.now[k] else None
            run = RenderedRun(plant.zone_names, plant.scenario, record, int(batch.now[k]))
            shown.append(run.table() if self.render_mode == "ansi" else run.picture())
        return tuple(shown)

    def _advance(self, actions: NDArray[np.float32]) -> tuple[NDArray[Any], NDArray[Any]]:
        """Step the plants through a control step; give rewards and mean measurements."""
        setpoints, batch = self.setpoints(actions), self.batch
        measured, rewards = batch.step(setpoints, self._ended), batch.rewards.astype(float)
        if self.each > 1:
            measured = measured.copy()
            for _ in range(self.each - 1):
                measured += batch.step(setpoints, self._ended)
                rewards += batch.rewards
            measured /= self.each
            rewards /= self.each if self.reward_of_mean else 1.0
        return rewards, measured

    def _begin(self, who: NDArray[np.intp], options: Infos | None = None) -> Infos:
        """Begin an episode in some members."""
        drawn = [draw_episode(self._rngs[k], len(self.batch.plants)) for k in who]
        infos: Infos = {}
        mask = np.zeros(self.num_envs, dtype=bool)
        mask[who] = True
        for name in ("plant", "plant_seed"):
            values = np.zeros(self.num_envs, dtype=np.int64)
            values[who] = [one[name] for one in drawn]
            if name in (options or {}):
                values[who] = np.broadcast_to((options or {})[name], self.num_envs)[who]
            infos |= {name: values, f"_{name}": mask.copy()}
        plants = infos["plant"][who]
        valid = bool(((plants >= 0) & (plants < len(self.batch.plants))).all())
        expected = f"a plant from 0 to {len(self.batch.plants) - 1}"
        MpcError.unless(valid, "options: plant", expected, repr(plants.tolist()[:4]))
        self.batch.reset(infos["plant_seed"][who], plants, who)
        for k, plant in zip(who.tolist(), plants.tolist(), strict=True):
            self._seen.begin(k, plant, None)
        return infos

    def _at_end(self, who: NDArray[np.intp]) -> Infos:
        batch, all_at_once = self.batch, len(who) == self.num_envs
        found, mask = np.full(self.num_envs, None, dtype=object), np.zeros(self.num_envs, dtype=bool)
        mask[who] = True
        zones, powers = batch.history or (np.zeros(0), np.zeros(0))
        for k in who.tolist():
            # what goes on in the place of a member that is reset alone must not change its indicators
            mine = slice(k, k + 1)
            kept = (zones, powers) if all_at_once else (zones[:, :, mine].copy(), powers[:, :, mine].copy())
            plant, place = batch.plants[int(batch.plant_of[k])], k if all_at_once else 0
            found[k] = EpisodeKpis(plant, kept, place, int(batch.now[k]), int(batch.seeds[k]))
        return {"kpis": found, "_kpis": mask}

    def _observe(self, measured: NDArray[Any]) -> Observation:
        self._seen.fill(self.batch.now, self._look)
        ahead, now = (self._look[self._seen.parts[part]] for part in ("ahead", "clock"))
        return self._observations.observe(measured, ahead, now)


def seen_rows(course: Course, plant: SimulatedPlant) -> dict[str, FloatArray]:
    """Lay out what is observed beside measurements: forecasts and the clock, a row for each end of a step.

    Parameters
    ----------
    course : Course
        Of the plant's time.
    plant : SimulatedPlant
        The plant.
    """
    edges = plant.scenario.grid.edges
    now = np.array([clock(int(seconds), course.timezone) for seconds in edges])
    ahead = course.ahead
    expected, advice = "plants with a forecaster, or block_ends=None", "pass horizon=... in PlantSettings"
    MpcError.unless(course.outlook is None or ahead is not None, "outlook", expected, "none", advice)
    rows = np.zeros((len(edges), 0)) if ahead is None else ahead[np.minimum(np.arange(len(edges)), len(ahead) - 1)]
    return {"ahead": np.clip(rows, -LARGEST, LARGEST), "clock": now}
