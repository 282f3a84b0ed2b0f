"""Sub-systems by themselves, driven by what was measured around them, to tell where a gap arises.

Each function takes time series of one sub-system's surroundings and gives what the model makes of them, over all times
at once.
"""

from typing import NamedTuple

import numpy as np

from thermal._types import FloatArray
from thermal.components.air_handler import AirHandler, Mixed
from thermal.components.boiler_loop import BoilerLoop
from thermal.components.component import Conditions
from thermal.components.operations import FloatOperations, NumpyOperations
from thermal.components.streams import AirCommand, AirDrawn, WaterDrawn
from thermal.components.terminals import Terminals
from thermal.components.water_coil import LEAST_FLOW, WaterCoil, heat_share, valve_flow, water_share
from thermal.units import AIR_HEAT_CAPACITY

_LEAST = 1e-9


class TerminalReplay(NamedTuple):
    """Terminals under measured commands.

    Parameters
    ----------
    airflow : numpy.ndarray, shape (n_time, n_terminal)
        Supply air [kg/s].
    discharge : numpy.ndarray, shape (n_time, n_terminal)
        Discharge temperatures [K].
    reheat : numpy.ndarray, shape (n_time, n_terminal)
        Heat from the water [W].
    water_flow : numpy.ndarray, shape (n_time, n_terminal)
        Hot water [kg/s].
    """

    airflow: FloatArray
    discharge: FloatArray
    reheat: FloatArray
    water_flow: FloatArray


class AirHandlerReplay(NamedTuple):
    """An air handler under measured air and setpoints.

    Parameters
    ----------
    mixed : Mixed
        Its air, cooling and fans, each of shape (n_time,).
    supply_temperature : numpy.ndarray, shape (n_time,)
        Supply air [K].
    heating : numpy.ndarray, shape (n_time,)
        Heat of its heating coil [W].
    fuel_power, electric_power : numpy.ndarray, shape (n_time,)
        Taken up, but for the hot water [W].
    water_flow : numpy.ndarray, shape (n_time,)
        Hot water [kg/s].
    """

    mixed: Mixed
    supply_temperature: FloatArray
    heating: FloatArray
    fuel_power: FloatArray
    electric_power: FloatArray
    water_flow: FloatArray


class LoopReplay(NamedTuple):
    """A hot-water loop under a measured load.

    Parameters
    ----------
    supply_temperature, return_temperature : numpy.ndarray, shape (n_time,)
        Of the water [K].
    boiler : numpy.ndarray, shape (n_time,)
        Heat into the water [W].
    fuel_power, pump_power : numpy.ndarray, shape (n_time,)
        Taken up [W].
    """

    supply_temperature: FloatArray
    return_temperature: FloatArray
    boiler: FloatArray
    fuel_power: FloatArray
    pump_power: FloatArray


def replay_terminals(
    terminals: Terminals,
    damper: FloatArray,
    valve: FloatArray,
    entering: FloatArray,
    water: FloatArray,
    static_pressure_share: FloatArray | float = 1.0,
    differential_pressure_share: FloatArray | float = 1.0,
) -> TerminalReplay:
    """Replay terminals under measured commands.

    Parameters
    ----------
    terminals : Terminals
        The terminals.
    damper, valve : numpy.ndarray, shape (n_time, n_terminal)
        Positions [-], 0 closed to 1 open.
    entering : numpy.ndarray, shape (n_time, n_terminal)
        Supply air at the terminals [K].
    water : numpy.ndarray, shape (n_time,)
        Supply water [K].
    static_pressure_share : numpy.ndarray or float
        Static pressure in the duct over its design value [-], shape (n_time, n_terminal) or one.
    differential_pressure_share : numpy.ndarray or float
        Differential pressure of the loop over its design value [-], shape (n_time,) or one.

    Returns
    -------
    TerminalReplay
        Flows and temperatures that follow.
    """
    ops = NumpyOperations()
    airflow = damper * terminals.design_flow * np.sqrt(static_pressure_share) + LEAST_FLOW
    opening = np.broadcast_to(np.sqrt(differential_pressure_share), np.shape(water))[:, np.newaxis]
    rate, open_water = AIR_HEAT_CAPACITY * airflow, terminals.open_water(ops, opening)
    coil = terminals.conductance(ops, airflow, rate, open_water)
    share = valve_flow(ops, np.asarray(valve), terminals.rangeability)
    part = heat_share(ops, share, coil, open_water.curve)
    reheat = part * coil * (np.asarray(water)[:, np.newaxis] - entering)
    discharge = entering + reheat / rate
    return TerminalReplay(airflow, discharge, reheat, share * opening * terminals.water_flow)


def replay_reheat(
    terminals: Terminals, airflow: FloatArray, entering: FloatArray, discharge: FloatArray, water: FloatArray
) -> TerminalReplay:
    """Find what terminals do to hold measured discharge temperatures, as far as their coils can.

    Parameters
    ----------
    terminals : Terminals
        The terminals.
    airflow : numpy.ndarray, shape (n_time, n_terminal)
        Supply air [kg/s].
    entering, discharge : numpy.ndarray, shape (n_time, n_terminal)
        Supply air, and the discharge air wanted [K]; what is colder than the supply air asks for nothing.
    water : numpy.ndarray, shape (n_time,)
        Supply water [K].

    Returns
    -------
    TerminalReplay
        Discharge temperatures reached, heat and water that it takes.
    """
    ops = NumpyOperations()
    airflow = airflow + LEAST_FLOW
    rate, open_water = AIR_HEAT_CAPACITY * airflow, terminals.open_water(ops, 1.0)
    coil = terminals.conductance(ops, airflow, rate, open_water)
    ready = coil * np.maximum(np.asarray(water)[:, np.newaxis] - entering, 0.0)
    wanted = rate * np.maximum(discharge - entering, 0.0)
    reheat = np.minimum(wanted, ready)
    part = reheat / (ready + _LEAST)
    flow = water_share(part * coil, coil, open_water.curve) * terminals.water_flow
    return TerminalReplay(airflow, entering + reheat / rate, reheat, flow)


def replay_air_handler(
    handler: AirHandler,
    flow: FloatArray,
    returning: FloatArray,
    conditions: Conditions,
    command: AirCommand,
    water: FloatArray | float = 355.35,
) -> AirHandlerReplay:
    """Replay an air handler under measured air and setpoints.

    Parameters
    ----------
    handler : AirHandler
        The air handler.
    flow : numpy.ndarray, shape (n_time,)
        Supply air [kg/s]; its fans run where that is above 0.
    returning : numpy.ndarray, shape (n_time,)
        Return air [K].
    conditions : Conditions
        Outdoor air and humidity of the return air, of shape (n_time,) or one; zones have no part in it.
    command : AirCommand
        Setpoints and ventilation, of shape (n_time,) or one; without a pressure the design value holds.
    water : numpy.ndarray or float
        Supply water of a water coil [K], shape (n_time,) or one.

    Returns
    -------
    AirHandlerReplay
        Temperatures and powers that follow.
    """
    ops, n = NumpyOperations(), len(flow)
    running, flow, pressure = (flow > 0.0) * 1.0, flow + LEAST_FLOW, command.supply_air_static_pressure_setpoint
    command = command._replace(
        fan_running=running,
        supply_air_static_pressure_setpoint=handler.design_pressure if pressure is None else pressure,
    )
    mixed = handler.mix(ops, AirDrawn(flow, flow * returning), conditions, command, 1.0)
    warmed = handler.warm(ops, mixed, water, 1.0)
    heating = warmed.direct + warmed.conductance * (water - mixed.cooled_temperature) + np.zeros(n)
    electric, fuel = handler.powers(mixed, warmed)
    drawn = warmed.flow_share * handler.heating.water_flow if isinstance(handler.heating, WaterCoil) else np.zeros(n)
    supply = warmed.offset + warmed.slope * water
    return AirHandlerReplay(mixed, supply, heating, fuel + np.zeros(n), electric, drawn)


def replay_loop(
    loop: BoilerLoop,
    load: FloatArray,
    water_flow: FloatArray,
    setpoint: FloatArray,
    step: float,
    start: float,
    room: float = 293.15,
    differential_pressure: FloatArray | float | None = None,
) -> LoopReplay:
    """Replay a hot-water loop under a measured load.

    Parameters
    ----------
    loop : BoilerLoop
        Boiler, pump and pipes.
    load : numpy.ndarray, shape (n_time,)
        Heat that coils took [W].
    water_flow : numpy.ndarray, shape (n_time,)
        Water through the coils [kg/s]; where it is 0 the pump is off.
    setpoint : numpy.ndarray, shape (n_time,)
        Of the supply water [K].
    step : float
        Time step [s].
    start : float
        Supply water at the start [K].
    room : float
        Temperature of the plant room [K].
    differential_pressure : numpy.ndarray or float, optional
        At the pump's sensor [Pa], shape (n_time,) or one; the design value by default.

    Returns
    -------
    LoopReplay
        Temperatures and powers that follow.
    """
    ops, pump = FloatOperations(), loop.pump
    pressure = pump.differential_pressure if differential_pressure is None else differential_pressure
    flow = pump.flow(NumpyOperations(), water_flow, (water_flow > 0.0) * 1.0)
    power = np.asarray(pump.power(flow, pressure))
    rows, water = [], start
    for k, (taken, target, through, pumped) in enumerate(
        zip(load.tolist(), setpoint.tolist(), flow.tolist(), power.tolist(), strict=True)
    ):
        drawn, goal = WaterDrawn(0.0, -taken, through), loop.goal(ops, water, target, step)
        most = loop.capacity * float(through > 0.0)
        end = loop.heat(ops, water, goal, most, drawn, pump.heat_to_water * pumped, room, step)
        back = loop.returning(end, through)
        rows.append((end.water, back, end.produced, loop.fuel(ops, end.produced, back), power[k]))
        water = end.water
    return LoopReplay(*np.array(rows).T)
