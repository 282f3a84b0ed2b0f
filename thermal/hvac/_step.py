"""What a step of the plant takes and gives."""

from __future__ import annotations

from typing import NamedTuple

from thermal.hvac._air import USUAL_HUMIDITY
from thermal.hvac._air_handler import Mixed, Warmed
from thermal.hvac._boiler import Heated
from thermal.hvac._operations import Value
from thermal.units import AIR_HEAT_CAPACITY


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
    airflow : Value
        Of the terminals [kg/s].
    entering : Value
        Supply air at the terminals [K].
    reheat : Value
        Heat from the water in the terminals [W].
    valve_flow : Value
        Water through the terminals over that of an open valve [-].
    terminal_heat : Value
        Heat into the zone, one a terminal [W]: flow x 1006 J/kg/K x (`discharge` - zone temperature).
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

    airflow: Value
    entering: Value
    reheat: Value
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

    @property
    def discharge(self) -> Value:
        """Discharge temperatures of the terminals [K]."""
        return self.entering + self.reheat / (AIR_HEAT_CAPACITY * self.airflow)
