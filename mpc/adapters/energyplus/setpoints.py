"""What can be set in EnergyPlus: schedules of the supply setpoints, one for each device, and thermostats."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import date
from typing import Any

from mpc.adapters.energyplus.building import EnergyPlusBuilding
from mpc.adapters.energyplus.input import InputFile, with_period
from mpc.adapters.energyplus.points import entity
from mpc.errors import EnergyPlusError, PlantError
from mpc.loop.actuators import ACTION_LIMITS, COOLING_SETPOINT, HEATING_SETPOINT, SUPPLY_AIR, SUPPLY_WATER, Actuator
from thermal.errors import describe, nearest

#: Ranges of the supply setpoints [K]; water as hot as the reference buildings' own, 82.2 degC, must be in.
_LIMITS = {SUPPLY_AIR: (283.15, 303.15), SUPPLY_WATER: (310.0, 361.15)}


def prepared(source: EnergyPlusBuilding, start: date, days: int, steps_per_hour: int) -> dict[str, Any]:
    """Write a building's input for a run: clock, and schedules of supply setpoints that are each device's own.

    Parameters
    ----------
    source : EnergyPlusBuilding
        The building.
    start : date
        First day.
    days : int
        Number of days.
    steps_per_hour : int
        Of zones and weather.

    Returns
    -------
    dict
        Content of an input file.
    """
    content = with_period(source.source, start, days, steps_per_hour)
    for name, managers in _managers(source).items():
        for manager in managers:
            fields = content["SetpointManager:Scheduled"][manager]
            kind, schedule = _schedule(source.source, str(fields["schedule_name"]))
            own = _own(name, schedule)
            content[kind][own] = dict(content[kind][schedule])
            fields["schedule_name"] = own
    return content


def _managers(source: EnergyPlusBuilding) -> dict[str, tuple[str, ...]]:
    """Setpoint managers by device."""
    managers = {loop.name: loop.managers for loop in source.layout.air_loops}
    return managers | {loop.name: loop.managers for loop in source.layout.water_loops}


def _schedule(source: InputFile, name: str) -> tuple[str, str]:
    """Type and name of a schedule as the file writes it."""
    for kind, title, _ in source.begins("Schedule:"):
        if title.lower() == name.lower():
            return kind, title
    raise EnergyPlusError(describe(source.name, f"a schedule {name!r}", "none"))


def _own(device: str, schedule: str) -> str:
    return f"{schedule} of {device}"


def actuators_of(
    source: EnergyPlusBuilding, limits: Mapping[str, tuple[float, float]]
) -> tuple[tuple[Actuator, ...], list[tuple[str, str, str]]]:
    """List the actuators, and what each is called in EnergyPlus: schedules of supply setpoints, thermostats of zones.

    Parameters
    ----------
    source : EnergyPlusBuilding
        The building.
    limits : mapping of str to tuple of float
        Ranges by kind of action in the place of the default ones [K].

    Raises
    ------
    PlantError
        When a limit is for no kind of action.
    EnergyPlusError
        When a device's setpoint managers follow several schedules.
    """
    for kind in limits:
        if kind not in ACTION_LIMITS:
            raise PlantError(describe("limits", "a kind of action", repr(kind), nearest(kind, ACTION_LIMITS)))
    bounds = {**ACTION_LIMITS, **_LIMITS, **limits}
    found: list[Actuator] = []
    handles: list[tuple[str, str, str]] = []
    devices = [(SUPPLY_AIR, loop.name, loop.managers) for loop in source.layout.air_loops]
    devices += [(SUPPLY_WATER, water.name, water.managers) for water in source.layout.water_loops]
    for point, name, managers in devices:
        named = {str(source.source.find("SetpointManager:Scheduled", m)["schedule_name"]).lower() for m in managers}
        if len(named) > 1:
            expected = f"one schedule for the setpoint managers of {name!r}"
            raise EnergyPlusError(describe(source.source.name, expected, ", ".join(sorted(named))))
        kind, schedule = _schedule(source.source, named.pop())
        found.append(Actuator(f"{entity(name)}/{point}", "K", *bounds[point], required=False))
        handles.append((kind, "Schedule Value", _own(name, schedule)))
    for point, control in ((HEATING_SETPOINT, "Heating Setpoint"), (COOLING_SETPOINT, "Cooling Setpoint")):
        for zone in source.layout.zones:
            found.append(Actuator(f"{entity(zone)}/{point}", "K", *bounds[point], required=False))
            handles.append(("Zone Temperature Control", control, zone))
    return tuple(found), handles
