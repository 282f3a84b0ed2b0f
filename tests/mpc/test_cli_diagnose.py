"""``buildingmpc diagnose``, and effects that `calibrate` is told of."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from mpc.cli.app import app
from thermal.data import bundled_case_path

CASE = str(bundled_case_path())


def run(*arguments: str | Path) -> Any:
    """Run the command in this process."""
    return CliRunner().invoke(app, [str(a) for a in arguments])


def test_diagnose_writes_what_it_says(tmp_path: Path) -> None:
    out = tmp_path / "gap"
    answer = run("diagnose", CASE, "--out", out, "--dx", "2.0", "--tune", "2023-03-01/2023-03-07",
                 "--hold-out", "2023-03-07T00:05/2023-03-11", "--json")  # fmt: skip
    assert answer.exit_code == 0, answer.stderr
    assert json.loads(answer.stdout) == json.loads((out / "diagnosis.json").read_text(encoding="utf-8"))
    assert sorted(p.name for p in out.iterdir()) == [
        "calibration.json", "diagnosis.json", "missing_watts.parquet", "predictions.parquet", "report.html",
    ]  # fmt: skip
    held_out = json.loads(answer.stdout)["intervals"]["held_out"]
    assert [i["start"] for i in held_out] == ["2023-03-07T00:05:00-05:00"]
    again = run("diagnose", CASE, "--out", out)
    assert again.exit_code == 2 and "ResultsExistError" in again.stderr


def test_the_terminal_has_verdict_candidates_and_how_far(capsys: pytest.CaptureFixture[str]) -> None:
    from calibration.diagnosis.diagnosis import diagnose
    from mpc.cli.calibrate import _show_diagnosis as _show
    from mpc.reports.diagnosis_words import diagnosis_verdict, where_sentence
    from thermal import load_bundled_case

    result = diagnose(load_bundled_case(), dx=2.0)
    _show(result)
    text = capsys.readouterr().out
    assert text.startswith(diagnosis_verdict(result)) and where_sentence(result.where) in text
    for s in result.verdict.candidates[:5]:
        assert s.effect in text
    assert f"{result.gap:.3f}" in text and f"{result.floor:.3f}" in text


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


def test_calibrate_takes_effects(tmp_path: Path) -> None:
    out = tmp_path / "sun"
    answer = run("calibrate", CASE, "--out", out, "--dx", "2.0", "--starts", "1", "--effects", "solar_gain")
    assert answer.exit_code == 0, answer.stderr
    content = json.loads((out / "calibration.json").read_text(encoding="utf-8"))
    assert [e["effect"] for e in content["effects"]] == ["solar_gain"]
    assert "solar_heat_gain_coefficient" in content["parameters"]
