"""The loop of a plant, step by step: schedules, thermostats, devices and building, each with the state that it has."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from mpc.loop.building import BuildingModel, zone_response
from mpc.loop.history import PlantStep
from mpc.loop.local import LocalControl, most_heat
from mpc.loop.operation import Operation
from mpc.loop.schedule import Schedule
from mpc.loop.signals import RADIANT, EffectSignals, sensor_offset
from mpc.scenario.scenario import Scenario
from thermal._types import FloatArray
from thermal.components.component import Conditions
from thermal.components.terminals import Terminals
from thermal.system.plant import HvacPlant, HvacState
from thermal.system.system import HvacSystem

_ZONES = 293.15  # K, of the zones at a start


class LoopState(NamedTuple):
    """Everything that the next steps of a loop depend on.

    Parameters
    ----------
    building : object
        Of the building's model.
    hvac : HvacState
        Of the devices.
    cycling : tuple of bool
        Which air handlers run since a zone has drifted.
    reading : ndarray, shape (n_zone,)
        What the zones' sensors read at the end of the last step [K].
    missed : ndarray, shape (n_zone,)
        What local control missed [K].
    """

    building: Any
    hvac: HvacState
    cycling: tuple[bool, ...]
    reading: FloatArray
    missed: FloatArray


class PlantLoop:
    """Steps building and plant together.

    Parameters
    ----------
    scenario : Scenario
        Steps and outdoor temperature.
    system : HvacSystem
        Air handlers, hot water and terminals, with the names of the devices.
    model : BuildingModel
        The building.
    operation : Operation
        Schedules.
    boundary : ndarray, shape (n_steps, n_boundary)
        Boundary temperatures [K].
    """

    def __init__(
        self,
        scenario: Scenario,
        system: HvacSystem,
        model: BuildingModel,
        operation: Operation,
        boundary: FloatArray,
    ) -> None:
        self.hvac, self._model, self._operation = HvacPlant(system), model, operation
        self._seconds, self.boundary = float(scenario.grid.step), boundary
        self._outdoor = [float(v) for v in scenario.outdoor]
        self.schedule = Schedule(operation, system, scenario.zones)
        self.terminals = next(iter(system.of_kind(Terminals)), None)
        self.local = LocalControl(system, zone_response(model, most_heat(system)))
        self._off = (False,) * len(system.air_handlers)
        signals = [signal.name for signal in model.network.signals]
        radiant = [f"{RADIANT}{zone}" for zone in scenario.zones]
        radiates = "radiant_heat" in system.heating and set(radiant) <= set(signals)
        self.radiant = [signals.index(name) for name in radiant] if radiates else []
        rooms = model.network.anatomy.rooms
        # where the case says what heaters give their heat by the model knows what becomes of it
        self.unsaid = np.array([not rooms[zone].emitted for zone in scenario.zones])
        self.offset = sensor_offset(model)
        self.biased = bool(self.offset.any())
        self._reading = np.zeros(len(scenario.zones))
        self._state, self._cycling = self.hvac.start(), self._off

    @property
    def air(self) -> FloatArray:
        """Air of the zones, which biased sensors do not say, shape (n_zone,) [K]."""
        return self._reading - self.offset

    def start(self, signals: FloatArray) -> None:
        """Start from a steady state at usual temperatures.

        Parameters
        ----------
        signals : ndarray, shape (n_signal,)
            Of the effects [signal unit].
        """
        zones = np.clip(_ZONES, self._operation.heating[0], self._operation.cooling[0])
        self._reading = self._model.reset(zones, self.boundary[0], signals)
        self._model.reseed(0)
        self._state, self._cycling = self.hvac.start(), self._off
        self.local.missed = np.zeros_like(self._reading)

    def save(self) -> LoopState:
        """Keep the state."""
        return LoopState(
            self._model.save_state(), self._state, self._cycling, self._reading, self.local.missed
        )  # fmt: skip

    def restore(self, state: LoopState) -> None:
        """Return to a state.

        Parameters
        ----------
        state : LoopState
            Of `save`.
        """
        building, self._state, self._cycling, self._reading, self.local.missed = state
        self._model.restore_state(building)

    def advance(self, k: int, given: Mapping[str, float], gains: FloatArray, effects: EffectSignals) -> PlantStep:
        """Take a step of the scenario.

        Parameters
        ----------
        k : int
            Its number.
        given : mapping of str to float
            Setpoints, checked [K] or [Pa].
        gains : ndarray, shape (n_zone,)
            Heat of people, light and equipment [W].
        effects : EffectSignals
            Signals of the effects.
        """
        heating, cooling = self.schedule.setpoints(k, given)
        runs, self._cycling = self.schedule.runs(k, self._reading, heating, cooling, self._cycling)
        free = self._model.begin(gains, self.boundary[k], effects.known(k))
        actions, supply, reach = self.schedule.actions(given, runs, self.schedule.ventilation[k])
        zone = self._reading
        if self.local.settles:
            zone = self.local.settle(free, heating, cooling, supply, reach)
        conditions = Conditions(zone, heating, cooling, self._outdoor[k])
        set_back = self.schedule.set_back[k]
        self._state, done = self.hvac.step(self._state, conditions, actions, self._seconds, set_back)
        heat = self.hvac.heat(done)
        terminals = done.results[self.terminals] if self.terminals else done.terminals
        by_heaters = heat - self.hvac.system.by_zone(terminals.heat)
        signals = effects.at(k, terminals.airflow, heat, by_heaters)
        if self.radiant:
            signals = signals.copy()
            signals[self.radiant] += self.unsaid * self.hvac.heat(done, "radiant_heat")
        mean, self._reading = self._model.finish(heat, signals)
        self.local.learn(self._reading)
        return PlantStep(k, conditions, actions, done, mean, self.air if self.biased else self._reading)
