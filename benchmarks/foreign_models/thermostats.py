"""Thermostats whose setpoint can be overwritten, and whose heater can be told to be on or off."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from energyplus_trials.frame import Objects

from foreign_models import objects as ep

_FULL, _OFF, _NEVER = 45.0, 5.0, 60.0  # degC: setpoints that ask for all and for nothing; no cooling

_TOLD = """
SET heat_{zone} = wanted_{zone}
SET cool_{zone} = {cooling}
IF told_{zone} > 0.5
  SET heat_{zone} = {full}
  SET cool_{zone} = {never}
ELSEIF told_{zone} >= 0.0
  SET heat_{zone} = {off}
  SET cool_{zone} = {never}
ENDIF
"""


def thermostat(zone: str, weekday: Sequence[float], weekend: Sequence[float], cooling: float | None = None) -> Objects:
    """Return a thermostat.

    Schedule ``ZONE SETPOINT`` is its heating setpoint. Schedule ``ZONE HEATER`` is ``OWN``; with 1 the heater gives
    all that it can, with 0 nothing, cooling neither.

    Parameters
    ----------
    zone : str
        Without spaces.
    weekday, weekend : sequence of float
        Heating setpoint by hour [degC].
    cooling : float, optional
        Cooling setpoint [degC], where there is cooling.
    """
    kind = "SingleHeating" if cooling is None else "DualSetpoint"
    setpoints = {"setpoint_temperature_schedule_name": f"{zone} heating"}
    if cooling is not None:
        setpoints = {"heating_setpoint_temperature_schedule_name": f"{zone} heating",
                     "cooling_setpoint_temperature_schedule_name": f"{zone} cooling"}  # fmt: skip
    text = _TOLD.format(zone=zone, full=_FULL, off=_OFF, never=_NEVER, cooling=_NEVER if cooling is None else cooling)
    found: Objects = {
        "Schedule:Compact": {f"{zone} SETPOINT": ep.daily(weekday, weekend)},
        "Schedule:Constant": {
            f"{zone} HEATER": ep.constant(ep.OWN), f"{zone} heating": ep.constant(15.0),
            f"{zone} cooling": ep.constant(_NEVER), f"{zone} kind": ep.constant(1.0 if cooling is None else 4.0),
        },
        f"ThermostatSetpoint:{kind}": {f"{zone} setpoints": setpoints},
        "ZoneControl:Thermostat": {f"{zone} thermostat": {
            "zone_or_zonelist_name": zone, "control_type_schedule_name": f"{zone} kind",
            "control_1_object_type": f"ThermostatSetpoint:{kind}", "control_1_name": f"{zone} setpoints",
        }},
    }  # fmt: skip
    ep.merge(found, ep.sensors({
        f"wanted_{zone}": (f"{zone} SETPOINT", "Schedule Value"), f"told_{zone}": (f"{zone} HEATER", "Schedule Value"),
    }))  # fmt: skip
    ep.merge(found, ep.actuators({
        f"heat_{zone}": (f"{zone} heating", "Schedule:Constant", "Schedule Value"),
        f"cool_{zone}": (f"{zone} cooling", "Schedule:Constant", "Schedule Value"),
    }))  # fmt: skip
    ep.merge(found, ep.program(f"thermostat_{zone}", text))
    return found


def clock(occupied: Sequence[bool], warm: float, cool: float, lead: int) -> list[float]:
    """Return the setpoints of a thermostat's own clock, shape (24,) [degC].

    Parameters
    ----------
    occupied : sequence of bool
        Whether somebody is in, by hour.
    warm, cool : float
        Setpoint while somebody is in, and otherwise [degC].
    lead : int
        So long before somebody comes it is warm already [h].
    """
    return [warm if any(occupied[(hour + k) % 24] for k in range(lead + 1)) else cool for hour in range(24)]


def thermostat_points(zone: str, entity: str, heater: str) -> tuple[dict[str, str], dict[str, Any]]:
    """Return measured points and actuators of a thermostat, as ``plant.yaml`` has them.

    Parameters
    ----------
    zone : str
        EnergyPlus' name.
    entity, heater : str
        Names of zone and heater there.
    """
    setpoint = f"{entity}/zone_air_heating_temperature_setpoint"
    measured = {
        f"{entity}/zone_air_temperature_sensor": f"{zone}, Zone Mean Air Temperature",
        setpoint: f"{zone} SETPOINT, Schedule Value",
    }
    return measured, {
        f"{heater}/on": {
            "signal": f"{zone} HEATER, Schedule:Constant, Schedule Value", "range": [0.0, 1.0], "kind": "on_off",
        },
        setpoint: {"signal": f"{zone} SETPOINT, Schedule:Compact, Schedule Value", "range": ["12 degC", "30 degC"]},
    }  # fmt: skip


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
