"""The case folder, which the diagnosis gets, and the sealed label, which it never gets."""

from __future__ import annotations

import csv
import json
import os
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pandas as pd
import yaml

from energyplus_trials import climate, model, plan, readings
from energyplus_trials.drawing import twins_of
from energyplus_trials.errors import TrialGeometryError
from energyplus_trials.specification import TrialSpec
from thermal.case.load import load_case
from thermal.case.plan import zone_floor_areas

AREA_TOLERANCE = 0.015  # [-]: where walls meet, the case counts cells and EnergyPlus has rectangles


def write_case(folder: Path, spec: TrialSpec, telemetry: pd.DataFrame) -> None:
    """Write a case folder, whole or not at all, and load it once.

    Parameters
    ----------
    folder : Path
        To be; must not exist.
    spec : TrialSpec
        Of which only geometry, place and name are told.
    telemetry : DataFrame, shape (n_time, n_column)
        As `Readings.telemetry` returns it.

    Raises
    ------
    TrialGeometryError
        The case's floor areas are not those of the plant.
    """
    folder.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=folder.parent, prefix=".trial_") as name:
        made = Path(name) / folder.name
        made.mkdir()
        (made / "building.yaml").write_text(
            yaml.safe_dump(_building(spec), sort_keys=False, default_flow_style=False), encoding="utf-8"
        )
        for floor in range(spec.layout.floors):
            with (made / f"plan_F{floor + 1}.csv").open("w", encoding="utf-8", newline="") as out:
                csv.writer(out, lineterminator="\n").writerows(plan.tokens(spec.layout.zones, floor).tolist())
        telemetry.to_parquet(made / "telemetry.parquet", compression="zstd")
        _check_areas(made, spec)
        os.replace(made, folder)


def _building(spec: TrialSpec) -> dict[str, Any]:
    layout, place = spec.layout, spec.climate
    floors = [
        {"name": f"F{f + 1}", "height": layout.height, "plan": f"plan_F{f + 1}.csv"} for f in range(layout.floors)
    ]
    return {
        "format": 1,
        "name": spec.name,
        "location": {
            "latitude": place.latitude,
            "longitude": place.longitude,
            "elevation": place.elevation,
            "timezone": climate.timezone(place),
        },
        "orientation": layout.orientation,
        "cell_size": plan.CELL_SIZE,
        "floors": floors,
        "glazing": plan.glazing(layout),
        "devices": [{"name": f"VAV_{zone}", "type": "vav", "zone": zone} for zone in spec.zone_names],
        "weather_station": "weather_station",
        "telemetry": "telemetry.parquet",
        "units": dict(readings.UNITS),
    }


def _check_areas(folder: Path, spec: TrialSpec) -> None:
    plans = load_case(folder).building.geometry
    for zone, area in zone_floor_areas(plans).items():
        expected = model.area(spec, zone)
        if abs(area / expected - 1.0) > AREA_TOLERANCE:
            raise TrialGeometryError(f"{spec.name}: {zone} has {area} m2 in the case, {expected} m2 in EnergyPlus")


def label(spec: TrialSpec, run: Mapping[str, Any]) -> dict[str, Any]:
    """Return what the trial holds.

    Parameters
    ----------
    spec : TrialSpec
        All of it.
    run : dict
        What was measured while it was made.
    """
    twins = [twin.name for twin in twins_of(spec)]
    return json.loads(spec.to_json()) | {"world": "office", "twins": twins, "run": run}
