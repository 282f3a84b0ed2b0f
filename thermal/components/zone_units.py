"""Units with a fan in the zone that they heat and cool: on water (fan coils), or on direct expansion (unitary)."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, ClassVar, NamedTuple

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
from thermal.components.operations import Operations, Value
from thermal.components.streams import HotWater, SupplyWater, WaterDrawn
from thermal.units import AIR_HEAT_CAPACITY

_WARM, _COLD = 15.0, 11.0  # K: of the air over and under the zone at design, for the flow
_FAN = 400.0  # W per kg/s of air: 0.3 W/(l/s), usual for fan coils (ASHRAE 90.1-2019, 6.5.3.1.3)
_LEAST = 1e-9

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
    cools : bool
        Whether they have chilled water; without it they have no such port.

    Notes
    -----
    Heat is a conductance times what the water is above the zone, ``G = Q_rated / (T_rated - T_room)``, for the share of
    time that it is on; so is sensible cooling, and moisture condenses by the apparatus dew point with it.
    """

    label, device = "fan coil", "fan_coil"
    rooms: ClassVar[tuple[float, float]] = (293.15, 300.15)  # K: EN 1397's 20 and 27 degC
    ports = (
        Port("hot_water", "water", "kg/s"), Port("chilled_water", "chilled_water", "kg/s"),
        Port("heat", "heat", "W", "each"), Port("electric_power", "electricity", "W", "each"),
    )  # fmt: skip

    hot_water: Annotated[float, Range("K", 298.15, 368.15)] = 318.15
    chilled_water: Annotated[float, Range("K", 274.15, 293.15)] = 280.15
    hot_difference: Annotated[float, Range("K", 1.0, 40.0)] = 5.0
    chilled_difference: Annotated[float, Range("K", 1.0, 20.0)] = 5.0
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
        hot = warm * pipe.opening * (self.heating / (self.hot_water - self.rooms[0]))
        given.put("hot_water", self._drawn(ops, hot, zone, warm * self.water_flow))
        water: SupplyWater = yield "hot_water"
        heating, cooling, moisture = hot * (water.temperature - zone), 0.0 * zone, 0.0 * zone
        if self.cools:
            pipe = yield "chilled_water"
            humidity = self.humidity(given.conditions)
            # rated cooling is total: of the rated room's half, 19 degC wet bulb, three quarters are sensible
            dry = 0.75 * self.cooling / (self.rooms[1] - self.chilled_water)
            running = dry * ops.positive(zone - pipe.warmest)
            # what condenses is more for the coil to take, so that the surface is where both together put it
            share = self.sensible_share(ops, running, zone, humidity)
            share = self.sensible_share(ops, running / share, zone, humidity)
            open_share = cold * pipe.opening
            chilled = open_share * dry / share
            given.put("chilled_water", self._drawn(ops, chilled, zone, cold * self.chilled_flow))
            water = yield "chilled_water"
            total = chilled * (zone - water.temperature)
            cooling, moisture = share * total, (1.0 - share) * total
        fan = (ops.maximum(warm, cold) if self.cools else warm) * self.fan_power
        return UnitStep(heating - cooling + fan, heating, cooling, moisture, fan, 1.0 * fan)

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
    A call is a share of what the unit can bring at the time, compressor first. Fan and compressor run for the share of
    time that this takes.
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
            heat, power, time = wanted, done.power + wanted - done.output, wanted / (able + _LEAST)
        fan = self.fan_power * ops.clip(time + cold, 0.0, 1.0)
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
