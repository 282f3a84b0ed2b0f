"""The case that comes with the library is whole and small."""

from importlib.resources import files
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from thermal.case.case import Case
from thermal.case.load import load_case

FOLDER = Path(str(files("thermal"))) / "data" / "bundled_case"


@pytest.fixture(scope="module")
def case() -> Case:
    return load_case(FOLDER)


def test_it_has_five_zones_with_a_device_each(case):
    assert set(case.building.zone_names) == {"F1_N", "F1_W", "F1_C", "F1_E", "F1_S"}
    assert {device.zone for device in case.building.devices} == set(case.building.zone_names)


def test_it_holds_ten_days_at_five_minutes(case):
    frame = case.telemetry.frame
    assert len(frame) == 2880
    assert case.telemetry.step == 300.0
    assert frame.index.tz is not None
    assert frame.index[0] == pd.Timestamp("2023-03-01 00:05", tz="Etc/GMT+5")


def test_nothing_is_missing(case):
    assert not case.telemetry.frame.isna().any(axis=None)
    assert not case.zone_temperatures().isna().any(axis=None)
    assert not case.zone_heat().isna().any(axis=None)
    assert not case.boundary_temperatures().isna().any(axis=None)


def test_rooms_are_warmer_than_outdoors_and_mostly_heated(case):
    rooms = case.zone_temperatures()
    assert rooms.to_numpy().min() > 288.0
    assert rooms.to_numpy().max() < 300.0
    assert (rooms.mean(axis=0) - case.boundary_temperatures()["outdoor"].mean()).min() > 12.0
    assert (case.zone_heat().mean(axis=0) > 100.0).all()


def test_metered_heat_is_never_more_than_the_terminals_can_give(case):
    areas = {"F1_N": 102.0, "F1_W": 33.25, "F1_C": 94.5, "F1_E": 40.25, "F1_S": 114.0}
    limit = np.array([areas[zone] * 0.0025 * 1.25 * 1006.0 * (35.5 - 15.0) for zone in case.building.zone_names])
    assert (case.zone_heat().to_numpy() < limit).all()


def test_it_is_under_one_and_a_half_megabytes():
    assert sum(path.stat().st_size for path in FOLDER.iterdir()) < 1_500_000
