"""One step of a plant: the one place where the equations of its devices are put together."""

from __future__ import annotations

from thermal.hvac._central import Central, DirectCentral
from thermal.hvac._coil import water_share
from thermal.hvac._operations import Operations, Value
from thermal.hvac._settings import Settings
from thermal.hvac._step import Calls, Conditions, HvacStep
from thermal.hvac._system import HvacSystem
from thermal.hvac._terminals import heat_rate


def advance(
    ops: Operations,
    system: HvacSystem,
    water: Value,
    calls: Calls,
    conditions: Conditions,
    settings: Settings,
    step: Value,
    central: Central | None = None,
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
    central : Central, optional
        What takes the central devices through it; their equations as they stand by default.

    Notes
    -----
    Valves are set for the warmest water that the step can bring, so that no discharge temperature passes its limit.
    With these the loop's balance is linear in the water's temperature at the end of the step and is solved exactly.
    While the water is colder than that - a boiler at its capacity, a setpoint that falls - coils give a little less
    than their valves could let them.
    """
    terminals, members, index = system.terminals, system.members, system.terminals.air_handler
    devices = DirectCentral(ops.scalar, system) if central is None else central
    zone = system.at_terminals(ops, conditions.zone_temperature)
    airflow = terminals.airflow(ops, calls.heating, calls.cooling, settings.most_airflow)
    flows, warmth = ops.sums(airflow, members), ops.sums(airflow * zone, members)
    supplied = devices.supply(flows, warmth, water, conditions, settings, step)
    rate, side = heat_rate(airflow), terminals.open_water(ops, settings.opening)
    open_, call = terminals.conductance(ops, airflow, rate, side), terminals.reheat_call(ops, calls.heating)
    coil = terminals.throttled(ops, call, rate, open_, ops.spread(supplied.allowances, index))
    valve_flow = water_share(coil, open_, side.curve)
    reheated, drawn = ops.sums(coil, members), ops.dot(valve_flow, terminals.water_flow)
    heated = devices.circulate(supplied, reheated, drawn)
    entering = ops.spread(heated.supply_temperature, index)
    reheat = coil * (heated.loop.water - entering)
    return HvacStep(
        airflow, entering, reheat, valve_flow, rate * (entering - zone) + reheat, supplied.mixed, supplied.warmed,
        tuple(heated.supply_temperature), heated.loop, heated.water_flow, heated.return_water, heated.pump_power,
        heated.electric_power, heated.fuel_power,
    )  # fmt: skip
