"""Functional mock-up units built from C here: a room and a house with BOPTEST's overwrites."""

from __future__ import annotations

import json
import shutil
import subprocess
import zipfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import pytest

HERE = Path(__file__).parent / "fmu"

# name, value reference, causality, variability, unit, start, range
_REALS: list[tuple[str, int, str, str, str, float | None, tuple[float, float] | None]] = [
    ("TZon", 0, "local", "continuous", "K", 293.15, None),
    ("TFlo", 1, "local", "continuous", "K", 293.15, None),
    ("der(TZon)", 2, "local", "continuous", "K/s", None, None),
    ("der(TFlo)", 3, "local", "continuous", "K/s", None, None),
    ("oveHeaPumY_u", 4, "input", "continuous", "1", 0.0, (0.0, 1.0)),
    ("oveTSet_u", 5, "input", "continuous", "K", 293.15, (278.15, 308.15)),
    ("weaSta_reaWeaTDryBul_y", 6, "output", "continuous", "K", None, None),
    ("reaPHeaPum_y", 7, "output", "continuous", "W", None, None),
    ("reaQFloHea_y", 8, "output", "continuous", "W", None, None),
    ("oveHeaPumY_y", 9, "output", "continuous", "1", None, None),
    ("oveTSet_y", 10, "output", "continuous", "K", None, None),
    ("amplitude", 11, "parameter", "fixed", "K", 0.0, None),
    ("deaf", 12, "parameter", "fixed", "1", 0.0, None),
    ("mean", 13, "parameter", "fixed", "K", 273.15, None),
    ("reaTZon_y", 14, "output", "continuous", "K", None, None),
]
_BOOLEANS = [("oveHeaPumY_activate", 100), ("oveTSet_activate", 101)]


def compiled(source: str, library: Path, *options: str) -> Path:
    """Build a shared library, or skip."""
    compiler = shutil.which("cc") or shutil.which("gcc")
    if compiler is None:
        pytest.skip("needs a C compiler to build a functional mock-up unit")
    command = [compiler, "-shared", "-fPIC", "-O1", *options, "-o", library, HERE / source, "-lm"]
    subprocess.run(command, check=True, timeout=60)
    return library


def pack(
    path: Path, description: str, library: Path | None, platform: str = "", resources: Mapping[str, str] | None = None
) -> Path:
    """Write a unit."""
    import fmpy

    version = "3.0" if 'fmiVersion="3.0"' in description else "2.0"
    here = fmpy.platform_tuple if version == "3.0" else fmpy.platform
    with zipfile.ZipFile(path, "w") as unit:
        unit.writestr("modelDescription.xml", description)
        if library is not None:
            unit.write(library, f"binaries/{platform or here}/{library.name}")
        for name, text in (resources or {}).items():
            unit.writestr(f"resources/{name}", text)
    return path


def house_description(version: str, kinds: tuple[str, ...], dropped: tuple[str, ...] = ()) -> str:
    """Model description of the house: its variables as BOPTEST names them."""
    three = version == "3.0"
    rows = []
    for name, reference, causality, variability, unit, start, limits in _REALS:
        if name in dropped:
            continue
        told = f' unit="{unit}"' + ("" if limits is None else f' min="{limits[0]}" max="{limits[1]}"')
        if name == "oveTSet_u" and not three:  # as Modelica's tools write what a type says
            told = ' declaredType="Temperature"'
        told += "" if start is None else f' start="{start}"'
        derivative = {"der(TZon)": 0, "der(TFlo)": 1}.get(name)
        if derivative is not None:
            told += f' derivative="{derivative if three else derivative + 1}"'
        exact = ' initial="exact"' if name in ("TZon", "TFlo") or causality == "parameter" else ""
        common = f'name="{name}" valueReference="{reference}" causality="{causality}" variability="{variability}"{exact}'
        rows.append(f"<Float64 {common}{told}/>" if three else f"<ScalarVariable {common}><Real{told}/></ScalarVariable>")
    for name, reference in _BOOLEANS:
        if name in dropped:
            continue
        common = f'name="{name}" valueReference="{reference}" causality="input" variability="discrete"'
        rows.append(f'<Boolean {common} start="false"/>' if three
                    else f'<ScalarVariable {common}><Boolean start="false"/></ScalarVariable>')  # fmt: skip
    if three:
        outputs = "".join(f'<Output valueReference="{k}"/>' for k in (6, 7, 8, 9, 10, 14))
        outputs += "".join(f'<ContinuousStateDerivative valueReference="{k}"/>' for k in (2, 3))
        outputs += "".join(f'<EventIndicator valueReference="{k}"/>' for k in (0, 1))
        return ('<fmiModelDescription fmiVersion="3.0" modelName="house" instantiationToken="house">'
                + "".join(f'<{kind} modelIdentifier="house"/>' for kind in kinds)
                + f"<ModelVariables>{''.join(rows)}</ModelVariables><ModelStructure>{outputs}</ModelStructure>"
                + "</fmiModelDescription>")  # fmt: skip
    return ('<fmiModelDescription fmiVersion="2.0" modelName="house" guid="house" numberOfEventIndicators="2">'
            + "".join(f'<{kind} modelIdentifier="house"/>' for kind in kinds)
            + '<TypeDefinitions><SimpleType name="Temperature"><Real unit="K" min="278.15" max="308.15"/></SimpleType>'
            + f"</TypeDefinitions><ModelVariables>{''.join(rows)}</ModelVariables><ModelStructure>"
            + '<Derivatives><Unknown index="3"/><Unknown index="4"/></Derivatives></ModelStructure>'
            + "</fmiModelDescription>")  # fmt: skip


@pytest.fixture(scope="session")
def boptest_resources() -> dict[str, str]:
    """What BOPTEST's units bring: tables by seconds of the year, and what their names mean."""
    hours = range(365 * 24 + 1)
    day = [7 <= k % 24 < 22 for k in hours]
    tables = {
        "weather.csv": ("TDryBul,HGloHor,HDirNor,HDifHor", [f"{273.15 + k % 24},0,0,0" for k in hours]),
        "prices.csv": ("PriceElectricPowerConstant,PriceElectricPowerHighlyDynamic,PriceDistrictHeatingPower",
                       [f"0.25,{0.3 if d else 0.1},0.08" for d in day]),
        "emissions.csv": ("EmissionsElectricPower,EmissionsDistrictHeatingPower", ["0.2,0.1" for _ in day]),
        "setpoints.csv": ("LowerSetp[1],UpperSetp[1]", [f"{294.15 if d else 288.15},{297.15 if d else 303.15}" for d in day]),
        "occupancy.csv": ("Occupancy[1]", [f"{0 if d else 5}" for d in day]),
    }  # fmt: skip
    found = {
        name: "\n".join([f"time,{header}", *(f"{3600 * k},{row}" for k, row in enumerate(rows))])
        for name, (header, rows) in tables.items()
    }
    found["days.json"] = json.dumps({"peak_heat_day": 8, "typical_heat_day": 40})
    found["config.json"] = json.dumps({"name": "house", "area": 192.0})
    return found


@pytest.fixture
def packed() -> Callable[..., Path]:
    """Write units of one's own."""
    return pack


@pytest.fixture(scope="session")
def room(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The room, compiled: co-simulation of FMI 2.0."""
    fmpy = pytest.importorskip("fmpy", reason="needs the extra [fmu]")
    folder = tmp_path_factory.mktemp("fmu")
    library = compiled("room.c", folder / f"room{fmpy.sharedLibraryExtension}")
    return pack(folder / "room.fmu", (HERE / "modelDescription.xml").read_text(), library)


@pytest.fixture(scope="session")
def make_house(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., Path]:
    """Make units of the house."""
    fmpy = pytest.importorskip("fmpy", reason="needs the extra [fmu]")
    folder = tmp_path_factory.mktemp("house")
    built: dict[str, Path] = {}

    def make(version: str = "2.0", kinds: tuple[str, ...] = ("CoSimulation", "ModelExchange"), **options: Any) -> Path:
        if version not in built:
            place = folder / version
            place.mkdir()
            flags = ("-DFMI3",) if version == "3.0" else ()
            built[version] = compiled("house.c", place / f"house{fmpy.sharedLibraryExtension}", *flags)
        text = house_description(version, kinds, options.pop("dropped", ()))
        path = folder / f"{len([*folder.iterdir()])}" / "wrapped.fmu"
        path.parent.mkdir()
        return pack(path, text, built[version], **options)

    return make
