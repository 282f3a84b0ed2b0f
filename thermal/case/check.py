"""Checking a case: everything a user wants to know of it before a model sees it."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from os import PathLike
from typing import Any

import pandas as pd

from thermal.case.building import FloorPlans
from thermal.case.case import Case
from thermal.case.load import load_case
from thermal.case.quality import QualityReport
from thermal.case.remarks import unknown_device_types
from thermal.case.schema import Location
from thermal.case.summary import (
    DeviceSummary,
    PointSummary,
    ZoneSummary,
    summarise_devices,
    summarise_points,
    summarise_zones,
)


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
        return {
            "name": self.name,
            "location": self.location.model_dump(),
            "geometry": self.geometry,
            "floors": list(self.floors),
            "floor_area": self.floor_area,
            "volume": self.volume,
            "zones": [_listed(asdict(zone)) for zone in self.zones],
            "devices": [_listed(asdict(device)) for device in self.devices],
            "unknown_device_types": dict(self.unknown_device_types),
            "measured_boundaries": list(self.measured_boundaries),
            "telemetry": {
                "start": self.start.isoformat(),
                "end": self.end.isoformat(),
                "step_seconds": self.step,
                "stamps": self.n_time,
                "timezone": self.location.timezone,
                "points": [asdict(point) for point in self.points],
            },
            "remarks": list(self.remarks),
            "quality": self.quality.to_dict(),
        }


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
    )


def _listed(content: dict[str, Any]) -> dict[str, Any]:
    return {key: list(value) if isinstance(value, tuple) else value for key, value in content.items()}
