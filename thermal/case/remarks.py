"""Remarks on a case: what is valid, and yet will not do what its author may think."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from thermal.case.areas import FACADE_STEPS
from thermal.case.building import INTERIOR_WALL, OUTSIDE, Building, FloorPlan, FloorPlans
from thermal.case.points import (
    DISCHARGE_TEMPERATURE,
    HEATING_POWER,
    OUTDOOR_TEMPERATURE,
    SUPPLY_FLOW,
    ZONE_TEMPERATURE,
)
from thermal.case.schema import DEVICE_TYPES
from thermal.case.telemetry import Telemetry
from thermal.errors import nearest

TERMINAL_TYPES = frozenset({"vav", "fan_coil", "electric_heater", "radiator", "supply_air_terminal"})
"""Devices that give heat to the zone they serve: without flow or power, that heat is unknown."""


def remarks(building: Building, telemetry: Telemetry) -> tuple[str, ...]:
    """List what is valid in a case, and yet worth a look.

    Parameters
    ----------
    building
        Building of the case.
    telemetry
        Telemetry of the case.

    Returns
    -------
    tuple of str
        One sentence each; empty when there is nothing to say.
    """
    columns = {str(column) for column in telemetry.frame.columns}
    silent = [str(column) for column in telemetry.frame.columns if telemetry.frame[column].isna().all()]
    return (
        *_on_plans(building),
        *_on_devices(building, columns),
        *_on_airflows(building, columns),
        *_on_temperatures(building, columns),
        *_on_entities(building, columns),
        *(f"column {column!r} never reports a value" for column in silent),
    )


def unknown_device_types(building: Building) -> dict[str, str]:
    """Find devices of a type that the library does not know: they are read, and reported.

    Parameters
    ----------
    building
        Building with devices.

    Returns
    -------
    dict
        Type by name of the device.
    """
    return {device.name: device.type for device in building.devices if device.type not in DEVICE_TYPES}


def _on_plans(building: Building) -> Iterator[str]:
    if isinstance(building.geometry, FloorPlans):
        for floor in building.geometry.floors:
            cells = _open_partitions(floor)
            if cells:
                yield f"floor {floor.name!r}: {cells} cells of interior wall ('+') touch the outside; draw '#' there"


def _open_partitions(floor: FloorPlan) -> int:
    outside = np.pad(floor.tokens == OUTSIDE, 1, constant_values=True)
    n_row, n_col = floor.tokens.shape
    touching = np.zeros(floor.tokens.shape, dtype=bool)
    for d_row, d_col in FACADE_STEPS.values():
        touching |= outside[1 + d_row : 1 + d_row + n_row, 1 + d_col : 1 + d_col + n_col]
    return int(np.count_nonzero(touching & (floor.tokens == INTERIOR_WALL)))


def _on_devices(building: Building, columns: set[str]) -> Iterator[str]:
    for name, kind in unknown_device_types(building).items():
        yield f"device {name!r} has the unknown type {kind!r} ({nearest(kind, DEVICE_TYPES)})"
    for device in building.devices:
        has = {p for p in (SUPPLY_FLOW, DISCHARGE_TEMPERATURE, HEATING_POWER) if f"{device.name}/{p}" in columns}
        if not any(column.startswith(f"{device.name}/") for column in columns):
            yield f"device {device.name!r} has no telemetry"
        if device.zone is None:
            if device.type in TERMINAL_TYPES or has & {HEATING_POWER, DISCHARGE_TEMPERATURE}:
                yield f"device {device.name!r} ({device.type}) serves no zone: its heat is not counted"
        elif has == {DISCHARGE_TEMPERATURE} or (device.type in TERMINAL_TYPES and not has):
            yield f"device {device.name!r} reports neither flow nor power: the heat of zone {device.zone!r} is unknown"
        elif SUPPLY_FLOW in has and DISCHARGE_TEMPERATURE not in has:
            zone = f"the heat of zone {device.zone!r} is unknown while air flows"
            yield f"device {device.name!r} reports a flow without a discharge temperature: {zone}"


def _on_airflows(building: Building, columns: set[str]) -> Iterator[str]:
    zone_of = {device.name: device.zone for device in building.devices}
    for name in dict.fromkeys(airflow.device for airflow in building.airflows):
        if f"{name}/{SUPPLY_FLOW}" not in columns:
            yield f"airflows: device {name!r} reports no flow: the air that goes on is unknown"
        surplus: dict[str, float] = {}
        for airflow in building.airflows:
            if airflow.device == name:
                surplus[airflow.source] = surplus.get(airflow.source, 0.0) - airflow.fraction
                surplus[airflow.target] = surplus.get(airflow.target, 0.0) + airflow.fraction
        for zone, share in surplus.items():
            if share + (1.0 if zone_of[name] == zone else 0.0) < -1e-6:
                yield f"airflows: more of the air of {name!r} leaves zone {zone!r} than enters it"


def _on_temperatures(building: Building, columns: set[str]) -> Iterator[str]:
    for zone in building.zone_names:
        entities = [zone, *(device.name for device in building.devices_of(zone))]
        if not any(f"{entity}/{ZONE_TEMPERATURE}" in columns for entity in entities):
            yield f"nothing measures the temperature of zone {zone!r}"
    if f"{building.weather_station}/{OUTDOOR_TEMPERATURE}" not in columns:
        others = sorted(column for column in columns if column.endswith(f"/{OUTDOOR_TEMPERATURE}"))
        source = f"{', '.join(others)} stands in" if others else "nothing measures the outdoors"
        yield f"the weather station {building.weather_station!r} has no {OUTDOOR_TEMPERATURE}: {source}"


def _on_entities(building: Building, columns: set[str]) -> Iterator[str]:
    places = {*building.zone_names, *building.measured_boundaries, building.weather_station}
    devices = {device.name: device for device in building.devices}
    for column in sorted(columns):
        entity, _, point = column.rpartition("/")
        if entity in places and point in {SUPPLY_FLOW, DISCHARGE_TEMPERATURE, HEATING_POWER}:
            yield f"column {column!r} is not of a device: it is not used"
        if entity in devices and point == ZONE_TEMPERATURE and devices[entity].zone is None:
            yield f"column {column!r} is of a device that serves no zone: it is not used"
