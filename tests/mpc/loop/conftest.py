"""The 12-zone office in closed loop: its building, plant and a winter day."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache
from typing import Any

import pytest

from mpc.loop.building import BuildingModel
from mpc.loop.make import pilot_weather
from mpc.loop.reduced import ReducedBuilding, reduced_building
from mpc.loop.simulated import SimulatedPlant
from mpc.scenario.gains import InternalGains
from mpc.scenario.grid import StepGrid
from mpc.scenario.scenario import Scenario, build_scenario
from mpc.scenario.tariff import paper_carbon, paper_tariff
from thermal import Building
from thermal.pilot.building import pilot_building
from thermal.system.sizing import size_system
from thermal.system.system import HvacSystem

MakePlant = Callable[..., SimulatedPlant]


@cache
def office() -> Building:
    """Twelve zones on two floors, 16 devices."""
    return pilot_building(1, floor_area=600.0, zones=12, name="office")


@cache
def reduced() -> ReducedBuilding:
    """Its reduction; a plant starts it anew."""
    return reduced_building(office(), dx=1.0)


@cache
def sized() -> HvacSystem:
    """Its plant."""
    return size_system(office())


def scenario_of(days: int = 1, step: float = 300.0, gains: InternalGains | None = None) -> Scenario:
    """Synthetic winter weather and an office's people."""
    grid = StepGrid.between("2023-01-09", f"2023-01-{9 + days:02d}", step, office())
    weather = pilot_weather(1, "2023-01-09", float(days), step)
    return build_scenario(office(), grid, weather, paper_tariff(), carbon=paper_carbon(), gains=gains)


@pytest.fixture(scope="session")
def building() -> Building:
    """Twelve zones on two floors."""
    return office()


@pytest.fixture(scope="session")
def system() -> HvacSystem:
    """Plant of the office."""
    return sized()


@pytest.fixture(scope="session")
def scenario() -> Callable[..., Scenario]:
    """Make a scenario."""
    return scenario_of


@pytest.fixture(scope="session")
def reduced_office() -> ReducedBuilding:
    """The office reduced to its modes."""
    return reduced()


@pytest.fixture(scope="session")
def make_plant() -> MakePlant:
    """Make the office's plant, on its reduced model unless told otherwise."""

    def make(
        scenario: Scenario | None = None,
        system: HvacSystem | None = None,
        model: BuildingModel | None = None,
        **options: Any,
    ) -> SimulatedPlant:
        return SimulatedPlant(scenario or scenario_of(), system or sized(), model or reduced(), **options)

    return make


@pytest.fixture(scope="session")
def drive() -> Callable[..., SimulatedPlant]:
    """Run a plant under fixed setpoints."""

    def run(plant: SimulatedPlant, steps: int = 288, setpoints: Mapping[str, float] | None = None) -> SimulatedPlant:
        plant.reset()
        actions = plant.default_actions | dict(setpoints or {})
        for _ in range(steps):
            plant.step(actions)
        return plant

    return run
