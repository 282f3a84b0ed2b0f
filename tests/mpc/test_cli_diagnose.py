"""``buildingmpc diagnose``, and effects that `calibrate` is told of."""

from __future__ import annotations

import json
import re
import shutil
from pathlib import Path
from typing import Any

import pandas as pd
import pytest
from typer.testing import CliRunner

from mpc.cli.app import app
from thermal.data import bundled_case_path
from thermal.effects.catalogue import CATALOGUE

CASE = str(bundled_case_path())

pytestmark = pytest.mark.usefixtures("blank_pictures")


def run(*arguments: str | Path) -> Any:
    """Run the command in this process."""
    return CliRunner().invoke(app, [str(a) for a in arguments])


def test_diagnose_writes_what_it_says(coarse_case: Path, tmp_path: Path) -> None:
    out = tmp_path / "gap"
    answer = run("diagnose", coarse_case, "--out", out, "--dx", "2.0", "--tune", "2023-03-01/2023-03-07",
                 "--hold-out", "2023-03-07T00:30/2023-03-11", "--json")  # fmt: skip
    assert answer.exit_code == 0, answer.stderr
    assert json.loads(answer.stdout) == json.loads((out / "diagnosis.json").read_text(encoding="utf-8"))
    assert sorted(p.name for p in out.iterdir()) == [
        "calibration.json", "diagnosis.json", "missing_watts.parquet", "posterior.json", "predictions.parquet", "report.html",
    ]  # fmt: skip
    held_out = json.loads(answer.stdout)["intervals"]["held_out"]
    assert [i["start"] for i in held_out] == ["2023-03-07T00:30:00-05:00"]
    again = run("diagnose", coarse_case, "--out", out)
    assert again.exit_code == 2 and "ResultsExistError" in again.stderr


@pytest.mark.parametrize(
    ("arguments", "error"),
    [
        (("diagnose", "nowhere", "--out", "unused"), "CaseError"),
        (("diagnose", CASE, "--out", "unused", "--tune", "yesterday"), "CalibrationError"),
        (("calibrate", CASE, "--out", "unused", "--effects", "solar_gian"), "EffectError"),
        (("calibrate", CASE, "--out", "unused", "--effects", "blinds"), "EffectError"),
    ],
)
def test_bad_input_is_named(arguments: tuple[str, ...], error: str) -> None:
    answer = run(*arguments)
    assert answer.exit_code == 2 and error in answer.stderr and "Traceback" not in answer.stderr
    assert not Path("unused").exists()


@pytest.mark.long
def test_calibrate_takes_effects(coarse_case: Path, tmp_path: Path) -> None:
    out = tmp_path / "sun"
    answer = run("calibrate", coarse_case, "--out", out, "--dx", "2.0", "--starts", "1", "--effects", "solar_gain")
    assert answer.exit_code == 0, answer.stderr
    content = json.loads((out / "calibration.json").read_text(encoding="utf-8"))
    assert [e["effect"] for e in content["effects"]] == ["solar_gain"]
    assert "solar_heat_gain_coefficient" in content["parameters"]


def test_effects_lists_the_catalogue_and_what_a_case_can_tell() -> None:
    plain, of_case = (json.loads(run("effects", *case, "--json").stdout)["effects"] for case in ((), (CASE,)))
    assert list(plain) == list(of_case) == list(CATALOGUE)
    assert plain["solar_gain"]["parameters"]["solar_heat_gain_coefficient"] == {"unit": "1", "range": [0.0, 0.8]}
    assert "untestable" not in plain["solar_gain"]
    assert of_case["solar_gain"]["untestable"] is None
    assert of_case["interfloor_exchange"]["untestable"] == "no zone lies above another"
    shown = run("effects", CASE).stdout
    assert "sun through the windows" in shown and "no zone lies above another" in shown


@pytest.mark.long
def test_what_is_known_or_ruled_out_is_not_sought(coarse_case: Path, tmp_path: Path) -> None:
    out = tmp_path / "gap"
    answer = run("diagnose", coarse_case, "--out", out, "--dx", "2.0", "--effects", "solar_gain", "--rule-out",
                 "sensor_bias,clock_shift", "--json")  # fmt: skip
    assert answer.exit_code == 0, answer.stderr
    found = json.loads(answer.stdout)
    by_id = {entry["effect"]: entry for entry in found["which"]}
    assert by_id["solar_gain"]["reason"] == "known to be there: part of the baseline"
    assert by_id["clock_shift"]["reason"] == by_id["sensor_bias"]["reason"] == "ruled out beforehand"
    assert [by_id[name]["probability"] for name in ("solar_gain", "sensor_bias", "clock_shift")] == [0.0] * 3
    calibration = json.loads((out / "calibration.json").read_text(encoding="utf-8"))
    assert "solar_gain" in calibration["settings"]["effects"]
    assert set(calibration["band_factors"]) and calibration["disturbance"]["time_constant"] > 0.0
    assert not found["how_far"]  # nothing else was found, so that there is one model to show
    assert "with_effects" not in " ".join(pd.read_parquet(out / "predictions.parquet").columns)
    assert "known to be there, is part of the baseline" in (out / "report.html").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--effects", "sun"), r"it may be solar_gain \(sun through the windows\)"),
        (("--rule-out", "sensor_bais"), "the nearest valid one is 'sensor_bias'"),
        (("--effects", "interfloor_exchange"), "expected one that the case can have, found no zone lies above another"),
        (("--effects", "solar_gain", "--rule-out", "solar_gain"), "expected known or ruled out, found both"),
    ],
)
def test_effects_that_cannot_be_known_are_named(arguments: tuple[str, ...], message: str, tmp_path: Path) -> None:
    answer = run("diagnose", CASE, "--out", tmp_path / "gap", "--dx", "2.0", *arguments)
    assert answer.exit_code == 2
    assert re.search(message, " ".join(answer.stderr.split()))
    assert not (tmp_path / "gap").exists()


@pytest.mark.long
def test_a_folder_of_cases_is_diagnosed_case_by_case(coarse_case: Path, tmp_path: Path) -> None:
    cases = tmp_path / "cases"
    for name in ("one", "two"):
        shutil.copytree(coarse_case, cases / name)
    text = (cases / "two" / "building.yaml").read_text(encoding="utf-8")
    (cases / "two" / "building.yaml").write_text(text.replace("zone: F1_N", "zone: G1_N"), encoding="utf-8")
    settings = ("--dx", "2.0", "--workers", "1", "--rule-out", "blinds")
    answer = run("diagnose", cases, "--out", tmp_path / "out", *settings)
    assert answer.exit_code == 1, answer.stderr
    assert "error: two: CaseError" in answer.stderr
    assert "solar_gain" in answer.stdout and "named" in answer.stdout
    assert (tmp_path / "out" / "one" / "report.html").is_file()
    summary = json.loads((tmp_path / "out" / "summary.json").read_text(encoding="utf-8"))["cases"]
    assert summary["one"]["effects"] == ["solar_gain"] and summary["two"]["status"] == "failed"
    again = run("diagnose", cases, "--out", tmp_path / "out", *settings, "--json")
    assert json.loads(again.stdout)["cases"]["one"]["resumed"]
    refused = run("diagnose", cases / "one", "--out", tmp_path / "alone", "--workers", "2")
    assert refused.exit_code == 2 and "are for a folder of cases" in refused.stderr
