"""The day in closed loop: grid and reduced model agree on a small office, and the table is laid out."""

from __future__ import annotations

from collections.abc import Callable
from types import ModuleType

import numpy as np
import pytest

from thermal.pilot.building import pilot_building
from thermal.system.sizing import size_system


@pytest.fixture(scope="module")
def speed(script: Callable[[str], ModuleType]) -> ModuleType:
    script("_table")
    script("_threads")
    return script("closed_loop_speed")


def test_both_run_the_same_day(speed: ModuleType) -> None:
    building = pilot_building(1, floor_area=600.0, zones=12)
    system, paths = size_system(building), []
    for kind in ("grid", "reduced"):
        plant, times = speed.make(building, system, kind, 1.0)
        assert speed.day(plant).shape == (288,) and set(times) == {"make", "reset"}
        paths.append(plant.record().zone_temperature)
    assert np.abs(paths[0] - paths[1]).mean() < 0.005


def test_the_table_has_both_and_the_paper(speed: ModuleType) -> None:
    each = dict.fromkeys(
        ("make", "reset", "day", "step_median", "step_min", "undisturbed_day", "undisturbed_mean", "read", "balance"),
        0.01,
    ) | {"dx": 0.5, "volumes": 1000, "states": 10}
    small = {"zones": 12, "points": 100, "step": 1e-4, "per_second": 1e4}
    found = {"grid": each, "reduced": each, "devices": 127, "zones": 123, "office": small}
    text = speed.report(found | {"mean_difference": 0.02, "max_difference": 0.1})
    assert "127 devices" in text and "20.0 mK in the mean, 100 mK" in text and "4,320" in text
    assert "100 µs a step" in text and "10,000 steps a second" in text


def test_a_small_office_steps_thousands_of_times_a_second(speed: ModuleType) -> None:
    found = speed.office(days=3)
    assert found["zones"] == 12 and found["points"] > 100
    assert found["step"] < 1e-3  # an order above what an idle machine takes
