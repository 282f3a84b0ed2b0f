"""One step of a plant: the one place where the equations of its devices are put together."""

from __future__ import annotations

from typing import NamedTuple

from thermal.hvac._air_handler import Mixed, Warmed
from thermal.hvac._coil import Characteristic, water_share
from thermal.hvac._operations import Operations, Value
from thermal.hvac._settings import Settings
from thermal.hvac._step import Calls, Conditions, HvacStep
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


class _Valves(NamedTuple):
    """Valves, and the coils' load ``conductance * T - source`` that follows."""

    warmed: tuple[Warmed, ...]
    coil: Value
    conductance: Value
    source: Value


def advance(
    ops: Operations,
    system: HvacSystem,
    water: Value,
    calls: Calls,
    conditions: Conditions,
    settings: Settings,
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
    settings : Settings
        Actions for the step, as `settings_of` lays them out.
    step : Value
        Its length [s].

    Notes
    -----
    Valves are set for the warmest water that the step can bring, so that no discharge temperature passes its limit.
    With these the loop's balance is linear in the water's temperature at the end of the step and is solved exactly.
    While the water is colder than that - a boiler at its capacity, a setpoint that falls - coils give a little less
    than their valves could let them.
    """
    scalar, loop, pump, terminals = ops.scalar, system.loop, system.loop.pump, system.terminals
    zone = system.at_terminals(ops, conditions.zone_temperature)
    air = _air_side(ops, system, zone, calls, conditions, settings)
    setpoint, running, room = settings.supply_water, settings.boiler, conditions.room_temperature
    warmest = scalar.maximum(water, running * loop.goal(scalar, water, setpoint, step))
    valves = _valves(ops, system, air, settings.opening, warmest)
    valve_flow = water_share(valves.coil, air.coil, air.curve)
    drawn = ops.dot(valve_flow, terminals.water_flow)
    for k, coil in system.water_coils:
        drawn = drawn + valves.warmed[k].flow_share * coil.water_flow
    least = pump.minimum_share * pump.design_flow
    flow = running * scalar.maximum(drawn * settings.opening, least, pump.design_flow)
    pump_power = pump.power(flow, settings.differential_pressure)
    heat = pump.heat_to_water * pump_power
    end = loop.heat(scalar, water, setpoint, running, valves.conductance, valves.source, heat, room, step)
    supply = tuple([w.offset + w.slope * end.water for w in valves.warmed])
    entering = ops.spread(supply, terminals.air_handler)
    reheat = valves.coil * (end.water - entering)
    back = loop.returning(end, flow)
    electric, fuel = _powers(system, air.mixed, valves.warmed)
    return HvacStep(
        air.airflow, entering, reheat, valve_flow, air.rate * (entering - zone) + reheat, air.mixed, valves.warmed,
        supply, end, flow, back, pump_power, electric + pump_power, loop.fuel(scalar, end.boiler, back) + fuel,
    )  # fmt: skip


def _air_side(
    ops: Operations, system: HvacSystem, zone: Value, calls: Calls, conditions: Conditions, settings: Settings
) -> _Air:
    """Flows of the terminals, and the air handlers up to their heating coils."""
    scalar, terminals, members, opening = ops.scalar, system.terminals, system.members, settings.opening
    airflow = terminals.airflow(ops, calls.heating, calls.cooling, settings.most_airflow)
    outdoor, damp, humid = conditions.outdoor_temperature, conditions.outdoor_humidity, conditions.return_humidity
    humidities = humid if isinstance(humid, tuple | list) else (humid,) * len(system.air_handlers)
    rows = zip(
        system.air_handlers, ops.sums(airflow, members), ops.sums(airflow * zone, members), settings.running,
        humidities, settings.supply_air, settings.static_pressure, settings.ventilation, strict=True,
    )  # fmt: skip
    mixed = tuple([
        handler.mix(scalar, flow, run, warmth / flow, humidity, outdoor, damp, setpoint, static, opening, ventilation)
        for handler, flow, warmth, run, humidity, setpoint, static, ventilation in rows
    ])  # fmt: skip
    rate, water = heat_rate(airflow), terminals.open_water(ops, opening)
    coil = terminals.conductance(ops, airflow, rate, water)
    return _Air(terminals.reheat_call(ops, calls.heating), airflow, rate, coil, water.curve, mixed)


def _valves(ops: Operations, system: HvacSystem, air: _Air, opening: Value, water: Value) -> _Valves:
    """Set all valves for a water temperature."""
    scalar, terminals = ops.scalar, system.terminals
    warmed = tuple([
        handler.warm(scalar, mixed, water, opening)
        for handler, mixed in zip(system.air_handlers, air.mixed, strict=True)
    ])  # fmt: skip
    allowances = [terminals.allowance(scalar, w.offset + w.slope * water, water) for w in warmed]
    allowance = ops.spread(allowances, terminals.air_handler)
    coil = terminals.throttled(ops, air.reheat_call, air.rate, air.coil, allowance)
    conductance: Value = 0.0
    source: Value = 0.0
    for total, w in zip(ops.sums(coil, system.members), warmed, strict=True):
        conductance = conductance + total * (1.0 - w.slope)
        source = source + total * w.offset
    for k, _ in system.water_coils:
        conductance = conductance + warmed[k].conductance
        source = source + warmed[k].conductance * air.mixed[k].cooled_temperature
    return _Valves(warmed, coil, conductance, source)


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
