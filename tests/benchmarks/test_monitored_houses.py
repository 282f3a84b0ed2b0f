"""Seasons of EnergyPlus houses that are monitored: what changes, where, and that nothing differs before it does."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable
from dataclasses import replace
from types import ModuleType, SimpleNamespace

import numpy as np
import pandas as pd
import pytest


@pytest.fixture
def houses(package: Callable[[str], ModuleType], script: Callable[[str], ModuleType]) -> ModuleType:
    package("energyplus_trials.climate")
    package("house_trials.trial")
    script("_monitored_years")
    return script("_monitored_houses")


def test_kinds_take_turns_where_a_house_can_have_them(houses: ModuleType) -> None:
    mended = 0
    for seed in range(16):
        spec = houses._drawn(seed)
        change = houses._change(spec, seed)
        assert change.kind == list(houses.CHANGES)[seed % 8] and set(change.zones) <= set(spec.zone_names)
        assert 42 < change.start < change.end <= houses.DAYS
        mended += change.end < houses.DAYS
        size, (low, high) = abs(change.size), houses.CHANGES[change.kind][2]
        if change.kind == "window_open":
            size /= spec.room(change.zones[0]).area / 20.0
        assert low <= size <= high
        if change.kind == "capacity_limit":  # off, or on and less than it says, is a meter that reads too much
            assert ("flow_gain" in change.effects) == (spec.heating.control == "on_off")
            assert change.zones[0] in houses.heated(spec)
        if change.kind == "door_open":
            assert change.zones in houses.doors(spec)
    assert mended == 8


def test_sensors_meters_and_clocks_read_wrong_while_the_change_lasts(houses: ModuleType) -> None:
    n = (houses.DAYS + 3) * 288
    index = pd.date_range("2023-01-17 00:05", periods=n, freq="5min")
    rng = np.random.default_rng(0)
    for kind, size in (("sensor_bias", 0.7), ("flow_gain", 0.25), ("clock_shift", 1.0)):
        true = {name: pd.DataFrame(rng.uniform(1.0, 9.0, (n, 2)), index, ["a", "b"]) for name in "thw"}
        reported = SimpleNamespace(temperature=true["t"].copy(), heat=true["h"].copy(), station=true["w"].copy())
        houses._read_wrong(reported, houses.Change(kind, (kind,), ("b",), size, 60, 70))
        wrong = np.zeros(n, dtype=bool)
        wrong[63 * 288 : 73 * 288] = True  # three days of run-in come before the telemetry
        for told, name in ((reported.temperature, "t"), (reported.heat, "h"), (reported.station, "w")):
            differs = ~np.isclose(told.to_numpy(), true[name].to_numpy())
            assert not differs[~wrong].any()
            expected = {"sensor_bias": ("t", 1), "flow_gain": ("h", 1), "clock_shift": ("w", 2)}[kind]
            assert differs[wrong].all(axis=0).sum() == (expected[1] if name == expected[0] else 0)
        if kind == "flow_gain":
            assert reported.heat["b"][wrong].to_numpy() * 1.25 == pytest.approx(true["h"]["b"][wrong].to_numpy())


@pytest.mark.skipif(importlib.util.find_spec("pyenergyplus") is None, reason="needs EnergyPlus: pip install -e .[energyplus]")
def test_nothing_differs_before_the_change(houses: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    """A window that stands open for two days of six: the room is colder, or its heater gives more, until it is shut."""
    monkeypatch.setattr(houses, "DAYS", 6)
    spec = replace(houses._drawn(1), days=6)
    room = houses._glazed(spec)[0]
    air, heat = [], []
    for change in (houses.Change(start=6, end=6), houses.Change("window_open", (), (room,), 0.1, 2, 4)):
        made = houses.build(spec)
        houses._added(made, change)
        results = houses.plant.simulate(made)
        air.append(results.outputs[room, "temperature"].to_numpy()[-6 * 288 :].reshape(6, -1))
        heat.append(results.given.get(room, pd.Series(0.0, results.given.index)).to_numpy()[-6 * 288 :].reshape(6, -1))
    np.testing.assert_array_equal(air[0][:2], air[1][:2])
    colder, more = (air[0] - air[1]).mean(axis=1), (heat[1] - heat[0]).mean(axis=1)
    assert (colder[2:4] > 0.05).all() and (more[2:4] >= 0.0).all()
    assert colder[5] < 0.5 * colder[3]
