"""Thermostats whose setpoint can be overwritten, and what the descriptions say of zones and people."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from energyplus_trials.frame import Objects

from foreign_models import objects as ep

#: Heating setpoints by day and by night of EnergyPlus' reference buildings [degC].
WARM, COOL = 21.0, 15.6
COOLING = 26.0  # degC, always


def thermostat(zone: str, weekday: Sequence[float], weekend: Sequence[float], *, cooled: bool = False) -> Objects:
    """Return a thermostat, whose heating setpoint is the schedule ``ZONE SETPOINT``.

    Parameters
    ----------
    zone : str
        Its zone.
    weekday, weekend : sequence of float
        Heating setpoint by hour [degC].
    cooled : bool
        Whether there is cooling.
    """
    kind, heating = "SingleHeating", f"{zone} SETPOINT"
    setpoints = {"setpoint_temperature_schedule_name": heating}
    if cooled:
        kind = "DualSetpoint"
        setpoints = {"heating_setpoint_temperature_schedule_name": heating,
                     "cooling_setpoint_temperature_schedule_name": f"{zone} cooling"}  # fmt: skip
    return {
        "Schedule:Compact": {heating: ep.daily(weekday, weekend)},
        "Schedule:Constant": {
            f"{zone} cooling": ep.constant(COOLING), f"{zone} kind": ep.constant(4.0 if cooled else 1.0),
        },
        f"ThermostatSetpoint:{kind}": {f"{zone} setpoints": setpoints},
        "ZoneControl:Thermostat": {f"{zone} thermostat": {
            "zone_or_zonelist_name": zone, "control_type_schedule_name": f"{zone} kind",
            "control_1_object_type": f"ThermostatSetpoint:{kind}", "control_1_name": f"{zone} setpoints",
        }},
    }  # fmt: skip


def clock(occupied: Sequence[bool], lead: int = 2, cool: float = COOL) -> list[float]:
    """Return the setpoints of a thermostat's own clock, shape (24,) [degC].

    Parameters
    ----------
    occupied : sequence of bool
        Whether somebody is in, by hour.
    lead : int
        So long before somebody comes it is warm already [h].
    cool : float
        Setpoint while nobody is in [degC].
    """
    return [WARM if any(occupied[(hour + k) % 24] for k in range(lead + 1)) else cool for hour in range(24)]


def thermostat_points(zone: str, entity: str) -> tuple[dict[str, str], dict[str, Any]]:
    """Return measured points and actuators of a thermostat, as ``plant.yaml`` has them.

    Parameters
    ----------
    zone, entity : str
        EnergyPlus' name, and ours.
    """
    setpoint = f"{entity}/zone_air_heating_temperature_setpoint"
    measured = {
        f"{entity}/zone_air_temperature_sensor": f"{zone}, Zone Mean Air Temperature",
        setpoint: f"{zone} SETPOINT, Schedule Value",
    }
    signal = f"{zone} SETPOINT, Schedule:Compact, Schedule Value"
    return measured, {setpoint: {"signal": signal, "range": ["12 degC", "25 degC"]}}


def comfort(weekday: Sequence[bool], weekend: Sequence[bool], within: tuple[float, float] = (20.0, 24.0),
            without: tuple[float, float] = (15.0, 30.0)) -> dict[str, Any]:  # fmt: skip
    """Return a comfort band by the hour, as ``plant.yaml`` has it.

    Parameters
    ----------
    weekday, weekend : sequence of bool
        Whether somebody is in, by hour.
    within, without : tuple of float
        Lower and upper edge while somebody is in, and otherwise [degC].
    """
    days = (("weekday", weekday), ("weekend", weekend))
    return {
        edge: {day: [f"{(within if some else without)[k]:g} degC" for some in hours] for day, hours in days}
        for k, edge in enumerate(("lower", "upper"))
    }


def present(people: float, weekday: Sequence[bool], weekend: Sequence[bool]) -> dict[str, list[float]]:
    """Return people by the hour, as ``plant.yaml`` has them.

    Parameters
    ----------
    people : float
        While somebody is in.
    weekday, weekend : sequence of bool
        By hour.
    """
    return {"weekday": [people * some for some in weekday], "weekend": [people * some for some in weekend]}
