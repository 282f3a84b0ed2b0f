"""The case folder, which the diagnosis gets."""

from __future__ import annotations

import csv
import os
import tempfile
from pathlib import Path
from typing import Any

import pandas as pd
import yaml

from ideal_air_trials import plan, readings
from ideal_air_trials.specification import Spec
from ideal_air_trials.weather import Weather
from thermal.case.load import load_case


def write_case(folder: Path, spec: Spec, weather: Weather, telemetry: pd.DataFrame) -> None:
    """Write a case folder, whole or not at all, and load it once.

    Parameters
    ----------
    folder : Path
        To be; must not exist.
    spec : Spec
        Of which only geometry and name are told.
    weather : Weather
        Of which only the place is told.
    telemetry : DataFrame, shape (n_time, n_column)
        As `Readings.telemetry` returns it.
    """
    folder.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=folder.parent, prefix=".trial_") as name:
        made = Path(name) / folder.name
        made.mkdir()
        text = yaml.safe_dump(building(spec, weather), sort_keys=False, default_flow_style=False)
        (made / "building.yaml").write_text(text, encoding="utf-8")
        for floor in range(spec.layout.floors):
            with (made / f"plan_F{floor + 1}.csv").open("w", encoding="utf-8", newline="") as out:
                csv.writer(out, lineterminator="\n").writerows(plan.tokens(spec.layout, floor))
        telemetry.to_parquet(made / "telemetry.parquet", compression="zstd")
        load_case(made)
        os.replace(made, folder)


def building(spec: Spec, weather: Weather) -> dict[str, Any]:
    """Return the contents of `building.yaml`.

    Parameters
    ----------
    spec : Spec
        Of a trial.
    weather : Weather
        Of its site.
    """
    layout = spec.layout
    return {
        "format": 1,
        "name": spec.name,
        "location": {
            "latitude": weather.latitude,
            "longitude": weather.longitude,
            "elevation": weather.elevation,
            "timezone": weather.timezone,
        },
        "orientation": layout.orientation,
        "cell_size": plan.CELL,
        "floors": [
            {"name": f"F{f + 1}", "height": layout.height, "plan": f"plan_F{f + 1}.csv"} for f in range(layout.floors)
        ],
        "glazing": drawn_glazing(spec),
        "devices": [{"name": f"VAV_{zone}", "type": "vav", "zone": zone} for zone in spec.zone_names],
        "weather_station": "weather_station",
        "telemetry": "telemetry.parquet",
        "units": dict(readings.UNITS),
    }


def drawn_glazing(spec: Spec) -> dict[str, dict[str, float]]:
    """Return the glazed area by zone and facade as the drawing has it [m2].

    Parameters
    ----------
    spec : Spec
        Of a trial.
    """
    errors, true = iter(spec.drawing_errors), plan.glazing(spec.layout)
    drawn = {
        zone: {side: round(area * next(errors), 2) for side, area in areas.items()}
        for zone, areas in sorted(true.items())
    }
    return {zone: drawn[zone] for zone in spec.zone_names if zone in drawn}
