"""A small building in California and a plain scenario of it; the bundled case made quick for tests of commands."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from mpc.scenario.grid import StepGrid
from mpc.scenario.occupancy import ScheduledOccupancy
from mpc.scenario.rates import ConstantRate
from mpc.scenario.scenario import Scenario, build_scenario
from mpc.scenario.tariff import CarbonIntensity, Tariff
from mpc.scenario.weather import Weather
from thermal import Building, ZoneTable
from thermal.case.building import Location, ZoneEntry

BAY = Location(latitude=37.4, longitude=-122.1, elevation=20.0, timezone="America/Los_Angeles")


@pytest.fixture
def building() -> Building:
    """Two rooms of 20 and 30 m2."""
    rooms = (ZoneEntry(name="east", volume=60, floor_area=20), ZoneEntry(name="west", volume=90, floor_area=30))
    return Building("two rooms", BAY, 0.0, ZoneTable(rooms))


@pytest.fixture(scope="session")
def coarse_case(bundled_case_in: Callable[[str], Path]) -> Path:
    """The bundled case in half hours."""
    return bundled_case_in("30min")


@pytest.fixture(scope="module")
def blank_pictures() -> Iterator[None]:
    """Pages with empty pictures: painting takes as long as a calibration, and tests of the reports look at them."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("mpc.reports.figures.style._uri", lambda figure: "data:image/svg+xml;base64,")
        yield


def mild_weather(grid: StepGrid) -> Weather:
    """15 degC around the clock, at the steps of a grid."""
    frame = pd.DataFrame({"outside_air_temperature_sensor": np.full(grid.n_steps, 288.15)}, index=grid.stamps)
    return Weather(frame, BAY)


@pytest.fixture
def plain_scenario(building: Building) -> Callable[..., Scenario]:
    """Make a scenario of constant prices: 0.2 and 0.05 a kWh, 0.4 and 0.18 kg a kWh, one person a zone."""

    def make(start: str = "2023-07-03", step: float = 900.0, n_steps: int = 96) -> Scenario:
        grid = StepGrid(pd.Timestamp(start, tz=BAY.timezone), step, n_steps)
        tariff = Tariff(ConstantRate(0.2), ConstantRate(0.05))
        carbon = CarbonIntensity(ConstantRate(0.4), "average", ConstantRate(0.18))
        people = ScheduledOccupancy(1.0)
        return build_scenario(building, grid, mild_weather(grid), tariff, carbon=carbon, occupancy=people)

    return make
