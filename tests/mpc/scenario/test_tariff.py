"""Demand charges: windows by brute force, months and periods by hand, plants with finer steps than the grid."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mpc.errors import ScenarioError
from mpc.scenario.grid import StepGrid
from mpc.scenario.tariff import DemandCharge, window_means

ZONE = "America/Los_Angeles"


def grid(start: str, step: float, n_steps: int) -> StepGrid:
    return StepGrid(pd.Timestamp(start, tz=ZONE), step, n_steps)


@given(
    step=st.sampled_from([60, 300, 420, 900, 1800]),
    first=st.integers(0, 30),
    seed=st.integers(0, 99),
    count=st.integers(1, 40),
)
@settings(max_examples=60, deadline=None)
def test_windows_by_minutes(step: int, first: int, seed: int, count: int) -> None:
    power = np.random.default_rng(seed).uniform(0, 100, count)
    start = first * 60
    minutes = np.repeat(power, step // 60)
    owner = (start + 60 * np.arange(len(minutes))) // 900
    expected = [minutes[owner == k].mean() for k in np.unique(owner)]
    mean, begin = window_means(power, start + step * np.arange(count), step, 900.0)
    assert mean == pytest.approx(expected)
    assert begin[0] == start and (begin[1:] % 900 == 0).all()


def test_a_bill_by_hand() -> None:
    # 10 a kW flat; 5 a kW more from 16 to 20 on weekdays, over half an hour
    hours = np.full((12, 24), -1)
    hours[:, 16:20] = 0
    peak_hours = DemandCharge([5.0], hours, np.full((12, 24), -1), 1800.0, "evening")
    flat = DemandCharge([10.0])
    day = grid("2023-07-31", 900.0, 2 * 96)  # the last of July and the first of August, both weekdays
    power = np.full(192, 1000.0)
    power[40] = 9000.0  # ten in the morning
    power[66] = 5000.0  # half past four, a quarter of an hour: 3 kW over half an hour
    power[96 + 70] = 4000.0
    assert flat.on(day).names == ("2023-07 flat", "2023-08 flat")
    assert flat.on(day).peaks(power).tolist() == [9000.0, 4000.0]
    assert flat.on(day).cost(power) == pytest.approx(130.0)
    evening = peak_hours.on(day)
    assert evening.peaks(power).tolist() == pytest.approx([3000.0, 2500.0])
    assert evening.cost(power) == pytest.approx(27.5)
    assert (evening.bucket >= 0).sum() == 2 * 16


def test_nothing_is_charged_on_a_weekend_that_is_free() -> None:
    hours = np.zeros((12, 24), dtype=int)
    charge = DemandCharge([5.0], hours, hours - 1, name="week")
    saturday = charge.on(grid("2023-07-08", 3600.0, 24))
    assert saturday.names == () and saturday.cost(np.full(24, 1e4)) == 0.0


def test_periods_have_rates_of_their_own() -> None:
    hours = np.zeros((12, 24), dtype=int)
    hours[:, 12:18] = 1
    charge = DemandCharge([2.0, 7.0], hours, name="time of use")
    buckets = charge.on(grid("2023-07-03", 3600.0, 24))
    assert buckets.names == ("2023-07 time of use 0", "2023-07 time of use 1")
    power = np.arange(24.0) * 1000.0
    assert buckets.cost(power) == pytest.approx(2.0 * 23.0 + 7.0 * 17.0)


@given(parts=st.sampled_from([1, 3, 5, 15]), seed=st.integers(0, 20))
@settings(max_examples=20, deadline=None)
def test_finer_steps_of_the_plant_change_nothing(parts: int, seed: int) -> None:
    buckets = DemandCharge([10.0]).on(grid("2023-07-31 12:00", 900.0, 96))
    power = np.random.default_rng(seed).uniform(0, 1e4, 60)
    whole = buckets.peaks(power, first_step=20)
    assert buckets.peaks(np.repeat(power, parts), 900.0 / parts, 20) == pytest.approx(whole)


def test_what_is_no_charge_is_refused() -> None:
    for build, message in (
        (lambda: DemandCharge([]), "rates"),
        (lambda: DemandCharge([-1.0]), "rates"),
        (lambda: DemandCharge([1.0], window=0.0), "window"),
        (lambda: DemandCharge([1.0], np.ones((12, 24))), "periods from -1 to 0"),
        (lambda: DemandCharge([1.0], np.zeros((24,))), "12 rows of 24"),
        (lambda: DemandCharge([1.0]).on(grid("2023-07-03", 900.0, 4)).peaks([1.0] * 5), "within 2023-07-03"),
    ):
        with pytest.raises(ScenarioError, match=message):
            build()
