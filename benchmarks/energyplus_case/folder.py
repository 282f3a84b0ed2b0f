"""The case folder and the record of the truth."""

import csv
import json
import os
import shutil
import tempfile
from dataclasses import asdict
from pathlib import Path
from typing import Any

import pandas as pd
import yaml

from energyplus_case import layout, materials, model, sensors, thermostats

README = """# Bundled case

One floor of 24 m x 16 m, five zones, ten days at five minutes: the case that `buildingmpc demo` uses.
Not measured: EnergyPlus {version} simulated it and sensor noise was added. Made by

    pip install -e .[energyplus]
    python benchmarks/make_bundled_case.py{arguments}

from {weather} ({first} to {last}, seed {seed}).
EnergyPlus runs {run_in} days before the saved stretch.
Each zone has a terminal that blows warm or cool air ({cold:.0f} to {hot:.0f} degC) to keep two set points; set points
differ between zones, fall at night, rise at another hour in each zone, and change at random moments.
Noise (standard deviation): zone temperatures {noise} K, then rounded to {resolution} K; discharge temperatures
{discharge} K; flows {flow} %.
Files: the library's case format, version 1. What the simulated building holds beyond the case folder is written
down in `{truth}`, so that a diagnosis can be made without it and compared afterwards.
"""


def write_case(out: Path, telemetry: pd.DataFrame, site: dict[str, Any], readme: str, *, force: bool) -> None:
    """Write a case folder, whole or not at all.

    Parameters
    ----------
    out : Path
        Folder to be; its parent is made if need be.
    telemetry : DataFrame, shape (n_time, n_column)
        Of the building and the weather station.
    site : dict
        `name` and `location` of `building.yaml`.
    readme : str
        Text of the folder's README.
    force : bool
        Replace the folder where it exists.

    Raises
    ------
    FileExistsError
        The folder exists and `force` is not set.
    """
    if out.exists() and not force:
        raise FileExistsError(f"{out} exists; pass --force to replace it")
    out.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=out.parent, prefix=".case_") as name:
        folder = Path(name) / out.name
        folder.mkdir()
        _write_files(folder, telemetry, site, readme)
        if out.exists():
            os.replace(out, Path(name) / "replaced")
        shutil.move(folder, out)


def _write_files(folder: Path, telemetry: pd.DataFrame, site: dict[str, Any], readme: str) -> None:
    building = {
        "format": 1,
        **site,
        "orientation": layout.ORIENTATION,
        "cell_size": layout.CELL_SIZE,
        "floors": [{"name": "F1", "height": layout.HEIGHT, "plan": "plan_F1.csv"}],
        "glazing": layout.glazing(),
        "devices": [{"name": f"VAV_{zone}", "type": "vav", "zone": zone} for zone in layout.ZONES],
        "weather_station": "weather_station",
        "telemetry": "telemetry.parquet",
        "units": sensors.UNITS,
    }
    text = yaml.safe_dump(building, sort_keys=False, default_flow_style=False)
    (folder / "building.yaml").write_text(text, encoding="utf-8")
    with (folder / "plan_F1.csv").open("w", encoding="utf-8", newline="") as out:
        csv.writer(out, lineterminator="\n").writerows(layout.plan_tokens().tolist())
    telemetry.to_parquet(folder / "telemetry.parquet", compression="zstd")
    (folder / "README.md").write_text(readme, encoding="utf-8")


def truth(effects: list[str], results: pd.DataFrame, heat: dict[str, dict[str, float]], **origin: str) -> str:
    """Return, as JSON, what the simulated building holds.

    Parameters
    ----------
    effects : list of str
        Effects of the catalogue that are on.
    results : DataFrame, shape (n_time, n_output)
        Of the saved stretch.
    heat : dict
        As `sensors.check_heat` returns it.
    **origin : str
        Where the case comes from.
    """
    record = {
        "effects": effects,
        "origin": origin,
        **_description(),
        "zones": _zones(results, heat),
    }
    return json.dumps(record, indent=2) + "\n"


def _zones(results: pd.DataFrame, heat: dict[str, dict[str, float]]) -> dict[str, Any]:
    areas = {zone: outline.area for zone, outline in layout.zone_rectangles().items()}
    return {
        zone: {
            "floor_area_m2": area,
            "volume_m3": area * layout.HEIGHT,
            "mean_transmitted_sun_W": round(float(results[zone, "transmitted_sun"].mean()), 1),
            **heat[zone],
            "thermostat_degC_h": asdict(thermostats.THERMOSTATS[zone]),
        }
        for zone, area in areas.items()
    }


def _description() -> dict[str, Any]:
    constructions = {
        name: [{"material": layer, **asdict(materials.MATERIALS[layer])} for layer in layers]
        for name, layers in materials.CONSTRUCTIONS.items()
    }
    return {
        "constructions_outside_to_inside": constructions,
        "u_values_W_m2_K": {name: round(value, 3) for name, value in materials.u_values().items()},
        "glazing": {"solar_heat_gain_coefficient": materials.GLAZING_SHGC, "area_m2": layout.glazing()},
        "exterior_convection_W_m2_K": materials.EXTERIOR_CONVECTION,
        "interior_convection": "TARP (depends on temperature difference)",
        "exterior_longwave": "surroundings at outdoor air temperature, emissivity 0.9 (walls), 0.84 (glass)",
        "exterior_solar_absorptance_of_walls": materials.EXTERIOR_SOLAR_ABSORPTANCE,
        "interior_solar_absorptance": materials.INTERIOR_SOLAR_ABSORPTANCE,
        "slabs": "adiabatic, mirrored at their middle: half their thickness takes part",
        "off": ["infiltration", "outdoor air", "internal gains", "ground", "roof", "furniture", "zone mixing"],
        "supply_air": {
            "heating_degC": model.SUPPLY_TEMPERATURE_HEATING,
            "cooling_degC": model.SUPPLY_TEMPERATURE_COOLING,
            "flow_limit_m3_s_m2": model.FLOW_PER_AREA,
        },
        "noise": {
            "zone_temperature_K": sensors.TEMPERATURE_NOISE,
            "zone_temperature_resolution_K": sensors.TEMPERATURE_RESOLUTION,
            "discharge_temperature_K": sensors.DISCHARGE_NOISE,
            "flow_share": sensors.FLOW_NOISE,
        },
    }
