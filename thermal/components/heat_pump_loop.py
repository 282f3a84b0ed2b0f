"""A hot-water loop that a heat pump heats, from air outdoors or from brine, with a resistance beside it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from thermal.components.component import Actuator, Conditions, Port, Range, State
from thermal.components.curves import AIR_SOURCE_INPUT, DX_HEATING_CAPACITY, DX_PART_LOAD
from thermal.components.machine_map import MachineMap
from thermal.components.operations import Operations, Value
from thermal.components.pump import Pump
from thermal.components.water_loop import SHORT_PIPES, Production, WaterLoop

#: Air to water: COP of Staffell et al. (2012), defrosting in it; capacity as air-source direct expansion has it.
AIR_TO_WATER = MachineMap(
    AIR_SOURCE_INPUT.rated_cop, DX_HEATING_CAPACITY, AIR_SOURCE_INPUT, DX_PART_LOAD, minimum=0.3, cycling_loss=0.1,
    standing_share=0.005,
)  # fmt: skip
_STEEP = 1.25  # capacity over the design load: rated at 8 degC, and a third less at -5 degC with `DX_HEATING_CAPACITY`


@dataclass(frozen=True)
class HeatPumpLoop(WaterLoop):
    """A heat pump and its hot-water loop.

    Parameters
    ----------
    capacity : float
        Rated heat into the water [W], positive.
    pump : Pump
        Of the loop.
    standing_conductance, pipe_conductance, water_volume, fastest_rise
        As in `WaterLoop` [W/K], [W/K], [m3], [K/s].
    machine : MachineMap
        The heat pump; x of its curves is the supply water, y the source. The default is an air-to-water heat pump with
        an inverter (minimum of 30 %, EN 14825's usual), a tenth lost by cycling (EN 14825, C_c = 0.9) and controls of
        0.5 % of the rated power.
    source_temperature : float, optional
        Of the brine or water that it takes its heat from [K]; None: air outdoors.
    backup : float
        Of an electric resistance behind it [W], for what the heat pump cannot bring.
    """

    label, device = "heat pump", "heat_pump"
    ports = (
        Port("hot_water", "water", "kg/s", supplies=True),
        Port("electric_power", "electricity", "W"),
    )
    states = (State("supply_water_temperature", "K", 273.15, 373.15, 308.15),)
    actuators = (
        # what heat pumps reach: low-temperature floors to high-temperature radiators (EN 14511: 35 to 65 degC)
        Actuator("supply_water_temperature_setpoint", "K", 278.15, 353.15, (293.15, 338.15)),
        Actuator("differential_pressure_setpoint", "Pa", 1e3, 6e5, (5_000.0, 150_000.0), "design_pressure"),
        Actuator("heat_pump_running", "-", 0.0, 1.0, default=1.0),
    )
    sensors = (
        "supply_water_temperature_setpoint", "supply_water_temperature_sensor", "return_water_temperature_sensor",
        "electrical_power_sensor", "differential_pressure_setpoint", "differential_pressure_sensor",
    )  # fmt: skip

    machine: MachineMap = AIR_TO_WATER
    source_temperature: Annotated[float | None, Range("K", 253.15, 313.15)] = None
    backup: Annotated[float, Range("W", 0.0, 1e8)] = 0.0

    @classmethod
    def sized(cls, capacity: float, water_flow: float) -> HeatPumpLoop:
        """Size heat pump, resistance, pump and pipes: a quarter more than the load, and the load's half by resistance.

        Parameters
        ----------
        capacity : float
            Largest heat [W].
        water_flow : float
            Through the open valves of all that draw from the loop [kg/s].
        """
        pipes = cls.pipes(capacity, water_flow, SHORT_PIPES)
        return cls(_STEEP * capacity, Pump(water_flow), backup=0.5 * capacity, **pipes)

    def source(self, conditions: Conditions) -> Value:
        """Temperature of the source [K].

        Parameters
        ----------
        conditions : Conditions
            Of the step.
        """
        return conditions.outdoor_temperature if self.source_temperature is None else self.source_temperature

    def can(self, ops: Operations, conditions: Conditions, water: Value) -> Value:
        """Most heat, with the resistance [W].

        Parameters
        ----------
        ops : Operations
            Arithmetic.
        conditions : Conditions
            Of the step.
        water : Value
            Temperature that the water is made with [K].
        """
        source = self.source(conditions)
        frost = self.machine.frosted(ops, source, conditions.outdoor_humidity)
        return self.machine.available(ops, self.capacity, water, source, frost) + self.backup

    def takes(self, ops: Operations, conditions: Conditions, produced: Value, water: Value, back: Value) -> Production:
        """Tell what the heat takes: electricity of the heat pump, and of the resistance for what it cannot bring.

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
        source = self.source(conditions)
        done = self.machine.run_at(ops, produced, self.capacity, water, source, conditions.outdoor_humidity)
        return Production(done.power + produced - done.output, duty=done.duty)
