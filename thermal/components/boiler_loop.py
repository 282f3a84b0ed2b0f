"""The hot-water loop: boiler, water and pipes, with its pump."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from thermal.components.component import Actuator, Conditions, Port, Range, State
from thermal.components.curves import ORDINARY_BOILER, Biquadratic, celsius
from thermal.components.energy_balance import EnergyBalance
from thermal.components.operations import Operations, Value
from thermal.components.pump import Pump
from thermal.components.water_loop import LoopStep, Production, WaterLoop


@dataclass(frozen=True)
class BoilerLoop(WaterLoop):
    """A boiler and its hot-water loop.

    Parameters
    ----------
    capacity : float
        Rated heat into the water [W], positive.
    pump : Pump
        Of the loop.
    standing_conductance, pipe_conductance, water_volume, fastest_rise
        As in `WaterLoop` [W/K], [W/K], [m3], [K/s].
    efficiency : float
        Nominal, on the higher heating value [-], 0.5 to 1. The default is the Large Office's.
    efficiency_curve : Biquadratic
        Efficiency over the nominal one, of part load [-] and return water [degC]; `CONDENSING_BOILER` condenses.
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

    efficiency: Annotated[float, Range("-", 0.5, 1.0)] = 0.78
    efficiency_curve: Biquadratic = ORDINARY_BOILER

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
        return cls(capacity, Pump(water_flow), **cls.pipes(capacity, water_flow))

    def takes(
        self, ops: Operations, conditions: Conditions, produced: Value, water: Value, back: Value
    ) -> Production:
        """Tell what the heat takes: fuel.

        Parameters
        ----------
        ops : Operations
            Arithmetic.
        conditions : Conditions
            Of the step.
        produced : Value
            Heat [W].
        water, back : Value
            Temperatures that the water is made with, and comes back with [K].
        """
        return Production(fuel_power=self.fuel(ops, produced, back))

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

    def energy(self, conditions: Conditions, done: LoopStep) -> EnergyBalance:
        """Where the energy of a step went: what the boiler gives off leaves through its flue.

        Parameters
        ----------
        conditions : Conditions
            Of the step.
        done : LoopStep
            What `run` returned.
        """
        return super().energy(conditions, done)._replace(condenser=0.0, flue=done.outdoors)
