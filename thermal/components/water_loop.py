"""A water loop: its water, pipes and pump, with something that heats or chills it."""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass
from typing import Annotated, ClassVar, NamedTuple, TypedDict

from thermal.components.checks import in_range
from thermal.components.component import Component, Conditions, Given, Range, Run
from thermal.components.energy_balance import EnergyBalance
from thermal.components.moist_air import WATER_DENSITY, WATER_HEAT_CAPACITY
from thermal.components.operations import Operations, Value
from thermal.components.pump import Pump
from thermal.components.streams import HotWater, SupplyWater, WaterDrawn

_LEAST = 1e-9
_LEAST_PIPES = 20.0  # W/K
SHORT_PIPES = 5.0  # W/K: 25 m of insulated pipe of a house, 0.2 W/m/K (EN 15316-3)
_LITRES = 0.01  # m3 of water per kW, usual for loops of steel pipe


class Pipes(TypedDict):
    """Water and pipes of a loop as named parameters of `WaterLoop`."""

    pipe_conductance: float
    standing_conductance: float
    water_volume: float


class Heated(NamedTuple):
    """The water of a loop after a step.

    Parameters
    ----------
    water : Value
        Temperature of the supply water [K].
    produced : Value
        Heat into the water, of what makes it; negative where it is chilled [W].
    load : Value
        Heat from the water to the coils [W].
    loss : Value
        Heat from pipes and jacket to the plant room [W].
    storage : Value
        Heat kept in the water [W].
    """

    water: Value
    produced: Value
    load: Value
    loss: Value
    storage: Value


class Production(NamedTuple):
    """What making the heat took.

    Parameters
    ----------
    electric_power, fuel_power : Value
        Without the pump; fuel on the higher heating value [W].
    duty : Value
        Share of the step that the machine ran [-].
    """

    electric_power: Value = 0.0
    fuel_power: Value = 0.0
    duty: Value = 1.0


class LoopStep(NamedTuple):
    """What a loop did in a step; powers are means over it.

    Parameters
    ----------
    supply_water_temperature, return_water_temperature : Value
        At the end of the step: to those that draw, and back from them [K].
    water_flow : Value
        Through the pump [kg/s].
    produced, load, loss, storage : Value
        As in `Heated` [W].
    pump_power, fuel_power, electric_power : Value
        Of the pump; fuel on the higher heating value; all electricity, with the pump's [W].
    outdoors : Value
        Heat that what makes it gives off, through flue or condenser; negative where it takes it from outdoors [W].
    duty : Value
        As in `Production` [-].
    """

    supply_water_temperature: Value
    return_water_temperature: Value
    water_flow: Value
    produced: Value
    load: Value
    loss: Value
    storage: Value
    pump_power: Value
    fuel_power: Value
    electric_power: Value
    outdoors: Value
    duty: Value

    @property
    def chilled_water_temperature(self) -> Value:
        """Supply water of a loop that chills [K]: the name of its state."""
        return self.supply_water_temperature


@dataclass(frozen=True)
class WaterLoop(Component):
    """Water that is held at a setpoint and pumped to those that draw from it; the base of what makes it warm or cold.

    A class of its own declares ports, one state, actuators - setpoint, pressure and switch - and sensors among those
    that `read` knows, and says what it `can` bring and what that `takes`.

    Parameters
    ----------
    capacity : float
        Rated heat, or cold, into the water [W], positive.
    pump : Pump
        Of the loop.
    standing_conductance : float
        From the jacket to the plant room [W/K], not negative.
    pipe_conductance : float
        From the pipes to the plant room [W/K], not negative.
    water_volume : float
        Of jacket and pipes [m3], positive: the loop's thermal mass.
    fastest_rise : float
        Largest change of the supply water's temperature that is aimed at [K/s]; the default is 2 K a minute, which
        spares a boiler thermal shock.

    Notes
    -----
    The water's balance is taken at the end of the step, with valves as they stand in it: unconditionally stable, and
    ``C (T - T_before) / dt = Q + P_pump - load(T) - loss(T)`` holds exactly.
    """

    #: Whether it chills: its heat is negative, and setpoints are reached from above.
    chills: ClassVar[bool] = False
    #: Name of the port that it supplies.
    supply: ClassVar[str] = "hot_water"

    capacity: Annotated[float, Range("W", 1.0, 1e8)]
    pump: Pump
    _: KW_ONLY
    standing_conductance: Annotated[float, Range("W/K", 0.0, 1e5)] = 10.0
    pipe_conductance: Annotated[float, Range("W/K", 0.0, 1e8)] = 40.0
    water_volume: Annotated[float, Range("m3", 1e-4, 1e4)] = 1.0
    fastest_rise: Annotated[float, Range("K/s", 1e-4, 1e3)] = 2.0 / 60.0

    def __post_init__(self) -> None:
        super().__post_init__()
        # beyond this the least flow would come back colder than the plant room
        highest = 0.5 * self.pump.minimum_share * self.pump.design_flow * WATER_HEAT_CAPACITY
        in_range(f"{type(self).__name__}.pipe_conductance", self.pipe_conductance, "W/K", 0.0, highest)

    @staticmethod
    def pipes(capacity: float, water_flow: float, least: float = _LEAST_PIPES) -> Pipes:
        """Size water and pipes, as named parameters.

        Parameters
        ----------
        capacity : float
            Largest heat [W].
        water_flow : float
            Through the open valves of all that draw from the loop [kg/s].
        least : float
            Conductance that short pipes have too [W/K].
        """
        pump, pipes = Pump(water_flow), max(least, 1e-3 * capacity / 10.0)
        most = 0.4 * pump.minimum_share * pump.design_flow * WATER_HEAT_CAPACITY
        return {
            "pipe_conductance": min(pipes, most), "standing_conductance": 0.25 * pipes,
            "water_volume": max(0.05, _LITRES * capacity / 1000.0),
        }  # fmt: skip

    @property
    def design_pressure(self) -> float:
        """Differential pressure that holds where none is set [Pa]."""
        return self.pump.differential_pressure

    @property
    def heat_capacity(self) -> float:
        """Of the water [J/K]."""
        return self.water_volume * WATER_DENSITY * WATER_HEAT_CAPACITY

    def can(self, ops: Operations, conditions: Conditions, water: Value) -> Value:
        """Most heat, or cold, that it can bring [W].

        Parameters
        ----------
        ops : Operations
            Arithmetic.
        conditions : Conditions
            Of the step.
        water : Value
            Temperature that the water is made with [K].
        """
        return self.capacity

    def takes(
        self, ops: Operations, conditions: Conditions, produced: Value, water: Value, back: Value
    ) -> Production:
        """Tell what it takes to bring heat, or cold.

        Parameters
        ----------
        ops : Operations
            Arithmetic.
        conditions : Conditions
            Of the step.
        produced : Value
            Heat or cold [W], not negative.
        water, back : Value
            Temperatures that the water is made with, and comes back with [K].
        """
        raise NotImplementedError

    def run(self, ops: Operations, given: Given) -> Run:
        """Offer water, hear what is drawn, and heat or chill it.

        Parameters
        ----------
        ops : Operations
            Arithmetic.
        given : Given
            Setpoints, the water's temperature before, and the plant room's.
        """
        pump, conditions, port, (before,) = self.pump, given.conditions, self.supply, given.state.values()
        setpoint, pressure, running = given.actions.values()
        goal = self.goal(ops, before, setpoint, given.seconds)
        opening = running * ops.sqrt(pressure / pump.differential_pressure)
        if self.chills:
            reach = ops.minimum(before, running * goal + (1.0 - running) * before)
        else:
            reach = ops.maximum(before, running * goal)
        given.put(port, HotWater(opening, reach))
        drawn: WaterDrawn = yield port
        flow = pump.flow(ops, drawn.flow * opening, running)
        power = pump.power(flow, pressure)
        most = running * self.can(ops, conditions, goal)
        room = conditions.room_temperature
        end = self.heat(ops, before, goal, most, drawn, pump.heat_to_water * power, room, given.seconds)
        given.put(port, SupplyWater(end.water))
        back = self.returning(end, flow)
        took = self.takes(ops, conditions, -end.produced if self.chills else end.produced, goal, back)
        return LoopStep(
            end.water, back, flow, end.produced, end.load, end.loss, end.storage, power, took.fuel_power,
            took.electric_power + power, took.electric_power + took.fuel_power - end.produced, took.duty,
        )  # fmt: skip

    def goal(self, ops: Operations, before: Value, setpoint: Value, step: Value) -> Value:
        """Temperature of the supply water that is aimed at in a step [K].

        Parameters
        ----------
        ops : Operations
            Arithmetic.
        before : Value
            Supply water at the start [K].
        setpoint : Value
            Of the supply water [K].
        step : Value
            Length of the step [s].
        """
        if self.chills:
            return ops.maximum(setpoint, before - self.fastest_rise * step)
        return ops.minimum(setpoint, before + self.fastest_rise * step)

    def heat(
        self,
        ops: Operations,
        before: Value,
        goal: Value,
        most: Value,
        drawn: WaterDrawn,
        pump_heat: Value,
        room: Value,
        step: Value,
    ) -> Heated:
        """Advance the loop by a step.

        Parameters
        ----------
        ops : Operations
            Arithmetic.
        before : Value
            Supply water at the start [K].
        goal : Value
            Temperature of the supply water that is aimed at [K].
        most : Value
            Most heat, or cold, that can be brought [W].
        drawn : WaterDrawn
            The load ``G T - H`` [W].
        pump_heat : Value
            From the pump into the water [W].
        room : Value
            Temperature of the plant room [K].
        step : Value
            Length of the step [s].
        """
        inertia = self.heat_capacity / step
        leak = self.standing_conductance + self.pipe_conductance
        conductance, source = drawn.conductance, drawn.source
        wanted = inertia * (goal - before) + conductance * goal - source + leak * (goal - room) - pump_heat
        lowest, highest = (-most, 0.0) if self.chills else (0.0, most)
        produced = ops.clip(wanted, lowest, highest, self.capacity)
        water = (inertia * before + produced + source + leak * room + pump_heat) / (inertia + conductance + leak)
        load, loss = conductance * water - source, leak * (water - room)
        return Heated(water, produced, load, loss, inertia * (water - before))

    def returning(self, heated: Heated, flow: Value) -> Value:
        """Temperature of the water that comes back [K].

        Parameters
        ----------
        heated : Heated
            The loop after the step.
        flow : Value
            Through the pump [kg/s].
        """
        pipes = self.pipe_conductance / (self.standing_conductance + self.pipe_conductance + _LEAST) * heated.loss
        # flow over its square: water that stands still comes back as it is
        return heated.water - (heated.load + pipes) * flow / (WATER_HEAT_CAPACITY * flow * flow + _LEAST)

    def energy(self, conditions: Conditions, done: LoopStep) -> EnergyBalance:
        """Where the energy of a step went.

        Parameters
        ----------
        conditions : Conditions
            Of the step.
        done : LoopStep
            What `run` returned.
        """
        room = done.loss + (1.0 - self.pump.heat_to_water) * done.pump_power
        return EnergyBalance(
            electricity=done.electric_power, fuel=done.fuel_power, condenser=done.outdoors, plant_room=room,
            storage=done.storage,
        )  # fmt: skip

    def read(self, ops: Operations, given: Given, done: LoopStep) -> list[Value]:
        """Values of its points.

        Parameters
        ----------
        ops : Operations
            Arithmetic.
        given : Given
            As `run` had it.
        done : LoopStep
            What `run` returned.
        """
        setpoint, pressure, running = given.actions.values()
        read = {
            "supply_water_temperature_setpoint": setpoint,
            "supply_water_temperature_sensor": done.supply_water_temperature,
            "return_water_temperature_sensor": done.return_water_temperature,
            "chilled_supply_water_temperature_sensor": done.supply_water_temperature,
            "chilled_return_water_temperature_sensor": done.return_water_temperature,
            "gas_power_sensor": done.fuel_power,
            "heating_power_sensor": done.fuel_power,
            "electrical_power_sensor": done.electric_power,
            "pump_power_sensor": done.pump_power,
            "differential_pressure_setpoint": pressure,
            "differential_pressure_sensor": running * pressure,
        }
        return [read[point] for point in self.sensors]
