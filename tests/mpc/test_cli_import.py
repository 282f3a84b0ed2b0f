"""``import-plan`` and ``import-devices``: drawings and a list become a case that ``check`` takes."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from mpc.cli.app import app

pytest.importorskip("skimage", reason="needs the extra [plan]")

LIST = """
name: two rooms
location: {latitude: 37.4, longitude: -122.1, elevation: 20.0, timezone: America/Los_Angeles}
orientation: 10.0
floors:
  - {name: F1, file: first.png, height: 2.8, scale: {points: [[50, 50], [450, 50]], distance: 8.0}}
  - {name: F2, file: second.csv, cell_size: 0.1}
"""


def run(*arguments: str | Path) -> Any:
    """Run the command in this process."""
    return CliRunner().invoke(app, [str(a) for a in arguments])


@pytest.fixture
def drawings(tmp_path: Path) -> Path:
    """Two floors of 8 m x 6 m, one drawn at 2 cm a pixel with a door, one in codes."""
    from PIL import Image

    pixels = np.full((400, 500), 255, dtype=np.uint8)
    pixels[40:360, 40:460] = 0
    pixels[50:350, 50:450] = 255
    pixels[50:350, 248:253] = 0
    pixels[100:145, 248:253] = 255
    Image.fromarray(pixels).save(tmp_path / "first.png")
    codes = np.full((64, 84), 2)
    codes[1:63, 1:83] = 1
    codes[2:62, 2:82] = 0
    np.savetxt(tmp_path / "second.csv", codes, fmt="%d", delimiter=",")
    (tmp_path / "plans.yaml").write_text(LIST, encoding="utf-8")
    (tmp_path / "devices.csv").write_text("name,type,zone\nV1,VAV,F1-R1\nV2,VAV,F1-R2\nV3,VAV,F3\nB,boiler,", "utf-8")
    return tmp_path / "plans.yaml"


def test_drawings_become_a_case(drawings: Path, tmp_path: Path) -> None:
    case = tmp_path / "case"
    answer = run("import-plan", drawings, "--devices", tmp_path / "devices.csv", "--out", case)
    assert (answer.exit_code, answer.stderr) == (0, "")
    assert "F1_R02" in answer.stdout and "V3" in answer.stdout
    assert "<svg" in (case / "report.html").read_text(encoding="utf-8")
    checked = json.loads(run("check", case, "--json").stdout)
    areas = {zone["name"]: zone["floor_area"] for zone in checked["zones"]}
    assert areas == pytest.approx({"F1_R01": 24.06, "F1_R02": 23.94, "F2_R01": 48.0}, rel=0.02)
    assert run("import-plan", drawings, "--out", case).exit_code == 2
    answer = run("import-plan", drawings, "--out", case, "--force", "--json")
    assert answer.exit_code == 0 and json.loads(answer.stdout)["largest_area_error"] < 0.02


def test_devices_and_columns(drawings: Path, tmp_path: Path) -> None:
    assert run("import-plan", drawings, "--out", tmp_path / "case").exit_code == 0
    (tmp_path / "t.csv").write_text("time,V1 zat,V1 airflow,lights\n", encoding="utf-8")
    arguments = ("import-devices", tmp_path / "case", tmp_path / "devices.csv", "--telemetry", tmp_path / "t.csv")
    answer = run(*arguments, "--out", tmp_path / "new")
    assert (answer.exit_code, answer.stderr) == (0, "")
    assert "2 of 3 columns matched" in answer.stdout and "lights" in answer.stdout
    assert (tmp_path / "new" / "points.csv").is_file()
    found = json.loads(run(*arguments, "--out", tmp_path / "json", "--json").stdout)
    assert found["devices"]["unplaced"] == {"V3": "F3"} and found["points"][0]["entity"] == "V1"


@pytest.mark.parametrize(
    ("old", "new", "error"),
    [
        ("first.png", "../../etc/passwd.png", "PlanError"),
        ("first.png", "none.png", "PlanError"),
        ("distance: 8.0", "distance: 80000.0", "PlanError"),
        ("distance: 8.0", "length: 8.0", "PlanError"),
        ("height: 2.8", "heigth: 2.8", "PlanError"),
        ("height: 2.8", "height: 0.1", "PlanError"),
        ("name: two rooms", "name: &a [*a]", "PlanError"),
        ("name: F2", "name: F1", "PlanError"),
    ],
)
def test_bad_lists_are_refused_by_name(drawings: Path, tmp_path: Path, old: str, new: str, error: str) -> None:
    drawings.write_text(LIST.replace(old, new), encoding="utf-8")
    answer = run("import-plan", drawings, "--out", tmp_path / "case")
    assert (answer.exit_code, answer.stdout) == (2, "")
    assert answer.stderr.startswith(f"error: {error}: ")
    assert not (tmp_path / "case").exists()


@pytest.fixture
def case(drawings: Path, tmp_path: Path) -> Path:
    """Three rooms with terminals in two of them, without telemetry."""
    devices = tmp_path / "devices.csv"
    assert run("import-plan", drawings, "--devices", devices, "--out", tmp_path / "case").exit_code == 0
    return tmp_path / "case"


@pytest.fixture
def export(tmp_path: Path) -> Path:
    """Ten minutes of a building automation system, in its own names and units."""
    rows = (
        "timestamp,V1 zat,V1 airflow,lights,V1 zn t",
        "2023-01-09T00:05:00-08:00,68,100,7,1",
        "2023-01-09T00:10:00-08:00,,,7,1",
    )
    (tmp_path / "export.csv").write_text("\n".join(rows), encoding="utf-8")
    return tmp_path / "export.csv"


def test_telemetry_of_any_names_and_units(case: Path, export: Path, tmp_path: Path) -> None:
    from thermal import load_case
    from thermal.units import air_density

    units = ("--unit", "zone_air_temperature_sensor=degF", "--unit", "supply_air_flowrate_sensor=cfm")
    answer = run("import-telemetry", case, export, *units, "--out", tmp_path / "new")
    assert (answer.exit_code, answer.stderr) == (0, "")
    assert "2 of 4 columns matched" in answer.stdout and "fits as well" in answer.stdout
    frame = load_case(tmp_path / "new").telemetry.frame
    assert frame["V1/zone_air_temperature_sensor"].iloc[0] == pytest.approx(293.15)
    cubic_metres = 100 * 0.3048**3 / 60
    assert frame["V1/supply_air_flowrate_sensor"].iloc[0] == pytest.approx(cubic_metres * air_density(20.0), rel=1e-3)
    assert run("check", tmp_path / "new").exit_code == 0

    points = tmp_path / "new" / "points.csv"
    text = points.read_text(encoding="utf-8")
    points.write_text(text.replace("V1 airflow,V1,supply_air_flowrate_sensor", "V1 airflow,,"), encoding="utf-8")
    answer = run("import-telemetry", case, export, "--points", points, "--out", tmp_path / "less", "--json")
    assert answer.exit_code == 0 and json.loads(answer.stdout)["columns"] == 1


@pytest.mark.parametrize(
    ("points", "more", "error"),
    [
        ("column,entity\nV1 zat,V1", (), "PlanError"),
        ("column,entity,point\n,V1,zone_air_temperature_sensor", (), "PlanError"),
        ("column,entity,point\nV1 zat,,", (), "PlanError"),
        ("column,entity,point\nnone,V1,zone_air_temperature_sensor", (), "PlanError"),
        ("column,entity,point\nV1 zat,V1,zone_air_temprature_sensor", (), "CaseError"),
        ("column,entity,point\nV1 zat,V9,zone_air_temperature_sensor", (), "CaseError"),
        ("column,entity,point\nV1 zat,V1,zone_air_temperature_sensor", ("--unit", "degF"), "PlanError"),
        (
            "column,entity,point\nV1 zat,V1,zone_air_temperature_sensor",
            ("--unit", "zone_air_temperature_sensor=W"),
            "CaseError",
        ),
    ],
)
def test_bad_points_are_refused_by_name(
    case: Path, export: Path, tmp_path: Path, points: str, more: tuple[str, ...], error: str
) -> None:
    (tmp_path / "points.csv").write_text(points, encoding="utf-8")
    given = ("--points", tmp_path / "points.csv", *more)
    answer = run("import-telemetry", case, export, *given, "--out", tmp_path / "new")
    assert (answer.exit_code, answer.stdout) == (2, "")
    assert answer.stderr.startswith(f"error: {error}: ")
    assert not (tmp_path / "new").exists()


def test_work_on_a_case_is_not_lost_by_the_way(drawings: Path, case: Path, export: Path, tmp_path: Path) -> None:
    (case / "labelling").mkdir()
    draft = {"devices": [{"x": 1.0}, {"x": None}], "floors": [{}, {}], "seconds": 600.0}
    (case / "labelling" / "labelling.json").write_text(json.dumps(draft), encoding="utf-8")
    assert run("import-telemetry", case, export, "--out", case, "--force").exit_code == 0
    assert json.loads((case / "labelling" / "labelling.json").read_text(encoding="utf-8")) == draft
    answer = run("import-plan", drawings, "--out", case)
    assert answer.exit_code == 2 and answer.stderr.startswith("error: PlanError: ")
    for text in ("10 minutes of work", "2 floors", "1 devices put", "4 devices", "telemetry of 2 columns", "--force"):
        assert text in answer.stderr
    answer = run("import-plan", drawings, "--out", case, "--force")
    assert answer.exit_code == 0 and "Replaced: 10 minutes of work" in answer.stdout
    assert not (case / "labelling").exists()
