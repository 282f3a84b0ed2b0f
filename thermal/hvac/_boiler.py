"""The hot-water loop: boiler, pump, water and pipes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from thermal.hvac._air import WATER_DENSITY, WATER_HEAT_CAPACITY
from thermal.hvac._checks import fields_in_range
from thermal.hvac._curves import ORDINARY_BOILER, Biquadratic, celsius
from thermal.hvac._operations import Operations, Value

_LEAST = 1e-9


@dataclass(frozen=True)
class Pump:
    """A pump with a variable-speed drive that holds a differential pressure.

    Parameters
    ----------
    design_flow : float
        Largest water flow [kg/s], positive.
    design_pressure : float
        Pressure rise at that flow [Pa], 5,000 to 600,000. The default is the reference buildings' (60 ft of water).
    differential_pressure : float
        Part of it that the drive holds at its sensor [Pa]; the default is usual at the far end of a loop.
    efficiency : float
        Of pump, motor and drive [-]; the default is the Large Office's, 179,352 Pa over 262,786 W/(m3/s).
    minimum_share : float
        Least flow over design flow, through a bypass [-], 0.01 to 1.
    heat_to_water : float
        Share of the power that warms the water [-]; the default leaves out the losses of the motor.

    Notes
    -----
    ``P = V dp / eta`` with V in m3/s, ``dp = p + (dp_design - p_design) x^2``: what the drive holds, and the losses up
    to its sensor.
    """

    design_flow: float
    design_pressure: float = 179_352.0
    differential_pressure: float = 80_000.0
    efficiency: float = 0.6825
    minimum_share: float = 0.1
    heat_to_water: float = 0.9

    def __post_init__(self) -> None:
        fields_in_range(
            self,
            {
                "design_flow": ("kg/s", 1e-6, 1e4),
                "design_pressure": ("Pa", 5e3, 6e5),
                "differential_pressure": ("Pa", 1e3, self.design_pressure),
                "efficiency": ("-", 0.05, 0.95),
                "minimum_share": ("-", 0.01, 1.0),
                "heat_to_water": ("-", 0.0, 1.0),
            },
        )

    def power(self, flow: Value, differential_pressure: Value) -> Value:
        """Electric power [W].

        Parameters
        ----------
        flow : Value
            Water [kg/s].
        differential_pressure : Value
            Setpoint at the sensor [Pa].
        """
        share = flow / self.design_flow
        pressure = differential_pressure + (self.design_pressure - self.differential_pressure) * share * share
        return flow / WATER_DENSITY * pressure / self.efficiency


class Heated(NamedTuple):
    """The loop after a step.

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


@dataclass(frozen=True)
class BoilerLoop:
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

    capacity: float
    pump: Pump
    efficiency: float = 0.78
    efficiency_curve: Biquadratic = ORDINARY_BOILER
    standing_conductance: float = 10.0
    pipe_conductance: float = 40.0
    water_volume: float = 1.0
    fastest_rise: float = 2.0 / 60.0

    def __post_init__(self) -> None:
        fields_in_range(
            self,
            {
                "capacity": ("W", 1.0, 1e8),
                "efficiency": ("-", 0.5, 1.0),
                "standing_conductance": ("W/K", 0.0, 1e5),
                # beyond this the least flow would come back colder than the plant room
                "pipe_conductance": (
                    "W/K",
                    0.0,
                    0.5 * self.pump.minimum_share * self.pump.design_flow * WATER_HEAT_CAPACITY,
                ),
                "water_volume": ("m3", 1e-4, 1e4),
                "fastest_rise": ("K/s", 1e-4, 1e3),
            },
        )

    @property
    def heat_capacity(self) -> float:
        """Of the water [J/K]."""
        return self.water_volume * WATER_DENSITY * WATER_HEAT_CAPACITY

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
        setpoint: Value,
        running: Value,
        conductance: Value,
        source: Value,
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
        setpoint : Value
            Of the supply water [K].
        running : Value
            1 while the boiler may fire, else 0 [-].
        conductance : Value
            G of the coils' load ``G T - H`` [W/K].
        source : Value
            H of the same [W].
        pump_heat : Value
            From the pump into the water [W].
        room : Value
            Temperature of the plant room [K].
        step : Value
            Length of the step [s].
        """
        inertia = self.heat_capacity / step
        leak = self.standing_conductance + self.pipe_conductance
        goal = self.goal(ops, before, setpoint, step)
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
