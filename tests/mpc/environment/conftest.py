"""An office of four zones on a winter day, and environments of it."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import pytest

pytest.importorskip("gymnasium", reason="needs the extra [rl]")

from mpc.environment.environment import ControlEnvironment
from mpc.loop.make import pilot_weather
from mpc.loop.noise import SensorNoise
from mpc.loop.reduced import ReducedBuilding, reduced_building
from mpc.loop.simulated import SimulatedPlant
from mpc.scenario.forecast import DAY_AHEAD_ERRORS, Forecaster
from mpc.scenario.grid import StepGrid
from mpc.scenario.occupancy import RandomOccupancy
from mpc.scenario.scenario import Scenario, build_scenario
from mpc.scenario.tariff import paper_carbon, paper_tariff
from thermal import Building
from thermal.pilot.building import pilot_building
from thermal.system.sizing import size_system
from thermal.system.system import HvacSystem


@cache
def office() -> Building:
    return pilot_building(1, floor_area=200.0, zones=4, name="office")


@cache
def sized() -> HvacSystem:
    return size_system(office())


def scenario_of(start: str, hours: int) -> Scenario:
    grid = StepGrid.between(start, f"{start}T{hours:02d}:00", 300.0, office())
    weather, people = pilot_weather(1, start, 1.0), RandomOccupancy(3)
    return build_scenario(office(), grid, weather, paper_tariff(), carbon=paper_carbon(), occupancy=people)


def reduced() -> ReducedBuilding:
    return reduced_building(office(), dx=1.0, order=30)


def plant_of(start: str = "2023-01-09", hours: int = 16, model: ReducedBuilding | None = None, **options: Any) -> Any:
    scenario = scenario_of(start, hours)
    forecaster = Forecaster(scenario, 72, DAY_AHEAD_ERRORS)
    given = {"noise": SensorNoise(), "forecaster": forecaster} | options
    return SimulatedPlant(scenario, sized(), model or reduced(), **given)


@pytest.fixture(scope="session")
def make_plant() -> Callable[..., SimulatedPlant]:
    """Make the office's plant: 16 hours from midnight on, the last six for forecasts."""
    return plant_of


@pytest.fixture(scope="session")
def make_environment() -> Callable[..., ControlEnvironment]:
    """Make an environment of one such plant."""

    def make(plant: dict[str, Any] | None = None, **options: Any) -> ControlEnvironment:
        return ControlEnvironment(plant_of(**(plant or {})), **options)

    return make
