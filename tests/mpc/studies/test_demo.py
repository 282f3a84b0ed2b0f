"""The main job from check to control, on coarse control volumes: what it finds, leaves behind and prints."""

from __future__ import annotations

import json
import re
from functools import partial
from pathlib import Path

import pandas as pd
import pytest
from typer.testing import CliRunner

from calibration import Interval
from calibration.errors import ResultsExistError
from mpc.cli.app import app
from mpc.errors import ControlError
from mpc.studies.demo import Demo, _working_day, run_demo
from thermal import Case, load_case

STEPS = ["check", "calibrate", "diagnose", "evaluate", "compare"]


@pytest.fixture(scope="module")
def case(coarse_case: Path) -> Case:
    """The bundled case, whose building has sun through its windows."""
    return load_case(coarse_case)


@pytest.fixture(scope="module")
def demo(case: Case, blank_pictures: None, tmp_path_factory: pytest.TempPathFactory) -> tuple[Demo, list[str]]:
    """Of two controllers and one hour."""
    said: list[str] = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("mpc.studies.demo.CONTROLLERS", ("reset", "mpc"))
        patch.setattr("mpc.studies.demo._working_day", lambda *_: ("2023-03-10T06:00", "2023-03-10T07:00"))
        out = tmp_path_factory.mktemp("demo") / "results"
        return run_demo(out, case=case, dx=1.0, told=lambda step, verdict: said.append(step)), said


@pytest.mark.long
def test_each_step_leaves_a_page_and_the_first_page_leads_to_all(demo: tuple[Demo, list[str]]) -> None:
    found, said = demo
    assert said == STEPS and list(found.pages) == STEPS
    folder = found.pages["check"].parents[1]
    page = (folder / "report.html").read_text(encoding="utf-8")
    links = re.findall(r'href="([^"]+)"', page)
    assert [folder / link for link in links] == list(found.pages.values())
    assert all((folder / link).is_file() for link in links) and 'src="http' not in page
    for sentence in found.verdicts.values():
        assert sentence in page
    with pytest.raises(ResultsExistError):
        run_demo(folder)


@pytest.mark.long
def test_the_numbers_are_those_of_the_steps(demo: tuple[Demo, list[str]]) -> None:
    found, _ = demo
    folder = found.pages["check"].parents[1]
    content = json.loads((folder / "demo.json").read_text(encoding="utf-8"))
    errors, steps = content["held_out_mae"], found.diagnosis.steps
    assert errors["uncalibrated"] > errors["calibrated"] > 2.0 * errors["with_effects"]
    assert content["diagnosis"]["effects"] == list(steps[-1].effects) == ["solar_gain"]
    assert errors["with_effects"] == pytest.approx(steps[-1].after, rel=0.05)
    kept = json.loads((folder / "compare" / "comparison.json").read_text(encoding="utf-8"))
    assert content["control"]["costs"] == {name: kept["controllers"][name]["cost"] for name in ("reset", "mpc")}
    assert content["control"]["best_rule"] == "reset" and content["fine"]


def test_the_command_prints_what_was_found(
    demo: tuple[Demo, list[str]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    found, _ = demo

    def told_at_once(out: Path, *, told, **_) -> Demo:
        for step, verdict in found.verdicts.items():
            told(step, verdict)
        return found

    monkeypatch.setattr("mpc.studies.demo.run_demo", told_at_once)
    run = partial(CliRunner().invoke, app)
    answer = run(["demo", "--out", str(tmp_path / "out")])
    assert (answer.exit_code, answer.stderr) == (0, "")
    for text in ("The bundled case", "The case is valid", "on data it was not fitted to", "optimal control", "Report:"):
        assert text in answer.stdout
    answer = run(["demo", "--out", str(tmp_path / "out"), "--json"])
    assert json.loads(answer.stdout) == json.loads(json.dumps(found.to_dict()))
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "mine.txt").touch()
    assert run(["demo", "--out", str(tmp_path / "out")]).exit_code == 2


def test_the_last_whole__working_day_is_controlled(case: Case) -> None:
    def of(start: str, end: str) -> tuple[str, str]:
        zone = case.building.location.timezone
        return _working_day(case, Interval(pd.Timestamp(start, tz=zone), pd.Timestamp(end, tz=zone)))

    assert of("2023-03-07 16:00", "2023-03-11") == ("2023-03-10T00:00:00-05:00", "2023-03-11T00:00:00-05:00")
    assert of("2023-03-07 16:00", "2023-03-13 12:00")[0].startswith("2023-03-10")  # Friday, before the weekend
    with pytest.raises(ControlError, match="whole working day"):
        of("2023-03-10 00:05", "2023-03-13")
