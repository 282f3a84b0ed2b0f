"""A small office on two floors, its controller's model, and plants of it."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import pytest

from mpc.loop.make import PlantSettings, pilot_weather, simulated_plant
from mpc.loop.noise import SensorNoise
from mpc.loop.simulated import SimulatedPlant
from mpc.model import control_model
from thermal import Building
from thermal.model.reduce import ReducedModel
from thermal.pilot.building import pilot_building
from thermal.system.sizing import size_system
from thermal.system.system import HvacSystem


@cache
def office() -> Building:
    return pilot_building(1, floor_area=300.0, zones=6, name="office")


@cache
def sized() -> HvacSystem:
    return size_system(office())


@pytest.fixture(scope="session")
def building() -> Building:
    """Six zones."""
    return office()


@pytest.fixture(scope="session")
def model(building: Building) -> ReducedModel:
    """Few states."""
    return control_model(building, dx=1.0, order=40)


@pytest.fixture(scope="session")
def make_plant() -> Callable[..., SimulatedPlant]:
    """Make the office's plant on a winter Monday, with forecasts of half a day."""

    def make(**options: Any) -> SimulatedPlant:
        weather = pilot_weather(1, "2023-01-09", 2.0)
        given = {"control_steps": 3, "noise": SensorNoise(), "horizon": 144, "system": sized(), "dx": 1.0} | options
        return simulated_plant(office(), weather, "2023-01-09", "2023-01-11", PlantSettings(**given))

    return make
