"""Forecasts: perfect ones are the truth, errors grow as their closed form says, and follow from seed and issue alone."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pandas as pd
import pytest

from mpc.errors import ScenarioError
from mpc.scenario.forecast import DAY_AHEAD_ERRORS, ErrorGrowth, Forecaster
from mpc.scenario.occupancy import RandomOccupancy
from mpc.scenario.scenario import Scenario, build_scenario
from mpc.scenario.tariff import paper_tariff
from mpc.scenario.weather import Weather
from thermal import Building

AIR, WIND = "outside_air_temperature_sensor", "wind_speed_sensor"
BEAM, DIFFUSE = "direct_normal_irradiance_sensor", "diffuse_horizontal_irradiance_sensor"


@pytest.fixture
def scenario(plain_scenario: Callable[..., Scenario], building: Building) -> Scenario:
    """Two days in quarters of an hour, with wind and sun, and people at random."""
    grid = plain_scenario(n_steps=192).grid
    columns = {AIR: 288.0, WIND: 0.5, BEAM: 600.0, DIFFUSE: 100.0}
    weather = Weather(pd.DataFrame(columns, index=grid.stamps), building.location)
    return build_scenario(building, grid, weather, paper_tariff(), occupancy=RandomOccupancy(9.0)).redrawn(1)


def test_a_perfect_forecast_is_the_truth(scenario: Scenario) -> None:
    forecaster = Forecaster(scenario, 24)
    forecast = forecaster.table(40)
    assert forecast.table.index[0] == scenario.grid.stamps[40]
    values = forecast.values([AIR, "electricity_price", "east/comfort_lower_temperature", "west/internal_gain"])
    rows = slice(40, 64)
    assert np.array_equal(values[:, 1], scenario.electricity_price[rows])
    assert np.array_equal(values[:, 2], scenario.lower[rows, 0])
    assert np.array_equal(values[:, 3], scenario.expected_gains[rows, 1])
    assert forecaster.values(40).base is not None  # a view: nothing is copied


def test_people_are_expected_unless_the_bound_may_know_them(scenario: Scenario) -> None:
    name = "east/occupancy_count_sensor"
    expected = Forecaster(scenario, 24).table(40).values([name])[:, 0]
    actual = Forecaster(scenario, 24, occupancy="actual").table(40).values([name])[:, 0]
    assert np.array_equal(expected, scenario.expected_occupancy[40:64, 0])
    assert np.array_equal(actual, scenario.occupancy[40:64, 0]) and not np.array_equal(actual, expected)


def test_errors_grow_as_their_closed_form(scenario: Scenario) -> None:
    growth = ErrorGrowth(2.0, 6 * 3600.0)
    draws = np.array(
        [
            Forecaster(scenario, 96, {"temperature": growth}, seed=seed).table(0).values([AIR])[:, 0] - 288.0
            for seed in range(400)
        ]
    )
    expected = [growth.after(900.0 * (k + 1)) for k in range(96)]
    assert draws.std(axis=0) == pytest.approx(expected, rel=0.15)
    assert np.abs(draws.mean(axis=0)).max() < 4.0 * 2.0 / 20.0
    assert growth.after(0.0) == 0.0 and growth.after(1e9) == pytest.approx(2.0)


def test_growth_does_not_depend_on_the_step() -> None:
    growth, rng = ErrorGrowth(1.0, 7200.0), np.random.default_rng(0)
    coarse = np.std([growth.path(rng, 4, 1800.0)[-1] for _ in range(4000)])
    fine = np.std([growth.path(rng, 24, 300.0)[-1] for _ in range(4000)])
    assert coarse == pytest.approx(growth.after(7200.0), rel=0.05) and fine == pytest.approx(coarse, rel=0.06)


def test_forecasts_follow_from_seed_and_issue_alone(scenario: Scenario) -> None:
    one, other = (Forecaster(scenario, 24, DAY_AHEAD_ERRORS, seed=5) for _ in range(2))
    later = one.values(90).copy()
    for k in (3, 90, 12, 90):
        other.values(k)
    assert np.array_equal(other.values(90), later)
    assert not np.array_equal(Forecaster(scenario, 24, DAY_AHEAD_ERRORS, seed=6).values(90), later)
    alone = Forecaster(scenario, 24, {"wind": DAY_AHEAD_ERRORS["wind"]}, seed=5)
    at = one.columns.index(WIND)
    assert np.array_equal(alone.values(90)[:, at], later[:, at])


def test_an_issue_holds_until_the_next(scenario: Scenario) -> None:
    forecaster = Forecaster(scenario, 24, DAY_AHEAD_ERRORS)
    at = forecaster.columns.index(AIR)
    hour = [forecaster.values(k)[:, at] for k in range(40, 45)]  # 10:00 to 11:00
    for k in range(1, 4):
        assert np.array_equal(hour[k][: 24 - k], hour[0][k:])
    assert not np.array_equal(hour[4][:20], hour[0][4:])


def test_the_sun_stays_a_sun(scenario: Scenario) -> None:
    forecaster = Forecaster(scenario, 96, {"sun": ErrorGrowth(1.5, 3600.0), "wind": ErrorGrowth(3.0, 3600.0)})
    values = forecaster.table(0).values([BEAM, DIFFUSE, WIND, AIR])
    assert values[:, :3].min() == 0.0 and (values[:, 3] == 288.0).all()
    assert values[:, 0] == pytest.approx(6.0 * values[:, 1])


def test_what_cannot_be_is_refused(scenario: Scenario) -> None:
    for build, message in (
        (lambda: Forecaster(scenario, 0), "a horizon of 1 to 192"),
        (lambda: Forecaster(scenario, 24, seed=-1), "a seed"),
        (lambda: Forecaster(scenario, 24, {"temprature": ErrorGrowth(1.0, 1.0)}), "nearest valid one is 'temperature'"),
        (lambda: Forecaster(scenario, 24, occupancy="drawn"), "'expected' or 'actual'"),  # type: ignore[arg-type]
        (lambda: Forecaster(scenario, 24).values(169), "a step from 0 to 168.*make the scenario's grid longer"),
        (lambda: Forecaster(scenario, 24).values(-1), "a step from 0"),
        (lambda: ErrorGrowth(-1.0, 1.0), "a deviation of 0 or more"),
        (lambda: ErrorGrowth(1.0, 0.0), "a positive time"),
    ):
        with pytest.raises(ScenarioError, match=message):
            build()
