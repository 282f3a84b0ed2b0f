"""Fans: power by flow and pressure, and the heat that it becomes."""

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated

from thermal.components.checks import in_range
from thermal.components.component import Component, Port, Range
from thermal.components.curves import FAN_PART_LOAD, Polynomial
from thermal.components.moist_air import SUPPLY_AIR_DENSITY
from thermal.components.operations import Operations, Value


@dataclass(frozen=True)
class Fan(Component):
    """A fan with a variable-speed drive.

    Parameters
    ----------
    design_flow : float
        Largest air flow [kg/s], positive.
    design_pressure : float
        Pressure rise at the design flow [Pa], 20 to 2500. The default is that of the Medium Office's supply fan.
    static_pressure : float
        Part of it that the drive holds in the duct whatever the flow [Pa]; the default is usual for VAV boxes (1 in.
        of water, ASHRAE Guideline 36-2021).
    efficiency : float
        Of fan, belt, motor and drive together at design [-]; the default is the Medium Office's.
    heat_to_air : float
        Share of the power that warms the air [-]; the default has the motor in the air stream.
    part_load : Polynomial
        Power over design power by share of the design flow, at the design static pressure.
    air_density : float
        Of the air moved [kg/m3], 0.5 to 1.5; the default is that of standard air, `thermal.units.air_density` gives a
        site's.

    Notes
    -----
    ``P = V_design dp_design / eta * f(x) * dp(x, p) / dp(x, p_design)`` with ``dp(x, p) = p + (dp_design - p_design)
    x^2``: what the drive holds, and the losses up to its sensor.
    """

    ports = (Port("air", "air", "kg/s"), Port("power", "electricity", "W"))

    design_flow: Annotated[float, Range("kg/s", 1e-6, 1e4)]
    design_pressure: Annotated[float, Range("Pa", 20.0, 2500.0)] = 1109.648
    static_pressure: Annotated[float, Range("Pa", 1.0, 2500.0)] = 250.0
    efficiency: Annotated[float, Range("-", 0.05, 0.95)] = 0.5915
    heat_to_air: Annotated[float, Range("-", 0.0, 1.0)] = 1.0
    part_load: Polynomial = FAN_PART_LOAD
    air_density: Annotated[float, Range("kg/m3", 0.5, 1.5)] = SUPPLY_AIR_DENSITY

    def __post_init__(self) -> None:
        super().__post_init__()
        in_range("Fan.static_pressure", self.static_pressure, "Pa", 1.0, self.design_pressure)

    @cached_property
    def design_power(self) -> float:
        """Electric power at the design flow [W]."""
        return self.design_flow / self.air_density * self.design_pressure / self.efficiency

    def power(self, ops: Operations, flow: Value, static_pressure: Value) -> Value:
        """Electric power while running [W].

        Parameters
        ----------
        ops : Operations
            Arithmetic.
        flow : Value
            Air flow [kg/s].
        static_pressure : Value
            Setpoint of the duct's static pressure [Pa].
        """
        share = flow / self.design_flow
        losses = (self.design_pressure - self.static_pressure) * share * share
        pressure = (static_pressure + losses) / (self.static_pressure + losses)
        return self.design_power * self.part_load(ops, share) * pressure
