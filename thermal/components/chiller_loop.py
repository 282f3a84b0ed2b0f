"""A chilled-water loop: a chiller cooled by air outdoors or by a tower, with its pump."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from thermal.components.component import Actuator, Conditions, Port, Range, State
from thermal.components.cooling_tower import CoolingTower, TowerStep
from thermal.components.curves import CHILLER_CAPACITY, CHILLER_INPUT, CHILLER_PART_LOAD
from thermal.components.machine_map import MachineMap, MachineStep
from thermal.components.moist_air import wet_bulb
from thermal.components.operations import Operations, Value
from thermal.components.pump import Pump
from thermal.components.water_loop import SHORT_PIPES, Production, WaterLoop

_PASSES = 2  # chiller, tower, chiller: the condenser's water moves by less than 0.1 K in the last

#: Air-cooled, COP near ASHRAE 90.1-2016's least (table 6.8.1-3: 2.985), fans of the condenser 3.5 % of the cooling
#: (EnergyPlus' template).
AIR_COOLED = MachineMap(
    3.0, CHILLER_CAPACITY, CHILLER_INPUT, CHILLER_PART_LOAD, minimum=0.25, running_share=0.105
)  # fmt: skip


@dataclass(frozen=True)
class ChillerLoop(WaterLoop):
    """A chiller and its chilled-water loop.

    Parameters
    ----------
    capacity : float
        Rated cooling into the water [W], positive.
    pump : Pump
        Of the loop.
    standing_conductance, pipe_conductance, water_volume, fastest_rise
        As in `WaterLoop` [W/K], [W/K], [m3], [K/s].
    machine : MachineMap
        The chiller; x of its curves is the chilled water, y what cools the condenser. The default is air-cooled.
    tower : CoolingTower, optional
        Cools the condenser; None: air outdoors does.
    condenser_pump : float
        Power of the pump between chiller and tower while the chiller runs [W].
    """

    label, device = "chiller", "chilled_water_plant"
    chills, supply = True, "chilled_water"
    ports = (
        Port("chilled_water", "chilled_water", "kg/s", supplies=True),
        Port("electric_power", "electricity", "W"),
    )
    states = (State("chilled_water_temperature", "K", 273.15, 313.15, 285.15),)
    actuators = (
        Actuator("chilled_water_temperature_setpoint", "K", 274.15, 298.15, default=279.82),
        Actuator("chilled_water_differential_pressure_setpoint", "Pa", 1e3, 6e5, default="design_pressure"),
        Actuator("chiller_running", "-", 0.0, 1.0, default=1.0),
    )
    sensors = (
        "chilled_supply_water_temperature_sensor", "chilled_return_water_temperature_sensor", "electrical_power_sensor",
    )  # fmt: skip

    machine: MachineMap = AIR_COOLED
    tower: CoolingTower | None = None
    condenser_pump: Annotated[float, Range("W", 0.0, 1e7)] = 0.0

    @classmethod
    def sized(cls, capacity: float, water_flow: float) -> ChillerLoop:
        """Size chiller, pump and pipes.

        Parameters
        ----------
        capacity : float
            Largest cooling [W].
        water_flow : float
            Through the open valves of all that draw from the loop [kg/s].
        """
        return cls(1.15 * capacity, Pump(water_flow), **cls.pipes(capacity, water_flow, SHORT_PIPES))

    def chilled(
        self, ops: Operations, wanted: Value, water: Value, conditions: Conditions
    ) -> tuple[MachineStep, TowerStep]:
        """Run chiller and tower for a cooling that is wanted.

        Parameters
        ----------
        ops : Operations
            Arithmetic.
        wanted : Value
            Cooling [W].
        water : Value
            Chilled water [K].
        conditions : Conditions
            Of the step.
        """
        outdoor = conditions.outdoor_temperature
        if self.tower is None:
            done = self.machine.run_at(ops, wanted, self.capacity, water, outdoor)
            return done, TowerStep(outdoor, 0.0, 0.0)
        wet = wet_bulb(ops, outdoor, conditions.outdoor_humidity, self.tower.pressure)
        cooled = TowerStep(ops.maximum(self.tower.setpoint, wet), 0.0, 0.0)
        for _ in range(_PASSES):
            done = self.machine.run_at(ops, wanted, self.capacity, water, cooled.water_temperature)
            cooled = self.tower.cool(ops, done.output + done.power, wet)
        return self.machine.run_at(ops, wanted, self.capacity, water, cooled.water_temperature), cooled

    def can(self, ops: Operations, conditions: Conditions, water: Value) -> Value:
        """Most cooling [W].

        Parameters
        ----------
        ops : Operations
            Arithmetic.
        conditions : Conditions
            Of the step.
        water : Value
            Temperature that the water is made with [K].
        """
        return self.chilled(ops, 2.0 * self.capacity, water, conditions)[0].available

    def takes(self, ops: Operations, conditions: Conditions, produced: Value, water: Value, back: Value) -> Production:
        """Tell what the cooling takes: electricity of the chiller, the tower's fan and its pump.

        Parameters
        ----------
        ops : Operations
            Arithmetic.
        conditions : Conditions
            Of the step.
        produced : Value
            Cooling [W].
        water, back : Value
            Temperatures that the water is made with, and comes back with [K].
        """
        done, tower = self.chilled(ops, produced, water, conditions)
        return Production(done.power + tower.power + done.duty * self.condenser_pump, duty=done.duty)
