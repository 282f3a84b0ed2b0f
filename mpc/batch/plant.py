"""Many plants of one structure, stepped together."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mpc.batch.alike import checked_plants, different_models
from mpc.batch.building import Array, BatchedBuilding
from mpc.batch.inputs import DrawnNoise, DrivingRows, people_rows, plant_rows
from mpc.batch.step import Score, TracedStep
from mpc.errors import PlantActionError, PlantError
from mpc.kpi.record import PlantRecord
from mpc.loop.loop import LoopState
from mpc.loop.plant import need_running
from mpc.loop.reduced import ReducedBuilding
from mpc.loop.simulated import SimulatedPlant
from mpc.scenario.scenario import Scenario
from thermal._types import FloatArray, IntArray
from thermal.batch.program import Program
from thermal.batch.trace import Traced
from thermal.units import REFERENCE_TEMPERATURE


class BatchedPlant:
    """Plants of one structure, stepped together: each member has one of several plants and a seed.

    The equations are those of `SimulatedPlant`, traced once and run on arrays whose last axis is of members. Plants may
    differ in what drives them, people, and in the parameters and effects of their buildings; HVAC system and schedules'
    rules are common.

    Parameters
    ----------
    plants : SimulatedPlant or sequence of SimulatedPlant
        On reduced buildings, with the same measurements, actuators and steps.
    members : int
        How many are stepped.
    actions : sequence of str, optional
        Actuators that are set, by ``ENTITY/POINT``; those that every action must have by default.
    dtype : type
        ``numpy.float32`` (default), or ``numpy.float64``.
    score : callable, optional
        What a step is worth, of `StepValues`; see `rewards`.
    record : bool
        Whether the run is kept, for `record`: four bytes a zone, member and step in single precision.
    compiled : bool
        As in `thermal.batch.program.Program`.

    Raises
    ------
    PlantError
        Plants do not fit each other, are on the grid, or have thermostats that remember, emitters that radiate, or
        effects whose signals are known only while they run.

    Examples
    --------
    >>> many = BatchedPlant(plant, 512)  # doctest: +SKIP
    >>> measured = many.reset(seeds=np.arange(512))  # doctest: +SKIP
    >>> measured = many.step(np.full((3, 512), 290.0))  # doctest: +SKIP
    """

    def __init__(
        self,
        plants: SimulatedPlant | Sequence[SimulatedPlant],
        members: int,
        *,
        actions: Sequence[str] | None = None,
        dtype: Any = np.float32,
        score: Score | None = None,
        record: bool = True,
        compiled: bool = False,
    ) -> None:
        self.plants = checked_plants(plants)
        first, self.members, self.dtype = self.plants[0], members, np.dtype(dtype)
        self.actions = tuple(actions or (a.name for a in first.actuators if a.required))
        known = {a.name: a for a in first.actuators}
        for name in self.actions:
            PlantActionError.unless_known(name, known, "actions", "an actuator of the plants")
        chosen = [known[name] for name in self.actions]
        self._lowest, self._highest = (np.array([[getattr(a, end)] for a in chosen]) for end in ("lowest", "highest"))
        self._redrawn = any(_differ(p.scenario.redrawn(0), p.scenario.redrawn(1)) for p in self.plants)
        models, self._model_of = different_models([p.model for p in self.plants])  # type: ignore[misc]
        own = ("gains", "people", "outside") if self._redrawn else ()
        self._building = BatchedBuilding(models)
        driving = [plant_rows(p, self._building.outside) for p in self.plants]
        self._rows = DrivingRows(driving, members, own, dtype)
        #: The step that was traced.
        self.traced = TracedStep(
            first, self._rows.parts, self._rows.width, self._rows.each, self.actions, self._building, score,
        )  # fmt: skip
        self._program = Program(self.traced.tape, members, dtype, compiled)
        noise = first.sensors.noise
        self._noise = None if noise is None else DrawnNoise(noise.width, members, dtype, compiled)
        #: Which plant and seed each member has, and the number of the step that comes next, shape (member,).
        self.plant_of, self.seeds, self.now = (np.zeros(members, dtype=np.intp) for _ in range(3))
        self._started = False
        self._lengths = np.array([p.scenario.grid.n_steps for p in self.plants])
        self._longest = int(self._lengths.max())
        self._history: tuple[Array, Array] | None = None
        self._recording = record

    @property
    def operations(self) -> int:
        """Instructions of a step."""
        return len(self._program)

    @property
    def zone_temperature(self) -> FloatArray:
        """Air of the zones, shape (n_zone, member) [K]."""
        return np.asarray(self._of("zone"), dtype=float) + REFERENCE_TEMPERATURE

    @property
    def zone(self) -> Array:
        """The same counted from the reference temperature; not to be kept, the next step writes to it."""
        return self._of("zone")

    @property
    def powers(self) -> Array:
        """Electricity and fuel of the last step, shape (2, member) [W]; the next step writes to it."""
        return self._of("powers")

    @property
    def rewards(self) -> Array:
        """What the last step was worth, shape (member,); the next step writes to it."""
        return self._of("reward")

    @property
    def measured(self) -> Array:
        """What was measured in the last step, shape (n_column, member) [library's units]; the next one writes to it."""
        return self._of("measured")

    def _of(self, name: str) -> Array:
        return self.of(getattr(self.traced.results, name))

    def _set(self, name: str) -> Array:
        return self.of(getattr(self.traced.inputs, name))

    def of(self, value: Traced) -> Array:
        """Give a value of `traced` as it is, shape (..., member or 1); the next step writes to it.

        Parameters
        ----------
        value : Traced
            An input or a result.
        """
        return self._program.of(value)

    def rows(self) -> Array:
        """Give what drives members from their reset on, shape (n_steps, width, member or 1), as `TracedStep.part`."""
        return self._rows.table()

    def noise(self, steps: IntArray) -> Array:
        """Give the random numbers of a step of each member, shape (n_noise, member) [-]; none without noise.

        Parameters
        ----------
        steps : ndarray of int, shape (member,)
            Numbers of the steps, in the order of the run.
        """
        found = np.zeros_like(self._set("noise"))
        if self._noise is not None:
            self._noise.fill(steps, found)
        return found

    def reset(self, seeds: ArrayLike, plants: ArrayLike | None = None, members: ArrayLike | None = None) -> Array:
        """Start members anew, after the warm-up of their plants.

        Parameters
        ----------
        seeds : array_like of int, shape (n,)
            Of people and noise, 0 or more.
        plants : array_like of int, shape (n,), optional
            Which plant each has; the first by default.
        members : array_like of int, shape (n,), optional
            Which ones; all by default.

        Returns
        -------
        ndarray, shape (n_column, member)
            Measurements of all, as `SimulatedPlant.reset` gives them.
        """
        who = np.arange(self.members) if members is None else np.atleast_1d(np.asarray(members, dtype=np.intp))
        seed = np.broadcast_to(np.asarray(seeds, dtype=np.int64), who.shape)
        which = np.zeros(len(who), dtype=np.intp) if plants is None else np.broadcast_to(np.asarray(plants), who.shape)
        valid = len(seed) == 0 or (seed.min() >= 0 and 0 <= which.min() and which.max() < len(self.plants))
        expected = f"seeds of 0 or more and plants from 0 to {len(self.plants) - 1}"
        PlantError.unless(valid, "reset", expected, "others")
        together = self._rows.each or len(who) == self.members
        PlantError.unless(together, "reset", "all members of one plant at once", f"{len(who)} of {self.members}")
        if self._history is None or len(who) == self.members:
            self._history = self._blank()
        self.plant_of[who], self.seeds[who], self.now[who], self._started = which, seed, 0, True
        for number in np.unique(which).tolist():
            self._start(number, who[which == number])
        return self.measured

    def start(self, modal_state: FloatArray, inputs: Mapping[str, FloatArray], states: Mapping[str, float]) -> None:
        """Start all members of the first plant from an estimated state, with inputs of a horizon in place of its own.

        Parameters
        ----------
        modal_state : ndarray, shape (order,)
            Modes of its building, as an observer has them [K].
        inputs : mapping of str to ndarray, shape (n_steps, width)
            Parts of `mpc.batch.inputs.plant_rows`, as there [any].
        states : mapping of str to float
            Of the HVAC system, as `HvacSystem.start` takes them [unit of the state].

        Raises
        ------
        PlantError
            When the state is of another building.
        """
        plant, model = self.plants[0], self.plants[0].model
        order = model.order if isinstance(model, ReducedBuilding) else 0
        PlantError.unless(modal_state.shape == (order,), "state", f"one of order {order}", f"{modal_state.shape}")
        state = model.counted(modal_state)  # type: ignore[attr-defined]
        reading = model.step_matrices()[3] @ state + REFERENCE_TEMPERATURE  # type: ignore[attr-defined]
        hvac, off = plant.loop.hvac.start(**states), (False,) * len(plant.system.air_handlers)
        self._rows.put(inputs)
        self.plant_of[:], self.now[:], self._started, self._history = 0, 0, True, self._blank()
        begun = LoopState((state, reading), hvac, off, reading, np.zeros(len(reading)))
        self._set_out(0, np.arange(self.members), begun)

    def _blank(self) -> tuple[Array, Array] | None:
        n, steps, members = len(self.plants[0].zone_names), self._longest, self.members
        zones, powers = (steps + 1, n, members), (steps, 2, members)
        return (np.zeros(zones, self.dtype), np.zeros(powers, self.dtype)) if self._recording else None

    def _start(self, number: int, who: IntArray) -> None:
        plant, index = self.plants[number], who.tolist()
        warm, last = plant.warmed_up()
        self._set_out(number, who, warm)
        for member in index:
            seed = int(self.seeds[member])
            scenario = plant.given.redrawn(seed) if self._redrawn else plant.given
            own = people_rows(plant, scenario, self._building.outside) if self._redrawn else None
            self._rows.begin(member, number, own)
            if self._noise is not None:
                self._noise.begin(member, seed)
            self.measured[:, member] = plant.sensors.read(last, scenario.occupancy[last.number], seed)

    def _set_out(self, number: int, who: IntArray, warm: LoopState) -> None:
        plant, (state, _) = self.plants[number], warm.building
        matrices = [self.of(value) for value in self.traced.inputs.matrices]
        self._building.start(who, int(self._model_of[number]), state, self._set("modes"), matrices)
        columns = {
            "reading": warm.reading - REFERENCE_TEMPERATURE, "missed": warm.missed,
            "cycling": np.array(warm.cycling, dtype=float), "states": np.array(warm.hvac.values),
        }  # fmt: skip
        for name, values in columns.items():
            self._set(name)[:, who] = values[:, None]
        several = not self._building.shared
        for name, values in (("offset", plant.loop.offset), ("response", plant.loop.local.response)):
            self._set(name)[:, who if several else [0]] = values[:, None]
        air = warm.reading - plant.loop.offset - REFERENCE_TEMPERATURE
        self._of("zone")[:, who] = air[:, None]
        if self._history is not None:
            self._history[0][0][:, who] = air[:, None]

    def step(self, setpoints: Array, idle: NDArray[np.bool_] | None = None) -> Array:
        """Hold setpoints for a step of the plants.

        Parameters
        ----------
        setpoints : ndarray, shape (n_action, member)
            In the order of `actions` [K] or [Pa].
        idle : ndarray of bool, shape (member,), optional
            Members whose scenario may be over, as they will be reset: what becomes of them says nothing.

        Returns
        -------
        ndarray, shape (n_column, member)
            What was measured; the next step writes to it.

        Raises
        ------
        PlantActionError
            When a setpoint is missing, no number or out of its range.
        PlantError
            When a scenario is over, or `reset` was not called.
        """
        need_running(self._started)
        expected = (len(self.actions), self.members)
        PlantActionError.unless(setpoints.shape == expected, "setpoints", f"shape {expected}", f"{setpoints.shape}")
        slack = 1e-6 * self._highest  # of single precision
        if not ((setpoints >= self._lowest - slack) & (setpoints <= self._highest + slack)).all():
            k = int(np.argmin(((setpoints >= self._lowest - slack) & (setpoints <= self._highest + slack)).all(axis=1)))
            ends = f"{self._lowest[k, 0]:g} to {self._highest[k, 0]:g}"
            found = f"{setpoints[k].min()} to {setpoints[k].max()}"
            raise PlantActionError(f"action {self.actions[k]}", f"numbers from {ends}", found)
        over = self.now >= self._lengths[self.plant_of]
        if idle is not None:
            over &= ~idle
        if over.any():
            raise PlantError("scenario", "one more step", f"none left of {over.sum()} members", "reset them")
        self._rows.fill(self.now, self._set("row"))
        if self._noise is not None:
            self._noise.fill(self.now, self._set("noise"))
        np.copyto(self._set("actions"), setpoints, casting="same_kind")
        self._program.run()
        if self._history is not None:
            self._keep()
        self.now += 1
        return self.measured

    def _keep(self) -> None:
        zones, powers = self._history or (self.zone, self.powers)
        first = int(self.now[0])
        if (self.now == first).all():
            zones[first + 1], powers[first] = self.zone, self.powers
        else:
            every = np.flatnonzero(self.now < self._longest)
            at = self.now[every]
            zones[at + 1, :, every], powers[at, :, every] = self.zone.T[every], self.powers.T[every]

    def record(self, member: int) -> PlantRecord:
        """Give the run of a member since its reset, for indicators.

        Parameters
        ----------
        member : int
            Which.

        Raises
        ------
        PlantError
            When runs are not kept, or there was no step yet.
        """
        return record_of(self._history, member, int(self.now[member]), float(self.plants[0].scenario.grid.step))

    @property
    def history(self) -> tuple[Array, Array] | None:
        """Zones at the edges of steps, counted from the reference temperature [K], and powers [W], with `record`."""
        return self._history


def _differ(one: Scenario, other: Scenario) -> bool:
    """Whether people or heat of two draws differ."""
    return any(not np.array_equal(getattr(one, name), getattr(other, name)) for name in ("occupancy", "gains"))


def record_of(history: tuple[Array, Array] | None, member: int, steps: int, seconds: float) -> PlantRecord:
    """Give the run of a member out of the history of all.

    Parameters
    ----------
    history : tuple of ndarray or None
        As `BatchedPlant.history`.
    member, steps : int
        Which, and how many steps it has made.
    seconds : float
        Step of the plant [s].
    """
    if history is None or steps < 1:
        raise PlantError("run", "one that is kept, of a step at least", "none", "make the batch with record=True")
    zones, powers = history
    kept = zones[: steps + 1, :, member].astype(float) + REFERENCE_TEMPERATURE
    electricity, gas = powers[:steps, :, member].astype(float).T
    return PlantRecord(seconds, kept, electricity, gas)
