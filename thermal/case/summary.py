"""Summaries of the zones, devices and points of a case."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from thermal.case.areas import zone_floor_areas, zone_volumes
from thermal.case.building import Building, FloorPlans
from thermal.case.case import Case
from thermal.case.points import POINT_TYPES, ZONE_TEMPERATURE, split_column
from thermal.case.schema import DEVICE_TYPES
from thermal.units import QUANTITIES, from_si


@dataclass(frozen=True)
class ZoneSummary:
    """What is known of a zone.

    Parameters
    ----------
    name
        Of the zone.
    floor
        Name of its floor; None in a zone table.
    floor_area
        [m2], with half of the interior walls.
    volume
        [m3].
    measured_by
        Telemetry columns of its air temperature.
    devices
        Devices that serve it.
    """

    name: str
    floor: str | None
    floor_area: float
    volume: float
    measured_by: tuple[str, ...]
    devices: tuple[str, ...]


@dataclass(frozen=True)
class DeviceSummary:
    """What is known of a device.

    Parameters
    ----------
    name
        Of the device.
    type
        As in the file.
    known
        Whether the library knows the type.
    zone
        The zone it serves; None for none.
    points
        Point types it reports.
    """

    name: str
    type: str
    known: bool
    zone: str | None
    points: tuple[str, ...]


@dataclass(frozen=True)
class PointSummary:
    """What a telemetry column is.

    Parameters
    ----------
    column
        ``ENTITY/POINT``.
    entity
        Before the slash.
    entity_kind
        ``device``, ``zone``, ``boundary`` or ``weather station``.
    zone
        The zone that it tells of; None for none.
    point
        After the slash.
    meaning
        In a few words.
    unit
        Unit of the four numbers that follow: the one that files use, so degC for temperatures.
    lowest, mean, highest
        Of the usable values [unit]; None without any.
    usable_share
        Share of the stamps with a usable value, 0 to 1 [-].
    """

    column: str
    entity: str
    entity_kind: str
    zone: str | None
    point: str
    meaning: str
    unit: str
    lowest: float | None
    mean: float | None
    highest: float | None
    usable_share: float


def summarise_zones(case: Case) -> tuple[ZoneSummary, ...]:
    """Summarise each zone of a case.

    Parameters
    ----------
    case
        Case.

    Returns
    -------
    tuple of ZoneSummary
        In the building's order.
    """
    building = case.building
    if isinstance(building.geometry, FloorPlans):
        areas, volumes = zone_floor_areas(building.geometry), zone_volumes(building.geometry)
        floors = {zone: floor.name for floor in building.geometry.floors for zone in floor.zone_names}
    else:
        areas = {zone.name: zone.floor_area for zone in building.geometry.zones}
        volumes = {zone.name: zone.volume for zone in building.geometry.zones}
        floors = {}
    summaries = []
    for zone in building.zone_names:
        devices = tuple(device.name for device in building.devices_of(zone))
        columns = [f"{entity}/{ZONE_TEMPERATURE}" for entity in (zone, *devices)]
        measured_by = tuple(column for column in columns if column in case.telemetry.frame)
        summaries.append(ZoneSummary(zone, floors.get(zone), areas[zone], volumes[zone], measured_by, devices))
    return tuple(summaries)


def summarise_devices(case: Case) -> tuple[DeviceSummary, ...]:
    """Summarise each device of a case.

    Parameters
    ----------
    case
        Case.

    Returns
    -------
    tuple of DeviceSummary
        In the order of the file.
    """
    points: dict[str, list[str]] = {}
    for column in case.telemetry.frame.columns:
        entity, point = split_column(str(column), "telemetry")
        points.setdefault(entity, []).append(point)
    return tuple(
        DeviceSummary(d.name, d.type, d.type in DEVICE_TYPES, d.zone, tuple(points.get(d.name, ())))
        for d in case.building.devices
    )


def summarise_points(case: Case) -> tuple[PointSummary, ...]:
    """Summarise each telemetry column of a case.

    Parameters
    ----------
    case
        Case.

    Returns
    -------
    tuple of PointSummary
        In the telemetry's order.
    """
    summaries = []
    for name in case.usable.columns:
        column = str(name)
        entity, point = split_column(column, "telemetry")
        kind, zone = _entity(case.building, entity)
        quantity = QUANTITIES[POINT_TYPES[point].quantity]
        values = case.usable[column].to_numpy(dtype=float)
        present = from_si(values[np.isfinite(values)], quantity.file_unit, POINT_TYPES[point].quantity)
        numbers = (present.min(), present.mean(), present.max()) if present.size else (None, None, None)
        lowest, mean, highest = (None if number is None else float(number) for number in numbers)
        share = present.size / len(values)
        meaning, unit = POINT_TYPES[point].meaning, quantity.file_unit
        summaries.append(PointSummary(column, entity, kind, zone, point, meaning, unit, lowest, mean, highest, share))
    return tuple(summaries)


def _entity(building: Building, entity: str) -> tuple[str, str | None]:
    if entity in building.zone_names:
        return "zone", entity
    if entity == building.weather_station:
        return "weather station", None
    if entity in building.measured_boundaries:
        return "boundary", None
    return "device", next((device.zone for device in building.devices if device.name == entity), None)
