"""Cases: a building and a stretch of its telemetry, read from a folder."""

from thermal.case.areas import facade_areas, wall_shares, zone_floor_areas, zone_volumes
from thermal.case.building import Building, FloorPlan, FloorPlans, ZoneTable
from thermal.case.case import Case
from thermal.case.check import CaseCheck, check_case, describe_case
from thermal.case.load import load_case
from thermal.case.quality import ColumnQuality, Finding, QualityReport, assess, usable
from thermal.case.save import save_case
from thermal.case.schema import Airflow, Device, Layer, Location, Surface, ZoneEntry
from thermal.case.summary import DeviceSummary, PointSummary, ZoneSummary
from thermal.case.telemetry import Telemetry
from thermal.case.times import local_timestamp

__all__ = [
    "Airflow",
    "Building",
    "Case",
    "CaseCheck",
    "ColumnQuality",
    "Device",
    "DeviceSummary",
    "Finding",
    "FloorPlan",
    "FloorPlans",
    "Layer",
    "Location",
    "PointSummary",
    "QualityReport",
    "Surface",
    "Telemetry",
    "ZoneEntry",
    "ZoneSummary",
    "ZoneTable",
    "assess",
    "check_case",
    "describe_case",
    "facade_areas",
    "load_case",
    "local_timestamp",
    "save_case",
    "usable",
    "wall_shares",
    "zone_floor_areas",
    "zone_volumes",
]
