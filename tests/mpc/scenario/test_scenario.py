"""A scenario: its parts on one grid, zones in order, and effects that find what drives them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from calibration.estimation.disturbance import DisturbanceModel
from mpc.errors import ScenarioError, WeatherError
from mpc.loop.signals import scenario_inputs
from mpc.scenario.gains import InternalGains
from mpc.scenario.grid import StepGrid
from mpc.scenario.occupancy import ComfortBand, RandomOccupancy
from mpc.scenario.scenario import Scenario, build_scenario, zone_areas
from mpc.scenario.tariff import paper_carbon, paper_tariff
from mpc.scenario.weather import Weather
from mpc.scenario.weather_files import weather_of_case
from thermal import Building, load_bundled_case


@pytest.fixture(scope="module")
def bundled() -> Scenario:
    """Two days of the bundled case."""
    case = load_bundled_case()
    grid = StepGrid(case.stamps[287], 300.0, 2 * 288)
    people = RandomOccupancy(6.0, arrival=(7.0, 9.0), departure=(16.0, 18.0))
    return build_scenario(
        case.building, grid, weather_of_case(case), paper_tariff(), carbon=paper_carbon(), occupancy=people
    ).redrawn(3)


def test_parts_are_those_asked_for(bundled: Scenario) -> None:
    case = load_bundled_case()
    grid, zones = bundled.grid, bundled.zones
    people = RandomOccupancy(6.0, arrival=(7.0, 9.0), departure=(16.0, 18.0))
    assert zones == case.building.zone_names and bundled.occupancy.shape == (576, len(zones))
    assert np.array_equal(bundled.occupancy, people.draw(grid, zones, 3))
    assert np.array_equal(bundled.expected_occupancy, people.expected(grid, zones))
    areas = zone_areas(case.building)
    assert bundled.floor_area == pytest.approx(areas.sum())
    heat = InternalGains().heat(bundled.occupancy, np.full(len(zones), 6.0), areas)
    assert np.array_equal(bundled.gains, heat)
    assert np.array_equal(bundled.electricity_price, paper_tariff().electricity.on(grid))
    assert np.array_equal(bundled.outdoor, case.boundary_temperatures()["outdoor"].to_numpy()[288:864])
    assert (bundled.carbon_kind, bundled.currency) == ("average", "USD")


def test_steps_are_rows(bundled: Scenario) -> None:
    length = bundled.grid.n_steps
    for name in ("occupancy", "expected_occupancy", "gains", "expected_gains", "latent", "lower", "upper"):
        values = getattr(bundled, name)
        assert values.shape == (length, len(bundled.zones)) and np.isfinite(values).all(), name
    for name in ("outdoor", "electricity_price", "gas_price", "electricity_carbon", "gas_carbon"):
        assert getattr(bundled, name).shape == (length,), name


def test_another_seed_brings_other_people_and_nothing_else(bundled: Scenario) -> None:
    other = bundled.redrawn(4)
    people = RandomOccupancy(6.0, arrival=(7.0, 9.0), departure=(16.0, 18.0))
    assert np.array_equal(other.occupancy, people.draw(bundled.grid, bundled.zones, 4))
    assert not np.array_equal(other.gains, bundled.gains) and other.weather is bundled.weather
    same = other.redrawn(3)
    for name in ("occupancy", "gains", "latent", "expected_gains"):
        assert np.array_equal(getattr(same, name), getattr(bundled, name)), name


def test_unmeasured_heat_is_in_the_zones_and_foreseen_by_nobody(bundled: Scenario) -> None:
    heat = DisturbanceModel(80.0, 7200.0, 0.03)
    disturbed = replace(bundled, unmeasured=heat)
    added = disturbed.gains - bundled.gains
    assert added.std() == pytest.approx(80.0, rel=0.15) and np.abs(added.mean()) < 20.0
    keep, _ = heat.discrete(bundled.grid.step)
    along = np.corrcoef(added[:-1].ravel(), added[1:].ravel())[0, 1]
    assert along == pytest.approx(keep, abs=0.02)
    assert abs(np.corrcoef(added[:, 0], added[:, 1])[0, 1]) < 0.5
    assert np.array_equal(disturbed.expected_gains, bundled.expected_gains)
    assert not np.array_equal(disturbed.redrawn(9).gains - bundled.redrawn(9).gains, added)
    assert np.array_equal(disturbed.redrawn(bundled.seed).gains, disturbed.gains)


def test_effects_find_what_drives_them(bundled: Scenario) -> None:
    drivers = scenario_inputs(bundled)
    assert np.array_equal(drivers.outdoor, bundled.outdoor)
    assert drivers.sun.normal == pytest.approx(bundled.weather.sun.normal)
    assert drivers.wind == pytest.approx(bundled.weather.values("wind_speed_sensor"))
    total = bundled.occupancy.sum(axis=1)
    assert drivers.occupancy == pytest.approx(total / total.max())
    assert drivers.usual.min() > 288.0 and drivers.usual.max() < 304.0


def test_the_office_is_the_default(plain_scenario: Callable[..., Scenario], building: Building) -> None:
    scenario = plain_scenario()
    office = build_scenario(building, scenario.grid, scenario.weather, paper_tariff())
    assert office.occupancy.max(axis=0) == pytest.approx(0.95 * np.array([20.0, 30.0]) / 18.58)
    assert office.carbon_kind == "" and not office.electricity_carbon.any()
    assert office.lower[0, 0] == 288.15 and office.lower[48, 0] == 294.15


def test_bands_of_zones(plain_scenario: Callable[..., Scenario], building: Building) -> None:
    scenario = plain_scenario()
    bands = {"east": ComfortBand(), "west": ComfortBand((293.15, 298.15))}
    both = build_scenario(building, scenario.grid, scenario.weather, paper_tariff(), comfort=bands)
    assert both.lower[48].tolist() == [294.15, 293.15] and both.upper[48].tolist() == [297.15, 298.15]
    with pytest.raises(ScenarioError, match="a band of zone 'east'.*nearest valid one is 'est'"):
        build_scenario(building, scenario.grid, scenario.weather, paper_tariff(), comfort={"est": ComfortBand()})


def test_weather_without_a_temperature_is_refused(plain_scenario: Callable[..., Scenario], building: Building) -> None:
    scenario = plain_scenario()
    frame = pd.DataFrame({"wind_speed_sensor": np.ones(96)}, index=scenario.grid.stamps)
    with pytest.raises(WeatherError, match="lacks 'outside_air_temperature_sensor' for 96 of 96"):
        build_scenario(building, scenario.grid, Weather(frame, building.location), paper_tariff())
