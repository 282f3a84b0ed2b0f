"""The Medium Office over a winter day, run by itself, by EnergyPlus alone and with its own setpoints as actions."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import pytest

MEDIUM = "RefBldgMediumOfficeNew2004_Chicago"
DAY = "2023-01-10"


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Skip what runs EnergyPlus where it is not installed."""
    if importlib.util.find_spec("pyenergyplus") is None:
        for item in items:
            if item.get_closest_marker("energyplus"):
                item.add_marker(pytest.mark.skip(reason="EnergyPlus is not installed: pip install -e .[energyplus]"))


@pytest.fixture(scope="session")
def office():
    from mpc.adapters.energyplus.building import energyplus_building

    return energyplus_building(MEDIUM)


@pytest.fixture
def make_plant():
    from mpc.adapters.energyplus.make import energyplus_plant
    from mpc.adapters.energyplus.plant import EnergyPlusSettings

    made = []

    def make(**options):
        made.append(energyplus_plant(MEDIUM, DAY, 1, EnergyPlusSettings(**options), step_seconds=600.0))
        return made[-1]

    yield make
    for plant in made:
        plant.close()


@pytest.fixture(scope="session")
def own():
    """The plant after a day under its own control."""
    from mpc.adapters.energyplus.make import energyplus_plant
    from mpc.adapters.energyplus.plant import EnergyPlusSettings

    plant = energyplus_plant(MEDIUM, DAY, 1, EnergyPlusSettings(control_steps=3), step_seconds=600.0)
    plant.reset()
    while not plant.finished:
        plant.step({})
    return plant


@pytest.fixture
def left_over():
    """Folders of runs that are there."""
    import tempfile

    def count():
        return {path.name for path in Path(tempfile.gettempdir()).glob("buildingmpc-energyplus-*")}

    return count
