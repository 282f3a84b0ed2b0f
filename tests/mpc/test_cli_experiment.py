"""``buildingmpc experiment``: its files, and what it refuses."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pandas as pd
import pytest
from typer.testing import CliRunner

from calibration.experiment import design
from mpc.cli.app import app
from thermal.case.case import Case
from thermal.case.save import save_case
from thermal.case.telemetry import Telemetry
from thermal.data import load_bundled_case


@pytest.fixture(scope="module")
def case(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Save the bundled case by the half hour."""
    found = load_bundled_case()
    frame = found.telemetry.frame.resample("30min", closed="right", label="right").mean().iloc[:-1]
    return save_case(Case(found.building, Telemetry.from_frame(frame)), tmp_path_factory.mktemp("cases") / "half_hours")


def run(*arguments: str | Path) -> Any:
    """Run the command in this process."""
    return CliRunner().invoke(app, [str(a) for a in arguments])


@pytest.fixture
def diagnosis(tmp_path: Path) -> Path:
    """Write a diagnosis that cannot tell two effects apart."""
    group = ["flow_gain", "sensor_bias"]
    which = [
        {"effect": e, "probability": 0.5, "group": group, "zones": ["F1_N"], "testable": True} for e in group
    ]  # fmt: skip
    days = [{"start": "2023-03-01T00:30:00-05:00", "end": "2023-03-07T00:00:00-05:00"}]
    later = [{"start": "2023-03-07T00:30:00-05:00", "end": "2023-03-11T00:00:00-05:00"}]
    content = {
        "case": "bundled_case", "verdict": "group", "which": which, "how_far": [],
        "intervals": {"tuning": days, "held_out": later},
    }  # fmt: skip
    folder = tmp_path / "diagnosis"
    folder.mkdir()
    (folder / "diagnosis.json").write_text(json.dumps(content), encoding="utf-8")
    return folder


def test_experiment_writes_what_it_says(
    case: Path, diagnosis: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    own = design.moves
    monkeypatch.setattr(design, "moves", lambda *a: own(*a)[:1])
    out = tmp_path / "out"
    answer = run("experiment", case, "--diagnosis", diagnosis, "--out", out, "--dx", "3", "--hours", "6", "--json")
    assert answer.exit_code == 0, answer.stderr
    content = json.loads((out / "experiment.json").read_text(encoding="utf-8"))
    assert json.loads(answer.stdout) == content
    assert content["start"] == "2023-03-11T00:00:00-05:00" and set(content["members"]) == {"flow_gain", "sensor_bias"}
    assert sorted(p.name for p in out.iterdir()) == [
        "expected.parquet", "experiment.json", "report.html", "schedule.csv",
    ]  # fmt: skip
    expected = pd.read_parquet(out / "expected.parquet")
    assert set(expected["zone"]) == {"F1_N", "F1_W", "F1_C", "F1_E", "F1_S"} and "flow_gain_usual" in expected
    rows = pd.read_csv(out / "schedule.csv")
    assert list(rows.columns) == ["time", "point", "value", "unit"]
    page = (out / "report.html").read_text(encoding="utf-8")
    assert bool(content["by_hand"]) == bool(content["moves"]) == ("The telemetry has no setpoints of" in page)


@pytest.mark.parametrize(
    ("options", "error"),
    [
        (("--members", "flow_gain,nonsense"), "members"),
        (("--prices", "cheap"), "--prices"),
        (("--hours", "1"), "hours"),
        (("--odds", "0.5"), "odds"),
        (("--run", "nowhere"), "site"),
        (("--start", "2030-01-01T00:00"), "experiment"),
        (("--start", "2023-03-10T13:00"), "end of the telemetry"),
        (("--prices", "1,nan"), "prices"),
        (("--members", "flow_gain,flow_gain"), "two different effects"),
    ],
)
def test_bad_input_is_named(case: Path, diagnosis: Path, tmp_path: Path, options: tuple[str, ...], error: str) -> None:
    if "--start" in options:
        options = (*options, "--hours", "300")
    answer = run("experiment", case, "--diagnosis", diagnosis, "--out", tmp_path / "out", "--dx", "3", *options)
    assert answer.exit_code == 2 and error in answer.stderr and "Traceback" not in answer.stderr
    assert not (tmp_path / "out").exists()


def test_a_wrong_site_is_told_before_the_design(
    case: Path, diagnosis: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "mine.py").write_text("def site(case, end):\n    return None\n", encoding="utf-8")
    monkeypatch.setattr(design, "design_experiment", None)
    site = f"{tmp_path / 'mine.py'}:site"
    answer = run("experiment", case, "--diagnosis", diagnosis, "--out", tmp_path / "out", "--dx", "3", "--run", site)
    assert answer.exit_code == 2 and "a plant" in answer.stderr and not (tmp_path / "out").exists()


def test_the_design_is_kept_where_a_run_fails(
    case: Path, diagnosis: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    own = design.moves
    monkeypatch.setattr(design, "moves", lambda *a: own(*a)[:1])
    text = "class Plant:\n    actuators, control_step, step, telemetry = (), 1800.0, None, None\n"
    text += "    def reset(self):\n        from mpc.errors import PlantError\n        raise PlantError('it is off')\n"
    (tmp_path / "mine.py").write_text(f"{text}def site(case, end):\n    return Plant(), {{}}\n", encoding="utf-8")
    site, out = f"{tmp_path / 'mine.py'}:site", tmp_path / "out"
    calibration = {"settings": {"dx": 3.0, "effects": {"infiltration": []}, "scopes": {"window_u_value": "facade"}}}
    (diagnosis / "calibration.json").write_text(json.dumps(calibration), encoding="utf-8")
    answer = run("experiment", case, "--diagnosis", diagnosis, "--out", out, "--hours", "6", "--run", site)
    assert answer.exit_code == 2, answer.stderr
    content = json.loads((out / "experiment.json").read_text(encoding="utf-8"))
    assert content["outcome"] is None and content["known"] == {"infiltration": []}
    assert content["settings"]["dx"] == 3.0 and content["settings"]["scopes"] == {"window_u_value": "facade"}


def test_no_diagnosis_and_no_experiment(case: Path, tmp_path: Path) -> None:
    answer = run("experiment", case, "--diagnosis", tmp_path, "--out", tmp_path / "out")
    assert answer.exit_code == 2 and "diagnosis.json" in answer.stderr
    answer = run("diagnose", case, "--experiment", tmp_path / "none.json", "--out", tmp_path / "out")
    assert answer.exit_code == 2 and "experiment.json" in answer.stderr
