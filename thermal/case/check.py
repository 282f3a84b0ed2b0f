"""Check of a case: what the library understood of it, summaries of its zones, devices and points."""

from dataclasses import dataclass, field
from os import PathLike
from typing import Any

import numpy as np
import pandas as pd

from thermal.case.building import Building, FloorPlans, Location
from thermal.case.case import Case
from thermal.case.load import load_case
from thermal.case.plan import zone_sizes
from thermal.case.plausibility.anomaly import Anomaly
from thermal.case.plausibility.examine import examine
from thermal.case.points import POINT_TYPES, ZONE_TEMPERATURE, split_column
from thermal.case.quality import QualityReport, plain
from thermal.case.validation import unknown_device_types
from thermal.components.registry import device_types
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
    plans = building.geometry.floors if isinstance(building.geometry, FloorPlans) else ()
    floors = {zone: floor.name for floor in plans for zone in floor.zone_names}
    sizes = zone_sizes(building)
    summaries = []
    for zone in building.zone_names:
        devices = tuple(device.name for device in building.devices_of(zone))
        columns = [f"{entity}/{ZONE_TEMPERATURE}" for entity in (zone, *devices)]
        measured_by = tuple(column for column in columns if column in case.telemetry.frame)
        summaries.append(ZoneSummary(zone, floors.get(zone), *sizes[zone], measured_by, devices))
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
        DeviceSummary(d.name, d.type, d.type in device_types(), d.zone, tuple(points.get(d.name, ())))
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


@dataclass(frozen=True, eq=False)
class CaseCheck:
    """What a look at a case found.

    Parameters
    ----------
    case
        The case itself (its plans, its telemetry); not part of `to_dict`.
    name
        Of the case.
    location
        Site.
    geometry
        ``floor plans`` or ``zone table``.
    floors
        Names of the floors, lowest first; empty in a zone table.
    zones, devices, points
        One entry each.
    measured_boundaries
        Spaces that are measured but not simulated.
    unknown_device_types
        Type by name of device, for types that the library does not know.
    start, end
        First and last stamp.
    step
        Time from a stamp to the next [s].
    n_time
        Number of stamps.
    remarks
        What is valid, and yet worth a look.
    quality
        Quality of the telemetry.
    anomalies
        What can hardly be true, the worst first.
    """

    case: Case = field(repr=False)
    name: str
    location: Location
    geometry: str
    floors: tuple[str, ...]
    zones: tuple[ZoneSummary, ...]
    devices: tuple[DeviceSummary, ...]
    points: tuple[PointSummary, ...]
    measured_boundaries: tuple[str, ...]
    unknown_device_types: dict[str, str]
    start: pd.Timestamp
    end: pd.Timestamp
    step: float
    n_time: int
    remarks: tuple[str, ...]
    quality: QualityReport
    anomalies: tuple[Anomaly, ...] = ()

    @property
    def is_fit_for_calibration(self) -> bool:
        """Whether nothing was found with which a calibration makes no sense."""
        return all(anomaly.severity != "error" for anomaly in self.anomalies)

    @property
    def floor_area(self) -> float:
        """Floor area of all zones [m2]."""
        return sum(zone.floor_area for zone in self.zones)

    @property
    def volume(self) -> float:
        """Volume of all zones [m3]."""
        return sum(zone.volume for zone in self.zones)

    def to_dict(self) -> dict[str, Any]:
        """Give the check as plain types, for JSON: no NaN, times in ISO 8601."""
        building = ("name", "location", "geometry", "floors", "floor_area", "volume", "zones", "devices")
        content = {key: plain(getattr(self, key)) for key in (*building, "unknown_device_types", "measured_boundaries")}
        content["telemetry"] = {
            **{"start": plain(self.start), "end": plain(self.end), "step_seconds": self.step, "stamps": self.n_time},
            **{"timezone": self.location.timezone, "points": plain(self.points)},
        }
        content |= {"remarks": list(self.remarks), "valid_for_calibration": self.is_fit_for_calibration}
        return content | {"anomalies": plain(self.anomalies), "quality": self.quality.to_dict()}


def check_case(path: str | PathLike[str]) -> CaseCheck:
    """Load a case folder and say what is in it.

    Parameters
    ----------
    path
        Case folder.

    Returns
    -------
    CaseCheck
        Building, points, quality of the telemetry, remarks.

    Raises
    ------
    CaseError
        One of its family, for the first thing that does not fit.

    Examples
    --------
    >>> check_case("../shared/cases/practice_none_prbs").floor_area  # doctest: +SKIP
    672.0
    """
    return describe_case(load_case(path))


def describe_case(case: Case) -> CaseCheck:
    """Say what is in a case that is loaded already.

    Parameters
    ----------
    case
        Case.

    Returns
    -------
    CaseCheck
        Building, points, quality of the telemetry, remarks.
    """
    building = case.building
    plans = building.geometry if isinstance(building.geometry, FloorPlans) else None
    return CaseCheck(
        case=case,
        name=building.name,
        location=building.location,
        geometry="floor plans" if plans else "zone table",
        floors=tuple(floor.name for floor in plans.floors) if plans else (),
        zones=summarise_zones(case),
        devices=summarise_devices(case),
        points=summarise_points(case),
        measured_boundaries=building.measured_boundaries,
        unknown_device_types=unknown_device_types(building),
        start=case.stamps[0],
        end=case.stamps[-1],
        step=case.step,
        n_time=len(case.stamps),
        remarks=case.remarks,
        quality=case.quality,
        anomalies=examine(case),
    )
