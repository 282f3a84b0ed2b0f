"""What one has of a building that stands, of a made-up office: drawings, a list of devices, an export of its sensors.

python examples/draw_an_office.py plans
"""

import csv
import sys
from pathlib import Path
from typing import cast

import numpy as np
import pandas as pd
import yaml
from PIL import Image

from mpc import FixedSetpoints, PlantSettings, SensorNoise, pilot_weather, run_closed_loop, simulated_plant
from thermal.case.building import EXTERIOR_WALL, INTERIOR_WALL, Building, FloorPlans
from thermal.effects.catalogue import chosen
from thermal.pilot.building import pilot_building
from thermal.pilot.weather import MOUNTAIN_VIEW

PAPER = 40  # px around the building
PIXEL = 0.05  # m

#: Names that an automation system has for points.
EXPORTED = {
    "zone_air_temperature_sensor": "ZAT",
    "supply_air_flowrate_sensor": "Airflow",
    "discharge_air_temperature_sensor": "DAT",
    "outside_air_temperature_sensor": "OAT",
    "direct_normal_irradiance_sensor": "DNI",
    "diffuse_horizontal_irradiance_sensor": "DHI",
}


def draw(folder: Path, *, zones: int = 6, floor_area: float = 300.0, days: int = 14) -> None:
    """Write drawings, ``plans.yaml``, ``windows.yaml``, ``devices.csv`` and ``export.csv``."""
    folder.mkdir(parents=True, exist_ok=True)
    building = pilot_building(1, floor_area=floor_area, zones=zones, name="office")
    plans = cast(FloorPlans, building.geometry)
    side = round(plans.cell_size / PIXEL)
    floors = []
    for floor in plans.floors:
        wall = np.isin(floor.tokens, [EXTERIOR_WALL, INTERIOR_WALL])
        pixels = np.kron(np.where(wall, 0, 255), np.ones((side, side))).astype(np.uint8)
        Image.fromarray(np.pad(pixels, PAPER, constant_values=255)).save(folder / f"{floor.name}.png")
        row, *_ = np.flatnonzero(wall.any(axis=1))
        first, *_, last = np.flatnonzero(wall[row])
        corners = [[int(PAPER + x * side), int(PAPER + row * side)] for x in (first, last + 1)]
        names = {}
        for zone in floor.zone_names:
            rows, columns = np.nonzero(floor.tokens == zone)
            middle = len(rows) // 2
            names[zone] = [int(PAPER + (x[middle] + 0.5) * side) for x in (columns, rows)]
        scale = {"points": corners, "distance": float((last + 1 - first) * plans.cell_size)}
        floors.append({"name": floor.name, "file": f"{floor.name}.png", "scale": scale, "names": names})
    listed = {"name": building.name, "location": MOUNTAIN_VIEW.model_dump(), "floors": floors}
    (folder / "plans.yaml").write_text(yaml.safe_dump(listed, sort_keys=False), encoding="utf-8")
    windows = {zone: {side: float(area) for side, area in sides.items()} for zone, sides in plans.glazing.items()}
    (folder / "windows.yaml").write_text(yaml.safe_dump({"glazing": windows}), encoding="utf-8")
    with (folder / "devices.csv").open("w", encoding="utf-8", newline="") as stream:
        writer = csv.writer(stream)
        writer.writerow(["Name", "Type", "Room"])
        writer.writerows([d.name, d.type, d.zone or ""] for d in building.devices)
    export(lived_in(building, days)).to_csv(folder / "export.csv")


def lived_in(building: Building, days: int) -> pd.DataFrame:
    """Measure two weeks of spring in the office, into which the sun shines and in which people work."""
    start = pd.Timestamp("2023-04-03")
    end = start + pd.Timedelta(days=days)
    weather = pilot_weather(0, "2023-04-03", days=days)
    settings = PlantSettings(dx=1.0, effects=chosen(["solar_gain"]), noise=SensorNoise())
    plant = simulated_plant(building, weather, "2023-04-03", f"{end:%Y-%m-%d}", settings)
    kinds = {"supply_air_temperature_setpoint": 287.0, "supply_water_temperature_setpoint": 333.0}
    run_closed_loop(plant, FixedSetpoints(kinds, plant.actuators), seed=1)
    return plant.case().telemetry.frame


def export(frame: pd.DataFrame) -> pd.DataFrame:
    """Give telemetry under the names of an automation system, with a column of nothing that the library knows."""
    names = {}
    for column in map(str, frame.columns):
        entity, _, point = column.partition("/")
        if point in EXPORTED:
            device = entity.replace("_", "-")
            names[column] = EXPORTED[point] if entity == "weather_station" else f"{device} {EXPORTED[point]}"
    table = frame[list(names)].rename(columns=names)
    kelvin = [c for c in table if c.endswith(("ZAT", "DAT", "OAT"))]
    table[kelvin] -= 273.15
    stamps = pd.Index([stamp.isoformat() for stamp in frame.index], name="timestamp")
    return table.round(3).assign(**{"Lobby lighting kWh": 0.0}).set_index(stamps)


if __name__ == "__main__":
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "plans")
    draw(folder)
    print(f"{folder}: " + ", ".join(sorted(path.name for path in folder.iterdir())))
