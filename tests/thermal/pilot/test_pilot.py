"""The whole pilot case, saved and loaded."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from thermal.case.building import Building, FloorPlans
from thermal.case.case import Case
from thermal.case.load import load_case
from thermal.errors import CaseError
from thermal.pilot.building import PilotSettings, generate_pilot


class HeldPlant:
    """Air that follows heat and outdoor air with an hour's delay."""

    def __init__(self, building: Building, step_seconds: float) -> None:
        self.step_seconds = step_seconds
        self.zone_names = building.zone_names

    def reset(self, zone_temperatures: np.ndarray, /) -> np.ndarray:
        self.air = zone_temperatures.copy()
        return self.air.copy()

    def step(self, zone_heat: np.ndarray, boundary_temperatures: np.ndarray, /) -> np.ndarray:
        target = boundary_temperatures[0] + zone_heat / 150.0
        self.air = self.air + (target - self.air) * self.step_seconds / 3600.0
        return self.air.copy()


@pytest.fixture(scope="module")
def case(tmp_path_factory: pytest.TempPathFactory) -> Case:
    folder = tmp_path_factory.mktemp("cases") / "pilot"
    return generate_pilot(folder, PilotSettings(days=1.0, spin_up_days=0.5), plant_factory=HeldPlant)


def test_the_pilot_case(case: Case) -> None:
    assert case.path is not None
    assert case.path.name == "pilot"
    geometry = case.building.geometry
    assert isinstance(geometry, FloorPlans)
    inside = sum(int(np.isin(floor.tokens, [".", "#"], invert=True).sum()) for floor in geometry.floors)
    assert inside * geometry.cell_size**2 == pytest.approx(6317.0, rel=0.005)
    assert len(case.building.zone_names) == 123
    assert Counter(device.type for device in case.building.devices) == {"vav": 123, "ahu": 2, "boiler": 1, "chiller": 1}
    assert case.telemetry.frame.shape == (288, 7 + 5 * 123)
    assert str(case.telemetry.frame.index[0]) == "2023-10-02 00:05:00-08:00"


def test_the_case_gives_the_models_signals(case: Case) -> None:
    for signals in (case.zone_temperatures(), case.zone_heat(), case.boundary_temperatures()):
        assert signals.notna().all().all()
    assert case.zone_temperatures().to_numpy().min() > 280.0
    assert list(case.boundary_temperatures()) == ["outdoor"]


def test_same_seed_same_case(tmp_path: Path) -> None:
    small = PilotSettings(days=0.25, spin_up_days=0.0, floor_area=600.0, zones=12)
    frames = [
        generate_pilot(tmp_path / str(n), small, seed=n % 2, plant_factory=HeldPlant).telemetry.frame for n in range(3)
    ]
    assert frames[0].equals(frames[2])
    assert not frames[0].equals(frames[1])


def test_a_folder_that_holds_something_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("mine")

    def unwanted(building: Building, step_seconds: float) -> HeldPlant:
        raise AssertionError("refused too late")

    with pytest.raises(CaseError, match="overwrite"):
        generate_pilot(tmp_path, plant_factory=unwanted)
    assert [path.name for path in tmp_path.iterdir()] == ["notes.txt"]


def test_a_case_is_replaced_when_asked_for(tmp_path: Path) -> None:
    small = PilotSettings(days=0.1, spin_up_days=0.0, floor_area=600.0)
    generate_pilot(tmp_path / "case", replace(small, zones=12), plant_factory=HeldPlant)
    generate_pilot(tmp_path / "case", replace(small, zones=14), plant_factory=HeldPlant, overwrite=True)
    assert len(load_case(tmp_path / "case").building.zone_names) == 14
