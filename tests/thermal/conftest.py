"""Small valid cases, to be spoilt one thing at a time."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import yaml

from thermal import Building, Case, FloorPlan, FloorPlans, Telemetry, ZoneTable
from thermal.case.building import Airflow, Device, Layer, Location, Surface, ZoneEntry

SHARED_CASES = Path(__file__).parents[2].parent / "shared" / "cases"


@dataclass
class CaseDraft:
    """A case before it is written: change what you like, then `write`."""

    folder: Path
    content: dict[str, Any]
    frame: pd.DataFrame
    plans: dict[str, str] = field(default_factory=dict)

    def write(self) -> Path:
        """Write the folder and return it; the suffix of `telemetry` decides on its file type."""
        self.folder.mkdir(parents=True, exist_ok=True)
        (self.folder / "building.yaml").write_text(yaml.safe_dump(self.content, sort_keys=False), encoding="utf-8")
        for name, text in self.plans.items():
            (self.folder / name).write_text(text, encoding="utf-8")
        file = self.folder / str(self.content.get("telemetry", "telemetry.parquet"))
        if file.suffix == ".csv":
            self.frame.to_csv(file)
        else:
            self.frame.to_parquet(file)
        return self.folder


def plan_text(*rows: str) -> str:
    """Spell a plan: one letter a cell."""
    return "\n".join(",".join(row) for row in rows) + "\n"


def stamps(n_time: int = 48, step: str = "5min", start: str = "2023-03-01T00:05:00-06:00") -> pd.DatetimeIndex:
    """Make a regular index."""
    return pd.date_range(start, periods=n_time, freq=step, name="timestamp")


@pytest.fixture
def plan_draft(tmp_path: Path) -> CaseDraft:
    """Two rooms side by side under plans: A has an air terminal, B a radiator."""
    index = stamps()
    hours = np.arange(len(index)) / 12.0
    frame = pd.DataFrame(
        {
            "station/outside_air_temperature_sensor": 5.0 + 3.0 * np.sin(hours),
            "station/direct_normal_irradiance_sensor": np.zeros(len(index)),
            "VAV_A/zone_air_temperature_sensor": 20.0 + 0.5 * np.sin(2.0 * hours),
            "VAV_A/supply_air_flowrate_sensor": np.full(len(index), 0.1),
            "VAV_A/discharge_air_temperature_sensor": np.full(len(index), 30.0),
            "B/zone_air_temperature_sensor": 21.0 + 0.5 * np.cos(2.0 * hours),
            "RAD_B/heating_power_sensor": np.full(len(index), 250.0),
        },
        index=index,
    )
    content = {
        "format": 1,
        "name": "two rooms",
        "location": {"latitude": 42.0, "longitude": -88.0, "elevation": 0.0, "timezone": "Etc/GMT+6"},
        "orientation": 0.0,
        "cell_size": 1.0,
        "floors": [{"name": "F1", "height": 3.0, "plan": "plan_F1.csv"}],
        "glazing": {"A": {"south": 2.0, "west": 1.5}},
        "devices": [
            {"name": "VAV_A", "type": "vav", "zone": "A"},
            {"name": "RAD_B", "type": "radiator", "zone": "B"},
            {"name": "AHU", "type": "ahu"},
        ],
        "airflows": [{"from": "A", "to": "B", "device": "VAV_A", "fraction": 0.4}],
        "weather_station": "station",
        "telemetry": "telemetry.parquet",
        "units": {
            "outside_air_temperature_sensor": "degC",
            "direct_normal_irradiance_sensor": "W/m^2",
            "zone_air_temperature_sensor": "degC",
            "supply_air_flowrate_sensor": "kg/s",
            "discharge_air_temperature_sensor": "degC",
            "heating_power_sensor": "W",
        },
    }
    plans = {"plan_F1.csv": plan_text("#######", "#AA+BB#", "#AA+BB#", "#######")}
    return CaseDraft(tmp_path / "plan_case", content, frame, plans)


@pytest.fixture
def table_draft(tmp_path: Path) -> CaseDraft:
    """Two rooms of a zone table, under a measured attic."""
    index = stamps()
    hours = np.arange(len(index)) / 12.0
    frame = pd.DataFrame(
        {
            "station/outside_air_temperature_sensor": 5.0 + 3.0 * np.sin(hours),
            "room/zone_air_temperature_sensor": 20.0 + 0.5 * np.sin(2.0 * hours),
            "hall/zone_air_temperature_sensor": 19.0 + 0.5 * np.sin(2.0 * hours),
            "attic/zone_air_temperature_sensor": 10.0 + np.sin(hours),
            "HEATER/heating_power_sensor": np.full(len(index), 500.0),
        },
        index=index,
    )
    content = {
        "format": 1,
        "name": "room and hall",
        "location": {"latitude": 48.0, "longitude": 12.0, "elevation": 690, "timezone": "Etc/GMT-1"},
        "zones": [
            {"name": "room", "volume": 50.0, "floor_area": 20.0},
            {"name": "hall", "volume": 25.0, "floor_area": 10},
        ],
        "surfaces": [
            {"name": "W1", "kind": "wall", "zone": "room", "other": "outdoor", "area": 12.0, "azimuth": 180,
             "construction": "brick"},
            {"name": "G1", "kind": "window", "zone": "room", "other": "outdoor", "area": 2.0, "azimuth": 180,
             "u_value": 1.1, "solar_transmittance": 0.5},
            {"name": "C1", "kind": "ceiling", "zone": "room", "other": "attic", "area": 20.0, "construction": "brick"},
            {"name": "P1", "kind": "bridge", "zone": "room", "other": "outdoor", "area": 1.0, "u_value": 1.0},
            {"name": "O1", "kind": "opening", "zone": "room", "other": "hall", "area": 1.9},
            {"name": "M1", "kind": "wall", "zone": "hall", "other": "hall", "area": 5.0, "construction": "brick"},
            {"name": "F1", "kind": "floor", "zone": "hall", "other": "ground", "area": 10.0, "construction": "brick"},
        ],
        "constructions": {
            "brick": [{"thickness": 0.3, "conductivity": 0.5, "density": 1500, "heat_capacity": 1000}],
        },
        "devices": [{"name": "HEATER", "type": "electric_heater", "zone": "room"}],
        "weather_station": "station",
        "telemetry": "telemetry.parquet",
        "units": {
            "outside_air_temperature_sensor": "degC",
            "zone_air_temperature_sensor": "degC",
            "heating_power_sensor": "W",
        },
    }  # fmt: skip
    return CaseDraft(tmp_path / "table_case", content, frame)


@pytest.fixture
def spell_plan() -> Callable[..., str]:
    """Give tests the plan speller: one letter a cell."""
    return plan_text


@pytest.fixture
def shared_cases() -> Path:
    """Folder of the shared cases; tests that need it are skipped without it."""
    if not SHARED_CASES.is_dir():
        pytest.skip(f"the shared cases are not here: {SHARED_CASES}")
    return SHARED_CASES


SITE = Location(latitude=48.0, longitude=12.0, elevation=690.0, timezone="Europe/Berlin")
STOREY = ("########", "#AAA+BB#", "#AAA+BB#", "#AAA+BB#", "########")


def stacked_building() -> Building:
    """Two floors of two rooms each, turned by 20 degrees; glass to the south, the west and the east."""
    floors = tuple(
        FloorPlan(name, 3.0, np.array([list(row.translate(str.maketrans("AB", zones))) for row in STOREY]))
        for name, zones in (("F1", "AB"), ("F2", "CD"))
    )
    glazing = {"A": {"south": 2.0, "west": 1.5}, "D": {"east": 3.0}}
    devices = tuple(Device(name=f"VAV_{z}", type="vav", zone=z) for z in "ABCD")
    return Building("stacked", SITE, 20.0, FloorPlans(1.0, floors, glazing), devices=devices)


def listed_building() -> Building:
    """Two rooms of a zone table, under a flat roof and an attic, on the ground; air goes from one to the other."""
    brick = (
        Layer(thickness=0.2, conductivity=0.5, density=1200.0, heat_capacity=1000.0),
        Layer(thickness=0.1, conductivity=0.04, density=30.0, heat_capacity=1000.0),
    )
    surfaces = (
        Surface(name="W", kind="wall", zone="A", other="outdoor", area=12.0, azimuth=180.0, construction="brick"),
        Surface(name="V", kind="wall", zone="B", other="outdoor", area=9.0, azimuth=-90.0, construction="brick"),
        Surface(name="I", kind="wall", zone="A", other="B", area=8.0, construction="brick"),
        Surface(name="C", kind="ceiling", zone="A", other="attic", area=20.0, construction="brick"),
        Surface(name="R", kind="ceiling", zone="B", other="outdoor", area=16.0, construction="brick"),
        Surface(name="F", kind="floor", zone="B", other="ground", area=16.0, construction="brick"),
        Surface(name="G", kind="window", zone="A", other="outdoor", area=3.0, azimuth=180.0, u_value=1.3,
                solar_transmittance=0.5),
        Surface(name="O", kind="opening", zone="A", other="B", area=1.9),
    )  # fmt: skip
    zones = (ZoneEntry(name="A", volume=50.0, floor_area=20.0), ZoneEntry(name="B", volume=40.0, floor_area=16.0))
    flows = (Airflow(source="A", target="B", device="VAV_A", fraction=0.5),)
    devices = (Device(name="VAV_A", type="vav", zone="A"), Device(name="HEATER", type="electric_heater", zone="B"))
    return Building("listed", SITE, 0.0, ZoneTable(zones, surfaces, {"brick": brick}), devices, flows)


def lively_telemetry(building: Building, days: float = 3.0, step: float = 600.0) -> pd.DataFrame:
    """Telemetry in which everything moves: weather with sun, wind and sky, thermostats, supply air [library's units]."""
    n = round(days * 86400.0 / step)
    index = pd.date_range("2023-03-24 00:10", periods=n, freq=f"{step:g}s", tz="Europe/Berlin", name="timestamp")
    hour = np.arange(n) * step / 3600.0
    day = np.maximum(np.sin(2.0 * np.pi * (hour - 6.0) / 24.0), 0.0)
    station = {
        "outside_air_temperature_sensor": 278.0 + 6.0 * np.sin(2.0 * np.pi * (hour - 9.0) / 24.0) + 0.3 * np.sin(hour),
        "wind_speed_sensor": 3.0 + 2.0 * np.sin(0.9 * hour),
        "direct_normal_irradiance_sensor": 700.0 * day * (1.0 + 0.3 * np.sin(2.1 * hour)),
        "diffuse_horizontal_irradiance_sensor": 150.0 * day,
        "horizontal_infrared_irradiance_sensor": 270.0 + 40.0 * np.sin(0.3 * hour),
    }
    columns = {f"weather_station/{point}": values for point, values in station.items()}
    for k, zone in enumerate(building.zone_names):
        warm = (hour % 24.0 > 6.0 + 0.5 * k) & (hour % 24.0 < 18.0)
        columns[f"{zone}/zone_air_temperature_sensor"] = 292.0 + 0.5 * k + 1.5 * day + 0.1 * np.sin(3.0 * hour + k)
        if f"VAV_{zone}" in [d.name for d in building.devices]:
            columns[f"VAV_{zone}/supply_air_flowrate_sensor"] = np.where(warm, 0.10 + 0.03 * np.sin(hour + k), 0.0)
            columns[f"VAV_{zone}/discharge_air_temperature_sensor"] = 295.0 + 8.0 * np.abs(np.sin(0.7 * hour + k))
    for boundary in building.measured_boundaries:
        columns[f"{boundary}/zone_air_temperature_sensor"] = 283.0 + 2.0 * np.sin(0.26 * hour)
    if "HEATER" in [d.name for d in building.devices]:
        columns["HEATER/heating_power_sensor"] = 400.0 * (1.0 + np.sin(0.8 * hour))
    return pd.DataFrame(columns, index=index, dtype=float)


@pytest.fixture(scope="session")
def lively_frame() -> Callable[..., pd.DataFrame]:
    """Telemetry in which everything moves, for a building of `lively_case`."""
    return lively_telemetry


@pytest.fixture(scope="session")
def lively_case() -> Callable[[str], Case]:
    """A small building of either kind (``plan`` or ``table``) with telemetry in which everything moves."""
    made: dict[str, Case] = {}

    def case_of(kind: str) -> Case:
        if kind not in made:
            building = stacked_building() if kind == "plan" else listed_building()
            made[kind] = Case(building, Telemetry.from_frame(lively_telemetry(building)))
        return made[kind]

    return case_of
