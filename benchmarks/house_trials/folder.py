"""The case folder, which the diagnosis gets, and the sealed label, which it never gets."""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import yaml
from energyplus_trials import climate

from house_trials import readings
from house_trials.draw_effects import heated
from house_trials.drawn import zone_table
from house_trials.readings import WHOLE
from house_trials.specification import HouseSpec
from thermal.case.load import load_case


def write_case(folder: Path, spec: HouseSpec, telemetry: pd.DataFrame) -> None:
    """Write a case folder, whole or not at all, and load it once.

    Parameters
    ----------
    folder : Path
        To be; must not exist.
    spec : HouseSpec
        Of which only the drawing, the place and the name are told.
    telemetry : DataFrame, shape (n_time, n_column)
        As `Readings.telemetry` returns it.
    """
    folder.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=folder.parent, prefix=".trial_") as name:
        made = Path(name) / folder.name
        made.mkdir()
        text = yaml.safe_dump(building(spec), sort_keys=False, default_flow_style=None, width=160)
        (made / "building.yaml").write_text(text, encoding="utf-8")
        telemetry.to_parquet(made / "telemetry.parquet", compression="zstd")
        load_case(made)
        os.replace(made, folder)


def building(spec: HouseSpec) -> dict[str, Any]:
    """Return the contents of `building.yaml`.

    Parameters
    ----------
    spec : HouseSpec
        Of a trial.
    """
    place = spec.climate
    zones = (WHOLE,) if spec.heating.meter == "house" else heated(spec)
    kind = "electric_heater" if spec.heating.emitter == "electric" else "radiator"
    units = (
        readings.UNITS if spec.sensors.counted else {k: v for k, v in readings.UNITS.items() if "occupancy" not in k}
    )
    content = {
        "format": 3,
        "name": spec.name,
        "location": {
            "latitude": place.latitude,
            "longitude": place.longitude,
            "elevation": place.elevation,
            "timezone": climate.timezone(place),
        },
        "geometry_quality": spec.sensors.quality,
        **zone_table(spec),
        "devices": [{"name": readings.device(spec, zone), "type": kind, "zone": zone} for zone in zones],
        "weather_station": "weather_station",
        "telemetry": "telemetry.parquet",
        "units": dict(units),
    }
    return dict(_rounded(content))


def _rounded(value: Any) -> Any:
    """Five digits of every number, as a drawing or a list would have."""
    if isinstance(value, Mapping):
        return {key: _rounded(part) for key, part in value.items()}
    if isinstance(value, list | tuple):
        return [_rounded(part) for part in value]
    return float(f"{value:.5g}") if isinstance(value, float) else value


def label(spec: HouseSpec, twins: list[str], run: Mapping[str, Any]) -> dict[str, Any]:
    """Return what the trial holds.

    Parameters
    ----------
    spec : HouseSpec
        All of it.
    twins : list of str
        Names of the trials without each of its effects.
    run : dict
        What was measured while it was made.
    """
    house = spec.house
    told = f"{house.floors} floors, {len(house.rooms)} rooms, {spec.heating.emitter}, {spec.sensors.quality}"
    found: dict[str, Any] = json.loads(spec.to_json())
    if spec.heating.meter == "house":  # the case has no rooms
        for effect in found["effects"]:
            effect["zones"] = [WHOLE] if effect["zones"] else []
            for key, value in effect["parameters"].items():
                if isinstance(value, dict):
                    effect["parameters"][key] = {WHOLE: float(np.mean(list(value.values())))}
    return found | {"world": "house", "building": told, "twins": twins, "run": run}
