"""Pumps: power by flow and differential pressure."""

from dataclasses import dataclass
from typing import Annotated

from thermal.components.checks import in_range
from thermal.components.component import Component, Port, Range
from thermal.components.moist_air import WATER_DENSITY
from thermal.components.operations import Operations, Value


@dataclass(frozen=True)
class Pump(Component):
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

    ports = (Port("water", "water", "kg/s"), Port("power", "electricity", "W"))

    design_flow: Annotated[float, Range("kg/s", 1e-6, 1e4)]
    design_pressure: Annotated[float, Range("Pa", 5e3, 6e5)] = 179_352.0
    differential_pressure: Annotated[float, Range("Pa", 1e3, 6e5)] = 80_000.0
    efficiency: Annotated[float, Range("-", 0.05, 0.95)] = 0.6825
    minimum_share: Annotated[float, Range("-", 0.01, 1.0)] = 0.1
    heat_to_water: Annotated[float, Range("-", 0.0, 1.0)] = 0.9

    def __post_init__(self) -> None:
        super().__post_init__()
        in_range("Pump.differential_pressure", self.differential_pressure, "Pa", 1e3, self.design_pressure)

    def flow(self, ops: Operations, drawn: Value, running: Value) -> Value:
        """Water through the pump [kg/s], where `drawn` [kg/s] goes through the valves; 0 where it is off.

        Parameters
        ----------
        ops : Operations
            Arithmetic.
        drawn : Value
            Water through the valves [kg/s].
        running : Value
            1 while the pump runs, else 0 [-].
        """
        return running * ops.maximum(drawn, self.minimum_share * self.design_flow, self.design_flow)

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
