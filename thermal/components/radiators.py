"""Radiators and heated floors on the hot-water loop, all of a building at once."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike

from thermal._types import FloatArray
from thermal.components.component import Given, Group, IndexArray, Port, Range, Run
from thermal.components.moist_air import WATER_HEAT_CAPACITY
from thermal.components.operations import Operations, Value
from thermal.components.streams import HotWater, SupplyWater, WaterDrawn
from thermal.components.water_coil import LEAST_FLOW
from thermal.errors import ModelError

_LEAST = 1e-6  # K: of an overtemperature, so that its powers have finite slopes


class RadiatorStep(NamedTuple):
    """What radiators did in a step; one value a radiator.

    Parameters
    ----------
    valve_flow : Value
        Water over that of an open valve [-].
    heat : Value
        Heat into the zone, air and surfaces together [W].
    radiant_heat : Value
        The part of it that falls on the surfaces [W].
    """

    valve_flow: Value
    heat: Value
    radiant_heat: Value


@dataclass(frozen=True, eq=False)
class WaterEmitters(Group):
    """What gives heat of hot water to zones without a fan, by valves that open with the thermostat's call for heating.

    Parameters
    ----------
    nominal_heat : float or numpy.ndarray, shape (n_emitter,)
        Heat at nominal temperatures [W], positive.
    zone : numpy.ndarray of int, shape (n_emitter,)
        Position of the zone that each stands in.
    exponent : float or numpy.ndarray, shape (n_emitter,)
        Exponent of the overtemperature [-], 1.05 to 1.6. The default is a panel radiator's (EN 442-2: 1.2 to 1.4).
    supply_temperature, return_temperature, room_temperature : float
        Nominal temperatures [K]; the defaults are EN 442's 75, 65 and 20 degC.
    radiant_share : float
        Share of the heat that falls on the surfaces of the zone [-]. The default is EnergyPlus' for
        ZoneHVAC:Baseboard:RadiantConvective:Water.

    Notes
    -----
    Each piece of the surface gives ``(T_water - T_zone)^n`` of EN 442, as in Modelica's RadiatorEN442_2 with many
    elements. Along the radiator ``m c d theta = -K theta^n dx``, which integrates to the heat

    ``q = m c theta (1 - (1 + (n - 1) K theta^(n-1) / (m c))^(-1/(n-1)))``,  theta = T_supply - T_zone,

    with K from the nominal temperatures. It lies within 2 % of ``q_nominal (dT / dT_nominal)^n`` of EN 442 with the
    logarithmic mean, scales with the overtemperatures to the power n, and no water leaves colder than the zone.
    """

    ports = (
        Port("hot_water", "water", "kg/s"), Port("heat", "heat", "W", "each"),
        Port("radiant_heat", "heat", "W", "each"),
    )  # fmt: skip
    sensors = ("heating_water_valve_percentage_command", "heating_power_sensor")

    nominal_heat: Annotated[FloatArray, Range("W", 1e-3, 1e7)]
    zone: IndexArray
    exponent: Annotated[FloatArray | float, Range("-", 1.05, 1.6)] = 1.3
    supply_temperature: Annotated[float, Range("K", 293.15, 373.15)] = 348.15
    return_temperature: Annotated[float, Range("K", 293.15, 373.15)] = 338.15
    room_temperature: Annotated[float, Range("K", 273.15, 313.15)] = 293.15
    radiant_share: Annotated[float, Range("-", 0.0, 1.0)] = 0.3

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.room_temperature < self.return_temperature < self.supply_temperature:
            found = f"{self.room_temperature:g}, {self.return_temperature:g} and {self.supply_temperature:g} K"
            raise ModelError(f"{type(self).__name__}: nominal temperatures", "room < return < supply", found)

    @classmethod
    def sized(cls, heat: ArrayLike, zone: IndexArray) -> Self:
        """Size emitters for the heat that they are to bring at nominal temperatures.

        Parameters
        ----------
        heat : array_like, shape (n_emitter,)
            Heat [W]; one for nothing gets a watt.
        zone : numpy.ndarray of int, shape (n_emitter,)
            Positions of the zones.
        """
        return cls(np.maximum(np.asarray(heat, dtype=float), 1.0), zone)

    @cached_property
    def water_flow(self) -> FloatArray:
        """Water through the open valves at the design differential pressure [kg/s]."""
        return self.nominal_heat / (WATER_HEAT_CAPACITY * (self.supply_temperature - self.return_temperature))

    @cached_property
    def surface(self) -> FloatArray:
        """K of the radiators [W/K^n]."""
        ends = self.supply_temperature - self.room_temperature, self.return_temperature - self.room_temperature
        less = self.exponent - 1.0
        rate = self.nominal_heat / (self.supply_temperature - self.return_temperature)
        return rate * (ends[1] ** -less - ends[0] ** -less) / less

    def emitted(self, water_flow: Value, overtemperature: Value) -> Value:
        """Heat [W] at a flow and an overtemperature of the supply water.

        Parameters
        ----------
        water_flow : Value
            Water [kg/s], not negative.
        overtemperature : Value
            Supply water above the zone [K], positive.
        """
        rate, less = WATER_HEAT_CAPACITY * (water_flow + LEAST_FLOW), self.exponent - 1.0
        transfer = less * self.surface * overtemperature**less / rate
        return rate * overtemperature * (1.0 - (1.0 + transfer) ** (-1.0 / less))

    def likely_heat(self, call: float, zone: FloatArray) -> FloatArray:
        """Heat at a call with water of the nominal temperature [W].

        Parameters
        ----------
        call : float
            For heating; none where it is negative, for cooling [-].
        zone : numpy.ndarray, shape (n_emitter,)
            Temperatures of their zones [K].
        """
        over = np.maximum(self.supply_temperature - zone, _LEAST)
        return np.asarray(self.emitted(max(call, 0.0) * self.water_flow, over))

    def run(self, ops: Operations, given: Given) -> Run:
        """Open valves by the calls, and bring the water's heat into the zones.

        Parameters
        ----------
        ops : Operations
            Arithmetic.
        given : Given
            Calls of the thermostats and temperatures of the zones.
        """
        zone = self.of_zones(ops, given.conditions.zone_temperature)
        valve_flow = self.of_zones(ops, given.calls.heating)
        pipe: HotWater = yield "hot_water"
        over = ops.positive(pipe.warmest - zone) + _LEAST
        conductance = self.emitted(valve_flow * self.water_flow * pipe.opening, over) / over
        drawn = self.total(ops, conductance), ops.dot(conductance, zone), ops.dot(valve_flow, self.water_flow)
        given.put("hot_water", WaterDrawn(*drawn))
        water: SupplyWater = yield "hot_water"
        heat = conductance * (water.temperature - zone)
        return RadiatorStep(valve_flow, heat, self.radiant_share * heat)

    def read(self, ops: Operations, given: Given, done: RadiatorStep) -> list[Value]:
        """Values of its points, one a radiator each.

        Parameters
        ----------
        ops : Operations
            Arithmetic.
        given : Given
            As `run` had it.
        done : RadiatorStep
            What `run` returned.
        """
        return [done.valve_flow, done.heat]


@dataclass(frozen=True, eq=False)
class Radiators(WaterEmitters):
    """Radiators: `WaterEmitters` with EN 442's nominal temperatures."""

    label, device = "radiator", "radiator"


@dataclass(frozen=True, eq=False)
class HeatedFloors(WaterEmitters):
    """Floors, or ceilings, with pipes: their heat goes into the layer of the building that the pipes are in.

    Parameters
    ----------
    nominal_heat : float or numpy.ndarray, shape (n_emitter,)
        Heat at nominal temperatures [W], positive.
    zone : numpy.ndarray of int, shape (n_emitter,)
        Position of the zone that each is under.
    exponent : float or numpy.ndarray, shape (n_emitter,)
        Of the overtemperature [-]: that of EN 1264-2's basic characteristic, ``q = 8.92 (T_floor - T_room)^1.1``.
    supply_temperature, return_temperature, room_temperature : float
        Nominal temperatures [K]; the defaults are usual ones of floors, 35, 30 and 20 degC.
    radiant_share : float
        Of heat past the layer [-]: none, as what the floor gives to the room is the building's.

    Notes
    -----
    The water's overtemperature is over the zone's air, as EN 1264 has it, and not over the layer: exact in the steady
    state; a layer that is still cold takes up a little more, and one still warm a little less than this gives.
    """

    label, device = "heated floor", "floor_heating"

    exponent: Annotated[FloatArray | float, Range("-", 1.05, 1.6)] = 1.1
    supply_temperature: Annotated[float, Range("K", 293.15, 373.15)] = 308.15
    return_temperature: Annotated[float, Range("K", 293.15, 373.15)] = 303.15
    radiant_share: Annotated[float, Range("-", 0.0, 1.0)] = 0.0
