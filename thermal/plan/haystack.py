"""Devices of a Project Haystack export: JSON of versions 3 and 4, and Zinc (project-haystack.org/doc)."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from thermal.errors import PlanError, describe
from thermal.plan.devices import DeviceImport, ListedPoint, device_type, import_devices, key

Entity = dict[str, str]

#: Value of a marker tag, once read.
MARKER = "\u2713"

_EQUIPMENT = {
    "vav": "vav",
    "cav": "vav",
    "fcu": "fan_coil",
    "ahu": "ahu",
    "rtu": "ahu",
    "doas": "ahu",
    "boiler": "boiler",
    "chiller": "chiller",
    "radiator": "radiator",
    "unitHeater": "electric_heater",
}

# Tags that a point must have, most demanding first.
_POINTS: tuple[tuple[frozenset[str], str], ...] = tuple(
    (frozenset(tags.split()), point)
    for tags, point in (
        ("zone air temp heating sp", "zone_air_heating_temperature_setpoint"),
        ("zone air temp cooling sp", "zone_air_cooling_temperature_setpoint"),
        ("zone air temp sensor", "zone_air_temperature_sensor"),
        ("zone air co2 sensor", "zone_air_co2_concentration_sensor"),
        ("discharge air temp sensor", "discharge_air_temperature_sensor"),
        ("discharge air temp sp", "supply_air_temperature_setpoint"),
        ("discharge air flow sensor", "supply_air_flowrate_sensor"),
        ("mixed air temp sensor", "mixed_air_temperature_sensor"),
        ("return air temp sensor", "return_air_temperature_sensor"),
        ("outside air temp sensor", "outside_air_temperature_sensor"),
        ("leaving hot water temp sensor", "supply_water_temperature_sensor"),
        ("leaving hot water temp sp", "supply_water_temperature_setpoint"),
        ("entering hot water temp sensor", "return_water_temperature_sensor"),
        ("damper cmd", "supply_air_damper_percentage_command"),
        ("heating valve cmd", "heating_water_valve_percentage_command"),
        ("hot water valve cmd", "heating_water_valve_percentage_command"),
        ("reheat cmd", "heating_water_valve_percentage_command"),
    )
)
_AT_AIR_HANDLER = {"discharge_air_temperature_sensor": "supply_air_temperature_sensor"}
_CELL = re.compile(r'\s*((?:"(?:\\.|[^"\\])*"|`[^`]*`|@\S+?(?=[ ,]|$)|[^,"`@]|@)*)\s*(?:,|$)')


def read_haystack(file: Path, zones: Sequence[str]) -> DeviceImport:
    """Read the devices of a Haystack export.

    Parameters
    ----------
    file : Path
        JSON or Zinc.
    zones : sequence of str
        Zones of the building; a device's is its ``spaceRef``, or the part of its name that is a zone's.

    Returns
    -------
    DeviceImport
        Devices and their points; a point's column is its ``id``.

    Raises
    ------
    PlanError
        The file is neither, or has no equipment.
    """
    entities = _read_json(file) if file.suffix.lower() == ".json" else _read_zinc(file)
    by_id = {entity["id"]: entity for entity in entities if "id" in entity}
    rows, kinds = [], {}
    for entity in entities:
        if "equip" not in entity or "id" not in entity:
            continue
        kind = next((meaning for tag, meaning in _EQUIPMENT.items() if tag in entity), None)
        kind = kind or device_type(_name(entity)) or ""
        if kind or "hvac" in entity:
            kinds[entity["id"]] = (_name(entity), kind)
            rows.append((_name(entity), kind, _zone(entity, by_id, zones)))
    points = []
    for entity in entities:
        owner = kinds.get(entity.get("equipRef", ""))
        if "point" in entity and owner is not None:
            points.append(ListedPoint(entity.get("id", _name(entity)), owner[0], _point(entity, owner[1])))
    if not rows:
        raise PlanError(describe(file.name, "entities with the tag 'equip'", f"none of {len(entities)}"))
    return import_devices(rows, zones, file.name, points)


def _name(entity: Entity) -> str:
    return entity.get("navName") or entity.get("dis") or entity.get("id", "")


def _zone(entity: Entity, by_id: Mapping[str, Entity], zones: Sequence[str]) -> str:
    for tag in ("spaceRef", "zoneRef", "roomRef", "hvacZoneRef"):
        if tag in entity:
            space = by_id.get(entity[tag], {})
            return _name(space) or entity[tag]
    words = key(_name(entity))
    inside = [z for z in zones if any(words[i : i + len(key(z))] == key(z) for i in range(len(words)))]
    return max(inside, key=len, default="")


def _point(entity: Entity, kind: str) -> str:
    found = next((point for tags, point in _POINTS if tags <= entity.keys()), "")
    return _AT_AIR_HANDLER.get(found, found) if kind == "ahu" else found


def _read_json(file: Path) -> list[Entity]:
    try:
        content = json.loads(file.read_text(encoding="utf-8-sig"))
    except (OSError, UnicodeDecodeError, ValueError, RecursionError) as error:
        raise PlanError(describe(file.name, "JSON", " ".join(str(error).split())[:200])) from error
    rows = content.get("rows") if isinstance(content, dict) else content
    if not isinstance(rows, list) or not all(isinstance(row, dict) for row in rows):
        raise PlanError(describe(file.name, "a Haystack grid with 'rows'", type(content).__name__))
    return [{tag: text for tag, value in row.items() if (text := _json_value(value))} for row in rows]


def _json_value(value: Any) -> str:
    """Text of a value of either version; references without their @ and name, markers as `MARKER`."""
    if isinstance(value, dict):
        kind = value.get("_kind")
        return MARKER if kind == "marker" else str(value.get("val", "")).removeprefix("@")
    if value is True:
        return MARKER
    if not isinstance(value, str):
        return "" if value in (None, False) or isinstance(value, list) else str(value)
    if value == "m:":
        return MARKER
    if value.startswith("r:"):
        return value[2:].partition(" ")[0].removeprefix("@")
    return value[2:] if re.match(r"[a-z]:", value) else value


def _read_zinc(file: Path) -> list[Entity]:
    try:
        lines = file.read_text(encoding="utf-8-sig").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise PlanError(describe(file.name, "Zinc in UTF-8", str(error))) from error
    if len(lines) < 2 or not lines[0].startswith("ver:"):
        raise PlanError(describe(file.name, "Zinc, which begins with 'ver:'", repr("".join(lines[:1])[:40])))
    tags = [re.match(r"\s*(\w*)", cell)[1] for cell in _cells(lines[1])]  # type: ignore[index]
    entities = []
    for number, line in enumerate(lines[2:], start=3):
        if not line.strip():
            break
        cells = _cells(line)
        if len(cells) > len(tags):
            found = f"{len(cells)} of {len(tags)}"
            raise PlanError(describe(f"{file.name}: line {number}", "as many cells as columns", found))
        values = (_zinc_value(cell) for cell in cells)
        entities.append({tag: value for tag, value in zip(tags, values, strict=False) if value})
    return entities


def _cells(line: str) -> list[str]:
    """Cells of a line of Zinc; commas in quotes part nothing."""
    cells: list[str] = []
    place = 0
    while True:
        match = _CELL.match(line, place)
        if match is None:
            return [*cells, line[place:].strip()]
        cells.append(match[1].strip())
        place = match.end()
        if place >= len(line):
            return [*cells, ""] if line.endswith(",") and match.end() > match.end(1) else cells


def _zinc_value(cell: str) -> str:
    if cell in ("M", "T"):
        return MARKER
    if cell in ("", "N", "F", "R", "NA"):
        return ""
    if cell.startswith("@"):
        return cell[1:].partition(" ")[0]
    if cell.startswith('"'):
        try:
            return str(json.loads(cell))
        except ValueError:
            return cell.strip('"')
    return cell
