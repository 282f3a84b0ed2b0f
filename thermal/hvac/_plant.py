"""The plant in closed loop: steps of NumPy, with its states, its checks and its meters."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from thermal.errors import HvacActionError, describe
from thermal.hvac._checks import action, scalar_action
from thermal.hvac._operations import StepOperations
from thermal.hvac._system import Actions, Calls, Conditions, HvacStep, HvacSystem, advance
from thermal.hvac._thermostat import Mode, ModeArray

FloatArray = NDArray[np.float64]
_AIR = (233.15, 353.15)  # K, of rooms: what lies outside is a fault of the caller's
_OUTDOOR = (193.15, 338.15)  # K
_SUPPLY_AIR = (273.15, 333.15)  # K, of setpoints
_SUPPLY_WATER = (278.15, 373.15)  # K, of setpoints: water that is neither frozen nor steam


class HvacState(NamedTuple):
    """What the plant remembers from step to step.

    Parameters
    ----------
    water : float
        Temperature of the supply water [K].
    mode : numpy.ndarray of int8, shape (n_zone,)
        Of the thermostats; matters only where they remember.
    set_back : numpy.ndarray of bool, shape (n_zone,)
        Whether their setpoints were those of set-back.
    """

    water: float
    mode: ModeArray
    set_back: NDArray[np.bool_]


class HvacPlant:
    """Steps a plant: heat into the zones from their temperatures and a controller's setpoints.

    Parameters
    ----------
    system : HvacSystem
        Its devices.

    Examples
    --------
    >>> from thermal.hvac import Actions, AirHandler, BoilerLoop, Conditions, Fan, Pump, Terminals
    >>> system = HvacSystem((AirHandler(Fan(1.0)),), BoilerLoop(2e4, Pump(0.5)), Terminals.sized([0.5, 0.5], 4000.0))
    >>> plant = HvacPlant(system)
    >>> cold = np.array([292.0, 296.0])
    >>> conditions = Conditions(cold, np.full(2, 294.0), np.full(2, 298.0), outdoor_temperature=275.0)
    >>> state, step = plant.step(plant.start(330.0), conditions, Actions(287.0, 330.0), 300.0)
    >>> bool(plant.heat(step)[0] > 0.0)
    True
    """

    def __init__(self, system: HvacSystem) -> None:
        self.system = system
        self._ops = StepOperations()
        self._checked: tuple[object, object] = (None, None)

    def start(self, water: float = 293.15) -> HvacState:
        """State with thermostats off.

        Parameters
        ----------
        water : float
            Temperature of the supply water [K].

        Returns
        -------
        HvacState
            To start from.
        """
        scalar_action("supply water at the start", water, "K", 273.15, 373.15)
        n = self.system.zone_count
        return HvacState(float(water), np.full(n, Mode.OFF, dtype=np.int8), np.zeros(n, dtype=bool))

    def step(
        self,
        state: HvacState,
        conditions: Conditions,
        actions: Actions,
        seconds: float,
        set_back: NDArray[np.bool_] | None = None,
    ) -> tuple[HvacState, HvacStep]:
        """Take a step.

        Parameters
        ----------
        state : HvacState
            At its start.
        conditions : Conditions
            Zone temperatures at its start, setpoints and weather.
        actions : Actions
            Setpoints of the supervisory controller.
        seconds : float
            Length of the step [s], 1 to 3600.
        set_back : numpy.ndarray of bool, shape (n_zone,), optional
            Whether the setpoints are those of set-back; only thermostats that remember look at it.

        Returns
        -------
        tuple of HvacState and HvacStep
            State at the end, and what happened; `heat` gives the heat into the zones.

        Raises
        ------
        HvacActionError
            Something is not finite, out of its range or of another shape.
        """
        self._check(conditions, actions, seconds)
        system, ops, zone = self.system, self._ops, conditions.zone_temperature
        heating, cooling, thermostat = conditions.heating_setpoint, conditions.cooling_setpoint, system.thermostat
        mode, was = state.mode, state.set_back
        if thermostat.remembers:
            now = np.zeros(len(zone), dtype=bool) if set_back is None else set_back
            mode, was = thermostat.next_mode(mode, zone, heating, cooling, now, was), now
            heat, cool = thermostat.calls_in(mode, zone, heating, cooling)
        else:
            heat, cool = thermostat.calls(ops, zone, heating, cooling)
        calls = Calls(system.at_terminals(ops, heat), system.at_terminals(ops, cool))
        done = advance(ops, system, state.water, calls, conditions, actions, seconds)
        return HvacState(done.loop.water, mode, was), done

    def heat(self, step: HvacStep) -> FloatArray:
        """Heat into the zones in a step.

        Parameters
        ----------
        step : HvacStep
            As `step` gives it.

        Returns
        -------
        numpy.ndarray, shape (n_zone,)
            Heat [W].
        """
        heat: FloatArray = self.system.at_zones(self._ops, step.terminal_heat)
        return heat

    def _check(self, conditions: Conditions, actions: Actions, seconds: float) -> None:
        zone, n = conditions.zone_temperature, self.system.zone_count
        if getattr(zone, "shape", None) != (n,):
            found = f"shape {np.shape(zone)}"
            raise HvacActionError(describe("zone_temperature", f"an array of {n} zones", found))
        action("zone_temperature", zone, "K", *_AIR)
        setpoints = (conditions.heating_setpoint, conditions.cooling_setpoint)
        if setpoints[0] is not self._checked[0] or setpoints[1] is not self._checked[1]:
            self._check_setpoints(*setpoints)
        scalar_action("outdoor_temperature", conditions.outdoor_temperature, "K", *_OUTDOOR)
        scalar_action("outdoor_humidity", conditions.outdoor_humidity, "kg/kg", 0.0, 0.05)
        scalar_action("room_temperature", conditions.room_temperature, "K", *_AIR)
        self._check_each("return_humidity", conditions.return_humidity, "kg/kg", 0.0, 0.05)
        scalar_action("step", seconds, "s", 1.0, 3600.0)
        self._check_each("supply_air_temperature", actions.supply_air_temperature, "K", *_SUPPLY_AIR)
        scalar_action("supply_water_temperature", actions.supply_water_temperature, "K", *_SUPPLY_WATER)
        if actions.static_pressure is not None:
            self._check_each("static_pressure", actions.static_pressure, "Pa", 1.0, 2500.0)
        if actions.differential_pressure is not None:
            scalar_action("differential_pressure", actions.differential_pressure, "Pa", 1e3, 6e5)
        self._check_each("running", actions.running, "-", 0.0, 1.0)
        scalar_action("boiler", actions.boiler, "-", 0.0, 1.0)

    def _check_setpoints(self, heating: FloatArray, cooling: FloatArray) -> None:
        """Check setpoints; what has been checked once and is the same object is not looked at again."""
        n = self.system.zone_count
        for name, values in (("heating_setpoint", heating), ("cooling_setpoint", cooling)):
            if getattr(values, "shape", None) != (n,):
                raise HvacActionError(describe(name, f"an array of {n} zones", f"shape {np.shape(values)}"))
            action(name, values, "K", *_AIR)
        if not (heating <= cooling).all():
            k = int(np.argmax(heating > cooling))
            found = f"{heating[k]} and {cooling[k]} K in zone {k}"
            raise HvacActionError(describe("setpoints", "heating not above cooling", found))
        frozen = not (heating.flags.writeable or cooling.flags.writeable)
        self._checked = (heating, cooling) if frozen else (None, None)

    def _check_each(self, name: str, values: object, unit: str, lowest: float, highest: float) -> None:
        """Check what is one value, or one an air handler."""
        n = len(self.system.air_handlers)
        if isinstance(values, tuple | list):
            if len(values) != n:
                raise HvacActionError(describe(name, f"one value or {n}, one an air handler", f"{len(values)}"))
            for k, value in enumerate(values):
                scalar_action(f"{name}[{k}]", value, unit, lowest, highest)
        else:
            scalar_action(name, values, unit, lowest, highest)  # type: ignore[arg-type]
