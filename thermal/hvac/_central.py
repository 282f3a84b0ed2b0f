"""What a building has a few of: air handlers, boiler, pump. Two stages of a step, between those of the terminals."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, Protocol

from thermal.hvac._air_handler import Mixed, Warmed
from thermal.hvac._boiler import Heated
from thermal.hvac._operations import Operations, Value
from thermal.hvac._settings import Settings
from thermal.hvac._step import Conditions
from thermal.hvac._system import HvacSystem


class Supplied(NamedTuple):
    """What the air handlers make of the terminals' flows.

    Parameters
    ----------
    mixed : tuple of Mixed
        Their air, up to the heating coils.
    warmed : tuple of Warmed
        Their heating coils, valves set.
    allowances : sequence of Value
        Rise up to the discharge limit over that up to the water's temperature, one an air handler [-].
    """

    mixed: tuple[Mixed, ...]
    warmed: tuple[Warmed, ...]
    allowances: Sequence[Value]


class Circulated(NamedTuple):
    """What boiler and pump make of the coils' load.

    Parameters
    ----------
    loop : Heated
        The hot-water loop.
    supply_temperature : sequence of Value
        Supply air of the air handlers [K].
    water_flow, return_water : Value
        Through the pump [kg/s], and back to the boiler [K].
    pump_power, electric_power, fuel_power : Value
        Of the pump; of everything; fuel of everything [W].
    """

    loop: Heated
    supply_temperature: Sequence[Value]
    water_flow: Value
    return_water: Value
    pump_power: Value
    electric_power: Value
    fuel_power: Value


class Central(Protocol):
    """Takes the central devices through a step, stage by stage; one step at a time."""

    def supply(
        self,
        flows: Sequence[Value],
        warmth: Sequence[Value],
        water: Value,
        conditions: Conditions,
        settings: Settings,
        step: Value,
    ) -> Supplied:
        """Mix, cool and warm the air.

        Parameters
        ----------
        flows, warmth : sequence of Value
            Supply air [kg/s], and flows times zone temperatures [kg K/s], summed over the terminals of each.
        water : Value
            Supply water at the start [K].
        conditions : Conditions
            Of the step.
        settings : Settings
            Actions for the step.
        step : Value
            Its length [s].
        """

    def circulate(self, supplied: Supplied, reheat: Sequence[Value], drawn: Value) -> Circulated:
        """Heat the water of the same step.

        Parameters
        ----------
        supplied : Supplied
            What `supply` gave.
        reheat : sequence of Value
            Conductance of the terminals' coils, valves set, summed for each air handler [W/K].
        drawn : Value
            Water through the terminals at the design differential pressure [kg/s].
        """


class DirectCentral:
    """The equations as they stand.

    Parameters
    ----------
    ops : Operations
        Arithmetic for what there is one of, or a few.
    system : HvacSystem
        The plant.
    """

    def __init__(self, ops: Operations, system: HvacSystem) -> None:
        self._ops, self._system = ops, system

    def supply(
        self,
        flows: Sequence[Value],
        warmth: Sequence[Value],
        water: Value,
        conditions: Conditions,
        settings: Settings,
        step: Value,
    ) -> Supplied:
        """Mix, cool and warm the air; see `Central`.

        Parameters
        ----------
        flows, warmth, water, conditions, settings, step : as there
            [kg/s], [kg K/s], [K], ..., [s].
        """
        ops, system, loop, opening = self._ops, self._system, self._system.loop, settings.opening
        self._given = water, conditions, settings, step
        outdoor, damp, humid = conditions.outdoor_temperature, conditions.outdoor_humidity, conditions.return_humidity
        humidities = humid if isinstance(humid, tuple | list) else (humid,) * len(system.air_handlers)
        rows = zip(
            system.air_handlers, flows, warmth, settings.running, humidities, settings.supply_air,
            settings.static_pressure, settings.ventilation, strict=True,
        )  # fmt: skip
        mixed = tuple([
            handler.mix(ops, flow, run, warm / flow, humidity, outdoor, damp, setpoint, static, opening, ventilation)
            for handler, flow, warm, run, humidity, setpoint, static, ventilation in rows
        ])  # fmt: skip
        warmest = ops.maximum(water, settings.boiler * loop.goal(ops, water, settings.supply_water, step))
        warmed = tuple([
            handler.warm(ops, air, warmest, opening) for handler, air in zip(system.air_handlers, mixed, strict=True)
        ])  # fmt: skip
        allowance = system.terminals.allowance
        return Supplied(mixed, warmed, [allowance(ops, w.offset + w.slope * warmest, warmest) for w in warmed])

    def circulate(self, supplied: Supplied, reheat: Sequence[Value], drawn: Value) -> Circulated:
        """Heat the water of the same step; see `Central`.

        Parameters
        ----------
        supplied : Supplied
            As there.
        reheat : sequence of Value
            As there [W/K].
        drawn : Value
            As there [kg/s].
        """
        ops, system, loop, pump = self._ops, self._system, self._system.loop, self._system.loop.pump
        water, conditions, settings, step = self._given
        mixed, warmed, running, room = supplied.mixed, supplied.warmed, settings.boiler, conditions.room_temperature
        conductance: Value = 0.0
        source: Value = 0.0
        for total, w in zip(reheat, warmed, strict=True):
            conductance, source = conductance + total * (1.0 - w.slope), source + total * w.offset
        for k, coil in system.water_coils:
            conductance = conductance + warmed[k].conductance
            source = source + warmed[k].conductance * mixed[k].cooled_temperature
            drawn = drawn + warmed[k].flow_share * coil.water_flow
        least = pump.minimum_share * pump.design_flow
        flow = running * ops.maximum(drawn * settings.opening, least, pump.design_flow)
        pump_power = pump.power(flow, settings.differential_pressure)
        heat = pump.heat_to_water * pump_power
        end = loop.heat(ops, water, settings.supply_water, running, conductance, source, heat, room, step)
        back = loop.returning(end, flow)
        electric, fuel = _powers(system, mixed, warmed)
        return Circulated(
            end, tuple([w.offset + w.slope * end.water for w in warmed]), flow, back, pump_power,
            electric + pump_power, loop.fuel(ops, end.boiler, back) + fuel,
        )  # fmt: skip


def _powers(system: HvacSystem, mixed: tuple[Mixed, ...], warmed: tuple[Warmed, ...]) -> tuple[Value, Value]:
    """Electric power of the air handlers, and fuel of their coils [W]."""
    electric: Value = 0.0
    fuel: Value = 0.0
    for m in mixed:
        electric = electric + m.cooling_power + m.supply_fan_power + m.exhaust_fan_power
    for k, heater in system.heaters:
        taken = warmed[k].direct / heater.efficiency
        electric, fuel = (electric + taken, fuel) if heater.electric else (electric, fuel + taken)
    return electric, fuel
