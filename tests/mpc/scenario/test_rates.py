"""Rates: the local clock on days of 23 and 25 hours, steps across a change of price, published series, gas units."""

from __future__ import annotations

from datetime import date

import numpy as np
import pandas as pd
import pint
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mpc.errors import ScenarioError
from mpc.scenario.grid import Calendar, StepGrid
from mpc.scenario.rates import GAS_UNITS, ConstantRate, HourlyRate, SeriesRate, gas_price, monthly_rate
from mpc.scenario.tariff import paper_carbon, paper_tariff

ZONE = "America/Los_Angeles"
BY_HOUR = [float(hour) for hour in range(24)]


def grid(start: str, step: float, n_steps: int, zone: str = ZONE) -> StepGrid:
    return StepGrid(pd.Timestamp(start, tz=zone), step, n_steps)


def test_a_short_day_skips_its_hour_and_a_long_day_has_it_twice() -> None:
    rate = HourlyRate(BY_HOUR)
    short = rate.on(grid("2023-03-12", 3600.0, 23))
    assert short.tolist() == [0.0, 1.0, *map(float, range(3, 24))]  # 02:00 does not exist
    long = rate.on(grid("2023-11-05", 3600.0, 25))
    assert long.tolist() == [0.0, 1.0, 1.0, *map(float, range(2, 24))]
    assert rate.on(grid("2023-11-06", 3600.0, 1)).tolist() == [0.0]


def test_a_step_across_a_change_has_its_mean() -> None:
    rate = HourlyRate([0.1] * 16 + [0.3] * 8)
    assert rate.on(grid("2023-07-03 15:30", 3600.0, 2)) == pytest.approx([0.2, 0.3])
    assert rate.on(grid("2023-07-03 15:50", 900.0, 1)) == pytest.approx([0.1 * 2 / 3 + 0.3 / 3])


def test_zones_a_quarter_of_an_hour_off() -> None:
    # Kathmandu is 5:45 ahead: its full hours are at a quarter past in UTC
    rate = HourlyRate(BY_HOUR)
    steps = StepGrid(pd.Timestamp("2023-07-03 00:00", tz="UTC").tz_convert("Asia/Kathmandu"), 3600.0, 2)
    assert rate.on(steps) == pytest.approx([5 * 0.25 + 6 * 0.75, 6 * 0.25 + 7 * 0.75])


def test_weekends_holidays_and_months() -> None:
    weekday = np.outer(np.arange(1.0, 13.0), np.ones(24))
    rate = HourlyRate(weekday, np.zeros(24), Calendar([date(2023, 7, 4)]))
    assert rate.on(grid("2023-06-30", 86400.0, 5)).tolist() == [6.0, 0.0, 0.0, 7.0, 0.0]  # Friday to a holiday
    assert monthly_rate(range(12)).on(grid("2023-06-30", 86400.0, 2)).tolist() == [5.0, 6.0]


@given(step=st.sampled_from([300, 900, 1800, 3600, 7200]))
@settings(max_examples=5, deadline=None)
def test_a_day_costs_the_same_at_any_step(step: int) -> None:
    rate = HourlyRate(BY_HOUR)
    n_steps = 25 * 3600 // step if 25 * 3600 % step == 0 else 24 * 3600 // step
    start = "2023-11-05" if 25 * 3600 % step == 0 else "2023-07-03"
    expected = sum(BY_HOUR) + (1.0 if start == "2023-11-05" else 0.0)
    assert rate.on(grid(start, float(step), n_steps)).sum() * step / 3600 == pytest.approx(expected)


def test_a_series_stamped_at_start_or_end() -> None:
    stamps = pd.date_range("2023-07-03 00:00", periods=4, freq="h", tz=ZONE)
    series = pd.Series([10.0, 20.0, 30.0, 40.0], index=stamps)
    assert SeriesRate(series, "start").on(grid("2023-07-03 01:00", 1800.0, 4)).tolist() == [20.0, 20.0, 30.0, 30.0]
    assert SeriesRate(series, "end").on(grid("2023-07-03 01:00", 3600.0, 2)).tolist() == [30.0, 40.0]
    assert SeriesRate(series, "start").on(grid("2023-07-03 00:30", 3600.0, 1)).tolist() == [15.0]
    assert SeriesRate(series.tz_convert("UTC"), "start").on(grid("2023-07-03", 3600.0, 1)).tolist() == [10.0]


def test_gas_by_the_unit_it_is_sold_in() -> None:
    units = pint.UnitRegistry()
    for name, pints in (("therm", "therm"), ("mmBtu", "megaBtu"), ("GJ", "gigajoule"), ("MWh", "megawatt_hour")):
        assert GAS_UNITS[name] == pytest.approx(units.Quantity(1.0, pints).to("kWh").magnitude, rel=3e-4)
    assert gas_price(1.0, "kcf").value == pytest.approx(1.0 / (1.036 * GAS_UNITS["mmBtu"]))
    with pytest.raises(ScenarioError, match="'barrel'"):
        gas_price(1.0, "barrel")


def test_the_papers_prices_are_local() -> None:
    day = grid("2023-07-03", 3600.0, 24)
    tariff, carbon = paper_tariff(), paper_carbon()
    price = tariff.electricity.on(day)
    assert price[[5, 6, 11, 12, 18, 19]].tolist() == [0.16, 0.18, 0.18, 0.20, 0.20, 0.16]
    assert tariff.gas.on(day)[0] == pytest.approx(6.77 / 293.07107)
    assert carbon.electricity.on(day)[15] == pytest.approx(0.1047359292)
    assert carbon.gas.on(day)[0] == pytest.approx(0.18125, abs=1e-5)
    assert carbon.kind == "average"


def test_what_is_no_rate_is_refused() -> None:
    stamps = pd.date_range("2023-07-03", periods=4, freq="h", tz=ZONE)
    series = pd.Series([1.0, 2.0, 3.0, 4.0], index=stamps)
    for build, message in (
        (lambda: HourlyRate([1.0] * 23), "24 finite numbers"),
        (lambda: HourlyRate([np.nan] * 24), "24 finite numbers"),
        (lambda: ConstantRate(float("nan")), "finite number"),
        (lambda: monthly_rate([1.0]), "12 finite"),
        (lambda: SeriesRate(series, "middle"), "'start' or 'end'"),  # type: ignore[arg-type]
        (lambda: SeriesRate(series.tz_localize(None), "end"), "time zone"),
        (lambda: SeriesRate(series.iloc[[0, 1, 3]], "end"), "03:00"),
        (lambda: SeriesRate(series.where(series != 3.0), "end"), "1 missing of 4, first 2023-07-03 02:00"),
        (lambda: SeriesRate(series, "start").on(grid("2023-07-03 03:30", 3600.0, 1)), "2023-07-03 04:30"),
    ):
        with pytest.raises(ScenarioError, match=message):
            build()
