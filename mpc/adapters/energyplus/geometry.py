"""A building's zone table, from the geometry that EnergyPlus reports."""

from __future__ import annotations

import sqlite3
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal, NamedTuple

from mpc.adapters.energyplus.input import InputFile
from mpc.adapters.energyplus.layout import PlantLayout
from mpc.adapters.energyplus.points import entity
from mpc.scenario.weather_files import read_epw
from thermal.case.building import Building, Device, Layer, Surface, ZoneEntry, ZoneTable

Kind = Literal["wall", "floor", "ceiling"]

_KINDS: Mapping[str, Kind] = {
    "Wall": "wall",
    "Door": "wall",
    "Internal Mass": "wall",
    "Floor": "floor",
    "Roof": "ceiling",
}
_OUTDOOR, _GROUND = "outdoor", "ground"
_THIN = 0.01  # m, of a layer that has a resistance only
_LIGHT = 10.0  # kg/m3, of such a layer
_QUERY = """
    SELECT s.SurfaceIndex, s.SurfaceName, s.ClassName, s.Area, s.Azimuth, s.ExtBoundCond, s.ZoneIndex, c.Name
    FROM Surfaces s JOIN Constructions c USING (ConstructionIndex) ORDER BY s.SurfaceIndex
"""


class _Face(NamedTuple):
    """A surface as EnergyPlus has it; `behind` is a surface, 0 outdoors, negative the ground."""

    number: int
    name: str
    kind: str
    area: float
    azimuth: float
    behind: int
    zone: int
    construction: str


def building_of(database: sqlite3.Connection, source: InputFile, layout: PlantLayout, weather: Path) -> Building:
    """Make the building of an input file.

    Parameters
    ----------
    database : sqlite3.Connection
        EnergyPlus' output of a run.
    source : InputFile
        Windows and the north axis.
    layout : PlantLayout
        Devices, and the zones that they serve; other zones are measured boundaries.
    weather : Path
        Weather file, whose site it is.

    Returns
    -------
    Building
        Zone table. Zones that stand for several are as large as all of them together.
    """
    names = {zone.upper(): zone for zone in (*layout.zones, *layout.others)}
    rows = database.execute("SELECT ZoneIndex, ZoneName, Volume, FloorArea, Multiplier * ListMultiplier FROM Zones")
    zones = {int(i): (names[name.upper()], float(v), float(a), float(m)) for i, name, v, a, m in rows}
    by_name = {z[0]: z for z in zones.values()}
    entries = tuple(
        ZoneEntry(
            name=entity(name),
            volume=by_name[name][1] * by_name[name][3],
            floor_area=by_name[name][2] * by_name[name][3],
        )
        for name in layout.zones
    )
    faces = {int(row[0]): _Face(*row) for row in database.execute(_QUERY)}
    surfaces = [s for face in faces.values() if (s := _surface(face, faces, zones, source, set(layout.zones)))]
    used = {s.construction for s in surfaces if s.construction}
    layers = {name: stack for name, stack in _constructions(database).items() if name in used}
    table = ZoneTable(entries, tuple(surfaces), layers)
    site = read_epw(weather).location
    return Building(entity(source.name), site, 0.0, table, _devices(layout))


def _devices(layout: PlantLayout) -> tuple[Device, ...]:
    devices = [Device(name=entity(t.name), type="vav", zone=entity(t.zone)) for t in layout.terminals]
    devices += [Device(name=entity(loop.name), type="ahu") for loop in layout.air_loops]
    devices += [Device(name=entity(loop.name), type="boiler") for loop in layout.water_loops]
    devices += [Device(name=entity(name), type="chiller") for name in layout.chillers]
    return tuple(devices)


def _surface(
    face: _Face,
    faces: dict[int, _Face],
    zones: dict[int, tuple[str, float, float, float]],
    source: InputFile,
    served: set[str],
) -> Surface | None:
    """Make a surface of the zone table; None for what is not a zone's, or has been counted from the other side."""
    zone, _, _, many = zones[face.zone]
    if zone not in served:
        return None
    name, area = entity(face.name), face.area * many
    if face.kind in ("Window", "Glass Door"):
        u_value, sun = _glazing(source, face)
        return Surface(name=name, kind="window", zone=entity(zone), other=_OUTDOOR, area=area, azimuth=face.azimuth,
                       u_value=u_value, solar_transmittance=sun)  # fmt: skip
    if face.kind not in _KINDS:
        return None
    kind, other = _KINDS[face.kind], _OUTDOOR
    if face.behind < 0:
        other = _GROUND
    elif face.behind > 0:
        other = entity(zones[faces[face.behind].zone][0])
        if other == entity(zone):  # its own back, or the same storey again: nothing leaves there
            kind = "wall"
        elif zones[faces[face.behind].zone][0] in served and face.behind < face.number:
            return None
    azimuth = face.azimuth if other == _OUTDOOR and kind == "wall" else None
    return Surface(name=name, kind=kind, zone=entity(zone), other=other, area=area, azimuth=azimuth,
                   construction=entity(face.construction))  # fmt: skip


def _glazing(source: InputFile, face: _Face) -> tuple[float, float]:
    """U-value [W/m2/K] and solar heat gain coefficient [-]."""
    fields = source.find("Construction", face.construction)
    layer = str(fields["outside_layer"])
    for name, glass in source.of_type("WindowMaterial:SimpleGlazingSystem").items():
        if name.lower() == layer.lower():
            return float(glass["u_factor"]), float(glass["solar_heat_gain_coefficient"])
    return 2.7, 0.4  # layered glass: an ordinary double pane, whose values a calibration moves


def _constructions(database: sqlite3.Connection) -> dict[str, tuple[Layer, ...]]:
    """Layers by construction, from the zone outwards."""
    query = """
        SELECT c.Name, m.Thickness, m.Conductivity, m.Density, m.SpecHeat, m.Resistance
        FROM ConstructionLayers l JOIN Constructions c USING (ConstructionIndex) JOIN Materials m USING (MaterialIndex)
        ORDER BY c.ConstructionIndex, l.LayerIndex DESC
    """
    stacks: dict[str, list[Layer]] = {}
    for name, *values in database.execute(query):
        stacks.setdefault(entity(name), []).append(_layer(*values))
    return {name: tuple(stack) for name, stack in stacks.items()}


def _layer(thickness: Any, conductivity: Any, density: Any, heat: Any, resistance: Any) -> Layer:
    if thickness and conductivity and density and heat:
        return Layer(thickness=thickness, conductivity=conductivity, density=density, heat_capacity=heat)
    return Layer(thickness=_THIN, conductivity=_THIN / (resistance or 0.1), density=_LIGHT, heat_capacity=1000.0)
