"""Devices of a Brick model (Balaji et al. 2018, doi:10.1016/j.apenergy.2018.02.091)."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any

from thermal.errors import PlanError, describe
from thermal.plan.devices import DeviceImport, ListedPoint, import_devices, key
from thermal.plan.extra import extra

_BRICK, _REF = "https://brickschema.org/schema/Brick#", "https://brickschema.org/schema/Brick/ref#"

_EQUIPMENT = {
    "Variable_Air_Volume_Box": "vav",
    "Constant_Air_Volume_Box": "vav",
    "Fan_Coil_Unit": "fan_coil",
    "Space_Heater": "electric_heater",
    "Radiator": "radiator",
    "Radiant_Panel": "radiator",
    "Air_Handling_Unit": "ahu",
    "Boiler": "boiler",
    "Chiller": "chiller",
    "Air_Diffuser": "supply_air_terminal",
    "Terminal_Unit": "supply_air_terminal",
}

# Brick has no word for the supply of a terminal against that of an air handler: the device's type decides.
_POINTS = {
    "Zone_Air_Temperature_Sensor": "zone_air_temperature_sensor",
    "Supply_Air_Flow_Sensor": "supply_air_flowrate_sensor",
    "Discharge_Air_Flow_Sensor": "supply_air_flowrate_sensor",
    "Discharge_Air_Temperature_Sensor": "discharge_air_temperature_sensor",
    "Supply_Air_Temperature_Sensor": "discharge_air_temperature_sensor",
    "Zone_Air_Heating_Temperature_Setpoint": "zone_air_heating_temperature_setpoint",
    "Heating_Zone_Air_Temperature_Setpoint": "zone_air_heating_temperature_setpoint",
    "Zone_Air_Cooling_Temperature_Setpoint": "zone_air_cooling_temperature_setpoint",
    "Cooling_Zone_Air_Temperature_Setpoint": "zone_air_cooling_temperature_setpoint",
    "Supply_Air_Temperature_Setpoint": "supply_air_temperature_setpoint",
    "Discharge_Air_Temperature_Setpoint": "supply_air_temperature_setpoint",
    "Mixed_Air_Temperature_Sensor": "mixed_air_temperature_sensor",
    "Return_Air_Temperature_Sensor": "return_air_temperature_sensor",
    "Outside_Air_Temperature_Sensor": "outside_air_temperature_sensor",
    "Leaving_Hot_Water_Temperature_Sensor": "supply_water_temperature_sensor",
    "Hot_Water_Supply_Temperature_Sensor": "supply_water_temperature_sensor",
    "Entering_Hot_Water_Temperature_Sensor": "return_water_temperature_sensor",
    "Hot_Water_Return_Temperature_Sensor": "return_water_temperature_sensor",
    "Damper_Position_Command": "supply_air_damper_percentage_command",
    "Heating_Valve_Command": "heating_water_valve_percentage_command",
    "Reheat_Command": "heating_water_valve_percentage_command",
    "CO2_Sensor": "zone_air_co2_concentration_sensor",
    "Occupancy_Count_Sensor": "occupancy_count_sensor",
}
_AT_AIR_HANDLER = {"discharge_air_temperature_sensor": "supply_air_temperature_sensor"}


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
    try:
        graph.parse(data=file.read_text(encoding="utf-8"), format="turtle")
    except Exception as error:  # rdflib's parser raises BadSyntax, which is no ValueError, and plain exceptions
        found = " ".join(str(error).split())[:200]
        raise PlanError(describe(file.name, "a Brick model in Turtle", found)) from error
    model = _Model(graph, rdf)
    keys = {key(zone) for zone in zones}
    rows, points = [], []
    for subject, kind in model.instances(_EQUIPMENT):
        name = model.name(subject)
        zone = model.zone(subject, keys)
        rows.append((name, kind, zone))
        points += model.points(subject, name, kind)
    if not rows:
        advice = "does it declare brick:VAV, brick:AHU and so on?"
        raise PlanError(describe(file.name, "equipment of Brick", "none", advice))
    order = sorted(range(len(rows)), key=lambda i: rows[i][0])
    return import_devices([rows[i] for i in order], zones, file.name, sorted(points, key=lambda p: p.column))


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

    def zone(self, subject: Any, keys: set[tuple[str, ...]]) -> str:
        """Find the zone among what a device feeds, the parts of that, and where it stands."""
        brick, graph = self.brick, self.graph
        fed = [*graph.objects(subject, brick.feeds), *graph.subjects(brick.isFedBy, subject)]
        parts = [part for space in fed for part in graph.objects(space, brick.hasPart)]
        parts += [part for space in fed for part in graph.subjects(brick.isPartOf, space)]
        there = [*graph.objects(subject, brick.hasLocation), *graph.subjects(brick.isLocationOf, subject)]
        spaces = [s for s in (*fed, *parts, *there) if not self._is_equipment(s)]
        for space in spaces:
            for text in (self.name(space), _local(space)):
                if key(text) in keys:
                    return text
        return self.name(spaces[0]) if spaces else ""

    def _is_equipment(self, subject: Any) -> bool:
        return any(self._meaning(kind, _EQUIPMENT) for kind in self.graph.objects(subject, self.rdf.RDF.type))

    def points(self, subject: Any, name: str, kind: str) -> list[ListedPoint]:
        brick, graph = self.brick, self.graph
        found = dict.fromkeys([*graph.objects(subject, brick.hasPoint), *graph.subjects(brick.isPointOf, subject)])
        listed = []
        for point in found:
            kinds = [self._meaning(k, _POINTS) for k in graph.objects(point, self.rdf.RDF.type)]
            meaning = next((k for k in kinds if k), "")
            if kind == "ahu":
                meaning = _AT_AIR_HANDLER.get(meaning, meaning)
            listed.append(ListedPoint(self._series(point), name, meaning))
        return listed

    def _series(self, point: Any) -> str:
        """Find the identifier of a point's series, in the ways of Brick 1.2 and 1.3; else its name."""
        ref = self.rdf.Namespace(_REF)
        for link in (ref.hasExternalReference, self.brick.timeseries):
            for reference in self.graph.objects(point, link):
                for identifier in (ref.hasTimeseriesId, self.brick.hasTimeseriesId):
                    value = self.graph.value(reference, identifier)
                    if value is not None:
                        return str(value)
        return self.name(point)


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
