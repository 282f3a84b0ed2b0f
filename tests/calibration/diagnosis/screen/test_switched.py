"""Heat that is switched on and off: seen where it comes at no hour of its own and in a zone of its own."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from calibration.diagnosis.screen.switched import switched_when

FloatArray = NDArray[np.float64]

STEP, DAY, DAYS = 300.0, 288, 14
TIME = np.arange(DAY * DAYS)


def switched(rng: np.random.Generator, every: float = 1.5) -> FloatArray:
    """On for one to five hours, a few times in two days, at any hour."""
    on = np.zeros(TIME.size)
    for begin in rng.integers(0, TIME.size - 60, int(every * DAYS)):
        on[begin : begin + int(rng.integers(12, 60))] = 1.0
    return on


def beyond(*heat: FloatArray, noise: float = 80.0, seed: int = 5) -> FloatArray:
    """Heat beyond the model of each zone, with noise and a slow error of it [W]."""
    slow = 150.0 * np.sin(2.0 * np.pi * TIME / (2.5 * DAY))
    table = np.column_stack(heat) + slow[:, None]
    return table + noise * np.random.default_rng(seed).standard_normal(table.shape)


@pytest.mark.parametrize("step", [300.0, 900.0])
def test_it_is_seen_where_it_is(step: float) -> None:
    rng = np.random.default_rng(2)
    first, second = switched(rng), switched(rng)
    heat = beyond(900.0 * first, np.zeros(TIME.size), 500.0 * second)
    heat[700:720] = np.nan
    per = round(step / STEP)
    seen = switched_when(heat[::per], step)
    assert not seen[:, 1].any()
    for k, true in ((0, first[::per]), (2, second[::per])):
        both = (seen[:, k] * true).sum()
        assert both > 0.9 * true.sum() and both > 0.9 * seen[:, k].sum()


def test_what_comes_by_the_clock_is_none() -> None:
    daily = ((TIME % DAY > 90) & (TIME % DAY < 150)).astype(float)
    assert not switched_when(beyond(900.0 * daily, np.zeros(TIME.size)), STEP).any()


def test_what_comes_by_the_week_is_none() -> None:
    rng, day, hour = np.random.default_rng(7), TIME // DAY % 7, TIME % DAY * STEP / 3600.0
    for days in ([1, 3], [2], [0]):
        weekly = (np.isin(day, days) & (hour >= 8.0) & (hour < 13.0)).astype(float)
        assert not switched_when(beyond(900.0 * weekly, np.zeros(TIME.size)), STEP).any()
    assert switched_when(beyond(900.0 * switched(rng, 0.5), np.zeros(TIME.size)), STEP).any()


def test_finer_telemetry_says_no_more_than_that_of_five_minutes() -> None:
    short = np.zeros(TIME.size)
    short[1000:1018] = 1.0
    for on in (short, switched(np.random.default_rng(8))):
        heat = beyond(900.0 * on, np.zeros(TIME.size))
        seen, finer = switched_when(heat, STEP), switched_when(np.repeat(heat, 5, axis=0), STEP / 5.0)
        assert np.array_equal(np.repeat(seen, 5, axis=0), finer)


def test_what_many_zones_have_at_a_time_is_a_wrong_model() -> None:
    on = switched(np.random.default_rng(3))
    assert switched_when(beyond(900.0 * on, 0.0 * on), STEP).any()
    assert not switched_when(beyond(900.0 * on, 700.0 * on), STEP).any()


def test_noise_little_heat_and_what_cools_are_none() -> None:
    on = switched(np.random.default_rng(4))
    zones = beyond(100.0 * on, 0.0 * on, -900.0 * on, noise=100.0)
    zones = np.column_stack([zones, np.full(TIME.size, np.nan)])
    assert not switched_when(zones, STEP).any()
    assert switched_when(np.zeros((10, 2)), STEP).shape == (10, 2)
