"""Scales that are fixed, forecasts that are block means, histograms that count, a clock that is local."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from mpc.environment.environment import ControlEnvironment
from mpc.environment.features import LARGEST, OBSERVED_RANGES, Outlook, clock
from mpc.environment.layout import HISTOGRAM_EDGES, ActionLayout, ObservationLayout
from mpc.loop.simulated import SimulatedPlant
from thermal.case.points import POINT_TYPES

Make = Callable[..., ControlEnvironment]


def test_every_point_but_directions_has_a_range() -> None:
    missing = {name for name, point in POINT_TYPES.items() if point.quantity != "angle"} - set(OBSERVED_RANGES)
    assert not missing


def test_measurements_are_read_back_from_an_observation(make_environment: Make) -> None:
    world = make_environment({"noise": None})
    seen, _ = world.reset(seed=1)
    for _ in range(5):
        seen, *_ = world.step(np.array([0.2, -0.4], dtype=np.float32))
    values = {f.name: f.lowest + 0.5 * (v + 1.0) * (f.highest - f.lowest)
              for f, v in zip(world.layout.features, seen, strict=True)}  # fmt: skip
    plant = world.plant
    assert values["BOILER/supply_water_temperature_setpoint"] == pytest.approx(337.0, abs=1e-4)
    assert values["AHU_F1/supply_air_temperature_setpoint"] == pytest.approx(289.5, abs=1e-4)
    row = plant.telemetry().iloc[-1]
    within = [c for c in plant.columns if c in values and abs(values[c]) < 1e9]
    for column in within:
        assert values[column] == pytest.approx(row[column], rel=1e-4, abs=1e-3) or abs(
            seen[[f.name for f in world.layout.features].index(column)]
        ) == pytest.approx(LARGEST)


def test_forecast_entries_are_block_means(make_plant: Callable[..., SimulatedPlant]) -> None:
    plant = make_plant()
    forecaster, zones = plant.forecaster, plant.scenario.zones
    ends = (0.5, 2.0, 6.0)
    area = plant.scenario.floor_area
    outlook = Outlook(forecaster.columns, zones, 300.0, area, ends)
    plant.reset(0)
    table = plant.forecast().table
    seen = outlook.of_forecast(plant.forecast())
    np.testing.assert_allclose(seen, outlook.table(forecaster)[0], rtol=1e-12)
    values = {f.name: f.lowest + 0.5 * (v + 1.0) * (f.highest - f.lowest)
              for f, v in zip(outlook.features, seen, strict=True)}  # fmt: skip
    for begin, end in ((0.0, 0.5), (0.5, 2.0), (2.0, 6.0)):
        rows, when = table.iloc[round(12 * begin) : round(12 * end)], f"{begin:g} to {end:g} h"
        for name in ("outside_air_temperature_sensor", "gas_price", "global_horizontal_irradiance_sensor"):
            assert values[f"{name}, {when}"] == pytest.approx(rows[name].mean(), rel=1e-9)
        gains = rows[[f"{zone}/internal_gain" for zone in zones]].sum(axis=1).mean()
        lower = rows[[f"{zone}/comfort_lower_temperature" for zone in zones]].to_numpy().mean()
        assert values[f"internal_gain, {when}"] == pytest.approx(gains, rel=1e-9)
        assert values[f"comfort_lower_temperature, {when}"] == pytest.approx(lower, rel=1e-9)


def test_the_last_values_of_a_short_forecast_hold(make_plant: Callable[..., SimulatedPlant]) -> None:
    plant = make_plant()
    outlook = Outlook(plant.forecaster.columns, plant.scenario.zones, 300.0, 200.0, (1.0,))
    values = np.arange(3.0)[:, None] * np.ones(len(outlook.columns))
    whole = np.vstack([values, np.repeat(values[-1:], 9, axis=0)])
    np.testing.assert_array_equal(outlook.of_values(values), outlook.of_values(whole))


def test_histograms_are_shares_of_devices(make_environment: Make) -> None:
    world = make_environment(histograms=True)
    seen, _ = world.reset(seed=1)
    names = [f.name for f in world.layout.features]
    reading = world.plant.reset(1)
    for point, edges in HISTOGRAM_EDGES.items():
        at = [k for k, name in enumerate(names) if name.startswith(f"share of {point} ")]
        values = [v for name, v in reading.items() if name.endswith(f"/{point}")]
        assert len(at) == len(edges) - 1 and seen[at].sum() == pytest.approx(1.0)
        counts = np.histogram(np.clip(values, edges[0], edges[-1] - 1e-9), edges)[0]
        assert seen[at].sum() == pytest.approx(counts.sum() / len(values))
    assert not any(name.endswith("/zone_air_temperature_sensor") for name in names)


def test_the_length_with_histograms_does_not_depend_on_the_zones() -> None:
    def length(count: int) -> int:
        columns = [f"VAV{k}/{point}" for k in range(count) for point in HISTOGRAM_EDGES]
        return len(ObservationLayout(columns, (), 100.0, histograms=True))

    assert length(2) == length(50)


def test_what_is_missing_is_the_middle_and_what_is_far_is_cut() -> None:
    columns = ["A/zone_air_temperature_sensor", "B/zone_air_temperature_sensor"]
    layout = ObservationLayout(columns, (), 100.0)
    seen = layout.observe(np.array([np.nan, 1e4]), None, np.zeros(6))
    assert seen[:2].tolist() == [0.0, LARGEST]


def test_the_clock_is_local() -> None:
    noon_in_winter = clock(1673636400 + 86400 * 0, "America/Los_Angeles")  # 2023-01-13 11:00 there, a Friday
    angle = 2.0 * np.pi * 11.0 / 24.0
    np.testing.assert_allclose(noon_in_winter[:2], [np.sin(angle), np.cos(angle)], atol=1e-12)
    week = 2.0 * np.pi * (4.0 + 11.0 / 24.0) / 7.0
    np.testing.assert_allclose(noon_in_winter[2:4], [np.sin(week), np.cos(week)], atol=1e-12)


def test_actions_and_setpoints_are_inverse(make_plant: Callable[..., SimulatedPlant]) -> None:
    layout = ActionLayout(make_plant().actuators)
    action = np.array([-1.0, 0.6])
    setpoints = layout.setpoints(action)
    assert setpoints["BOILER/supply_water_temperature_setpoint"] == 310.0
    assert setpoints["AHU_F1/supply_air_temperature_setpoint"] == setpoints["AHU_F2/supply_air_temperature_setpoint"]
    np.testing.assert_allclose(layout.action(setpoints), action, atol=1e-12)
    assert layout.setpoints(np.float32([1.0000001, 1.0]))["BOILER/supply_water_temperature_setpoint"] == 355.0
