"""A system in closed loop: steps of NumPy, with its states, its checks and its meters."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from thermal._types import FloatArray
from thermal.components.checks import action, scalar_action
from thermal.components.component import Conditions
from thermal.components.operations import StepOperations
from thermal.components.thermostat import Mode, ModeArray
from thermal.errors import ModelError
from thermal.system.compiled import CompiledSystem
from thermal.system.step import HvacStep
from thermal.system.system import HvacSystem

_AIR = (233.15, 353.15)  # K, of rooms: what lies outside is a fault of the caller's
_COLDEST, _HOTTEST = 193.15, 338.15  # K, outdoors
_CONDITIONS = (
    ("outdoor_temperature", "K", _COLDEST, _HOTTEST),
    ("outdoor_humidity", "kg/kg", 0.0, 0.05),
    ("return_humidity", "kg/kg", 0.0, 0.05),
    ("room_temperature", "K", *_AIR),
)


class HvacState(NamedTuple):
    """What a system remembers from step to step.

    Parameters
    ----------
    values : tuple of float
        States of components, in the order of `HvacSystem.states` [unit of the state].
    mode : numpy.ndarray of int8, shape (n_zone,)
        Of the thermostats; matters only where they remember.
    set_back : numpy.ndarray of bool, shape (n_zone,)
        Whether their setpoints were those of set-back.
    """

    values: tuple[float, ...]
    mode: ModeArray
    set_back: NDArray[np.bool_]


class HvacPlant:
    """Steps a system: heat into the zones from their temperatures and a controller's setpoints.

    Parameters
    ----------
    system : HvacSystem
        Its components.

    Examples
    --------
    >>> from thermal.components.air_handler import AirHandler
    >>> from thermal.components.boiler_loop import BoilerLoop
    >>> from thermal.components.fan import Fan
    >>> from thermal.components.pump import Pump
    >>> from thermal.components.terminals import Terminals
    >>> from thermal.system.system import vav_system
    >>> system = vav_system([AirHandler(Fan(1.0))], BoilerLoop(2e4, Pump(0.5)), Terminals.sized([0.5, 0.5], 4000.0))
    >>> plant = HvacPlant(system)
    >>> cold = np.array([292.0, 296.0])
    >>> conditions = Conditions(cold, np.full(2, 294.0), np.full(2, 298.0), outdoor_temperature=275.0)
    >>> actions = system.actions(supply_air_temperature_setpoint=287.0, supply_water_temperature_setpoint=330.0)
    >>> state, step = plant.step(plant.start(), conditions, actions, 300.0)
    >>> bool(plant.heat(step)[0] > 0.0)
    True
    """

    def __init__(self, system: HvacSystem) -> None:
        self.system = system
        self._ops, self._compiled = StepOperations(), CompiledSystem(system)
        self._checked: tuple[object, object] = (None, None)
        self._usual: tuple[object, ...] = (None, None, None)
        self._asked: tuple[Mapping[str, Any] | None, tuple[float, ...]] = (None, ())

    def start(self, **values: Any) -> HvacState:
        """State with thermostats off.

        Parameters
        ----------
        **values
            As in `HvacSystem.start` [unit of the state].

        Returns
        -------
        HvacState
            To start from.
        """
        chosen, n = self.system.start(**values), self.system.zone_count
        for key, (_, s) in self.system.states.items():
            scalar_action(f"{key} at the start", chosen[key], s.unit, s.lowest, s.highest)
        off = np.full(n, Mode.OFF, dtype=np.int8)
        return HvacState(tuple(map(float, chosen.values())), off, np.zeros(n, dtype=bool))

    def step(
        self,
        state: HvacState,
        conditions: Conditions,
        actions: Mapping[str, float],
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
        actions : mapping of str to float
            Setpoints of the supervisory controller and switches by ``ENTITY/point`` [unit of the actuator]; the same
            object, unchanged, is not looked at again.
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
            Something is missing, not finite, out of its range or of another shape.
        """
        conditions = self._check(conditions, seconds)
        chosen = self._asked[1] if actions is self._asked[0] else self._actions(actions)
        thermostat, mode, was = self.system.thermostat, state.mode, state.set_back
        zone, heating, cooling = conditions[:3]
        if thermostat.remembers:
            now = np.zeros(len(zone), dtype=bool) if set_back is None else set_back
            mode, was = thermostat.next_mode(mode, zone, heating, cooling, now, was), now
            calls = thermostat.calls_in(mode, zone, heating, cooling)
        else:
            calls = thermostat.calls(self._ops, zone, heating, cooling)
        done = self._compiled.step(state.values, calls, conditions, chosen, seconds)
        return HvacState(done.state, mode, was), done

    def heat(self, step: HvacStep, port: str = "heat") -> FloatArray:
        """Heat into the zones in a step.

        Parameters
        ----------
        step : HvacStep
            As `step` gives it.
        port : str
            All of it, ``heat``, or the part that falls on surfaces, ``radiant_heat``.

        Returns
        -------
        numpy.ndarray, shape (n_zone,)
            Heat [W].
        """
        heat: FloatArray = self.system.at_zones(self._ops, step.results, port)
        return heat

    def _check(self, conditions: Conditions, seconds: float) -> Conditions:
        zone, n = conditions.zone_temperature, self.system.zone_count
        if getattr(zone, "shape", None) != (n,):
            raise ModelError("zone_temperature", f"an array of {n} zones", f"shape {np.shape(zone)}")
        action("zone_temperature", zone, "K", *_AIR)
        setpoints = conditions[1:3]
        if setpoints[0] is not self._checked[0] or setpoints[1] is not self._checked[1]:
            self._check_setpoints(*setpoints)
        if not (type(seconds) is float and 1.0 <= seconds <= 3600.0):
            scalar_action("step", seconds, "s", 1.0, 3600.0)
        outdoor, known = conditions[3], self._usual
        same = conditions[4] is known[0] and conditions[5] is known[1] and conditions[6] is known[2]
        if same and type(outdoor) is float and _COLDEST <= outdoor <= _HOTTEST:
            return conditions
        values = [self._checked_value(*row) for row in zip(_CONDITIONS, conditions[3:], strict=True)]
        checked = Conditions(*conditions[:3], *values)
        self._usual = checked[4:]
        return checked

    def _actions(self, actions: Mapping[str, Any]) -> tuple[float, ...]:
        """Check actions by the ranges of their actuators, and lay them out."""
        system, chosen = self.system, []
        for name in actions:
            if name not in system.actuators:
                ModelError.unless_known(name, system.actuators, "actions", "an actuator")
        for name, (_, actuator) in system.actuators.items():
            value = actions.get(name, system.defaults.get(name))
            if type(value) is float and actuator.lowest <= value <= actuator.highest:
                chosen.append(value)
                continue
            if not isinstance(value, float | int):
                raise ModelError(name, f"a number of {actuator.unit}", repr(value))
            scalar_action(name, value, actuator.unit, actuator.lowest, actuator.highest)
            chosen.append(float(value))
        self._asked = (actions, tuple(chosen))
        return self._asked[1]

    def _checked_value(self, limits: tuple[str, str, float, float], value: object) -> Any:
        """Check what is one value, or one an air handler, and make Python's floats of NumPy's."""
        name, unit, lowest, highest = limits
        plain: Any = value.tolist() if isinstance(value, np.ndarray | np.generic) else value
        each, n = name == "return_humidity" and isinstance(plain, tuple | list), len(self.system.air_handlers)
        if each and len(plain) != n:
            raise ModelError(name, f"one value or {n}, one an air handler", f"{len(plain)} values")
        for one in plain if each else [plain]:
            if not isinstance(one, float | int):
                raise ModelError(name, f"a number of {unit}", repr(one))
            scalar_action(name, one, unit, lowest, highest)
        return tuple(map(float, plain)) if each else plain if type(plain) is float else float(plain)

    def _check_setpoints(self, heating: FloatArray, cooling: FloatArray) -> None:
        """Check setpoints; what has been checked once and is the same object is not looked at again."""
        n = self.system.zone_count
        for name, values in zip(Conditions._fields[1:3], (heating, cooling), strict=True):
            if getattr(values, "shape", None) != (n,):
                raise ModelError(name, f"an array of {n} zones", f"shape {np.shape(values)}")
            action(name, values, "K", *_AIR)
        if not (heating <= cooling).all():
            k = int(np.argmax(heating > cooling))
            raise ModelError("setpoints", "heating not above cooling", f"{heating[k]} and {cooling[k]} K in zone {k}")
        frozen = not (heating.flags.writeable or cooling.flags.writeable)
        self._checked = (heating, cooling) if frozen else (None, None)
