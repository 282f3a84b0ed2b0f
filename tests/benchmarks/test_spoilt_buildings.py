"""Measured buildings with a known fault in their telemetry: what is spoilt, and how answers are scored."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pandas as pd
import pytest

from thermal import Case, Telemetry, load_case, save_case
from thermal.case.building import Building, Device, Layer, Location, Surface, ZoneEntry, ZoneTable


@pytest.fixture(scope="module")
def spoilt(script: Callable[[str], ModuleType], package: Callable[[str], ModuleType]) -> ModuleType:
    package("energyplus_trials.drawing")
    for name in ("_table", "_code", "_seeds", "_trial_scores", "_trial_answers"):
        script(name)
    return script("spoilt_buildings")


@pytest.fixture
def house() -> Case:
    """Two rooms over a measured cellar, each with a heater, two days of ten minutes."""
    walls = [
        Surface(name=f"wall {z}", kind="wall", zone=z, other="outdoor", area=10.0, azimuth=0.0, construction="wall")
        for z in ("one", "two")
    ]
    floors = [
        Surface(name=f"floor {z}", kind="floor", zone=z, other="cellar", area=20.0, construction="wall")
        for z in ("one", "two")
    ]
    brick = (Layer(thickness=0.2, conductivity=0.7, density=1800.0, heat_capacity=840.0),)
    zones = tuple(ZoneEntry(name=z, volume=50.0, floor_area=20.0) for z in ("one", "two"))
    devices = (Device(name="H1", type="radiator", zone="one"), Device(name="H2", type="radiator", zone="two"))
    site = Location(latitude=48.0, longitude=11.0, elevation=500.0, timezone="Etc/GMT-1")
    building = Building("house", site, 0.0, ZoneTable(zones, (*walls, *floors), {"wall": brick}), devices)
    stamps = pd.date_range("2023-01-01 00:10", periods=288, freq="10min", tz="Etc/GMT-1", name="timestamp")
    rng = np.random.default_rng(0)
    columns = {
        "weather_station/outside_air_temperature_sensor": 275.0 + rng.normal(size=288),
        "weather_station/global_horizontal_irradiance_sensor": rng.uniform(0.0, 300.0, 288),
        "one/zone_air_temperature_sensor": 293.0 + rng.normal(size=288),
        "two/zone_air_temperature_sensor": 291.0 + rng.normal(size=288),
        "cellar/zone_air_temperature_sensor": 285.0 + rng.normal(size=288),
        "H1/heating_power_sensor": rng.uniform(0.0, 500.0, 288),
        "H2/heating_power_sensor": rng.uniform(0.0, 500.0, 288),
    }
    return Case(building, Telemetry.from_frame(pd.DataFrame(columns, index=stamps)))


def spoil(spoilt: ModuleType, house: Case, kind: str) -> tuple[Building, pd.DataFrame, tuple[str, ...], dict[str, Any]]:
    made, _, _ = spoilt.SPOILS[kind]
    found = made(house, np.random.default_rng(1))
    assert found is not None
    return found


def changed(house: Case, frame: pd.DataFrame) -> set[str]:
    before = house.telemetry.frame
    return {c for c in before if c not in frame or not before[c].equals(frame[c])}


@pytest.mark.parametrize("kind", ["sensor_bias", "sensor_lag"])
def test_one_sensor_is_spoilt(spoilt: ModuleType, house: Case, kind: str) -> None:
    _, frame, zones, numbers = spoil(spoilt, house, kind)
    (column,) = changed(house, frame)
    assert column == f"{zones[0]}/zone_air_temperature_sensor"
    before = house.telemetry.frame[column]
    if kind == "sensor_bias":
        assert np.allclose(frame[column] - before, numbers["bias_K"][zones[0]])
        return
    share = 1.0 - np.exp(-600.0 / numbers["time_constant_s"])
    steps = frame[column].diff().iloc[1:]
    assert np.allclose(steps[50:], share * (before - frame[column].shift())[51:], atol=1e-3)


def test_a_meter_reads_wrong_in_its_zone(spoilt: ModuleType, house: Case) -> None:
    _, frame, zones, numbers = spoil(spoilt, house, "flow_gain")
    (column,) = changed(house, frame)
    assert column == {"one": "H1", "two": "H2"}[zones[0]] + "/heating_power_sensor"
    assert np.allclose(frame[column] / house.telemetry.frame[column], 1.0 + numbers["gain"])


def test_the_station_s_clock_is_moved_and_nothing_else(spoilt: ModuleType, house: Case) -> None:
    _, frame, _, numbers = spoil(spoilt, house, "clock_shift")
    assert all(c.startswith("weather_station/") for c in changed(house, frame))
    before = house.telemetry.frame["weather_station/outside_air_temperature_sensor"].to_numpy()
    after = frame["weather_station/outside_air_temperature_sensor"].to_numpy()
    steps = numbers["steps"]
    assert abs(steps) == 6
    assert np.array_equal(after[10:-10], before[10 - steps : len(before) - 10 - steps])


def test_what_is_lost_is_lost_from_building_and_telemetry(spoilt: ModuleType, house: Case, tmp_path: Path) -> None:
    for kind, gone in (("unmetered_device", "H"), ("no_irradiance", "weather_station"), ("no_boundary", "cellar")):
        building, frame, _, _ = spoil(spoilt, house, kind)
        lost = changed(house, frame)
        assert lost and all(c not in frame and c.startswith(gone) for c in lost)
        left = load_case(save_case(Case(replace(building, name=kind), Telemetry.from_frame(frame)), tmp_path / kind))
        assert ("cellar" in left.building.measured_boundaries) == (kind != "no_boundary")
        assert len(left.building.devices) == (1 if kind == "unmetered_device" else 2)


def test_sensors_are_exchanged(spoilt: ModuleType, house: Case) -> None:
    _, frame, zones, _ = spoil(spoilt, house, "swapped_sensors")
    a, b = (f"{z}/zone_air_temperature_sensor" for z in zones)
    assert frame[a].equals(house.telemetry.frame[b].rename(a))


def test_what_the_building_has_itself_is_no_answer(spoilt: ModuleType, house: Case, tmp_path: Path) -> None:
    save_case(house, tmp_path / "case")
    spoilt.make(tmp_path / "case", tmp_path / "out", range(1))
    labels = {p.stem: json.loads(p.read_text()) for p in (tmp_path / "out" / "sealed").glob("*.json")}
    assert sorted(label["kind"] for label in labels.values()) == sorted(["null", *spoilt.SPOILS])
    answers = tmp_path / "out" / "answers"
    answers.mkdir()
    order = ["solar_gain", "sensor_bias", "wind_film"]
    for name, label in labels.items():
        null = label["kind"] == "null"
        entry = {"probability": 0.9, "zones": [], "parameters": {}, "testable": True}
        which = [{**entry, "effect": e, "group": [e]} for e in order]
        content = {
            "verdict": "named", "gap": {"mae": 0.3 if null else 0.5}, "which": which, "set90": order[:2],
            "how_far": [{"effects": order[:1], "share_closed": 0.5, "held_out_mae_after": 0.1 if null else 0.2}],
            "seconds": 1.0,
        }  # fmt: skip
        (answers / f"{name}.json").write_text(json.dumps(content))
    found = {label["kind"]: trial for label, trial in spoilt.read(tmp_path / "out").values()}
    # the sun is every building's own, with its windows
    assert found["null"].ranked(1) == ["sensor_bias"] and found["null"].answer["verdict"] == "no_gap"
    assert found["sensor_bias"].twins == (0.1,) and found["sensor_bias"].answer["gap"]["mae"] == 0.2
    assert found["no_irradiance"].ranked(1) == ["solar_gain"]  # where it is what was taken away it is the answer
    assert found["sensor_bias"].right_first and found["sensor_bias"].counted
    assert not found["sensor_lag"].right_first
    assert "| case | sensor_bias |" in spoilt.report(tmp_path / "out")
