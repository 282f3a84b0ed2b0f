"""Fan coils on hot and chilled water, all of a building at once."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike

from thermal._types import FloatArray
from thermal.components.component import Given, IndexArray, Port, Range, Run
from thermal.components.moist_air import EVAPORATION_HEAT, WATER_HEAT_CAPACITY, saturation_humidity
from thermal.components.operations import NumpyOperations, Operations, Value
from thermal.components.streams import HotWater, SupplyWater, WaterDrawn
from thermal.components.zone_units import UnitStep, ZoneUnits
from thermal.errors import ModelError
from thermal.units import AIR_HEAT_CAPACITY

_SMALL = 0.1  # K
_NEWTON = 5  # steps of Newton's rule for a wet surface: within 1e-3 K


@dataclass(frozen=True, eq=False)
class FanCoils(ZoneUnits):
    """Fan coils on hot and, where there is any, on chilled water; fan and valves are on for the share of the call.

    Parameters
    ----------
    heating, cooling : float or numpy.ndarray, shape (n_unit,)
        Rated heat and total cooling of the coils, with water and room as below [W].
    zone : numpy.ndarray of int, shape (n_unit,)
        Position of the zone that each is in.
    air_flow, fan_power, bypass, pressure
        As in `ZoneUnits` [kg/s], [W], [-], [Pa].
    hot_water, chilled_water : float
        Rated supply temperatures [K]; the defaults are those of heat pumps and chillers, 45 and 7 degC (EN 1397).
    hot_difference, chilled_difference : float
        Of the water at the rated heat, for its flow [K] (EN 1397: 5 K).
    rated : tuple of float
        Air of the zone that heat is rated at, and temperature and humidity ratio that cooling is [K], [K], [kg/kg];
        the defaults are EN 1397's 20 degC, and 27 degC with a wet bulb of 19 degC.
    cools : bool
        Whether they have chilled water; without it they have no such port.

    Notes
    -----
    Heat is a conductance times what the water is above the zone, ``G = Q_rated / (T_rated - T_room)``, for the share of
    time that it is on. The cooling coil has a surface between air and water: ``(T_s - T_water) / R = m (1 - b) (c_p
    (T - T_s) + L max(w - w_s(T_s), 0))``, with R from the rated total cooling.
    """

    label, device = "fan coil", "fan_coil"
    ports = (
        Port("hot_water", "water", "kg/s"), Port("chilled_water", "chilled_water", "kg/s"),
        Port("heat", "heat", "W", "each"), Port("electric_power", "electricity", "W", "each"),
    )  # fmt: skip

    hot_water: Annotated[float, Range("K", 298.15, 368.15)] = 318.15
    chilled_water: Annotated[float, Range("K", 274.15, 293.15)] = 280.15
    hot_difference: Annotated[float, Range("K", 1.0, 40.0)] = 5.0
    chilled_difference: Annotated[float, Range("K", 1.0, 20.0)] = 5.0
    rated: tuple[float, float, float] = (293.15, 300.15, 0.0105)
    cools: bool = True

    @property
    def connectors(self) -> tuple[Port, ...]:
        """Ports of water that it has."""
        return tuple(port for port in super().connectors if self.cools or port.quantity == "water")

    @classmethod
    def sized(cls, heat: ArrayLike, zone: IndexArray, cooling: ArrayLike | None = None) -> FanCoils:
        """Size fan coils for loads.

        Parameters
        ----------
        heat, cooling : array_like, shape (n_unit,)
            Heat and sensible cooling that they are to bring [W].
        zone : numpy.ndarray of int, shape (n_unit,)
            Positions of the zones.
        """
        warm, cold, flow, fan = cls.by_loads(heat, cooling)
        return cls(warm, cold, zone, flow, fan)

    @property
    def water_flow(self) -> FloatArray:
        """Hot water at the rated heat [kg/s]."""
        return self.heating / (WATER_HEAT_CAPACITY * self.hot_difference)

    @property
    def chilled_flow(self) -> FloatArray:
        """Chilled water at the rated cooling [kg/s]."""
        return self.cooling / (WATER_HEAT_CAPACITY * self.chilled_difference)

    def run(self, ops: Operations, given: Given) -> Run:
        """Run fan and valves for the calls, and bring heat and cold of the water into the zones.

        Parameters
        ----------
        ops : Operations
            Arithmetic.
        given : Given
            Calls of the thermostats, temperatures of the zones, and their humidity.
        """
        zone = self.of_zones(ops, given.conditions.zone_temperature)
        warm, cold = self.of_zones(ops, given.calls.heating), self.of_zones(ops, given.calls.cooling)
        pipe: HotWater = yield "hot_water"
        hot = warm * pipe.opening * (self.heating / (self.hot_water - self.rated[0]))
        given.put("hot_water", self._drawn(ops, hot, zone, warm * self.water_flow))
        water: SupplyWater = yield "hot_water"
        heating, cooling, moisture = hot * (water.temperature - zone), 0.0 * zone, 0.0 * zone
        if self.cools:
            pipe = yield "chilled_water"
            surface = self.surface(ops, pipe.warmest, zone, self.humidity(given.conditions))
            touched = self.air_flow * (1.0 - self.bypass)
            dry = AIR_HEAT_CAPACITY * touched * (zone - surface)
            wet = EVAPORATION_HEAT * touched * self._condensed(ops, surface, self.humidity(given.conditions))
            # as for valves: what the coil does with the coldest water is a conductance for the water that comes
            total = ops.positive(dry + wet) / ops.maximum(zone - pipe.warmest, _SMALL, _SMALL)
            chilled = cold * pipe.opening * total
            given.put("chilled_water", self._drawn(ops, chilled, zone, cold * self.chilled_flow))
            water = yield "chilled_water"
            brought, share = chilled * (zone - water.temperature), dry / ops.maximum(dry + wet, 1.0, 1.0)
            cooling, moisture = share * brought, (1.0 - share) * brought
        fan = (ops.maximum(warm, cold) if self.cools else warm) * self.fan_power
        return UnitStep(heating - cooling + fan, heating, cooling, moisture, fan, 1.0 * fan)

    def _condensed(self, ops: Operations, surface: Value, humidity: Value) -> Value:
        """Fall of the humidity ratio where the air touches a surface of a temperature [kg/kg]."""
        return ops.positive(humidity - saturation_humidity(ops, surface, self.pressure), 1e-3)

    @cached_property
    def resistance(self) -> FloatArray:
        """Between the cooling coil's surface and its water [K/W], from the rated cooling."""
        ops, (_, room, damp) = NumpyOperations(), self.rated
        touched = self.air_flow * (1.0 - self.bypass)
        surface = np.full(len(self), room)
        for _ in range(_NEWTON):
            surface = self._step(ops, surface, room, damp, 0.0, self.cooling / touched)
        resistance = (surface - self.chilled_water) / self.cooling
        if (resistance <= 0.0).any():
            k = int(np.argmin(resistance))
            expected = f"less than the air can bring with a coil of {self.chilled_water:g} K, or more air"
            raise ModelError(f"FanCoils: cooling of unit {k}", expected, f"{self.cooling[k]:g} W")
        return np.asarray(resistance)

    def surface(self, ops: Operations, water: Value, zone: Value, humidity: Value) -> Value:
        """Temperature of the cooling coil's surface with water of a temperature [K].

        The heat that the air gives, sensible and latent, is what goes on to the water.

        Parameters
        ----------
        ops : Operations
            Arithmetic.
        water : Value
            Chilled water that enters [K].
        zone, humidity : Value
            Of the air that enters [K], [kg/kg].
        """
        onward = 1.0 / (self.resistance * self.air_flow * (1.0 - self.bypass))
        found = zone + 0.0
        for _ in range(_NEWTON):
            found = self._step(ops, found, zone, humidity, onward, -onward * water)
        return found

    def _step(self, ops: Operations, at: Value, zone: Value, humidity: Value, slope: Value, offset: Value) -> Value:
        """Improve by Newton's rule where ``c_p (T - at) + L (w - w_s(at)) = offset + slope at`` [K]."""
        saturated = saturation_humidity(ops, at, self.pressure)
        wet = ops.step(humidity - saturated, 1e-3)
        steep = saturated * 17.625 * 243.04 / (at - 273.15 + 243.04) ** 2
        excess = AIR_HEAT_CAPACITY * (zone - at) + EVAPORATION_HEAT * wet * (humidity - saturated) - offset - slope * at
        return at + excess / (AIR_HEAT_CAPACITY + EVAPORATION_HEAT * wet * steep + slope)

    def _drawn(self, ops: Operations, conductance: Value, zone: Value, flow: Value) -> WaterDrawn:
        return WaterDrawn(self.total(ops, conductance), ops.dot(conductance, zone), self.total(ops, flow))
