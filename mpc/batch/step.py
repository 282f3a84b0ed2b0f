"""A step of a plant, traced: the equations of the single one, of `mpc.loop` and `thermal`, noted for many members."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from mpc.batch.building import BatchedBuilding
from mpc.errors import PlantError
from mpc.kpi.rewards import StepValues
from mpc.loop.actuators import COOLING_SETPOINT, HEATING_SETPOINT
from mpc.loop.history import PlantStep
from mpc.loop.local import LocalControl
from mpc.loop.simulated import SimulatedPlant
from thermal.batch.operations import TracedOperations
from thermal.batch.trace import Tape, Traced
from thermal.components.component import Conditions
from thermal.components.operations import Value
from thermal.system.exchange import advance
from thermal.units import REFERENCE_TEMPERATURE

#: What a step is worth, of traced values.
Score = Callable[[StepValues], Value]


@dataclass(eq=False)
class StepInputs:
    """Values of a step that are set from outside, each with its place on a tape.

    Parameters
    ----------
    row : Traced
        Of the driving rows.
    actions : Traced, shape (n_action,)
        Setpoints [K] or [Pa].
    noise : Traced, shape (n_noise,)
        Random numbers [-].
    reading, missed, offset, response : Traced, shape (n_zone,)
        Readings of the zones' sensors at the start, counted from the reference temperature [K]; what local control
        missed [K]; what sensors say too much [K]; rise over a step to heat [K/W].
    cycling : Traced, shape (n_air_handler,)
        1 for those that run since a zone has drifted [-].
    states : Traced, shape (n_state,)
        Of the system [unit of the state].
    modes : Traced, shape (order,)
        Of the building [-].
    matrices : tuple of Traced
        Of `StepMatrices`, where members have buildings of their own.
    """

    row: Traced
    actions: Traced
    noise: Traced
    reading: Traced
    missed: Traced
    offset: Traced
    response: Traced
    cycling: Traced
    states: Traced
    modes: Traced
    matrices: tuple[Traced, ...]


@dataclass(eq=False)
class StepResults:
    """What a step gives.

    Parameters
    ----------
    measured : Traced, shape (n_column,)
        With noise [library's units].
    zone : Traced, shape (n_zone,)
        Air at the end of the step, counted from the reference temperature [K].
    powers : Traced, shape (2,)
        Electricity and fuel [W].
    reward : Traced
        What the score said.
    """

    measured: Traced
    zone: Traced
    powers: Traced
    reward: Traced


@dataclass(eq=False)
class TracedStep:
    """A step of plants of one structure, noted.

    Parameters
    ----------
    plant : SimulatedPlant
        One of them.
    parts : mapping of str to slice
        Of the driving rows.
    row_width : int
        Of a row.
    each_row : bool
        Whether members have rows of their own.
    actions : sequence of str
        Actuators that are set, by ``ENTITY/POINT``.
    building : BatchedBuilding
        Of all members.
    score : callable, optional
        What a step is worth; nothing by default.
    tape : Tape
        Where it is noted.
    """

    plant: SimulatedPlant
    parts: Mapping[str, slice]
    row_width: int
    each_row: bool
    actions: Sequence[str]
    building: BatchedBuilding
    score: Score | None = None
    tape: Tape = field(default_factory=Tape)

    def __post_init__(self) -> None:
        plant, tape, system = self.plant, self.tape, self.plant.system
        PlantError.unless(plant.loop.local.settles, "batch", "thermostats without memory", "some that remember")
        PlantError.unless(not plant.loop.radiant, "batch", "heat into the air of the zones", "radiators that radiate")
        n, noise = len(plant.zone_names), plant.sensors.noise
        self.inputs = StepInputs(
            tape.value(self.row_width, each=self.each_row), tape.value(len(self.actions)),
            tape.value(0 if noise is None else noise.width), tape.value(n), tape.value(n),
            tape.value(n, each=not self.building.shared), tape.value(n, each=not self.building.shared),
            tape.value(len(system.air_handlers)), tape.value(len(system.states)),
            tape.value(self.building.order), self.building.matrices(tape),
        )  # fmt: skip
        self.results = self._trace(TracedOperations(tape))

    def part(self, name: str) -> Traced:
        """Give a part of the driving row.

        Parameters
        ----------
        name : str
            Of `mpc.batch.inputs.plant_rows`.
        """
        found: Traced = self.inputs.row[self.parts[name]]
        return found

    def _trace(self, ops: TracedOperations) -> StepResults:
        plant, tape, given, part = self.plant, self.tape, self.inputs, self.part
        system, schedule, n = plant.system, plant.loop.schedule, len(plant.zone_names)
        asked = {name: given.actions[k] for k, name in enumerate(self.actions)}
        heating, cooling = self._setpoints(asked)
        runs, cycling = self._runs(ops, heating, cooling)
        free, finish = self.building.traced(given.matrices, given.modes, part("gains"), part("outside"))
        actions, supply, reach = schedule.switched(ops, asked, runs, part("ventilation")[0])
        local = LocalControl(system, given.response)  # type: ignore[arg-type]
        air = np.stack([s - REFERENCE_TEMPERATURE for s in supply]) if supply else np.zeros(0)
        lines = local.segments(
            heating, cooling, air, np.stack(reach) if reach else np.zeros(0), zero=REFERENCE_TEMPERATURE
        )
        zone = local.rest(free + given.missed, lines)
        conditions = Conditions(
            zone + REFERENCE_TEMPERATURE, heating + REFERENCE_TEMPERATURE, cooling + REFERENCE_TEMPERATURE,
            part("outdoor")[0],
        )  # fmt: skip
        # differences of what is counted from near by keep the digits that absolute ones lose in single precision
        calls = system.thermostat.calls(ops, zone, heating, cooling)
        before = [given.states[k] for k in range(len(system.states))]
        done = advance(ops, system, before, calls, conditions, actions, plant.scenario.grid.step * 1.0)
        heat = system.at_zones(ops, done.results)
        reached = finish(heat)
        mean = 0.5 * (given.reading + reached) + REFERENCE_TEMPERATURE
        step = PlantStep(0, conditions, actions, done, mean, reached)  # type: ignore[arg-type]
        measured = plant.sensors.exact(ops, step, part("weather"), part("people"))
        if plant.sensors.noise is not None:
            plant.sensors.noise.add(measured, given.noise)
        tape.kept.add(measured.view.slot.number)
        powers, end = tape.value(2), given.reading - given.offset
        powers[0], powers[1] = done.electric_power, done.fuel_power
        prices = [part("prices")[k] for k in range(4)]
        worth: Value = 0.0
        if self.score is not None:
            worth = self.score(StepValues(
                end, reached - given.offset, part("lower"), part("upper"), part("people"),
                (done.electric_power, done.fuel_power), (prices[0], prices[1]), (prices[2], prices[3]),
                float(plant.scenario.grid.step),
            ))  # fmt: skip
        results = StepResults(measured, tape.keep(reached - given.offset, n), powers, tape.keep(worth))
        given.missed[...] = LocalControl.missing(given.missed, reached, zone)
        given.reading[...] = reached
        for k, value in enumerate(cycling):
            given.cycling[k] = value
        for k, value in enumerate(done.state):
            given.states[k] = value
        return results

    def _setpoints(self, asked: Mapping[str, Traced]) -> tuple[Value, Value]:
        """Schedule's setpoints, but for those that an action has; as `Schedule.setpoints`."""
        heating, cooling = self.part("heating"), self.part("cooling")
        places = {f"{zone}/{kind}": (side, k) for k, zone in enumerate(self.plant.zone_names)
                  for side, kind in enumerate((HEATING_SETPOINT, COOLING_SETPOINT))}  # fmt: skip
        if not any(name in places for name in asked):
            return heating, cooling
        both = [self.tape.value(len(heating), kept=False) for _ in range(2)]
        both[0][...], both[1][...] = heating, cooling
        for name, value in asked.items():
            if name in places:
                side, zone = places[name]
                both[side][zone] = value - REFERENCE_TEMPERATURE
        low: Value = both[0]
        high: Value = both[1]
        return np.minimum(low, high), high

    def _runs(self, ops: TracedOperations, heating: Value, cooling: Value) -> tuple[list[Value], list[Value]]:
        """Which air handlers run, and which of them since a zone has drifted; as `Schedule.runs`."""
        given, count = self.inputs, len(self.plant.system.air_handlers)
        scheduled = [self.part("running")[k] for k in range(count)]
        if self.plant.operation.night_cycle is None:
            return scheduled, [0.0] * count
        beyond = np.maximum(heating - given.reading, given.reading - cooling)
        drifted = self.plant.loop.schedule.drifted(ops, beyond, [given.cycling[k] for k in range(count)])
        now = [d * self.part("some_idle")[0] for d in drifted]
        return [ops.maximum(s, c) for s, c in zip(scheduled, now, strict=True)], now
