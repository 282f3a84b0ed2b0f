"""Device models: lists as CSV, Brick (Turtle) and Project Haystack (JSON, Zinc)."""

import json
import re
from collections.abc import Mapping, Sequence
from functools import cache
from os import PathLike
from pathlib import Path
from typing import Any

from thermal.errors import PlanError
from thermal.plan.devices import DeviceImport, ListedPoint, device_type, import_devices, key, read_rows
from thermal.plan.guard import checked_file, extra, reading, vocabulary

_BRICK, _REF = "https://brickschema.org/schema/Brick#", "https://brickschema.org/schema/Brick/ref#"

_BRICK_EQUIPMENT, _BRICK_POINTS = vocabulary("brick_equipment"), vocabulary("brick_points")

_AT_AIR_HANDLER = {"discharge_air_temperature_sensor": "supply_air_temperature_sensor"}


def read_devices(path: str | PathLike[str], zones: Sequence[str]) -> DeviceImport:
    """Read a list of devices.

    Parameters
    ----------
    path : str or path
        CSV with a column of names and columns of types, zones and feeders (``;`` between two); a Brick model
        (``.ttl``); Haystack as JSON or Zinc.
    zones : sequence of str
        Zones of the building.

    Returns
    -------
    DeviceImport
        Devices, and what could not be placed.

    Raises
    ------
    PlanError
        The file is missing or of another kind.
    PlanError
        It cannot be understood.
    """
    file = checked_file(Path(path), (".csv", ".ttl", ".json", ".zinc"))
    if file.suffix.lower() == ".ttl":
        return read_brick(file, zones)
    if file.suffix.lower() in (".json", ".zinc"):
        return read_haystack(file, zones)
    rows = read_rows(file)
    fed_by = {row["name"]: re.split(r"\s*[;,]\s*", row.get("fed_by", "")) for row in rows}
    named = ((row["name"], row.get("type", ""), row.get("zone", "")) for row in rows)
    return import_devices(named, zones, file.name, fed_by=fed_by)


def read_brick(file: Path, zones: Sequence[str]) -> DeviceImport:
    """Read the devices of a Brick model.

    Parameters
    ----------
    file : Path
        Turtle.
    zones : sequence of str
        Zones of the building; a device's is what it feeds, or a part of that, or where it stands.

    Returns
    -------
    DeviceImport
        Devices and their points; a point's column is its timeseries identifier where the model has one.

    Raises
    ------
    PlanError
        It is no Turtle, or describes no equipment that serves a building's zones.
    """
    rdf = extra("rdflib")
    graph = rdf.Graph()
    with reading(file, "a Brick model in Turtle", Exception):  # rdflib's parser raises its own, and plain ones
        graph.parse(data=file.read_text(encoding="utf-8"), format="turtle")
    model = _Model(graph, rdf)
    keys = {key(zone) for zone in zones}
    rows, points, fed_by = [], [], {}
    for subject, kind in model.instances(_BRICK_EQUIPMENT):
        name = model.name(subject)
        zone = model.zone(subject, keys)
        rows.append((name, kind, zone))
        fed_by[name] = model.feeders(subject)
        points += model.points(subject, name, kind)
    PlanError.unless(rows, file.name, "equipment of Brick", "none", "does it declare brick:VAV, brick:AHU and so on?")
    rows.sort(key=lambda row: row[0])
    return import_devices(rows, zones, file.name, sorted(points, key=lambda p: p.column), fed_by)


class _Model:
    """A graph of statements, asked in the words of this module."""

    def __init__(self, graph: Any, rdf: Any) -> None:
        self.graph, self.rdf = graph, rdf
        self.brick = rdf.Namespace(_BRICK)

    def instances(self, classes: dict[str, str]) -> list[tuple[Any, str]]:
        """Subjects whose class is, or descends from, one of `classes`, with what that means."""
        found: dict[Any, str] = {}
        for subject, kind in self.graph.subject_objects(self.rdf.RDF.type):
            meaning = self._meaning(kind, classes)
            if meaning:
                found.setdefault(subject, meaning)
        return list(found.items())

    def _meaning(self, kind: Any, classes: dict[str, str]) -> str:
        """Say what the nearest of a class's ancestors means, the model's own classes among them."""
        level, seen = [str(kind)], {str(kind)}
        while level:
            for name in level:
                meaning = classes.get(name.removeprefix(_BRICK))
                if meaning:
                    return meaning
            above = [parent for name in level for parent in _parents().get(name, ())]
            above += [str(o) for n in level for o in self.graph.objects(self.rdf.URIRef(n), self.rdf.RDFS.subClassOf)]
            level = [name for name in dict.fromkeys(above) if name not in seen]
            seen.update(level)
        return ""

    def name(self, subject: Any) -> str:
        label = self.graph.value(subject, self.rdf.RDFS.label)
        return str(label) if label is not None else _local(subject)

    def feeders(self, subject: Any) -> list[str]:
        """Names of the equipment that feeds a device."""
        fed = [*self.graph.subjects(self.brick.feeds, subject), *self.graph.objects(subject, self.brick.isFedBy)]
        return sorted(self.name(s) for s in fed if self._is_equipment(s))

    def zone(self, subject: Any, keys: set[tuple[str, ...]]) -> str:
        """Find the zone among what a device feeds, the parts of that, and where it stands."""
        brick, graph = self.brick, self.graph
        fed = [*graph.objects(subject, brick.feeds), *graph.subjects(brick.isFedBy, subject)]
        parts = [part for space in fed for part in graph.objects(space, brick.hasPart)]
        parts += [part for space in fed for part in graph.subjects(brick.isPartOf, space)]
        there = [*graph.objects(subject, brick.hasLocation), *graph.subjects(brick.isLocationOf, subject)]
        spaces = [s for s in (*fed, *parts, *there) if not self._is_equipment(s)]
        texts = (text for space in spaces for text in (self.name(space), _local(space)))
        return next((text for text in texts if key(text) in keys), self.name(spaces[0]) if spaces else "")

    def _is_equipment(self, subject: Any) -> bool:
        return any(self._meaning(kind, _BRICK_EQUIPMENT) for kind in self.graph.objects(subject, self.rdf.RDF.type))

    def points(self, subject: Any, name: str, kind: str) -> list[ListedPoint]:
        brick, graph = self.brick, self.graph
        found = dict.fromkeys([*graph.objects(subject, brick.hasPoint), *graph.subjects(brick.isPointOf, subject)])
        listed = []
        for point in found:
            kinds = [self._meaning(k, _BRICK_POINTS) for k in graph.objects(point, self.rdf.RDF.type)]
            meaning = next((k for k in kinds if k), "")
            if kind == "ahu":
                meaning = _AT_AIR_HANDLER.get(meaning, meaning)
            listed.append(ListedPoint(self._series(point), name, meaning))
        return listed

    def _series(self, point: Any) -> str:
        """Find the identifier of a point's series, in the ways of Brick 1.2 and 1.3; else its name."""
        ref = self.rdf.Namespace(_REF)
        ways, ids = (ref.hasExternalReference, self.brick.timeseries), (ref.hasTimeseriesId, self.brick.hasTimeseriesId)
        references = (reference for way in ways for reference in self.graph.objects(point, way))
        series = (self.graph.value(reference, name) for reference in references for name in ids)
        return next((str(value) for value in series if value is not None), self.name(point))


def _local(subject: Any) -> str:
    text = str(subject)
    return text.rpartition("#")[2] if "#" in text else text.rpartition("/")[2]


@cache
def _parents() -> dict[str, tuple[str, ...]]:
    """Superclasses of Brick's classes, by name, from the copy of Brick that `brickschema` brings."""
    rdf = extra("rdflib")
    ontology = extra("brickschema").Graph(load_brick=True)
    parents: dict[str, tuple[str, ...]] = {}
    for relation in (rdf.RDFS.subClassOf, rdf.OWL.equivalentClass):
        for child, parent in ontology.subject_objects(relation):
            if isinstance(parent, rdf.URIRef):
                parents[str(child)] = (*parents.get(str(child), ()), str(parent))
                if relation == rdf.OWL.equivalentClass:
                    parents[str(parent)] = (*parents.get(str(parent), ()), str(child))
    return parents


Entity = dict[str, str]

#: Value of a marker tag, once read.
MARKER = "\u2713"

_HAYSTACK_EQUIPMENT, _HAYSTACK_POINTS = vocabulary("haystack_equipment"), vocabulary("haystack_points")

#: Tags that refer to what gives an equipment air, water or steam.
_FEEDER = re.compile(r"(air|ahu|hotWater|chilledWater|steam|boiler|chiller)Ref")
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
    rows, kinds, fed_by = [], {}, {}
    for entity in entities:
        if "equip" not in entity or "id" not in entity:
            continue
        kind = next((meaning for tag, meaning in _HAYSTACK_EQUIPMENT.items() if tag in entity), None)
        kind = kind or device_type(_name(entity)) or ""
        if kind or "hvac" in entity:
            kinds[entity["id"]] = (_name(entity), kind)
            rows.append((_name(entity), kind, _zone(entity, by_id, zones)))
            refs = (reference for tag, reference in entity.items() if _FEEDER.fullmatch(tag))
            fed_by[_name(entity)] = [_name(by_id[reference]) for reference in refs if reference in by_id]
    points = []
    for entity in entities:
        owner = kinds.get(entity.get("equipRef", ""))
        if "point" in entity and owner is not None:
            points.append(ListedPoint(entity.get("id", _name(entity)), owner[0], _point(entity, owner[1])))
    PlanError.unless(rows, file.name, "entities with the tag 'equip'", f"none of {len(entities)}")
    return import_devices(rows, zones, file.name, points, fed_by)


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
    found = next((point for tags, point in _HAYSTACK_POINTS.items() if {*tags.split()} <= entity.keys()), "")
    return _AT_AIR_HANDLER.get(found, found) if kind == "ahu" else found


def _read_json(file: Path) -> list[Entity]:
    with reading(file, "JSON", RecursionError):
        content = json.loads(file.read_text(encoding="utf-8-sig"))
    rows = content.get("rows") if isinstance(content, dict) else content
    if not isinstance(rows, list) or not all(isinstance(row, dict) for row in rows):
        raise PlanError(file.name, "a Haystack grid with 'rows'", type(content).__name__)
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
    with reading(file, "Zinc in UTF-8"):
        lines = file.read_text(encoding="utf-8-sig").splitlines()
    if len(lines) < 2 or not lines[0].startswith("ver:"):
        raise PlanError(file.name, "Zinc, which begins with 'ver:'", repr("".join(lines[:1])[:40]))
    tags = [re.match(r"\s*(\w*)", cell)[1] for cell in _cells(lines[1])]  # type: ignore[index]
    entities = []
    for number, line in enumerate(lines[2:], start=3):
        if not line.strip():
            break
        cells = _cells(line)
        if len(cells) > len(tags):
            raise PlanError(f"{file.name}: line {number}", "as many cells as columns", f"{len(cells)} of {len(tags)}")
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
