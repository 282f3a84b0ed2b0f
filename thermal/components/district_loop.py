"""A hot-water loop that a district network heats through an exchanger."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from thermal.components.component import Actuator, Conditions, Port, Range, State
from thermal.components.operations import Operations, Value
from thermal.components.pump import Pump
from thermal.components.water_loop import SHORT_PIPES, Production, WaterLoop


@dataclass(frozen=True)
class DistrictLoop(WaterLoop):
    """A connection to a district network, with its exchanger and hot-water loop.

    Parameters
    ----------
    capacity : float
        Rated heat, at `network_temperature` and `rated_water`, into the water [W], positive.
    pump : Pump
        Of the loop.
    standing_conductance, pipe_conductance, water_volume, fastest_rise
        As in `WaterLoop` [W/K], [W/K], [m3], [K/s].
    network_temperature : float
        Supply of the network [K]; the default is that of networks of the third generation in winter (Lund et al. 2014,
        doi:10.1016/j.energy.2014.02.089: below 100 degC).
    rated_water : float
        Temperature of the loop's supply water that the capacity is at [K].

    Notes
    -----
    The most that it brings falls with the difference to the network, ``Q = Q_rated (T_network - T) / (T_network -
    T_rated)``: an exchanger with constant flows. What it brings is metered as heat, and stands where fuel does.
    """

    label, device = "district connection", "district_heating"
    ports = (
        Port("hot_water", "water", "kg/s", supplies=True),
        Port("electric_power", "electricity", "W"),
        Port("fuel_power", "fuel", "W"),
    )
    states = (State("supply_water_temperature", "K", 273.15, 373.15, 320.0),)
    actuators = (
        Actuator("supply_water_temperature_setpoint", "K", 278.15, 373.15, (310.0, 355.0)),
        Actuator("differential_pressure_setpoint", "Pa", 1e3, 6e5, (5_000.0, 150_000.0), "design_pressure"),
        Actuator("district_running", "-", 0.0, 1.0, default=1.0),
    )
    sensors = (
        "supply_water_temperature_setpoint", "supply_water_temperature_sensor", "return_water_temperature_sensor",
        "heating_power_sensor", "pump_power_sensor", "differential_pressure_setpoint", "differential_pressure_sensor",
    )  # fmt: skip

    network_temperature: Annotated[float, Range("K", 303.15, 423.15)] = 363.15
    rated_water: Annotated[float, Range("K", 293.15, 373.15)] = 343.15

    @classmethod
    def sized(cls, capacity: float, water_flow: float) -> DistrictLoop:
        """Size exchanger, pump and pipes.

        Parameters
        ----------
        capacity : float
            Largest heat [W].
        water_flow : float
            Through the open valves of all that draw from the loop [kg/s].
        """
        return cls(capacity, Pump(water_flow), **cls.pipes(capacity, water_flow, SHORT_PIPES))

    def can(self, ops: Operations, conditions: Conditions, water: Value) -> Value:
        """Most heat through the exchanger [W].

        Parameters
        ----------
        ops : Operations
            Arithmetic.
        conditions : Conditions
            Of the step.
        water : Value
            Temperature that the water is made with [K].
        """
        share = (self.network_temperature - water) / max(self.network_temperature - self.rated_water, 1.0)
        return self.capacity * ops.positive(share)

    def takes(self, ops: Operations, conditions: Conditions, produced: Value, water: Value, back: Value) -> Production:
        """Tell what the heat takes: as much from the network.

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
        return Production(fuel_power=produced)
