"""One step of a plant: the one place where the equations of its devices are put together."""

from __future__ import annotations

from typing import NamedTuple

from thermal.hvac._air_handler import Mixed, Warmed
from thermal.hvac._coil import Characteristic, water_share
from thermal.hvac._operations import Operations, Value
from thermal.hvac._step import Actions, Calls, Conditions, HvacStep
from thermal.hvac._system import HvacSystem
from thermal.hvac._terminals import heat_rate


class _Air(NamedTuple):
    """What the water side takes from the air side."""

    reheat_call: Value
    airflow: Value
    rate: Value
    coil: Value
    curve: Characteristic
    mixed: tuple[Mixed, ...]
    opening: Value


class _Valves(NamedTuple):
    """Valves, and the coils' load ``conductance * T - source`` that follows."""

    warmed: tuple[Warmed, ...]
    share: Value
    coil: Value
    offset: Value
    slope: Value
    conductance: Value
    source: Value


def advance(
    ops: Operations,
    system: HvacSystem,
    water: Value,
    calls: Calls,
    conditions: Conditions,
    actions: Actions,
    step: Value,
) -> HvacStep:
    """Take the plant through a step.

    Parameters
    ----------
    ops : Operations
        Arithmetic.
    system : HvacSystem
        The plant.
    water : Value
        Supply water at the start [K].
    calls : Calls
        Of the thermostats.
    conditions : Conditions
        Of the step.
    actions : Actions
        For the step.
    step : Value
        Its length [s].

    Notes
    -----
    Valves are set for the warmest water that the step can bring, so that no discharge temperature passes its limit.
    With these the loop's balance is linear in the water's temperature at the end of the step and is solved exactly.
    While the water is colder than that - a boiler at its capacity, a setpoint that falls - coils give a little less
    than their valves could let them.
    """
    scalar, loop, pump = ops.scalar, system.loop, system.loop.pump
    zone = system.at_terminals(ops, conditions.zone_temperature)
    air = _air_side(ops, system, zone, calls, conditions, actions)
    room = conditions.room_temperature
    setpoint, running = actions.supply_water_temperature, actions.boiler
    warmest = scalar.maximum(water, running * loop.goal(scalar, water, setpoint, step))
    valves = _valves(ops, system, air, warmest)
    valve_flow = water_share(valves.share, air.coil, air.curve)
    drawn = ops.dot(valve_flow, system.terminals.water_flow)
    for k, coil in system.water_coils:
        drawn = drawn + valves.warmed[k].flow_share * coil.water_flow
    flow = running * scalar.maximum(drawn * air.opening, pump.minimum_share * pump.design_flow, pump.design_flow)
    pump_power = pump.power(flow, _or_design(actions.differential_pressure, pump.differential_pressure))
    heat = pump.heat_to_water * pump_power
    end = loop.heat(scalar, water, setpoint, running, valves.conductance, valves.source, heat, room, step)
    entering = valves.offset + valves.slope * end.water
    reheat = valves.coil * (end.water - entering)
    discharge = entering + reheat / air.rate
    back = loop.returning(end, flow)
    electric, fuel = _powers(system, air.mixed, valves.warmed)
    return HvacStep(
        calls, air.airflow, entering, reheat, discharge, valve_flow, air.rate * (discharge - zone), air.mixed,
        valves.warmed, tuple([w.offset + w.slope * end.water for w in valves.warmed]), end, flow, back, pump_power,
        electric + pump_power, loop.fuel(scalar, end.boiler, back) + fuel,
    )  # fmt: skip


def _air_side(
    ops: Operations, system: HvacSystem, zone: Value, calls: Calls, conditions: Conditions, actions: Actions
) -> _Air:
    """Flows of the terminals, and the air handlers up to their heating coils."""
    scalar, terminals, handlers = ops.scalar, system.terminals, system.air_handlers
    n, designs = len(handlers), system.static_pressures
    statics = designs if actions.static_pressure is None else _each(actions.static_pressure, n)
    runs = _each(actions.running, n)
    reaches = [run * scalar.sqrt(p / design) for run, p, design in zip(runs, statics, designs, strict=True)]
    airflow = terminals.airflow(ops, calls.heating, calls.cooling, _spread(ops, system, reaches))
    pump = system.loop.pump
    pressure = _or_design(actions.differential_pressure, pump.differential_pressure)
    opening = actions.boiler * scalar.sqrt(pressure / pump.differential_pressure)
    rows = zip(
        handlers, ops.sums(airflow, system.members), ops.sums(airflow * zone, system.members), runs, statics,
        _each(conditions.return_humidity, n), _each(actions.supply_air_temperature, n), _each(actions.ventilation, n),
        strict=True,
    )  # fmt: skip
    outdoor, damp = conditions.outdoor_temperature, conditions.outdoor_humidity
    mixed = tuple([
        handler.mix(scalar, flow, run, warmth / flow, humid, outdoor, damp, setpoint, static, opening, ventilation)
        for handler, flow, warmth, run, static, humid, setpoint, ventilation in rows
    ])  # fmt: skip
    first = terminals.reheat_first
    call = calls.heating if first == 1.0 else ops.unit(calls.heating * (1.0 / first))
    rate, water = heat_rate(airflow), terminals.open_water(ops, opening)
    return _Air(call, airflow, rate, terminals.conductance(ops, airflow, rate, water), water[2], mixed, opening)


def _valves(ops: Operations, system: HvacSystem, air: _Air, water: Value) -> _Valves:
    """Set all valves for a water temperature."""
    scalar = ops.scalar
    warmed = tuple([
        handler.warm(scalar, mixed, water, air.opening)
        for handler, mixed in zip(system.air_handlers, air.mixed, strict=True)
    ])  # fmt: skip
    offset = _spread(ops, system, [w.offset for w in warmed])
    slope = _spread(ops, system, [w.slope for w in warmed])
    entering = offset + slope * water
    share = system.terminals.heat_share(ops, air.reheat_call, air.rate, air.coil, entering, water)
    coil = share * air.coil
    conductance, source = ops.dot(coil, 1.0 - slope), ops.dot(coil, offset)
    for k, _ in system.water_coils:
        conductance = conductance + warmed[k].conductance
        source = source + warmed[k].conductance * air.mixed[k].cooled_temperature
    return _Valves(warmed, share, coil, offset, slope, conductance, source)


def _each(values: Value, n: int) -> Value:
    """One value an air handler, where all may have the same."""
    return values if isinstance(values, tuple | list) else (values,) * n


def _spread(ops: Operations, system: HvacSystem, values: list[Value]) -> Value:
    """Give each terminal the value of its air handler."""
    return ops.spread(values, system.terminals.air_handler)


def _or_design(setpoint: Value, design: float) -> Value:
    return design if setpoint is None else setpoint


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
