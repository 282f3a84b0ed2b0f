"""Units with a fan in the zone that they heat and cool: on water (fan coils), or on direct expansion (unitary)."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Annotated, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from thermal._types import FloatArray
from thermal.components.component import Conditions, Given, Group, IndexArray, Port, Range, Run
from thermal.components.curves import (
    DX_CAPACITY,
    DX_HEATING_CAPACITY,
    DX_HEATING_INPUT,
    DX_INPUT,
)
from thermal.components.energy_balance import EnergyBalance
from thermal.components.machine_map import Defrost, MachineMap
from thermal.components.moist_air import (
    EVAPORATION_HEAT,
    WATER_HEAT_CAPACITY,
    enthalpy,
    saturated_temperature,
    saturation_humidity,
    wet_bulb,
)
from thermal.components.operations import NumpyOperations, Operations, Value
from thermal.components.streams import HotWater, SupplyWater, WaterDrawn
from thermal.errors import ModelError
from thermal.units import AIR_HEAT_CAPACITY

_WARM, _COLD = 15.0, 11.0  # K: of the air over and under the zone at design, for the flow
_FAN = 400.0  # W per kg/s of air: 0.3 W/(l/s), usual for fan coils (ASHRAE 90.1-2019, 6.5.3.1.3)
_SMALL = 0.1  # K
_NEWTON = 5  # steps of Newton's rule for a wet surface: within 1e-3 K

#: Direct expansion that heats from air outdoors: EnergyPlus' defrosting on demand, part load with AHRI's loss.
DX_HEATING = MachineMap(3.36, DX_HEATING_CAPACITY, DX_HEATING_INPUT, cycling_loss=0.15, defrost=Defrost())
#: Direct expansion that cools: the 10-ton coil of the Medium Office, part load with the Small Office's loss.
DX_COOLING = MachineMap(4.1, DX_CAPACITY, DX_INPUT, cycling_loss=0.15)


class UnitStep(NamedTuple):
    """What units in zones did in a step; one value a unit.

    Parameters
    ----------
    heat : Value
        Into the zone, sensible, with the fan's; negative where it cools [W].
    heating, cooling, moisture : Value
        Of the coils: heat, sensible cooling, and the latent one that dries the air [W].
    fan_power : Value
        [W].
    electric_power : Value
        All of it [W].
    """

    heat: Value
    heating: Value
    cooling: Value
    moisture: Value
    fan_power: Value
    electric_power: Value


@dataclass(frozen=True, eq=False)
class ZoneUnits(Group):
    """Units whose fan and coils are on for the share of time that the thermostat calls; the base of both kinds.

    Parameters
    ----------
    heating, cooling : float or numpy.ndarray, shape (n_unit,)
        Rated heat and total cooling of the coils [W], positive.
    zone : numpy.ndarray of int, shape (n_unit,)
        Position of the zone that each is in.
    air_flow : float or numpy.ndarray, shape (n_unit,)
        Of the fan while it runs [kg/s], positive.
    fan_power : float or numpy.ndarray, shape (n_unit,)
        While it runs; all of it warms the air [W].
    bypass : float
        Share of the air that does not touch the cooling coil [-]. The default is usual for three to four rows.
    pressure : float
        Of the air [Pa].
    """

    heating: Annotated[FloatArray, Range("W", 1e-3, 1e7)]
    cooling: Annotated[FloatArray, Range("W", 1e-3, 1e7)]
    zone: IndexArray
    air_flow: Annotated[FloatArray, Range("kg/s", 1e-6, 1e4)]
    fan_power: Annotated[FloatArray, Range("W", 0.0, 1e6)]
    bypass: Annotated[float, Range("-", 0.0, 0.5)] = 0.1
    pressure: Annotated[float, Range("Pa", 5e4, 1.1e5)] = 101_325.0

    sensors = ("heating_power_sensor", "electrical_power_sensor")

    @staticmethod
    def by_loads(heat: ArrayLike, cooling: ArrayLike | None) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Size coils and fan for loads: heating and cooling [W], air [kg/s], and the fan's power [W].

        Parameters
        ----------
        heat : array_like, shape (n_unit,)
            Heat that they are to bring [W].
        cooling : array_like, shape (n_unit,), optional
            Sensible cooling [W]; as much as the heat by default.
        """
        warm = np.maximum(np.asarray(heat, dtype=float), 100.0)
        cold = warm if cooling is None else np.maximum(np.asarray(cooling, dtype=float), 100.0)
        flow = np.maximum(warm / _WARM, cold / _COLD) / AIR_HEAT_CAPACITY
        return warm, 1.25 * cold, flow, _FAN * flow

    def likely_heat(self, call: float, zone: FloatArray) -> FloatArray:
        """Heat at a call and rated capacity [W].

        Parameters
        ----------
        call : float
            For heating; negative for cooling [-].
        zone : numpy.ndarray, shape (n_unit,)
            Temperatures of their zones [K].
        """
        fan = abs(call) * self.fan_power
        return fan + (call * self.heating if call > 0.0 else 0.8 * call * self.cooling)

    def humidity(self, conditions: Conditions) -> Value:
        """Humidity ratio of the zones' air [kg/kg]: the return air's, of several air handlers their mean.

        Parameters
        ----------
        conditions : Conditions
            Of the step.
        """
        given = conditions.return_humidity
        return sum(given) / len(given) if isinstance(given, tuple | list) else given

    def sensible_share(self, ops: Operations, total: Value, temperature: Value, humidity: Value) -> Value:
        """Share of a coil's cooling that is sensible, by the apparatus dew point [-].

        ``h_s(T_adp) = h_in - Q / (m (1 - b))``; ``(h(T_in, w_adp) - h_adp) / (h_in - h_adp)``, 1 where that is dry
        (EnergyPlus Engineering Reference 26.1, DX cooling coil).

        Parameters
        ----------
        ops : Operations
            Arithmetic.
        total : Value
            Cooling while it runs [W].
        temperature, humidity : Value
            Of the air that enters [K], [kg/kg].
        """
        drop = ops.maximum(total / (self.air_flow * (1.0 - self.bypass)), 10.0, 100.0)
        inside = enthalpy(temperature, humidity)
        surface = saturated_temperature(ops, inside - drop, self.pressure)
        dew = saturation_humidity(ops, surface, self.pressure)
        latent = ops.positive(humidity - dew, 1e-3) * (2.501e6 + 1860.0 * (temperature - 273.15))
        return 1.0 - ops.clip(latent / drop, 0.0, 0.95)

    def energy(self, conditions: Conditions, done: UnitStep) -> EnergyBalance:
        """Where the energy of a step went.

        Parameters
        ----------
        conditions : Conditions
            Of the step.
        done : UnitStep
            What `run` returned.
        """
        used, drying = done.electric_power.sum(axis=-1), done.moisture.sum(axis=-1)
        return EnergyBalance(electricity=used, zones=done.heat.sum(axis=-1), moisture=-drying)

    def read(self, ops: Operations, given: Given, done: UnitStep) -> list[Value]:
        """Values of their points, one a unit each.

        Parameters
        ----------
        ops : Operations
            Arithmetic.
        given : Given
            As `run` had it.
        done : UnitStep
            What `run` returned.
        """
        return [done.heat, done.electric_power]


@dataclass(frozen=True, eq=False)
class FanCoils(ZoneUnits):
    """Fan coils on hot and, where there is any, on chilled water; fan and valves are on for the share of the call.

    Parameters
    ----------
    heating, cooling, zone, air_flow, fan_power, bypass, pressure
        As in `ZoneUnits`; rated with water and room as below.
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


@dataclass(frozen=True, eq=False)
class UnitaryUnits(ZoneUnits):
    """Packaged units of direct expansion: heat pumps, or air conditioners with electric heating, each in its zone.

    Parameters
    ----------
    heating, cooling, zone, air_flow, fan_power, bypass, pressure
        As in `ZoneUnits`; rated at the conditions of the maps.
    heating_map : MachineMap, optional
        Of the heat pump; x is the zone, y outdoors. None: it does not heat by the compressor.
    cooling_map : MachineMap
        x is the wet bulb of the air that enters, y outdoors.
    supplement : float or numpy.ndarray, shape (n_unit,)
        Electric resistance for what the heat pump cannot bring [W].

    Notes
    -----
    A call is a share of what the unit can bring at the time, compressor first. The fan runs while the compressor does.
    """

    label, device = "unitary heat pump", "unitary_heat_pump"
    ports = (Port("heat", "heat", "W", "each"), Port("electric_power", "electricity", "W", "each"))

    heating_map: MachineMap | None = DX_HEATING
    cooling_map: MachineMap = DX_COOLING
    supplement: Annotated[FloatArray, Range("W", 0.0, 1e7)] = field(default_factory=lambda: np.zeros(()))

    @classmethod
    def sized(cls, heat: ArrayLike, zone: IndexArray, cooling: ArrayLike | None = None) -> UnitaryUnits:
        """Size units for loads: a resistance brings half of the heat too.

        Parameters
        ----------
        heat, cooling : array_like, shape (n_unit,)
            Heat and sensible cooling that they are to bring [W].
        zone : numpy.ndarray of int, shape (n_unit,)
            Positions of the zones.
        """
        warm, cold, flow, fan = cls.by_loads(heat, cooling)
        return cls(warm, cold, zone, flow, fan, supplement=0.5 * warm)

    def run(self, ops: Operations, given: Given) -> UnitStep:
        """Run compressor, resistance and fan for the calls.

        Parameters
        ----------
        ops : Operations
            Arithmetic.
        given : Given
            Calls of the thermostats, temperatures of the zones, outdoors, and humidities.
        """
        conditions = given.conditions
        zone, outdoor = self.of_zones(ops, conditions.zone_temperature), conditions.outdoor_temperature
        warm, cold = self.of_zones(ops, given.calls.heating), self.of_zones(ops, given.calls.cooling)
        humidity = self.humidity(conditions)
        wet = wet_bulb(ops, zone, humidity + 0.0 * zone, self.pressure)
        cooler = self.cooling_map
        most = cooler.available(ops, self.cooling, wet, outdoor, cooler.frosted(ops, outdoor, 0.0))
        chilled = cooler.run_at(ops, cold * most, self.cooling, wet, outdoor)
        share = self.sensible_share(ops, most, zone, humidity)
        heat, power, time = warm * self.supplement, warm * self.supplement, warm * 1.0
        if (machine := self.heating_map) is not None:
            damp = conditions.outdoor_humidity
            frost = machine.frosted(ops, outdoor, damp)
            able = machine.available(ops, self.heating, zone, outdoor, frost)
            wanted = warm * (able + self.supplement)
            done = machine.run_at(ops, wanted, self.heating, zone, outdoor, damp)
            heat, power, time = wanted, done.power + wanted - done.output, done.duty
        fan = self.fan_power * ops.clip(time + chilled.duty, 0.0, 1.0)
        cooling = chilled.output * share
        return UnitStep(
            heat - cooling + fan, heat, cooling, chilled.output - cooling, fan, power + chilled.power + fan
        )  # fmt: skip

    def energy(self, conditions: Conditions, done: UnitStep) -> EnergyBalance:
        """Where the energy of a step went: what compressors move leaves outdoors, or comes from there.

        Parameters
        ----------
        conditions : Conditions
            Of the step.
        done : UnitStep
            What `run` returned.
        """
        moved = done.electric_power - done.fan_power + done.cooling + done.moisture - done.heating
        return super().energy(conditions, done)._replace(condenser=moved.sum(axis=-1))
