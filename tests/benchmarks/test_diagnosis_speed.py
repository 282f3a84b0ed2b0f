"""Timing of the diagnosis command, on a small twin."""

from __future__ import annotations

import resource
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import pytest

from thermal.case.save import save_case
from thermal.pilot.building import pilot_building
from thermal.pilot.twin import TwinSettings, generate_twin


@pytest.fixture(scope="module")
def speed(script: Callable[[str], ModuleType]) -> ModuleType:
    for name in ("_table", "_code"):
        script(name)
    return script("diagnosis_speed")


@pytest.mark.long
def test_a_case_is_diagnosed_by_the_command_and_timed(speed: ModuleType, tmp_path: Path) -> None:
    office = pilot_building(3, floor_area=120.0, zones=4, floors=1, name="office")
    twin = generate_twin(office, 3, TwinSettings(days=9.0, step_seconds=1800.0, dx=1.0, meter="exact"))[0]
    path = tmp_path / "office"
    save_case(twin, path)
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    found = speed.measure(path, tmp_path / "out")
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    spent = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    assert 0.0 < found.cpu == pytest.approx(spent, abs=0.05)
    assert found.row()[:4] == ["office", "4", "9", "30"]
    assert 0.0 < found.after <= found.before
    assert (tmp_path / "out" / "report.html").is_file()


@pytest.mark.long
def test_a_case_that_cannot_be_diagnosed_ends_the_benchmark(speed: ModuleType, tmp_path: Path) -> None:
    with pytest.raises(SystemExit, match="expected a diagnosis"):
        speed.measure(tmp_path / "nothing", tmp_path / "out")
