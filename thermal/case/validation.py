"""What must hold between the parts of a building, and what is worth a remark."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from graphlib import CycleError, TopologicalSorter

import numpy as np
from scipy import ndimage

from thermal.case import points
from thermal.case.building import (
    FACADES,
    GROUND,
    INTERIOR_WALL,
    OUTDOOR,
    OUTSIDE,
    PLAN_TOKENS,
    Building,
    Device,
    FloorPlans,
    Surface,
    ZoneTable,
)
from thermal.case.commands import air_column, commanded_devices
from thermal.case.emitters import is_heater
from thermal.case.plan import check_plan, facade_areas
from thermal.case.telemetry import Telemetry
from thermal.components.registry import device_types
from thermal.errors import CaseError, nearest, some_of

_ZONE, _DEVICE = "a zone of the building", "a device of the building"
RESERVED = frozenset({OUTDOOR, GROUND, *PLAN_TOKENS})
GLAZING_TOLERANCE = 1.01  # drawings are rounded: a facade may be overdrawn by 1 %
_OF_DEVICES = (points.SUPPLY_FLOW, points.DISCHARGE_TEMPERATURE, points.HEATING_POWER)
_LAYERED = frozenset({"wall", "floor", "ceiling"})
_PROPERTIES: dict[str, frozenset[str]] = {  # what a kind needs; what another kind needs it must not have
    **dict.fromkeys(_LAYERED, frozenset({"construction"})),
    "window": frozenset({"u_value", "solar_transmittance"}),
    "bridge": frozenset({"u_value"}),
    "opening": frozenset(),
}


def check_building(
    building: Building, plan_files: Mapping[str, str] | None = None, file: str = "building.yaml"
) -> None:
    """Refuse a building whose parts do not fit together.

    Parameters
    ----------
    building
        Building to check.
    plan_files
        File by floor name, for messages; default the floors' names.
    file
        Name for messages.

    Raises
    ------
    CaseError
        One of its family, for the first thing that does not fit.

    Notes
    -----
    Whether a measured boundary is measured is for `check_columns` to say, which sees the telemetry.
    """
    if isinstance(building.geometry, FloorPlans):
        for floor in building.geometry.floors:
            check_plan(floor.tokens, (plan_files or {}).get(floor.name, f"plan of floor {floor.name!r}"))
    _check_zones(building, file)
    _check_devices(building, file)
    _check_airflows(building, file)
    if isinstance(building.geometry, FloorPlans):
        _check_glazing(building.geometry, file)
    else:
        _check_surfaces(building.geometry, file)


def check_columns(building: Building, columns: Collection[str], file: str, *, check_boundaries: bool = True) -> None:
    """Refuse telemetry columns of nothing, and boundaries that nothing measures.

    Parameters
    ----------
    building
        Building that the telemetry is of.
    columns
        Names of the telemetry's columns.
    file
        Telemetry file, for messages.
    check_boundaries
        Whether each boundary must be measured.

    Raises
    ------
    CaseError
        A surface's `other` is no zone, ``outdoor`` or ``ground``, and no column holds its temperature.
    CaseError
        A column's entity is no device, zone, boundary or weather station.
    """
    zones, boundaries = building.zone_names, building.measured_boundaries
    if isinstance(building.geometry, ZoneTable):
        for index, surface in enumerate(building.geometry.surfaces):
            column = f"{surface.other}/{points.ZONE_TEMPERATURE}"
            if check_boundaries and surface.other in boundaries and column not in columns:
                where = f"building.yaml: surfaces[{index}] ({surface.name}): other"
                expected = f"a zone, outdoor, ground, or a boundary with the column {column!r} in {file}"
                CaseError.unless_known(surface.other, [*zones, OUTDOOR, GROUND], where, expected)
    entities = [*(device.name for device in building.devices), *zones, *boundaries, building.weather_station]
    for column in columns:
        expected = "a device, a zone, a measured boundary or the weather station before the slash"
        CaseError.unless_known(points.split_column(column, file)[0], entities, f"{file}: column {column!r}", expected)


def _check_zones(building: Building, file: str) -> None:
    places: dict[str, str] = {}
    if isinstance(building.geometry, FloorPlans):
        _check_unique({f"floors[{i}]": f.name for i, f in enumerate(building.geometry.floors)}, file)
        found = [(zone, f"floor {floor.name!r}") for floor in building.geometry.floors for zone in floor.zone_names]
    else:
        found = [(zone.name, f"zones[{i}]") for i, zone in enumerate(building.geometry.zones)]
    for zone, place in found:
        if zone in RESERVED:
            raise CaseError(f"{file}: {place}", "a name of the zone's own", repr(zone), "rename the zone")
        if zone in places:
            advice = "zone names are unique in the building: rename one"
            raise CaseError(f"{file}: {place}", "a new zone", f"{zone!r}, as {places[zone]}", advice)
        places[zone] = place


def _check_unique(names: Mapping[str, str], file: str) -> None:
    places: dict[str, str] = {}
    for place, name in names.items():
        if name in places:
            found = f"{name!r}, which {places[name]} is named too"
            raise CaseError(f"{file}: {place}", "a name of its own", found, "rename one")
        places[name] = place


def _check_devices(building: Building, file: str) -> None:
    zones = building.zone_names
    names = {f"zone {zone!r}": zone for zone in zones}
    names |= {f"surfaces: other {boundary!r}": boundary for boundary in building.measured_boundaries}
    _check_unique(names | {"weather_station": building.weather_station}, file)
    _check_unique(names | {f"devices[{i}]": device.name for i, device in enumerate(building.devices)}, file)
    for i, device in enumerate(building.devices):
        if device.zone is not None:
            CaseError.unless_known(device.zone, zones, f"{file}: devices[{i}] ({device.name}): zone", _ZONE)
        if device.emitter not in (None, "air") and not is_heater(device):
            found = f"{device.emitter!r} of a device of type {device.type!r}{'' if device.zone else ' without a zone'}"
            where, expected = f"{file}: devices[{i}] ({device.name}): emitter", "'air', or a heater that serves a zone"
            raise CaseError(where, expected, found, "drop the emitter")
    _check_feeders(building.devices, file)


def _check_feeders(devices: Sequence[Device], file: str) -> None:
    """Refuse feeders that are not there, and devices that feed themselves, through others too."""
    fed_by = {device.name: device.fed_by for device in devices}
    for i, device in enumerate(devices):
        where = f"{file}: devices[{i}] ({device.name}): fed_by"
        for feeder in device.fed_by:
            CaseError.unless(feeder != device.name, where, "other devices", f"{feeder!r}, the device itself", "drop it")
            CaseError.unless_known(feeder, [name for name in fed_by if name != device.name], where, _DEVICE)
        if len({*device.fed_by}) < len(device.fed_by):
            raise CaseError(where, "each feeder once", ", ".join(device.fed_by), "drop one")
    try:
        TopologicalSorter(fed_by).prepare()
    except CycleError as error:
        circle = error.args[1][::-1]
        i = next(i for i, device in enumerate(devices) if device.name == circle[0])
        where = f"{file}: devices[{i}] ({circle[0]}): fed_by"
        raise CaseError(where, "feeders without a circle", " <- ".join(circle), "drop one of them") from error


def _check_airflows(building: Building, file: str) -> None:
    devices = [device.name for device in building.devices]
    for i, airflow in enumerate(building.airflows):
        where = f"{file}: airflows[{i}]"
        for key, zone in (("from", airflow.source), ("to", airflow.target)):
            CaseError.unless_known(zone, building.zone_names, f"{where}: {key}", _ZONE)
        CaseError.unless_known(airflow.device, devices, f"{where}: device", _DEVICE)
        if airflow.source == airflow.target:
            raise CaseError(f"{where}: to", "another zone than 'from'", repr(airflow.target))


def _check_glazing(plans: FloorPlans, file: str) -> None:
    areas = facade_areas(plans)
    for zone, by_facade in plans.glazing.items():
        CaseError.unless_known(zone, areas, f"{file}: glazing.{zone}", _ZONE)
        for facade, area in by_facade.items():
            where = f"{file}: glazing.{zone}.{facade}"
            CaseError.unless_known(facade, FACADES, where, f"a facade ({', '.join(FACADES)})")
            if not area <= areas[zone][facade] * GLAZING_TOLERANCE:
                expected = f"at most the zone's {areas[zone][facade]:.2f} m2 of {facade} facade"
                raise CaseError(where, expected, f"{area:g} m2", "correct the area, the facade, or the plan")


def _check_surfaces(table: ZoneTable, file: str) -> None:
    zones = [zone.name for zone in table.zones]
    _check_unique({f"surfaces[{i}]": surface.name for i, surface in enumerate(table.surfaces)}, file)
    for name, layers in table.constructions.items():
        CaseError.unless(layers, f"{file}: constructions.{name}", "at least one layer", "none")
    for i, surface in enumerate(table.surfaces):
        where = f"{file}: surfaces[{i}] ({surface.name})"
        CaseError.unless_known(surface.zone, zones, f"{where}: zone", _ZONE)
        if surface.construction is not None:
            layered, expected = table.constructions, "a name under 'constructions'"
            CaseError.unless_known(surface.construction, layered, f"{where}: construction", expected)
        _check_kind(surface, zones, where)


def _check_kind(surface: Surface, zones: Collection[str], where: str) -> None:
    needed = _PROPERTIES[surface.kind]
    for key in ("construction", "u_value", "solar_transmittance"):
        given = getattr(surface, key) is not None
        CaseError.unless(key not in needed or given, f"{where}: {key}", f"a value, for a {surface.kind}", "none")
        if given and key not in needed:
            advice = f"of kind {surface.kind}: {', '.join(sorted(needed)) or 'only an area'}"
            raise CaseError(f"{where}: {key}", "no such key", repr(getattr(surface, key)), advice)
    if surface.other == OUTDOOR and surface.kind in {"wall", "window"} and surface.azimuth is None:
        advice = "give the degrees clockwise from north that the outer face looks to"
        raise CaseError(f"{where}: azimuth", "a value", "none", advice)
    if surface.other == surface.zone and surface.kind not in _LAYERED:
        raise CaseError(f"{where}: other", "something else than the zone itself", repr(surface.other))
    if surface.kind == "opening":
        CaseError.unless_known(surface.other, zones, f"{where}: other", "a zone, for an opening")


#: What tells the heat of a device without a meter, and how many devices are named in one sentence.
_TOLD, _NAMED = {"damper": "dampers", "valve": "valves", "counter": "the counter of their feeder"}, 5
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
        *((NO_WINDOWS,) if not has_windows(building) else ()),
        *_on_plans(building),
        *_on_devices(building, columns),
        *_on_airflows(building, columns),
        *_on_temperatures(building, columns),
        *_on_entities(building, columns),
        *(f"column {column!r} never reports a value" for column in silent),
    )


#: What is said of a building that has no window at all.
NO_WINDOWS = (
    "the building has no windows: without any, the model lets no sun in, and a calibration puts the sun's heat into "
    "other parameters; give window-to-wall ratios on the page (buildingmpc label CASE, tab Building), or areas under "
    "'glazing', or surfaces of kind 'window'"
)


def has_windows(building: Building) -> bool:
    """Tell whether a building has glazing at all.

    Parameters
    ----------
    building
        With plans or a zone table.
    """
    geometry = building.geometry
    if isinstance(geometry, FloorPlans):
        return any(area > 0.0 for by_facade in geometry.glazing.values() for area in by_facade.values())
    return any(surface.kind == "window" for surface in geometry.surfaces)


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
    return {device.name: device.type for device in building.devices if device.type not in device_types()}


def _on_plans(building: Building) -> Iterator[str]:
    if isinstance(building.geometry, FloorPlans):
        for floor in building.geometry.floors:
            outside = ndimage.binary_dilation(floor.tokens == OUTSIDE, border_value=1)
            if cells := np.count_nonzero(outside & (floor.tokens == INTERIOR_WALL)):
                yield f"floor {floor.name!r}: {cells} cells of interior wall ('+') touch the outside; draw '#' there"


def _on_devices(building: Building, columns: set[str]) -> Iterator[str]:
    commanded = commanded_devices(building, columns)
    for what, meaning in _TOLD.items():
        named = [own.device for own in commanded if own.kind == what]
        if named:
            yield f"heat that no meter tells is fitted to {meaning}: {some_of(named, _NAMED)}"
    told = {own.device for own in commanded} | {column.partition("/")[0] for own in commanded for column in own.columns}
    for name, kind in unknown_device_types(building).items():
        yield f"device {name!r} has the unknown type {kind!r} ({nearest(kind, device_types())})"
    for device in building.devices:
        has = {point for point in _OF_DEVICES if f"{device.name}/{point}" in columns}
        if not any(column.startswith(f"{device.name}/") for column in columns):
            yield f"device {device.name!r} has no telemetry"
        if device.zone is None:
            if device.name in told:
                continue
            if device.type in TERMINAL_TYPES or has & {points.HEATING_POWER, points.DISCHARGE_TEMPERATURE}:
                yield f"device {device.name!r} ({device.type}) serves no zone: its heat is not counted"
        elif device.name in told:
            continue
        elif has == {points.DISCHARGE_TEMPERATURE} or (device.type in TERMINAL_TYPES and not has):
            yield f"device {device.name!r} reports neither flow nor power: the heat of zone {device.zone!r} is unknown"
        elif points.SUPPLY_FLOW in has and air_column(building, device, columns) is None:
            zone = f"the heat of zone {device.zone!r} is unknown while air flows"
            yield f"device {device.name!r} reports a flow without a discharge temperature: {zone}"


def _on_airflows(building: Building, columns: set[str]) -> Iterator[str]:
    zone_of = {device.name: device.zone for device in building.devices}
    for name in dict.fromkeys(airflow.device for airflow in building.airflows):
        if f"{name}/{points.SUPPLY_FLOW}" not in columns:
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
        if not any(f"{entity}/{points.ZONE_TEMPERATURE}" in columns for entity in entities):
            yield f"nothing measures the temperature of zone {zone!r}"
    if f"{building.weather_station}/{points.OUTDOOR_TEMPERATURE}" not in columns:
        others = sorted(column for column in columns if column.endswith(f"/{points.OUTDOOR_TEMPERATURE}"))
        source = f"{', '.join(others)} stands in" if others else "nothing measures the outdoors"
        yield f"the weather station {building.weather_station!r} has no {points.OUTDOOR_TEMPERATURE}: {source}"


def _on_entities(building: Building, columns: set[str]) -> Iterator[str]:
    places = {*building.zone_names, *building.measured_boundaries, building.weather_station}
    devices = {device.name: device for device in building.devices}
    for column in sorted(columns):
        entity, _, point = column.rpartition("/")
        if entity in places and point in _OF_DEVICES:
            yield f"column {column!r} is not of a device: it is not used"
        if entity in devices and point == points.ZONE_TEMPERATURE and devices[entity].zone is None:
            yield f"column {column!r} is of a device that serves no zone: it is not used"
