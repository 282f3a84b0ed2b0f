"""The hot-water loop: boiler, water and pipes, with its pump."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, NamedTuple

from thermal.components.checks import in_range
from thermal.components.component import Actuator, Component, Conditions, Given, Port, Range, Run, State
from thermal.components.curves import ORDINARY_BOILER, Biquadratic, celsius
from thermal.components.energy_balance import EnergyBalance
from thermal.components.moist_air import WATER_DENSITY, WATER_HEAT_CAPACITY
from thermal.components.operations import Operations, Value
from thermal.components.pump import Pump
from thermal.components.streams import HotWater, SupplyWater, WaterDrawn

_LEAST = 1e-9
_LEAST_PIPES = 20.0  # W/K
_LITRES = 0.01  # m3 of water per kW of boiler, usual for loops of steel pipe


class Heated(NamedTuple):
    """The water of a loop after a step.

    Parameters
    ----------
    water : Value
        Temperature of the supply water [K].
    boiler : Value
        Heat from the boiler into the water [W].
    load : Value
        Heat from the water to the coils [W].
    loss : Value
        Heat from pipes and jacket to the plant room [W].
    storage : Value
        Heat kept in the water [W].
    """

    water: Value
    boiler: Value
    load: Value
    loss: Value
    storage: Value


class LoopStep(NamedTuple):
    """What a hot-water loop did in a step; powers are means over it.

    Parameters
    ----------
    supply_water_temperature, return_water_temperature : Value
        At the end of the step: from the boiler, and back to it [K].
    water_flow : Value
        Through the pump [kg/s].
    boiler, load, loss, storage : Value
        As in `Heated` [W].
    pump_power, fuel_power : Value
        Of the pump; of the boiler, on the higher heating value [W].
    """

    supply_water_temperature: Value
    return_water_temperature: Value
    water_flow: Value
    boiler: Value
    load: Value
    loss: Value
    storage: Value
    pump_power: Value
    fuel_power: Value

    @property
    def electric_power(self) -> Value:
        """Electric power [W]."""
        return self.pump_power


@dataclass(frozen=True)
class BoilerLoop(Component):
    """A boiler and its hot-water loop.

    Parameters
    ----------
    capacity : float
        Largest heat into the water [W], positive.
    pump : Pump
        Of the loop.
    efficiency : float
        Nominal, on the higher heating value [-], 0.5 to 1. The default is the Large Office's.
    efficiency_curve : Biquadratic
        Efficiency over the nominal one, of part load [-] and return water [degC]; `CONDENSING_BOILER` condenses.
    standing_conductance : float
        From the boiler's jacket to the plant room [W/K], not negative.
    pipe_conductance : float
        From the pipes to the plant room [W/K], not negative.
    water_volume : float
        Of boiler and pipes [m3], positive: the loop's thermal mass.
    fastest_rise : float
        Largest rise of the supply water's temperature [K/s]; the default is 2 K a minute, which spares a boiler
        thermal shock.

    Notes
    -----
    The water's balance is taken at the end of the step, with valves as they stand in it: unconditionally stable, and
    ``C (T - T_before) / dt = Q_boiler + P_pump - load(T) - loss(T)`` holds exactly.
    """

    label, device = "boiler", "boiler"
    ports = (
        Port("hot_water", "water", "kg/s", supplies=True),
        Port("electric_power", "electricity", "W"),
        Port("fuel_power", "fuel", "W"),
    )
    states = (State("supply_water_temperature", "K", 273.15, 373.15, 320.0),)
    actuators = (
        # water that is neither frozen nor steam; the usual range is that of the paper's simulator
        Actuator("supply_water_temperature_setpoint", "K", 278.15, 373.15, (310.0, 355.0)),
        Actuator("differential_pressure_setpoint", "Pa", 1e3, 6e5, (5_000.0, 150_000.0), "design_pressure"),
        Actuator("boiler_running", "-", 0.0, 1.0, default=1.0),
    )
    sensors = (
        "supply_water_temperature_setpoint", "supply_water_temperature_sensor", "return_water_temperature_sensor",
        "gas_power_sensor", "pump_power_sensor", "differential_pressure_setpoint", "differential_pressure_sensor",
    )  # fmt: skip

    capacity: Annotated[float, Range("W", 1.0, 1e8)]
    pump: Pump
    efficiency: Annotated[float, Range("-", 0.5, 1.0)] = 0.78
    efficiency_curve: Biquadratic = ORDINARY_BOILER
    standing_conductance: Annotated[float, Range("W/K", 0.0, 1e5)] = 10.0
    pipe_conductance: Annotated[float, Range("W/K", 0.0, 1e8)] = 40.0
    water_volume: Annotated[float, Range("m3", 1e-4, 1e4)] = 1.0
    fastest_rise: Annotated[float, Range("K/s", 1e-4, 1e3)] = 2.0 / 60.0

    def __post_init__(self) -> None:
        super().__post_init__()
        # beyond this the least flow would come back colder than the plant room
        highest = 0.5 * self.pump.minimum_share * self.pump.design_flow * WATER_HEAT_CAPACITY
        in_range("BoilerLoop.pipe_conductance", self.pipe_conductance, "W/K", 0.0, highest)

    @classmethod
    def sized(cls, capacity: float, water_flow: float) -> BoilerLoop:
        """Size boiler, pump and pipes.

        Parameters
        ----------
        capacity : float
            Largest heat [W].
        water_flow : float
            Through the open valves of all that draw from the loop [kg/s].
        """
        pump, pipes = Pump(water_flow), max(_LEAST_PIPES, 1e-3 * capacity / 10.0)
        return cls(
            capacity, pump, pipe_conductance=min(pipes, 0.4 * pump.minimum_share * pump.design_flow * 4186.0),
            standing_conductance=0.25 * pipes, water_volume=max(0.05, _LITRES * capacity / 1000.0),
        )  # fmt: skip

    @property
    def design_pressure(self) -> float:
        """Differential pressure that holds where none is set [Pa]."""
        return self.pump.differential_pressure

    @property
    def heat_capacity(self) -> float:
        """Of the water [J/K]."""
        return self.water_volume * WATER_DENSITY * WATER_HEAT_CAPACITY

    def run(self, ops: Operations, given: Given) -> Run:
        """Offer warm water, hear what is drawn, and heat it.

        Parameters
        ----------
        ops : Operations
            Arithmetic.
        given : Given
            Setpoints, the water's temperature before, and the plant room's.
        """
        pump, actions, before = self.pump, given.actions, given.state["supply_water_temperature"]
        running, pressure = actions["boiler_running"], actions["differential_pressure_setpoint"]
        goal = self.goal(ops, before, actions["supply_water_temperature_setpoint"], given.seconds)
        opening = running * ops.sqrt(pressure / pump.differential_pressure)
        given.put("hot_water", HotWater(opening, ops.maximum(before, running * goal)))
        drawn: WaterDrawn = yield "hot_water"
        flow = pump.flow(ops, drawn.flow * opening, running)
        power = pump.power(flow, pressure)
        room = given.conditions.room_temperature
        end = self.heat(ops, before, goal, running, drawn, pump.heat_to_water * power, room, given.seconds)
        given.put("hot_water", SupplyWater(end.water))
        back = self.returning(end, flow)
        return LoopStep(
            end.water, back, flow, end.boiler, end.load, end.loss, end.storage, power, self.fuel(ops, end.boiler, back)
        )

    def goal(self, ops: Operations, before: Value, setpoint: Value, step: Value) -> Value:
        """Temperature of the supply water that the boiler aims at in a step [K].

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
        return ops.minimum(setpoint, before + self.fastest_rise * step)

    def heat(
        self,
        ops: Operations,
        before: Value,
        goal: Value,
        running: Value,
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
        running : Value
            1 while the boiler may fire, else 0 [-].
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
        boiler = running * ops.clip(wanted, 0.0, self.capacity, self.capacity)
        water = (inertia * before + boiler + source + leak * room + pump_heat) / (inertia + conductance + leak)
        load, loss = conductance * water - source, leak * (water - room)
        return Heated(water, boiler, load, loss, inertia * (water - before))

    def fuel(self, ops: Operations, boiler: Value, return_temperature: Value) -> Value:
        """Fuel power on the higher heating value [W].

        Parameters
        ----------
        ops : Operations
            Arithmetic.
        boiler : Value
            Heat into the water [W].
        return_temperature : Value
            Of the water that comes back [K].
        """
        curve = self.efficiency_curve(ops, boiler / self.capacity, celsius(return_temperature))
        # no boiler gives more heat than its fuel's higher heating value
        return boiler / ops.minimum(self.efficiency * curve, 1.0, 0.1)

    def returning(self, heated: Heated, flow: Value) -> Value:
        """Temperature of the water that comes back to the boiler [K].

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
            electricity=done.pump_power, fuel=done.fuel_power, flue=done.fuel_power - done.boiler, plant_room=room,
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
        held = given.actions["differential_pressure_setpoint"]
        return [
            given.actions["supply_water_temperature_setpoint"], done.supply_water_temperature,
            done.return_water_temperature, done.fuel_power, done.pump_power, held,
            given.actions["boiler_running"] * held,
        ]  # fmt: skip
