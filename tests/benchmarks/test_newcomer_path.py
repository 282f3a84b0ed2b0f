"""The newcomer's path on a tiny office, its commands in this process: no clone, no installation, no page."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from pathlib import Path
from types import ModuleType

import pytest
from typer.testing import CliRunner

from mpc.cli.app import app

pytest.importorskip("skimage", reason="needs the extra [plan]")


@pytest.fixture(scope="module")
def benchmark(script: Callable[[str], ModuleType]) -> ModuleType:
    for neighbour in ("_table", "_newcomer_building"):
        script(neighbour)
    return script("newcomer_path")


def in_process(command: Sequence[str], folder: Path) -> str:
    """Run ``python -m mpc.cli ...`` here."""
    here = Path.cwd()
    os.chdir(folder)
    try:
        answer = CliRunner().invoke(app, list(command[3:]))
    finally:
        os.chdir(here)
    assert answer.exit_code == 0, answer.output
    return answer.stdout


@pytest.mark.long
def test_from_drawings_to_a_calibrated_simulator(
    benchmark: ModuleType, blank_pictures: None, tmp_path: Path
) -> None:
    size = benchmark.Size(seed=1, zones=4, floor_area=200.0, floors=1, days=4.0, dx=1.0, pixel=0.05)
    found = benchmark.walk(tmp_path, size, without_visit=True, without_browser=True, run=in_process)
    names = [step["name"] for step in found["steps"]]
    assert names == ["drawings to a case, by command", "telemetry", "check", "calibrate", "simulate a day"]
    assert found["area_error"] < 0.02 and found["matched"].startswith("26 of 28 columns")
    assert found["mae"]["after"] < found["mae"]["before"]
    assert 0 < found["held"] <= found["parameters"] == 13
    assert "| own building | calibrate | `buildingmpc calibrate office" in found["table"]


def test_the_readme_is_taken_apart(benchmark: ModuleType) -> None:
    venv, install, demo = benchmark.readme_steps()
    assert venv.endswith("-m venv .venv") and "pip install -e ." in install
    assert demo.endswith("buildingmpc demo --out demo_results")
