"""The plant of a building: air handlers, hot-water loop, terminals and thermostats, and one step of all of them."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from thermal.errors import HvacParameterError, describe
from thermal.hvac._air import USUAL_HUMIDITY
from thermal.hvac._air_handler import AirHandler, Heater, Mixed, Warmed
from thermal.hvac._boiler import BoilerLoop, Heated
from thermal.hvac._coil import Characteristic, WaterCoil, water_share
from thermal.hvac._operations import Operations, Value
from thermal.hvac._terminals import Terminals, heat_rate
from thermal.hvac._thermostat import Thermostat


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
    ventilation : float or tuple of float
        Share of an air handler's minimum of outdoor air that is asked for [-]: 1 while there are people.
    """

    supply_air_temperature: Value
    supply_water_temperature: Value
    static_pressure: Value = None
    differential_pressure: Value = None
    running: Value = 1.0
    boiler: Value = 1.0
    ventilation: Value = 1.0


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

    @cached_property
    def static_pressures(self) -> tuple[float, ...]:
        """Design static pressures of the air handlers [Pa]."""
        return tuple(handler.supply_fan.static_pressure for handler in self.air_handlers)

    @cached_property
    def water_coils(self) -> tuple[tuple[int, WaterCoil], ...]:
        """Positions of the air handlers with a water coil, and the coils."""
        return tuple((k, h.heating) for k, h in enumerate(self.air_handlers) if isinstance(h.heating, WaterCoil))

    @cached_property
    def heaters(self) -> tuple[tuple[int, Heater], ...]:
        """Positions of the air handlers with a coil that is no water coil, and the coils."""
        return tuple((k, h.heating) for k, h in enumerate(self.air_handlers) if isinstance(h.heating, Heater))

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
