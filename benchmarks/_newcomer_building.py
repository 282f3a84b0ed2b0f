"""The building that a newcomer has: drawings, a list of devices, an export of its automation system, and its truth."""

from __future__ import annotations

import json
import os
import re
import shutil
import signal
import subprocess
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from typing import Any

import pandas as pd
import yaml
from _table import ROOT

from calibration import Interval, evaluate_case
from thermal import FloorPlans, load_case, save_case
from thermal.case.plan import FACADE_STEPS, facade_areas
from thermal.pilot.building import pilot_building
from thermal.pilot.twin import TwinSettings, TwinTruth, generate_twin
from thermal.pilot.weather import MOUNTAIN_VIEW

BROWSER = ROOT / "tests" / "browser"
SEED = 0

#: Columns of the export, as an automation system has them; the last two are of nothing that the library knows.
EXPORTED = {
    "zone_air_temperature_sensor": "ZAT",
    "supply_air_flowrate_sensor": "Airflow",
    "discharge_air_temperature_sensor": "DAT",
    "zone_air_heating_temperature_setpoint": "Zone Htg Temp SP",
    "zone_air_cooling_temperature_setpoint": "Zone Clg Temp SP",
    "outside_air_temperature_sensor": "OAT",
    "wind_speed_sensor": "Wind Speed",
    "wind_direction_sensor": "Wind Direction",
    "direct_normal_irradiance_sensor": "DNI",
    "diffuse_horizontal_irradiance_sensor": "DHI",
    "global_horizontal_irradiance_sensor": "GHI",
}
UNKNOWN = ("Lobby lighting kWh", "Lift alarm")


@dataclass(frozen=True)
class Size:
    """How large the building is, and how it is calibrated."""

    seed: int
    zones: int
    floor_area: float  # m2
    floors: int
    days: float
    dx: float  # m, between control volumes
    pixel: float  # m, of the drawings


PILOT = Size(0, 123, 6317.0, 2, 10.0, 1.0, 0.025)
SMALL = Size(1, 12, 600.0, 2, 10.0, 1.0, 0.05)


@dataclass(frozen=True)
class Standing:
    """A building that stands, and what is true of it."""

    size: Size
    areas: Mapping[str, float]  # m2, by zone
    glazing: Mapping[str, Mapping[str, float]]  # m2, by zone and facade
    truth: TwinTruth
    devices: int
    last_day: tuple[str, str]

    @property
    def zones(self) -> int:
        """Number of zones."""
        return len(self.areas)


def raise_building(home: Path, size: Size) -> Standing:
    """Draw the building, let it be lived in, and export what its sensors saw."""
    drawings = home / "drawings"
    drawings.mkdir()
    pilot = _drawing_script()
    drawn = pilot.draw_pilot(
        drawings, seed=size.seed, zones=size.zones, floor_area=size.floor_area, floors=size.floors, pixel=size.pixel
    )
    pilot.write_bomb(drawings)
    listed = {
        "name": "office",
        "location": MOUNTAIN_VIEW.model_dump(),
        "floors": [
            {
                "name": floor,
                "file": f"{floor}.png",
                "scale": drawn["scale"],
                "names": {name: room["point"] for name, room in drawn["rooms"].items() if room["floor"] == floor},
            }
            for floor in drawn["floors"]
        ],
    }
    written_out = json.loads(json.dumps(listed))  # a list of drawings has no aliases
    (drawings / "plans.yaml").write_text(yaml.safe_dump(written_out, sort_keys=False), encoding="utf-8")
    building = pilot_building(size.seed, floor_area=size.floor_area, zones=size.zones, floors=size.floors)
    case, truth = generate_twin(building, SEED, TwinSettings(days=size.days, dx=size.dx))
    frame = pd.read_parquet(save_case(case, home / "truth") / "telemetry.parquet")
    export_telemetry(frame, home / "export.csv")
    end = frame.index[-1].floor("D")
    days = tuple(stamp.strftime("%Y-%m-%dT%H:%M") for stamp in (end - pd.Timedelta(days=1), end))
    plans = building.geometry
    if not isinstance(plans, FloorPlans):
        raise SystemExit("pilot: expected floor plans")
    known = drawn | {"glazing": glazing_by_facade(plans), "place": MOUNTAIN_VIEW.model_dump()}
    (drawings / "truth.json").write_text(json.dumps(known), encoding="utf-8")
    return Standing(size, drawn["areas"], plans.glazing, truth, len(drawn["devices"]), (days[0], days[1]))


def glazing_by_facade(plans: FloorPlans) -> dict[str, float]:
    """Glazed share of each facade of the whole building [-], which is what a person reads off it from the street."""
    facades = facade_areas(plans)
    found = {}
    for side in FACADE_STEPS:
        whole = sum(areas[side] for areas in facades.values())
        found[side] = sum(glass.get(side, 0.0) for glass in plans.glazing.values()) / whole if whole else 0.0
    return found


def _drawing_script() -> Any:
    """Load the script that draws buildings for the test of the page."""
    spec = spec_from_file_location("pilot_drawings", BROWSER / "pilot.py")
    if spec is None or spec.loader is None:
        raise SystemExit(f"{BROWSER}: expected pilot.py, found none")
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def export_telemetry(frame: pd.DataFrame, path: Path) -> None:
    """Write telemetry under the names of an automation system."""
    names = {}
    for column in map(str, frame.columns):
        entity, _, point = column.partition("/")
        if point in EXPORTED:
            device = entity.replace("_", "-")
            names[column] = EXPORTED[point] if entity == "weather_station" else f"{device} {EXPORTED[point]}"
    table = frame[list(names)].rename(columns=names).round(4)
    table = table.assign(**dict.fromkeys(UNKNOWN, 0.0))
    table.index = pd.Index([stamp.isoformat() for stamp in frame.index], name="timestamp")
    table.to_csv(path)


def with_glazing(case: Path, glazing: Mapping[str, Mapping[str, float]]) -> None:
    """Add glazed areas, which no drawing here has, as one types them into ``building.yaml``."""
    file = case / "building.yaml"
    content = yaml.safe_load(file.read_text(encoding="utf-8"))
    content["glazing"] = {zone: dict(sides) for zone, sides in glazing.items()}
    file.write_text(yaml.safe_dump(content, sort_keys=False), encoding="utf-8")


def browser_programs() -> tuple[str, str, Path] | None:
    """Give node, chromium and the folder of playwright-core, where `tests/browser/install.sh` has put them."""
    node, chromium = shutil.which("node"), shutil.which("chromium") or shutil.which("chromium-browser")
    modules = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "buildingmpc-browser" / "node_modules"
    if node is None or chromium is None or not (modules / "playwright-core").is_dir():
        return None
    return node, chromium, modules


def walk_page(
    command: Sequence[str], home: Path, environment: Mapping[str, str], pictures: Path | None = None
) -> dict[str, Any]:
    """Serve the page and let a scripted person go all the way on it; gives what the script counted."""
    programs = browser_programs()
    if programs is None:
        raise SystemExit("expected node, chromium and playwright-core; run tests/browser/install.sh")
    node, chromium, modules = programs
    with subprocess.Popen(
        list(command), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=dict(environment)
    ) as server:
        try:
            lines = "".join(server.stdout.readline() for _ in range(2)) if server.stdout is not None else ""
            address = re.search(r"http://127\.0\.0\.1:\d+/\S+/", lines)
            if address is None:
                raise SystemExit(f"{' '.join(command)}: expected the page's address, found {lines!r}")
            person = Path(__file__).with_name("newcomer_person.mjs")
            script = [node, str(person), address[0], str(home / "drawings"), str(modules), chromium, str(server.pid)]
            if pictures is not None:
                pictures.mkdir(parents=True, exist_ok=True)
                script.append(str(pictures))
            done = subprocess.run(script, capture_output=True, text=True, timeout=7200)
            if done.returncode:
                raise SystemExit(f"newcomer_person.mjs ended with {done.returncode}\n{done.stderr[-3000:]}")
            server.send_signal(signal.SIGINT)
            server.wait(timeout=30)
        finally:
            server.kill()
    return json.loads(done.stdout)  # type: ignore[no-any-return]


def near(home: Path, standing: Standing, case: Path, results: Path) -> dict[str, Any]:
    """Hold the calibrated simulator against the truth."""
    checked = json.loads((home / "check" / "check.json").read_text(encoding="utf-8"))
    areas = {zone["name"]: zone["floor_area"] for zone in checked["zones"]}
    if areas.keys() != standing.areas.keys():
        raise SystemExit(f"zones: expected those of the drawings, found {sorted(areas.keys() ^ standing.areas.keys())}")
    found = json.loads((results / "calibration.json").read_text(encoding="utf-8"))
    true = {p.name: float(value) for p, value in zip(standing.truth.parameters, standing.truth.theta, strict=True)}
    held = {
        name: lower <= true[name] <= upper
        for name, p in found["parameters"].items()
        if p["standard_error"] is not None
        for lower, upper in [p["interval90"]]
    }
    (home / "true.json").write_text(json.dumps({"parameters": standing.truth.to_dict()["parameters"]}), "utf-8")
    office = load_case(case)
    zone = office.building.location.timezone
    intervals = [
        Interval(*(pd.Timestamp(i[end]).tz_convert(zone) for end in ("start", "end")))
        for i in found["intervals"]["held_out"]
    ]
    at_truth = evaluate_case(office, intervals, parameters=home / "true.json", dx=standing.size.dx).metrics.mae
    replay = json.loads((home / "replay" / "simulation.json").read_text(encoding="utf-8"))
    errors = {
        when: found[key]["held_out"]["mae"] for when, key in (("before", "uncalibrated"), ("after", "calibrated"))
    }
    return {
        "area_error": max(abs(areas[zone] / area - 1.0) for zone, area in standing.areas.items()),
        "mae": errors | {"truth": at_truth},
        "held": sum(held.values()),
        "parameters": len(held),
        "replay_mae": replay["mae"],
    }
