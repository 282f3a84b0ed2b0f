"""``label``: opens the page of a case, a drawing or a list; ends cleanly; refuses what it cannot label."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import time
import urllib.request
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from mpc.cli import serve as _label
from mpc.cli.app import app

pytest.importorskip("fastapi", reason="needs the extra [pages]")
pytest.importorskip("skimage", reason="needs the extra [plan]")

LIST = """
name: hut
location: {latitude: 37.4, longitude: -122.1, elevation: 20.0, timezone: America/Los_Angeles}
orientation: 10.0
floors:
  - {name: F1, file: codes.csv, cell_size: 0.5}
"""


def run(*arguments: str | Path) -> Any:
    """Run the command in this process."""
    return CliRunner().invoke(app, ["label", "--no-browser", *map(str, arguments)])


@pytest.fixture
def drawings(tmp_path: Path) -> Path:
    """Codes of a hut of one room, and the list that names them."""
    codes = np.pad(np.pad(np.zeros((8, 10), dtype=int), 1, constant_values=1), 1, constant_values=2)
    np.savetxt(tmp_path / "codes.csv", codes, fmt="%d", delimiter=",")
    (tmp_path / "plans.yaml").write_text(LIST, encoding="utf-8")
    return tmp_path / "plans.yaml"


@pytest.fixture
def served(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """What would be served."""
    desks: list[Any] = []

    def serve_page(desk: Any, *, port: int, ready: Any) -> None:
        desks.append((desk, port))
        desk.end()

    monkeypatch.setattr("thermal.plan.page.serve.serve_page", serve_page)
    return desks


def test_a_list_is_on_the_page_and_in_the_case(drawings: Path, served: list[Any]) -> None:
    answer = run(drawings, "--port", "8123")
    assert (answer.exit_code, answer.stderr) == (0, "")
    (desk, port), case = served[0], drawings.with_suffix("")
    assert (port, desk.store.draft.name, desk.store.draft.orientation) == (8123, "hut", 10.0)
    assert (case / "labelling" / "drawings" / "codes.csv").is_file() and (case / "building.yaml").is_file()
    assert CliRunner().invoke(app, ["check", str(case)]).exit_code == 0
    again = run(drawings)
    assert again.exit_code == 2 and "open the case itself" in again.stderr


def test_a_drawing_waits_on_the_page_for_its_scale(drawings: Path, served: list[Any], tmp_path: Path) -> None:
    assert run(tmp_path / "codes.csv", "--out", tmp_path / "case").exit_code == 0
    assert [p.name for p in (tmp_path / "case" / "labelling" / "drawings").iterdir()] == ["codes.csv"]


def test_a_new_case_has_the_name_that_is_given(served: list[Any], tmp_path: Path) -> None:
    assert run(tmp_path / "cases" / "office").exit_code == 0
    assert served[0][0].store.draft.name == "office"
    assert set(served[0][0].reports.kinds) == {"check", "calibrate", "diagnose"}


def test_bad_input_is_refused_by_name(tmp_path: Path, drawings: Path) -> None:
    (tmp_path / "evil.png").write_bytes(b"hello")
    (tmp_path / "plans").mkdir()
    (tmp_path / "plans" / "bad.yaml").write_text(LIST.replace("codes.csv", "../codes.csv"), encoding="utf-8")
    for argument, told in (
        (tmp_path / "spam.png", "LabelError"),
        (tmp_path / "evil.png", "PlanError"),
        (tmp_path / "plans", "LabelError"),
        (tmp_path / "plans" / "bad.yaml", "PlanError"),
    ):
        answer = run(argument)
        assert answer.exit_code == 2 and told in answer.stderr, (argument, answer.stderr)
    assert run(tmp_path, "--out", tmp_path / "y").exit_code == 2
    assert run("--port", "70000").exit_code == 2


@pytest.mark.long
def test_it_serves_the_page_until_it_is_interrupted(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "mpc.cli", "label", str(tmp_path / "case"), "--no-browser"]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment
    ) as process:
        try:
            assert process.stdout is not None
            lines = process.stdout.readline() + process.stdout.readline()
            address = re.search(r"http://127\.0\.0\.1:\d+/\S+/", lines)
            assert address is not None, lines
            with urllib.request.urlopen(f"{address[0]}api/state", timeout=20) as answer:
                assert json.load(answer)["draft"]["name"] == "case"
            other = subprocess.run([*command], capture_output=True, text=True, env=environment, timeout=60)
            assert other.returncode == 2 and f"process {process.pid} has open" in other.stderr
            process.send_signal(signal.SIGINT)
            out, err = process.communicate(timeout=20)
        finally:
            process.kill()
    assert (process.returncode, err) == (0, "")
    assert "buildingmpc check" in out
    assert not (tmp_path / "case" / "labelling" / "open.json").exists()


@pytest.mark.long
def test_a_report_is_made_in_a_process_of_its_own(drawings: Path, served: list[Any], tmp_path: Path) -> None:
    run(drawings)
    case, told = drawings.with_suffix(""), []
    _label._make_apart("check", case, tmp_path / "out", lambda *words: told.append(words), "ip")
    assert "ft²" in (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert ("check", 0, 1) in told
    with pytest.raises(Exception, match="MpcError|expected|Error") as caught:
        _label._make_apart("calibrate", case, tmp_path / "out2", lambda *words: None)
    assert type(caught.value).__name__ == "MpcError"


def test_a_report_that_is_stopped_ends_its_process(drawings: Path, served: list[Any], tmp_path: Path) -> None:
    run(drawings)

    def stop(*words: Any) -> None:
        raise KeyboardInterrupt

    began = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        _label._make_apart("check", drawings.with_suffix(""), tmp_path / "out", stop)
    assert time.monotonic() - began < 20.0
