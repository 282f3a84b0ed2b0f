"""Thermostats whose setpoint can be overwritten, and what the descriptions say of zones and people."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from energyplus_trials.frame import Objects

from foreign_models import objects as ep

#: Heating setpoints by day and by night of EnergyPlus' reference buildings [degC].
WARM, COOL = 21.0, 15.6
#: Cooling setpoints of buildings that are looked at in winter: 26 degC, always.
COOLING = [26.0] * 24
#: Cooling setpoints by day and by night of buildings that are looked at in summer [degC].
_COOLED, _LET_GO = 24.0, 30.0


def thermostat(
    zone: str, weekday: Sequence[float], weekend: Sequence[float],
    cooling: tuple[Sequence[float], Sequence[float]] | None = None,
) -> Objects:  # fmt: skip
    """Return a thermostat, whose heating setpoint is the schedule ``ZONE SETPOINT``, that of cooling ``ZONE COOLING``.

    Parameters
    ----------
    zone : str
        Its zone.
    weekday, weekend : sequence of float
        Heating setpoint by hour [degC].
    cooling : tuple of sequence of float, optional
        Cooling setpoint by hour of working days and of week-ends, where there is cooling [degC].
    """
    kind, heating = "SingleHeating", f"{zone} SETPOINT"
    setpoints, schedules = {"setpoint_temperature_schedule_name": heating}, {heating: ep.daily(weekday, weekend)}
    if cooling is not None:
        kind = "DualSetpoint"
        setpoints = {"heating_setpoint_temperature_schedule_name": heating,
                     "cooling_setpoint_temperature_schedule_name": f"{zone} COOLING"}  # fmt: skip
        schedules[f"{zone} COOLING"] = ep.daily(*cooling)
    return {
        "Schedule:Compact": schedules,
        "Schedule:Constant": {f"{zone} kind": ep.constant(1.0 if cooling is None else 4.0)},
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


def cooling_clock(occupied: Sequence[bool], lead: int = 2) -> list[float]:
    """Return the cooling setpoints of a thermostat's own clock, shape (24,) [degC].

    Parameters
    ----------
    occupied : sequence of bool
        Whether somebody is in, by hour.
    lead : int
        So long before somebody comes it is cool already [h].
    """
    return [_COOLED if value == WARM else _LET_GO for value in clock(occupied, lead)]


def thermostat_points(zone: str, entity: str, *, cooled: bool = False) -> tuple[dict[str, str], dict[str, Any]]:
    """Return measured points and actuators of a thermostat, as ``plant.yaml`` has them.

    Parameters
    ----------
    zone, entity : str
        EnergyPlus' name, and ours.
    cooled : bool
        Whether the setpoint of cooling is among them.
    """
    measured, acted = {f"{entity}/zone_air_temperature_sensor": f"{zone}, Zone Mean Air Temperature"}, {}
    kinds = {"heating": (f"{zone} SETPOINT", ["12 degC", "25 degC"])}
    kinds |= {"cooling": (f"{zone} COOLING", ["20 degC", "32 degC"])} if cooled else {}
    for kind, (schedule, span) in kinds.items():
        setpoint = f"{entity}/zone_air_{kind}_temperature_setpoint"
        measured[setpoint] = f"{schedule}, Schedule Value"
        acted[setpoint] = {"signal": f"{schedule}, Schedule:Compact, Schedule Value", "range": span}
    return measured, acted


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
