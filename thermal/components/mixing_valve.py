"""A three-way valve that mixes water back, for those that want it less warm than it comes, such as heated floors."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from thermal.components.component import Actuator, Component, Conditions, Given, Port, Run
from thermal.components.energy_balance import EnergyBalance
from thermal.components.moist_air import WATER_HEAT_CAPACITY
from thermal.components.operations import Operations, Value
from thermal.components.pump import Pump
from thermal.components.streams import HotWater, SupplyWater, WaterDrawn

_LEAST = 1e-6  # K
_LITTLE = 1e-9  # share


class MixingStep(NamedTuple):
    """What a mixing valve did in a step.

    Parameters
    ----------
    mixed_water_temperature, return_water_temperature : Value
        To those that draw, and back from them [K].
    position : Value
        Share of the water that is fresh [-].
    load : Value
        Heat that is drawn [W].
    electric_power : Value
        Of its pump [W].
    """

    mixed_water_temperature: Value
    return_water_temperature: Value
    position: Value
    load: Value
    electric_power: Value


@dataclass(frozen=True)
class MixingValve(Component):
    """A three-way valve with its pump.

    Parameters
    ----------
    pump : Pump
        Behind the valve; it runs always.

    Notes
    -----
    With a share x of fresh water ``T_mixed = x T_supply + (1 - x) T_return``, and with ``T_return = T_mixed - (G
    T_mixed - H) / (m c)`` of the load ``T_mixed = (x T_supply + (1 - x) h) / (x + (1 - x) g)``, where ``g = G / (m c)``
    and ``h = H / (m c)``: linear in the supply. x is what brings the setpoint with the warmest water of the step, as
    valves of terminals are set, ``x = (T_set - T_return) / (T_warmest - T_return)``, as far as its supplier lets water
    through.
    """

    label, device = "mixing valve", "mixing_valve"
    ports = (
        Port("primary", "water", "kg/s"), Port("hot_water", "water", "kg/s", supplies=True),
        Port("electric_power", "electricity", "W"),
    )  # fmt: skip
    actuators = (Actuator("mixed_water_temperature_setpoint", "K", 283.15, 363.15, (293.15, 328.15), 308.15),)
    sensors = ("supply_water_temperature_sensor", "return_water_temperature_sensor", "pump_power_sensor")

    pump: Pump

    @classmethod
    def sized(cls, capacity: float, water_flow: float) -> MixingValve:
        """Size the pump.

        Parameters
        ----------
        capacity : float
            Largest heat [W].
        water_flow : float
            Through the open valves of all that draw [kg/s].
        """
        return cls(Pump(water_flow))

    def run(self, ops: Operations, given: Given) -> Run:
        """Mix water for those that draw.

        Parameters
        ----------
        ops : Operations
            Arithmetic.
        given : Given
            The setpoint.
        """
        setpoint = given.actions["mixed_water_temperature_setpoint"]
        pipe: HotWater = yield "primary"
        given.put("hot_water", HotWater(1.0, ops.minimum(pipe.warmest, setpoint)))
        drawn: WaterDrawn = yield "hot_water"
        flow = self.pump.flow(ops, drawn.flow, 1.0)
        rate = WATER_HEAT_CAPACITY * flow
        g, h = drawn.conductance / rate, drawn.source / rate
        fall = ops.positive(g * setpoint - h) + _LEAST
        position = fall / (ops.positive(pipe.warmest - setpoint) + fall)
        fresh = position * pipe.opening
        part = fresh + (1.0 - fresh) * g + _LITTLE
        # water that neither is fresh nor gives heat is as warm as could be
        slope, offset = fresh / part, ((1.0 - fresh) * h + _LITTLE * pipe.warmest) / part
        load = WaterDrawn(drawn.conductance * slope, drawn.source - drawn.conductance * offset, position * flow)
        given.put("primary", load)
        water: SupplyWater = yield "primary"
        mixed = slope * water.temperature + offset
        given.put("hot_water", SupplyWater(mixed))
        heat = drawn.conductance * mixed - drawn.source
        power = self.pump.power(flow, self.pump.differential_pressure)
        return MixingStep(mixed, mixed - heat / rate, position, heat, power)

    def energy(self, conditions: Conditions, done: MixingStep) -> EnergyBalance:
        """Where the energy of a step went: the pump's heat to the plant room.

        Parameters
        ----------
        conditions : Conditions
            Of the step.
        done : MixingStep
            What `run` returned.
        """
        return EnergyBalance(electricity=done.electric_power, plant_room=done.electric_power)

    def read(self, ops: Operations, given: Given, done: MixingStep) -> list[Value]:
        """Values of its points.

        Parameters
        ----------
        ops : Operations
            Arithmetic.
        given : Given
            As `run` had it.
        done : MixingStep
            What `run` returned.
        """
        return [done.mixed_water_temperature, done.return_water_temperature, done.electric_power]
