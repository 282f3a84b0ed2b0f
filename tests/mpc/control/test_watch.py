"""Stuck sensors and a plant far from its model: rates of false alarms, what is named, when it ends."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from mpc.control.controller.site import values_of
from mpc.control.controller.watch import FarFromModel, PossibleReadings, StuckSensors
from mpc.errors import ControlError
from thermal.case.points import POINT_TYPES

ZONES = ("hall", "lab", "loft")


def test_a_stuck_sensor_is_found_and_let_go() -> None:
    watch, rng = StuckSensors(ZONES, np.full(3, 0.05), resolution=0.0), np.random.default_rng(0)
    assert watch.needed.tolist() == [6, 6, 6]
    for k in range(12):
        zone = 294.0 + 0.05 * rng.standard_normal(3)
        if k >= 4:
            zone[1] = 295.0
        assert watch.update(zone).tolist() == [False, k >= 9, False]
    assert not watch.update(np.full(3, 293.0)).any()


def test_what_is_missing_is_not_stuck() -> None:
    watch = StuckSensors(ZONES, np.full(3, 0.05), resolution=0.0)
    for _ in range(10):
        assert not watch.update(np.full(3, np.nan)).any()


@pytest.mark.parametrize("offset", [0.0, 0.03, 0.05])
def test_false_alarms_are_as_rare_as_was_asked_for(offset) -> None:
    """Sensors that round, in zones that stand still: of 40,000 readings a share below the stated one is an alarm."""
    rng, rate, count = np.random.default_rng(1), 0.01, 40_000
    watch = StuckSensors(("hall",), np.array([0.05]), rate, resolution=0.1)
    seen = np.round((294.0 + offset + 0.05 * rng.standard_normal(count)) / 0.1) * 0.1
    alarms = sum(bool(watch.update(np.array([value]))[0]) for value in seen)
    assert alarms / count < rate
    if offset == 0.0:  # where the zone stands in the middle of a step of the scale, the bound is nearly met
        assert alarms / count > 0.2 * rate


def test_memory_is_all_there_is() -> None:
    one, other = (StuckSensors(ZONES, np.full(3, 0.05), resolution=0.0) for _ in range(2))
    for _ in range(4):
        one.update(np.full(3, 294.0))
    other.memory = one.memory
    for _ in range(2):
        np.testing.assert_array_equal(one.update(np.full(3, 294.0)), other.update(np.full(3, 294.0)))


def test_far_zones_are_named_and_most_of_them_start_the_state_anew() -> None:
    watch, said = FarFromModel(ZONES, np.full(3, 0.1)), []
    assert not watch.update(np.array([0.9, np.nan, -0.2]), said) and not said
    assert not watch.update(np.array([0.1, 3.0, np.nan]), said)
    assert len(said) == 1 and said[0].startswith("zone 'lab' is +3.0 K from what its model predicted")
    assert [watch.update(np.array([-5.0, 4.0, 0.0]), said) for _ in range(4)] == [False, False, True, False]
    assert "started anew" in said[-3]


def test_noise_that_does_not_show_is_not_watched() -> None:
    watch = StuckSensors(ZONES, np.array([0.05, 0.05, 0.01]))
    assert watch.watched.tolist() == [True, True, False] and watch.needed[:2].tolist() == [32, 32]
    for _ in range(300):
        stuck = watch.update(np.full(3, 294.0))
    assert stuck.tolist() == [True, True, False]
    assert not StuckSensors(ZONES, np.full(3, 0.05), 0.0).watched.any()
    with pytest.raises(ControlError, match="probability"):
        StuckSensors(ZONES, np.full(3, 0.1), 1.0)


def test_a_step_with_a_wrong_clock_does_not_last() -> None:
    """What was read in the future, as a clock before it is set says, does not judge what comes after."""
    column, stamp = "site/outside_air_temperature_sensor", pd.Timestamp("2026-01-10", tz="UTC")
    watch, said = PossibleReadings([column]), list[str]()
    watch.update({column: 263.15}, stamp.replace(year=2036), said)
    summer = stamp + pd.Timedelta(days=150)
    assert watch.update({column: 293.15}, summer, said) == {column: 293.15} and not said
    assert watch.memory[column] == (293.15, summer)
    assert np.isnan(watch.update({column: 250.0}, summer + pd.Timedelta(minutes=5), said)[column])
    assert "faster than it can move" in said[0]


@pytest.mark.parametrize(
    ("point", "value", "never"),
    [
        ("zone_air_temperature_sensor", 248.15, 233.15),  # a cold store; what a failed sensor reads
        ("supply_water_temperature_sensor", 457.15, 6553.5),
        ("heating_power_sensor", -1.5e6, 1e9),
        ("differential_pressure_sensor", 1.2e6, 1e7),
        ("discharge_air_temperature_sensor", 242.0, 0.0),
        ("wind_direction_sensor", 361.0, 999.0),
    ],
)
def test_a_controller_takes_what_plants_have(point: str, value: float, never: float) -> None:
    """Beyond the ranges by which telemetry is judged, which stay as they are."""
    column, said = f"a/{point}", list[str]()
    for reading, taken in ((value, True), (never, False)):
        watch = PossibleReadings([column])
        seen = watch.update({column: reading}, pd.Timestamp("2026-01-10", tz="UTC"), said)
        assert np.isfinite(seen[column]) == np.isfinite(values_of({column: reading}, ["a"], point)[0]) == taken
    assert len(said) == 1 and not POINT_TYPES[point].possible(value)
