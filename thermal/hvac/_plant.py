"""The plant in closed loop: steps of NumPy, with its states, its checks and its meters."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from thermal._types import FloatArray
from thermal.errors import ModelError, describe
from thermal.hvac._advance import advance
from thermal.hvac._checks import action, scalar_action
from thermal.hvac._compiled import CompiledCentral
from thermal.hvac._operations import StepOperations, Value
from thermal.hvac._settings import Settings, settings_of
from thermal.hvac._step import Actions, Calls, Conditions, HvacStep
from thermal.hvac._system import HvacSystem
from thermal.hvac._thermostat import Mode, ModeArray

_Limits = tuple[str, str, float, float]  # name, unit, lowest, highest
_AIR = (233.15, 353.15)  # K, of rooms: what lies outside is a fault of the caller's
_COLDEST, _HOTTEST = 193.15, 338.15  # K, outdoors
_CONDITIONS = (
    ("outdoor_temperature", "K", _COLDEST, _HOTTEST),
    ("outdoor_humidity", "kg/kg", 0.0, 0.05),
    ("return_humidity", "kg/kg", 0.0, 0.05),
    ("room_temperature", "K", *_AIR),
)
_ACTIONS = (
    ("supply_air_temperature", "K", 273.15, 333.15),
    ("supply_water_temperature", "K", 278.15, 373.15),  # water that is neither frozen nor steam
    ("static_pressure", "Pa", 1.0, 2500.0),
    ("differential_pressure", "Pa", 1e3, 6e5),
    ("running", "-", 0.0, 1.0),
    ("boiler", "-", 0.0, 1.0),
    ("ventilation", "-", 0.0, 1.0),
)
_OPTIONAL = {"static_pressure", "differential_pressure"}
_EACH = {"return_humidity", "supply_air_temperature", "static_pressure", "running", "ventilation"}


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
    >>> from thermal.hvac._air_handler import AirHandler
    >>> from thermal.hvac._boiler import BoilerLoop, Pump
    >>> from thermal.hvac._fan import Fan
    >>> from thermal.hvac._step import Actions, Conditions
    >>> from thermal.hvac._terminals import Terminals
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
        self._ops, self._central = StepOperations(), CompiledCentral(system)
        self._checked: tuple[object, object] = (None, None)
        self._usual: tuple[object, ...] = (None, None, None)
        self._asked: tuple[Actions | None, Any] = (None, None)

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
        ModelError
            Something is not finite, out of its range or of another shape.
        """
        conditions, settings = self._check(conditions, actions, seconds)
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
        done = advance(ops, system, state.water, calls, conditions, settings, seconds, self._central)
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

    def _check(self, conditions: Conditions, actions: Actions, seconds: float) -> tuple[Conditions, Settings]:
        zone, n = conditions.zone_temperature, self.system.zone_count
        if getattr(zone, "shape", None) != (n,):
            found = f"shape {np.shape(zone)}"
            raise ModelError(describe("zone_temperature", f"an array of {n} zones", found))
        action("zone_temperature", zone, "K", *_AIR)
        setpoints = (conditions.heating_setpoint, conditions.cooling_setpoint)
        if setpoints[0] is not self._checked[0] or setpoints[1] is not self._checked[1]:
            self._check_setpoints(*setpoints)
        if not (type(seconds) is float and 1.0 <= seconds <= 3600.0):
            scalar_action("step", seconds, "s", 1.0, 3600.0)
        _, _, _, outdoor, damp, humid, room = conditions
        known = self._usual
        same = damp is known[0] and humid is known[1] and room is known[2]
        if not (same and type(outdoor) is float and _COLDEST <= outdoor <= _HOTTEST):
            conditions = self._check_surroundings(conditions)
        return conditions, self._asked[1] if actions is self._asked[0] else self._settings(actions)

    def _check_surroundings(self, conditions: Conditions) -> Conditions:
        """Check weather and rooms; what has been found fine, but for the weather, is known again."""
        if self._is_fine(_CONDITIONS, conditions[3:]):
            self._usual = conditions[4:]
            return conditions
        values = [self._checked_value(*row) for row in zip(_CONDITIONS, conditions[3:], strict=True)]
        return Conditions(*conditions[:3], *values)

    def _settings(self, actions: Actions) -> Settings:
        """Check actions and lay them out; the same object, of nothing but floats, is not looked at again."""
        fine = self._is_fine(_ACTIONS, actions)
        if not fine:
            actions = Actions(*[self._checked_value(*row) for row in zip(_ACTIONS, actions, strict=True)])
        settings = settings_of(self._ops, self.system, actions)
        if fine:
            self._asked = (actions, settings)
        return settings

    def _is_fine(self, limits: tuple[_Limits, ...], values: tuple[Value, ...]) -> bool:
        """Tell whether all values are plain floats in range, or as many of them as there are air handlers."""
        for (name, _, lowest, highest), value in zip(limits, values, strict=True):
            if type(value) is float:
                if not lowest <= value <= highest:
                    return False
            elif type(value) is tuple:
                if name not in _EACH or len(value) != len(self.system.air_handlers):
                    return False
                for one in value:
                    if not (type(one) is float and lowest <= one <= highest):
                        return False
            elif not (value is None and name in _OPTIONAL):
                return False
        return True

    def _checked_value(self, limits: _Limits, value: object) -> Value:
        """Check what is one value, or one an air handler, and make Python's floats of NumPy's."""
        name, unit, lowest, highest = limits
        if value is None and name in _OPTIONAL:
            return None
        plain: Any = value.tolist() if isinstance(value, np.ndarray | np.generic) else value
        each, n = name in _EACH and isinstance(plain, tuple | list), len(self.system.air_handlers)
        if each and len(plain) != n:
            raise ModelError(describe(name, f"one value or {n}, one an air handler", f"{len(plain)} values"))
        values = plain if each else [plain]
        for k, one in enumerate(values):
            where = f"{name}[{k}]" if each else name
            if not isinstance(one, float | int):
                raise ModelError(describe(where, f"a number of {unit}", repr(one)))
            scalar_action(where, one, unit, lowest, highest)
        return tuple(map(float, values)) if each else float(values[0])

    def _check_setpoints(self, heating: FloatArray, cooling: FloatArray) -> None:
        """Check setpoints; what has been checked once and is the same object is not looked at again."""
        n = self.system.zone_count
        for name, values in (("heating_setpoint", heating), ("cooling_setpoint", cooling)):
            if getattr(values, "shape", None) != (n,):
                raise ModelError(describe(name, f"an array of {n} zones", f"shape {np.shape(values)}"))
            action(name, values, "K", *_AIR)
        if not (heating <= cooling).all():
            k = int(np.argmax(heating > cooling))
            found = f"{heating[k]} and {cooling[k]} K in zone {k}"
            raise ModelError(describe("setpoints", "heating not above cooling", found))
        frozen = not (heating.flags.writeable or cooling.flags.writeable)
        self._checked = (heating, cooling) if frozen else (None, None)
