"""Thermostats: from a zone's temperature and setpoints to calls for heating and cooling."""

from dataclasses import dataclass
from enum import IntEnum
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from thermal._types import FloatArray
from thermal.components.component import Actuator, Calls, Component, Range
from thermal.components.operations import Operations, Value

ModeArray = NDArray[np.int8]


class Mode(IntEnum):
    """What a thermostat is doing, with the paper's four modes."""

    OFF = 0
    HEAT = 1
    COOL = 2
    PASSIVE_COOL = 3


@dataclass(frozen=True)
class Thermostat(Component):
    """Proportional control on the distance to the setpoints, with the paper's modes or without memory.

    Parameters
    ----------
    throttling_range : float
        Distance over which a call goes from 0 to 1 [K], 0.05 to 5. The default is half of what pneumatic thermostats
        have (ASHRAE Handbook, Fundamentals 2017, ch. 7); there is no integral action, so a zone under load sits within
        this range of its setpoint.
    release : float
        Share of the way from a setpoint to the other one at which a call ends [-], 0 to 0.5. 0 is control without
        memory. 0.5 is the paper's simulator: a call begins at the setpoint and ends half-way to the other one.

    Notes
    -----
    A call for heating is ``clip((T_release - T) / range, 0, 1)``, while the mode is HEAT; cooling mirrored. With
    memory the mode changes as in the paper's simulator; on the way into set-back it is PASSIVE_COOL, no calls at all,
    until the zone has cooled to the heating setpoint. Without memory the mode is only read off the calls. The smooth
    version, for predictors, has no memory: its calls begin half-way between where the two branches of the memory do.
    """

    label = "thermostat"
    actuators = (
        Actuator("zone_air_heating_temperature_setpoint", "K", 233.15, 353.15, (283.15, 299.15), "schedule"),
        Actuator("zone_air_cooling_temperature_setpoint", "K", 233.15, 353.15, (291.15, 308.15), "schedule"),
    )

    throttling_range: Annotated[float, Range("K", 0.05, 5.0)] = 1.0
    release: Annotated[float, Range("-", 0.0, 0.5)] = 0.0

    @property
    def remembers(self) -> bool:
        """Whether calls depend on the mode before."""
        return self.release > 0.0

    def calls(self, ops: Operations, zone: Value, heating: Value, cooling: Value) -> Calls:
        """Give calls for heating and cooling [-] without memory, 0 to 1.

        Parameters
        ----------
        ops : Operations
            Arithmetic.
        zone : Value
            Zone air temperatures [K].
        heating, cooling : Value
            Setpoints [K].
        """
        if self.release:
            shift = 0.5 * self.release * (cooling - heating)
            heating, cooling = heating + shift, cooling - shift
        cold, warm = heating - zone, zone - cooling
        if self.throttling_range != 1.0:
            rate = 1.0 / self.throttling_range
            cold, warm = cold * rate, warm * rate
        return Calls(ops.unit(cold), ops.unit(warm))

    def calls_in(self, mode: ModeArray, zone: FloatArray, heating: FloatArray, cooling: FloatArray) -> Calls:
        """Give calls for heating and cooling [-] in given modes.

        Parameters
        ----------
        mode : numpy.ndarray of int8, shape (n_zone,)
            As `next_mode` gives them.
        zone : numpy.ndarray, shape (n_zone,)
            Zone air temperatures [K].
        heating, cooling : numpy.ndarray, shape (n_zone,)
            Setpoints [K].

        Returns
        -------
        Calls
            Of shape (n_zone,) [-].
        """
        shift = self.release * (cooling - heating)
        heat = np.clip((heating + shift - zone) / self.throttling_range, 0.0, 1.0)
        cool = np.clip((zone - cooling + shift) / self.throttling_range, 0.0, 1.0)
        return Calls(np.where(mode == Mode.HEAT, heat, 0.0), np.where(mode == Mode.COOL, cool, 0.0))

    def next_mode(
        self,
        mode: ModeArray,
        zone: FloatArray,
        heating: FloatArray,
        cooling: FloatArray,
        set_back: NDArray[np.bool_],
        was_set_back: NDArray[np.bool_],
    ) -> ModeArray:
        """Give the modes after a look at the zones.

        Parameters
        ----------
        mode : numpy.ndarray of int8, shape (n_zone,)
            Modes before.
        zone : numpy.ndarray, shape (n_zone,)
            Zone air temperatures [K].
        heating, cooling : numpy.ndarray, shape (n_zone,)
            Setpoints [K].
        set_back, was_set_back : numpy.ndarray of bool, shape (n_zone,)
            Whether the setpoints are those of set-back, now and at the step before.

        Returns
        -------
        numpy.ndarray of int8, shape (n_zone,)
            Modes now.

        Examples
        --------
        >>> t, low, high, day = (np.array([v]) for v in (294.0, 293.0, 297.0, False))
        >>> Thermostat(release=0.5).next_mode(np.array([1], dtype=np.int8), t, low, high, day, day)
        array([1], dtype=int8)
        """
        shift = self.release * (cooling - heating)
        heats = (zone < heating) | ((zone < heating + shift) & (mode == Mode.HEAT))
        cools = (zone > cooling) | ((zone > cooling - shift) & (mode == Mode.COOL))
        free = np.where(heats, Mode.HEAT, np.where(cools, Mode.COOL, Mode.OFF))
        passive = set_back & (~was_set_back | ((mode == Mode.PASSIVE_COOL) & (zone > heating)))
        return np.where(passive, Mode.PASSIVE_COOL, free).astype(np.int8)
