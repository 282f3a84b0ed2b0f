"""The schedules of a building's automation as a plant steps through them, with its night cycle."""

from collections.abc import Mapping, Sequence
from functools import reduce
from typing import Any

import numpy as np

from mpc.loop.actuators import COOLING_SETPOINT, HEATING_SETPOINT, STATIC_PRESSURE, SUPPLY_AIR, actuators_of
from mpc.loop.operation import Operation, shared_rows
from thermal._types import FloatArray
from thermal.components.air_handler import AirHandler
from thermal.components.operations import Operations, StepOperations, Value
from thermal.system.system import HvacSystem

_STEP = StepOperations()


class Schedule:
    """Schedules laid out as a plant takes them: rows, floats and tuples.

    Parameters
    ----------
    operation : Operation
        The schedules.
    system : HvacSystem
        The plant, with the names of its devices.
    zones : tuple of str
        Their names.

    Attributes
    ----------
    ventilation : list of float
        Share of the minimum of outdoor air, one a step [-].
    set_back : list of ndarray of bool, shape (n_zone,)
        Whether setpoints are those of set-back, one a step.
    """

    def __init__(self, operation: Operation, system: HvacSystem, zones: tuple[str, ...]) -> None:
        self._heating, self._cooling = shared_rows(operation.heating), shared_rows(operation.cooling)
        self._running = [tuple(map(float, row)) for row in operation.running]
        self._limit = operation.night_cycle
        self.ventilation = [float(v) for v in operation.ventilation]
        self.set_back = list(operation.set_back)
        count, terminals = len(system.air_handlers), system.terminals
        self._served = [terminals.zone[terminals.air_handler == k] for k in range(count)]
        kinds, self._optional = (HEATING_SETPOINT, COOLING_SETPOINT), system.defaults
        self._water = system.water_switches
        self._required = sum(a.required for a in actuators_of(system, ()))
        handlers = system.of_kind(AirHandler)
        self._switches = [f"{name}/fan_running" for name in handlers], [f"{name}/ventilation" for name in handlers]
        self._supply = [(f"{name}/{SUPPLY_AIR}", f"{name}/{STATIC_PRESSURE}") for name in handlers]
        self._known: tuple[Any, ...] = (None, None, None)
        self._made: tuple[dict[str, float], tuple[float, ...], tuple[float, ...]] = ({}, (), ())
        self._given = {f"{zone}/{kind}": (i, k) for k, zone in enumerate(zones) for i, kind in enumerate(kinds)}

    def setpoints(self, k: int, given: Mapping[str, float]) -> tuple[FloatArray, FloatArray]:
        """Give the thermostats' setpoints: the schedule's, but for those that an action has.

        Parameters
        ----------
        k : int
            Number of the step.
        given : mapping of str to float
            The action, checked [K] or [Pa].

        Returns
        -------
        tuple of ndarray, shape (n_zone,)
            Heating and cooling setpoints [K]; where an action crosses them, the heating one gives way.
        """
        both = self._heating[k], self._cooling[k]
        if len(given) == self._required:
            return both
        asked = [(place, value) for name, value in given.items() if (place := self._given.get(name)) is not None]
        if asked:
            both = both[0].copy(), both[1].copy()
            for (side, zone), value in asked:
                both[side][zone] = value
            np.minimum(*both, out=both[0])
        return both

    def runs(
        self, k: int, zone: FloatArray, heating: FloatArray, cooling: FloatArray, cycling: tuple[bool, ...]
    ) -> tuple[tuple[float, ...], tuple[bool, ...]]:
        """Tell which air handlers run: by schedule, or since a zone has drifted too far.

        Parameters
        ----------
        k : int
            Number of the step.
        zone, heating, cooling : ndarray, shape (n_zone,)
            Temperatures and setpoints [K].
        cycling : tuple of bool
            Which ran for the latter reason in the step before.

        Returns
        -------
        tuple
            1 or 0 for each air handler [-], and which cycle now.
        """
        scheduled = self._running[k]
        if self._limit is None or min(scheduled, default=1.0) == 1.0:
            return scheduled, (False,) * len(scheduled)
        beyond = np.maximum(heating - zone, zone - cooling)
        if beyond[beyond.argmax()] <= 0.0:  # none has drifted at all
            return scheduled, (False,) * len(scheduled)
        was = tuple(map(float, cycling))
        now = self.drifted(_STEP, np.maximum(heating - zone, zone - cooling), was)
        return tuple(max(s, c) for s, c in zip(scheduled, now, strict=True)), tuple(map(bool, now))

    def drifted(self, ops: Operations, beyond: Value, was: Sequence[Value]) -> list[Value]:
        """Tell which air handlers run since a zone has drifted too far.

        Parameters
        ----------
        ops : Operations
            Arithmetic.
        beyond : Value, shape (n_zone,)
            What the zones are beyond their setpoints [K].
        was : sequence of Value
            1 for those that ran for this reason in the step before, else 0 [-].

        Returns
        -------
        list of Value
            The same now.
        """
        worst = [beyond[zones].max(axis=-1) for zones in self._served]
        limit = self._limit or 0.0
        return [ops.scalar.step(w - limit * (1.0 - before)) for w, before in zip(worst, was, strict=True)]

    def actions(
        self, given: Mapping[str, float], runs: tuple[float, ...], ventilation: float
    ) -> tuple[dict[str, float], tuple[float, ...], tuple[float, ...]]:
        """Give the plant's actions, the same object as long as nothing changes.

        Parameters
        ----------
        given : mapping of str to float
            The controller's, checked [K] or [Pa].
        runs : tuple of float
            1 or 0 for each air handler [-].
        ventilation : float
            Share of the minimum of outdoor air [-].

        Returns
        -------
        tuple
            Actions by ``ENTITY/point``; setpoints of the supply air [K]; and how much of its design flow each duct's
            pressure drives [-].
        """
        if given != self._known[0] or (runs, ventilation) != self._known[1:]:
            self._known = dict(given), runs, ventilation
            self._made = self.switched(_STEP.scalar, given, runs, ventilation)
        return self._made

    def switched(
        self, few: Operations, given: Mapping[str, Value], runs: Sequence[Value], ventilation: Value
    ) -> tuple[dict[str, Value], tuple[Value, ...], tuple[Value, ...]]:
        """Add to a controller's actions what schedules switch: `actions` anew.

        Parameters
        ----------
        few : Operations
            Arithmetic of single values.
        given : mapping of str to Value
            The controller's [K] or [Pa].
        runs : sequence of Value
            1 or 0 for each air handler [-].
        ventilation : Value
            Share of the minimum of outdoor air [-].
        """
        chosen = {name: value for name, value in given.items() if name not in self._given}
        fans, outdoor = self._switches
        chosen |= dict(zip(fans, runs, strict=True)) | dict.fromkeys(outdoor, ventilation)
        chosen |= dict.fromkeys(self._water, reduce(few.maximum, runs) if runs else 1.0)
        reach = [
            run * few.sqrt(chosen.get(pressure, self._optional[pressure]) / self._optional[pressure])
            for run, (_, pressure) in zip(runs, self._supply, strict=True)
        ]
        return chosen, tuple(chosen[air] for air, _ in self._supply), tuple(reach)
