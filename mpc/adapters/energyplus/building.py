"""A reference building: its plant, its zone table and its sizes, from the input file and a day that EnergyPlus ran."""

import json
import re
import sqlite3
from collections.abc import Mapping
from contextlib import closing
from dataclasses import dataclass
from datetime import date
from functools import cache
from pathlib import Path
from typing import Any, Literal, NamedTuple

from mpc.adapters.energyplus.input import CHICAGO, InputFile, building_path, entity, read_input, weather_path
from mpc.adapters.energyplus.layout import PlantLayout, find_layout
from mpc.adapters.energyplus.process import Job, run_energyplus
from mpc.errors import EnergyPlusError
from mpc.loop.sensors import PlantDevices
from mpc.scenario.weather_files import read_epw
from thermal.case.building import Building, Device, Layer, Surface, ZoneEntry, ZoneTable

_METER = re.compile(r"^Output:Meter,([^,]+),", re.M)
_DAY = date(2023, 1, 2)  # any: sizes come from design days
_WATER_DENSITY = 983.0  # kg/m3, as `thermal.components` has it

Kind = Literal["wall", "floor", "ceiling"]

_KINDS: dict[str, Kind] = {"Wall": "wall", "Door": "wall", "Internal Mass": "wall", "Floor": "floor", "Roof": "ceiling"}
_GLASS = ("Window", "Glass Door")
_OUTDOOR, _GROUND = "outdoor", "ground"
_THIN = 0.01  # m, of a layer that has a resistance only
_LIGHT = 10.0  # kg/m3, of such a layer
_QUERY = """
    SELECT s.SurfaceIndex, s.SurfaceName, s.ClassName, s.Area, s.Azimuth, s.ExtBoundCond, s.ZoneIndex, c.Name
    FROM Surfaces s JOIN Constructions c USING (ConstructionIndex) ORDER BY s.SurfaceIndex
"""


@dataclass(frozen=True, eq=False)
class EnergyPlusBuilding:
    """A building of EnergyPlus as the library sees it; made by `energyplus_building`.

    Parameters
    ----------
    source : InputFile
        What EnergyPlus reads.
    weather : Path
        Weather file.
    layout : PlantLayout
        Air loops, terminals and hot water.
    building : Building
        Zone table, devices and site. A zone that stands for several (`multiplier`) is as large as all of them together,
        as its air flows are.
    sizes : mapping
        Component in capitals and description to what EnergyPlus sized it to [EnergyPlus' units].
    meters : tuple of str
        All energy meters of the building.
    """

    source: InputFile
    weather: Path
    layout: PlantLayout
    building: Building
    sizes: Mapping[tuple[str, str], float]
    meters: tuple[str, ...]

    def size(self, component: str, description: str) -> float:
        """Look up a size.

        Parameters
        ----------
        component : str
            Name of the object.
        description : str
            Beginning of EnergyPlus' description, such as ``Design Size Maximum Flow Rate``.

        Raises
        ------
        EnergyPlusError
            When there is none.
        """
        begin, whose = _plain(description), component.upper()
        found = [v for (c, d), v in self.sizes.items() if c == whose and _plain(d).startswith(begin)]
        known = sorted(d for c, d in self.sizes if c == whose)
        EnergyPlusError.unless(found, f"sizes of {component!r}", repr(description), ", ".join(known) or "none")
        return found[0]

    @property
    def devices(self) -> PlantDevices:
        """Names of the devices; a building without boilers has an empty one, several chillers count as the first."""
        kinds = ("vav", "ahu", "boiler", "chiller")
        names = {kind: [d.name for d in self.building.devices if d.type == kind] for kind in kinds}
        names["chiller"] = names["chiller"][:1]
        return PlantDevices({kind: tuple(each) for kind, each in names.items()}, next(iter(names["boiler"]), ""))

    @property
    def full_water_flow(self) -> dict[str, float]:
        """Water flow of the reheat coils whose valve is open, by coil [kg/s]; those of other kinds are not there."""
        wet = [t.coil for t in self.layout.terminals if t.water_node]
        return {coil: _WATER_DENSITY * self.size(coil, "Design Size Maximum Water Flow Rate") for coil in wet}


def energyplus_building(name: str | Path, weather: str | Path = CHICAGO) -> EnergyPlusBuilding:
    """Read a building, and run it for a day to learn its sizes.

    Parameters
    ----------
    name : str or Path
        An ``.idf`` file, or one of `reference_buildings`.
    weather : str or Path
        An ``.epw`` file, or one of `weather_files`.

    Returns
    -------
    EnergyPlusBuilding
        Kept: the second call for the same files is free.

    Raises
    ------
    EnergyPlusError
        When EnergyPlus or the file is missing, the building has no plant of the kind that is looked for, or the run
        failed.
    """
    return _described(building_path(name), weather_path(weather))


@cache
def _described(path: Path, weather: Path) -> EnergyPlusBuilding:
    source = read_input(path)
    layout = find_layout(source)
    content: dict[str, Any] = source.with_period(_DAY, 1, 6)
    content["Output:SQLite"] = {"Output:SQLite 1": {"option_type": "SimpleAndTabular"}}
    content["Output:VariableDictionary"] = {"Output:VariableDictionary 1": {"key_field": "IDF"}}
    job = Job(json.dumps(content), "in.epJSON", weather, stepped=False)
    files = run_energyplus(job, ["eplusout.sql", "eplusout.mdd"])
    with closing(sqlite3.connect(":memory:")) as database:
        database.deserialize(files["eplusout.sql"])
        rows = database.execute("SELECT CompName, Description, Value FROM ComponentSizes").fetchall()
        table = zone_table(database, source, layout.zones, layout.others)
    building = Building(entity(source.name), read_epw(weather).location, 0.0, table, _devices(layout))
    sizes = {(str(name).upper(), str(what)): float(value) for name, what, value in rows}
    meters = tuple(_METER.findall(files["eplusout.mdd"].decode("latin-1")))
    return EnergyPlusBuilding(source, weather, layout, building, sizes, meters)


def _plain(description: str) -> str:
    """Write a description without capitals and underscores, which some runs have and others have not."""
    return description.lower().replace("_", " ")


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


class _Zone(NamedTuple):
    """A zone as large as all those that it stands for together."""

    name: str
    volume: float
    floor_area: float
    multiplier: float


def zone_table(
    database: sqlite3.Connection, source: InputFile, served: tuple[str, ...], others: tuple[str, ...]
) -> ZoneTable:
    """Make the zone table of a building from EnergyPlus' own account of a run.

    Parameters
    ----------
    database : sqlite3.Connection
        Output of the run, ``Output:SQLite`` with the option ``SimpleAndTabular``.
    source : InputFile
        What EnergyPlus read.
    served : tuple of str
        Zones of the table.
    others : tuple of str
        Zones that are measured boundaries.
    """
    names = {zone.upper(): zone for zone in (*served, *others)}
    rows = database.execute("SELECT ZoneIndex, ZoneName, Volume, FloorArea, Multiplier * ListMultiplier FROM Zones")
    zones = {int(i): _Zone(names[name.upper()], v * m, a * m, float(m)) for i, name, v, a, m in rows}
    by_name = {zone.name: zone for zone in zones.values()}
    entries = tuple(
        ZoneEntry(name=entity(name), volume=by_name[name].volume, floor_area=by_name[name].floor_area)
        for name in served
    )
    faces = {int(row[0]): _Face(*row) for row in database.execute(_QUERY)}
    surfaces = [s for face in faces.values() if (s := _surface(face, faces, zones, source, set(served)))]
    used = {s.construction for s in surfaces if s.construction}
    layers = {name: stack for name, stack in _constructions(database).items() if name in used}
    return ZoneTable(entries, tuple(surfaces), layers)


def _devices(layout: PlantLayout) -> tuple[Device, ...]:
    central = {
        "ahu": [loop.name for loop in layout.air_loops],
        "boiler": [loop.name for loop in layout.water_loops],
        "chiller": layout.chillers,
    }
    terminals = [Device(name=entity(t.name), type="vav", zone=entity(t.zone)) for t in layout.terminals]
    return (*terminals, *(Device(name=entity(name), type=kind) for kind, names in central.items() for name in names))


def _surface(
    face: _Face, faces: Mapping[int, _Face], zones: Mapping[int, _Zone], source: InputFile, served: set[str]
) -> Surface | None:
    """Make a surface of the zone table; None for what is not a zone's, or has been counted from the other side."""
    zone = zones[face.zone]
    if zone.name not in served or face.kind not in (*_KINDS, *_GLASS):
        return None
    name, own, area = entity(face.name), entity(zone.name), face.area * zone.multiplier
    if face.kind in _GLASS:
        u_value, sun = _glazing(source, face)
        return Surface(name=name, kind="window", zone=own, other=_OUTDOOR, area=area, azimuth=face.azimuth,
                       u_value=u_value, solar_transmittance=sun)  # fmt: skip
    kind, other = _KINDS[face.kind], _OUTDOOR if face.behind == 0 else _GROUND
    if face.behind > 0:
        behind = zones[faces[face.behind].zone].name
        other = entity(behind)
        if other == own:  # its own back, or the same storey again: nothing leaves there
            # The table lets both faces look at the zone; EnergyPlus' area is all that does (its Input Output Reference,
            # `InternalMass`).
            kind, area = "wall", area / 2.0
        elif behind in served and face.behind < face.number:
            return None
    azimuth = face.azimuth if other == _OUTDOOR and kind == "wall" else None
    return Surface(name=name, kind=kind, zone=own, other=other, area=area, azimuth=azimuth,
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
