"""The plant of a building: air handlers, hot-water loop, terminals and thermostats, and one step of all of them."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from thermal.errors import HvacParameterError, describe
from thermal.hvac._air import USUAL_HUMIDITY
from thermal.hvac._air_handler import AirHandler, Mixed, Warmed
from thermal.hvac._boiler import BoilerLoop, Heated
from thermal.hvac._coil import WaterCoil, water_share
from thermal.hvac._operations import Operations, Value
from thermal.hvac._terminals import Terminals, heat_rate
from thermal.hvac._thermostat import Thermostat

_LEAST = 1e-12  # kg/s: return air has a temperature even where nothing flows


class Conditions(NamedTuple):
    """What the plant meets at the start of a step.

    Parameters
    ----------
    zone_temperature : numpy.ndarray, shape (n_zone,)
        Air of the zones [K].
    heating_setpoint, cooling_setpoint : numpy.ndarray, shape (n_zone,)
        Of the thermostats [K].
    outdoor_temperature : float
        [K].
    outdoor_humidity : float
        Humidity ratio outdoors [kg/kg].
    return_humidity : float or tuple of float
        Of the return air [kg/kg], for all air handlers or one each.
    room_temperature : float
        Of the plant room, where pipes and boiler lose heat [K].
    """

    zone_temperature: Value
    heating_setpoint: Value
    cooling_setpoint: Value
    outdoor_temperature: Value
    outdoor_humidity: Value = USUAL_HUMIDITY
    return_humidity: Value = USUAL_HUMIDITY
    room_temperature: Value = 293.15


class Actions(NamedTuple):
    """What a supervisory controller sets for a step; None leaves a pressure at its design value.

    Parameters
    ----------
    supply_air_temperature : float or tuple of float
        Setpoint of the supply air [K], for all air handlers or one each.
    supply_water_temperature : float
        Setpoint of the supply water [K].
    static_pressure : float or tuple of float, optional
        Setpoint of the ducts' static pressure [Pa].
    differential_pressure : float, optional
        Setpoint of the loop's differential pressure [Pa].
    running : float or tuple of float
        1 while the fans of an air handler run, else 0 [-].
    boiler : float
        1 while boiler and pump run, else 0 [-].
    """

    supply_air_temperature: Value
    supply_water_temperature: Value
    static_pressure: Value = None
    differential_pressure: Value = None
    running: Value = 1.0
    boiler: Value = 1.0


class Calls(NamedTuple):
    """Calls of the thermostats, as terminals take them.

    Parameters
    ----------
    heating, cooling : Value
        0 to 1 [-], one a terminal.
    """

    heating: Value
    cooling: Value


class HvacStep(NamedTuple):
    """What the plant did in a step; powers are means over it.

    Parameters
    ----------
    calls : Calls
        Of the thermostats.
    airflow : Value
        Of the terminals [kg/s].
    entering : Value
        Supply air at the terminals [K].
    reheat : Value
        Heat from the water in the terminals [W].
    discharge : Value
        Discharge temperatures [K].
    valve_flow : Value
        Water through the terminals over that of an open valve [-].
    terminal_heat : Value
        Heat into the zone, one a terminal [W]: flow x 1006 J/kg/K x (discharge - zone temperature).
    mixed : tuple of Mixed
        Air side of the air handlers.
    warmed : tuple of Warmed
        Their heating coils.
    supply_temperature : tuple of Value
        Supply air of the air handlers [K].
    loop : Heated
        The hot-water loop.
    water_flow : Value
        Through the pump [kg/s].
    return_water : Value
        Temperature of the water back to the boiler [K].
    pump_power, electric_power, fuel_power : Value
        Of the pump; of everything; fuel of everything, on the higher heating value [W].
    """

    calls: Calls
    airflow: Value
    entering: Value
    reheat: Value
    discharge: Value
    valve_flow: Value
    terminal_heat: Value
    mixed: tuple[Mixed, ...]
    warmed: tuple[Warmed, ...]
    supply_temperature: tuple[Value, ...]
    loop: Heated
    water_flow: Value
    return_water: Value
    pump_power: Value
    electric_power: Value
    fuel_power: Value


class _Air(NamedTuple):
    """What both passes over the water side take from the air side."""

    calls: Calls
    reheat_call: Value
    airflow: Value
    rate: Value
    coil: Value
    mixed: tuple[Mixed, ...]
    opening: Value


class _Valves(NamedTuple):
    """Valves of a pass, and the coils' load ``conductance * T - source`` that follows."""

    warmed: tuple[Warmed, ...]
    share: Value
    offset: Value
    slope: Value
    conductance: Value
    source: Value


@dataclass(frozen=True)
class HvacSystem:
    """Devices of a building's plant and how they hang together.

    Parameters
    ----------
    air_handlers : tuple of AirHandler
        At least one.
    loop : BoilerLoop
        The hot-water loop, which every water coil hangs on.
    terminals : Terminals
        Each served by one of the air handlers.
    thermostat : Thermostat
        Of every zone.
    """

    air_handlers: tuple[AirHandler, ...]
    loop: BoilerLoop
    terminals: Terminals
    thermostat: Thermostat = field(default_factory=Thermostat)

    def __post_init__(self) -> None:
        n = len(self.air_handlers)
        served = set(self.terminals.air_handler.tolist())
        if n == 0 or not served or served != set(range(n)):
            expected = "at least one air handler, each with a terminal of its own"
            advice = "Terminals.air_handler holds positions in air_handlers"
            raise HvacParameterError(describe("HvacSystem", expected, f"{n} of them and terminals at {served}", advice))
        zones = np.unique(self.terminals.zone)
        if len(zones) != zones[-1] + 1:
            missing = sorted(set(range(int(zones[-1]))) - set(zones.tolist()))
            raise HvacParameterError(describe("HvacSystem", "a terminal in each zone", f"none in zones {missing[:8]}"))

    @property
    def zone_count(self) -> int:
        """Zones that terminals serve."""
        return int(self.terminals.zone.max()) + 1

    @cached_property
    def members(self) -> NDArray[np.float64]:
        """Terminals of each air handler as 1 of 0 and 1, (n_terminal, n_air_handler)."""
        return np.eye(len(self.air_handlers))[self.terminals.air_handler]

    @cached_property
    def rooms(self) -> NDArray[np.float64]:
        """Terminals of each zone as 1 of 0 and 1, (n_terminal, n_zone)."""
        return np.eye(self.zone_count)[self.terminals.zone]

    @cached_property
    def one_each(self) -> bool:
        """Whether the first terminal serves the first zone and so on."""
        return bool(np.array_equal(self.terminals.zone, np.arange(self.zone_count)))

    def at_terminals(self, ops: Operations, values: Value) -> Value:
        """Give values of the zones, one a terminal.

        Parameters
        ----------
        ops : Operations
            Arithmetic.
        values : Value
            One a zone.
        """
        return values if self.one_each else ops.pick(values, self.terminals.zone)

    def at_zones(self, ops: Operations, values: Value) -> Value:
        """Sum the terminals' values, one a zone.

        Parameters
        ----------
        ops : Operations
            Arithmetic.
        values : Value
            One a terminal.
        """
        return values if self.one_each else ops.columns(ops.sums(values, self.rooms))


def advance(
    ops: Operations,
    system: HvacSystem,
    water: Value,
    calls: Calls,
    conditions: Conditions,
    actions: Actions,
    step: Value,
) -> HvacStep:
    """Take the plant through a step: the one place where its equations are put together.

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
    Valves are set twice: for the water at the start, then for the temperature that it would reach with them. With
    these the loop's balance is linear in the water's temperature at the end of the step and is solved exactly.
    """
    scalar, loop = ops.scalar, system.loop
    zone = system.at_terminals(ops, conditions.zone_temperature)
    air = _air_side(ops, system, zone, calls, conditions, actions)
    room = conditions.room_temperature
    setpoint, running = actions.supply_water_temperature, actions.boiler
    first = _valves(ops, system, air, water)
    expected = loop.heat(scalar, water, setpoint, running, first.conductance, first.source, 0.0, room, step).water
    valves = first if scalar.equal(expected, water) else _valves(ops, system, air, expected)
    terminals = system.terminals
    valve_flow = water_share(valves.share, terminals.thermal_effectiveness(air.coil, air.opening))
    drawn = ops.total(valve_flow * terminals.water_flow)
    for handler, warmed in zip(system.air_handlers, valves.warmed, strict=True):
        if isinstance(handler.heating, WaterCoil):
            drawn = drawn + warmed.flow_share * handler.heating.water_flow
    pump = loop.pump
    flow = running * scalar.maximum(drawn * air.opening, pump.minimum_share * pump.design_flow, pump.design_flow)
    pump_power = pump.power(flow, _pressure(actions.differential_pressure, pump.differential_pressure))
    heat = pump.heat_to_water * pump_power
    end = loop.heat(scalar, water, setpoint, running, valves.conductance, valves.source, heat, room, step)
    entering = valves.offset + valves.slope * end.water
    reheat = valves.share * air.coil * (end.water - entering)
    discharge = entering + reheat / (air.rate + _LEAST)
    back = loop.returning(end, flow)
    return HvacStep(
        calls, air.airflow, entering, reheat, discharge, valve_flow, air.rate * (discharge - zone), air.mixed,
        valves.warmed, tuple(w.offset + w.slope * end.water for w in valves.warmed), end, flow, back, pump_power,
        _electric(system, air.mixed, valves.warmed) + pump_power,
        loop.fuel(scalar, end.boiler, back) + _direct(system, valves.warmed, False),
    )  # fmt: skip


def _air_side(
    ops: Operations, system: HvacSystem, zone: Value, calls: Calls, conditions: Conditions, actions: Actions
) -> _Air:
    """Flows of the terminals, and the air handlers up to their heating coils."""
    scalar, terminals, handlers = ops.scalar, system.terminals, system.air_handlers
    n = len(handlers)
    statics = [
        _pressure(_one(actions.static_pressure, k), h.supply_fan.static_pressure) for k, h in enumerate(handlers)
    ]
    runs = [_one(actions.running, k) for k in range(n)]
    reaches = [
        run * scalar.sqrt(static / handler.supply_fan.static_pressure)
        for run, static, handler in zip(runs, statics, handlers, strict=True)
    ]
    reach = ops.spread(reaches, terminals.air_handler) if n > 1 else reaches[0]
    airflow = terminals.airflow(ops, calls.heating, calls.cooling, reach)
    weights = airflow + _LEAST
    flows, warmth = ops.sums(weights, system.members), ops.sums(weights * zone, system.members)
    setpoints, humid = actions.supply_air_temperature, conditions.return_humidity
    pump = system.loop.pump
    pressure = _pressure(actions.differential_pressure, pump.differential_pressure)
    opening = actions.boiler * scalar.sqrt(pressure / pump.differential_pressure)
    mixed = tuple(
        handler.mix(
            scalar, flows[k], runs[k], warmth[k] / flows[k], _one(humid, k), conditions.outdoor_temperature,
            conditions.outdoor_humidity, _one(setpoints, k), statics[k], opening,
        )
        for k, handler in enumerate(handlers)
    )  # fmt: skip
    first = terminals.reheat_first
    call = calls.heating if first == 1.0 else ops.minimum(calls.heating * (1.0 / first), 1.0)
    coil = terminals.conductance(ops, airflow, opening)
    return _Air(calls, call, airflow, heat_rate(airflow), coil, mixed, opening)


def _valves(ops: Operations, system: HvacSystem, air: _Air, water: Value) -> _Valves:
    """Set all valves for a water temperature."""
    terminals = system.terminals
    warmed = tuple(
        handler.warm(ops.scalar, mixed, water, air.opening)
        for handler, mixed in zip(system.air_handlers, air.mixed, strict=True)
    )
    offsets, slopes = [w.offset for w in warmed], [w.slope for w in warmed]
    if len(warmed) > 1:
        offset = ops.spread(offsets, terminals.air_handler)
        slope = ops.spread(slopes, terminals.air_handler)
    else:
        offset, slope = offsets[0], slopes[0]
    entering = offset + slope * water
    share = terminals.heat_share(ops, air.reheat_call, air.rate, air.coil, entering, water)
    coil = share * air.coil
    conductance, source = ops.total(coil * (1.0 - slope)), ops.total(coil * offset)
    for mixed, w in zip(air.mixed, warmed, strict=True):
        conductance = conductance + w.conductance
        source = source + w.conductance * mixed.cooled_temperature
    return _Valves(warmed, share, offset, slope, conductance, source)


def _one(values: Value, k: int) -> Value:
    """Return an air handler's value, where all may have the same or one each."""
    return values[k] if isinstance(values, tuple | list) else values


def _pressure(setpoint: Value, design: float) -> Value:
    return design if setpoint is None else setpoint


def _direct(system: HvacSystem, warmed: tuple[Warmed, ...], electric: bool) -> Value:
    """Power of heating coils that burn gas, or of those that are electric [W]."""
    power: Value = 0.0
    for handler, w in zip(system.air_handlers, warmed, strict=True):
        heater = handler.heating
        if heater is not None and not isinstance(heater, WaterCoil) and heater.electric == electric:
            power = power + w.direct / heater.efficiency
    return power


def _electric(system: HvacSystem, mixed: tuple[Mixed, ...], warmed: tuple[Warmed, ...]) -> Value:
    """Electric power of the air handlers [W]."""
    power = _direct(system, warmed, True)
    for m in mixed:
        power = power + m.cooling_power + m.supply_fan_power + m.exhaust_fan_power
    return power
