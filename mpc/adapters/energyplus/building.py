"""A reference building: its plant, its geometry and its sizes, from the input file and a day that EnergyPlus ran."""

from __future__ import annotations

import json
import re
import sqlite3
import tempfile
from collections.abc import Mapping
from contextlib import closing
from dataclasses import dataclass
from datetime import date
from functools import cache
from pathlib import Path
from typing import Any

from mpc.adapters.energyplus.geometry import building_of
from mpc.adapters.energyplus.input import InputFile, read_input, with_period
from mpc.adapters.energyplus.install import CHICAGO, building_path, weather_path
from mpc.adapters.energyplus.layout import PlantLayout, find_layout
from mpc.adapters.energyplus.process import Job, run_energyplus
from mpc.errors import EnergyPlusError
from mpc.loop.sensors import PlantDevices
from thermal.case.building import Building
from thermal.errors import describe

_METER = re.compile(r"^Output:Meter,([^,]+),", re.M)
_DAY = date(2023, 1, 2)  # any: sizes come from design days
_WATER_DENSITY = 983.0  # kg/m3, as `thermal.components` has it


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
        if not found:
            known = sorted(d for c, d in self.sizes if c == whose)
            raise EnergyPlusError(describe(f"sizes of {component!r}", repr(description), ", ".join(known) or "none"))
        return found[0]

    @property
    def devices(self) -> PlantDevices:
        """Names of the devices; a building without boilers has an empty one, several chillers count as the first."""
        names = {
            kind: [d.name for d in self.building.devices if d.type == kind]
            for kind in ("vav", "ahu", "boiler", "chiller")
        }
        return PlantDevices({kind: tuple(each[:1] if kind == "chiller" else each) for kind, each in names.items()})

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
    content: dict[str, Any] = with_period(source, _DAY, 1, 6)
    content["Output:SQLite"] = {"Output:SQLite 1": {"option_type": "SimpleAndTabular"}}
    content["Output:VariableDictionary"] = {"Output:VariableDictionary 1": {"key_field": "IDF"}}
    files = run_energyplus(
        Job(json.dumps(content), "in.epJSON", weather, stepped=False), ["eplusout.sql", "eplusout.mdd"]
    )
    with tempfile.TemporaryDirectory(prefix="buildingmpc-energyplus-") as folder:
        copy = Path(folder) / "eplusout.sql"
        copy.write_bytes(files["eplusout.sql"])
        with closing(sqlite3.connect(copy)) as database:
            rows = database.execute("SELECT CompName, Description, Value FROM ComponentSizes").fetchall()
            building = building_of(database, source, layout, weather)
    sizes = {(str(name).upper(), str(what)): float(value) for name, what, value in rows}
    meters = tuple(_METER.findall(files["eplusout.mdd"].decode("latin-1")))
    return EnergyPlusBuilding(source, weather, layout, building, sizes, meters)


def _plain(description: str) -> str:
    """Write a description without capitals and underscores, which some runs have and others have not."""
    return description.lower().replace("_", " ")
