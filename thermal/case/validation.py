"""What must hold between the parts of a building: every name leads somewhere, every surface makes sense."""

from __future__ import annotations

from collections.abc import Collection, Mapping

from thermal.case.areas import facade_areas
from thermal.case.building import (
    EXTERIOR_WALL,
    GROUND,
    INTERIOR_WALL,
    OUTDOOR,
    OUTSIDE,
    Building,
    FloorPlans,
    ZoneTable,
)
from thermal.case.plan import check_plan
from thermal.case.points import ZONE_TEMPERATURE, split_column
from thermal.case.schema import FACADES, Surface
from thermal.errors import CaseError, describe, nearest

RESERVED = frozenset({OUTDOOR, GROUND, OUTSIDE, EXTERIOR_WALL, INTERIOR_WALL})
GLAZING_TOLERANCE = 1.01  # drawings are rounded: a facade may be overdrawn by 1 %
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


def check_columns(building: Building, columns: Collection[str], file: str) -> None:
    """Refuse telemetry columns of nothing, and boundaries that nothing measures.

    Parameters
    ----------
    building
        Building that the telemetry is of.
    columns
        Names of the telemetry's columns.
    file
        Telemetry file, for messages.

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
            column = f"{surface.other}/{ZONE_TEMPERATURE}"
            if surface.other in boundaries and column not in columns:
                where = f"building.yaml: surfaces[{index}] ({surface.name}): other"
                expected = f"a zone, outdoor, ground, or a boundary with the column {column!r} in {file}"
                raise CaseError(
                    describe(where, expected, repr(surface.other), nearest(surface.other, [*zones, OUTDOOR, GROUND]))
                )
    entities = [*(device.name for device in building.devices), *zones, *boundaries, building.weather_station]
    for column in columns:
        entity, _ = split_column(column, file)
        if entity not in entities:
            expected = "a device, a zone, a measured boundary or the weather station before the slash"
            raise CaseError(
                describe(f"{file}: column {column!r}", expected, repr(entity), nearest(entity, entities))
            )


def _check_zones(building: Building, file: str) -> None:
    places: dict[str, str] = {}
    if isinstance(building.geometry, FloorPlans):
        _check_unique({f"floors[{i}]": f.name for i, f in enumerate(building.geometry.floors)}, file)
        found = [(zone, f"floor {floor.name!r}") for floor in building.geometry.floors for zone in floor.zone_names]
    else:
        found = [(zone.name, f"zones[{i}]") for i, zone in enumerate(building.geometry.zones)]
    for zone, place in found:
        if zone in RESERVED:
            raise CaseError(
                describe(f"{file}: {place}", "a name of the zone's own", repr(zone), "rename the zone")
            )
        if zone in places:
            advice = "zone names are unique in the building: rename one"
            raise CaseError(describe(f"{file}: {place}", "a new zone", f"{zone!r}, as {places[zone]}", advice))
        places[zone] = place


def _check_unique(names: Mapping[str, str], file: str) -> None:
    places: dict[str, str] = {}
    for place, name in names.items():
        if name in places:
            found = f"{name!r}, which {places[name]} is named too"
            raise CaseError(describe(f"{file}: {place}", "a name of its own", found, "rename one"))
        places[name] = place


def _check_devices(building: Building, file: str) -> None:
    zones = building.zone_names
    names = {f"zone {zone!r}": zone for zone in zones}
    names |= {f"surfaces: other {boundary!r}": boundary for boundary in building.measured_boundaries}
    _check_unique(names | {"weather_station": building.weather_station}, file)
    _check_unique(names | {f"devices[{i}]": device.name for i, device in enumerate(building.devices)}, file)
    for i, device in enumerate(building.devices):
        if device.zone is not None and device.zone not in zones:
            where = f"{file}: devices[{i}] ({device.name}): zone"
            raise CaseError(
                describe(where, "a zone of the building", repr(device.zone), nearest(device.zone, zones))
            )


def _check_airflows(building: Building, file: str) -> None:
    devices = [device.name for device in building.devices]
    for i, airflow in enumerate(building.airflows):
        where = f"{file}: airflows[{i}]"
        for key, zone in (("from", airflow.source), ("to", airflow.target)):
            if zone not in building.zone_names:
                advice = nearest(zone, building.zone_names)
                raise CaseError(describe(f"{where}: {key}", "a zone of the building", repr(zone), advice))
        if airflow.device not in devices:
            advice = nearest(airflow.device, devices)
            raise CaseError(
                describe(f"{where}: device", "a device of the building", repr(airflow.device), advice)
            )
        if airflow.source == airflow.target:
            raise CaseError(describe(f"{where}: to", "another zone than 'from'", repr(airflow.target)))


def _check_glazing(plans: FloorPlans, file: str) -> None:
    areas = facade_areas(plans)
    for zone, by_facade in plans.glazing.items():
        if zone not in areas:
            where = f"{file}: glazing.{zone}"
            raise CaseError(describe(where, "a zone of the building", repr(zone), nearest(zone, areas)))
        for facade, area in by_facade.items():
            where = f"{file}: glazing.{zone}.{facade}"
            if facade not in FACADES:
                advice = nearest(facade, FACADES)
                raise CaseError(describe(where, f"a facade ({', '.join(FACADES)})", repr(facade), advice))
            if not area <= areas[zone][facade] * GLAZING_TOLERANCE:
                expected = f"at most the zone's {areas[zone][facade]:.2f} m2 of {facade} facade"
                advice = "correct the area, the facade, or the plan"
                raise CaseError(describe(where, expected, f"{area:g} m2", advice))


def _check_surfaces(table: ZoneTable, file: str) -> None:
    zones = [zone.name for zone in table.zones]
    _check_unique({f"surfaces[{i}]": surface.name for i, surface in enumerate(table.surfaces)}, file)
    for name, layers in table.constructions.items():
        if not layers:
            raise CaseError(describe(f"{file}: constructions.{name}", "at least one layer", "none"))
    for i, surface in enumerate(table.surfaces):
        where = f"{file}: surfaces[{i}] ({surface.name})"
        if surface.zone not in zones:
            advice = nearest(surface.zone, zones)
            raise CaseError(describe(f"{where}: zone", "a zone of the building", repr(surface.zone), advice))
        if surface.construction is not None and surface.construction not in table.constructions:
            advice = nearest(surface.construction, table.constructions)
            raise CaseError(
                describe(f"{where}: construction", "a name under 'constructions'", repr(surface.construction), advice)
            )
        _check_kind(surface, zones, where)


def _check_kind(surface: Surface, zones: Collection[str], where: str) -> None:
    needed = _PROPERTIES[surface.kind]
    for key in ("construction", "u_value", "solar_transmittance"):
        given = getattr(surface, key) is not None
        if key in needed and not given:
            raise CaseError(describe(f"{where}: {key}", f"a value, for a {surface.kind}", "none"))
        if given and key not in needed:
            advice = f"of kind {surface.kind}: {', '.join(sorted(needed)) or 'only an area'}"
            raise CaseError(describe(f"{where}: {key}", "no such key", repr(getattr(surface, key)), advice))
    if surface.other == OUTDOOR and surface.kind in {"wall", "window"} and surface.azimuth is None:
        advice = "give the degrees clockwise from north that the outer face looks to"
        raise CaseError(describe(f"{where}: azimuth", "a value", "none", advice))
    if surface.other == surface.zone and surface.kind not in _LAYERED:
        raise CaseError(
            describe(f"{where}: other", "something else than the zone itself", repr(surface.other))
        )
    if surface.kind == "opening" and surface.other not in zones:
        advice = nearest(surface.other, zones)
        raise CaseError(describe(f"{where}: other", "a zone, for an opening", repr(surface.other), advice))
