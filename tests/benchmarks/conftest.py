"""Packages that lie beside the scripts of the benchmarks."""

from __future__ import annotations

import importlib
import importlib.util
import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

SCRIPTS = Path(__file__).parents[2] / "benchmarks"


@pytest.fixture(scope="session")
def package(script: Callable[[str], ModuleType]) -> Callable[[str], ModuleType]:
    """Load a module of a package that lies beside the scripts, such as `energyplus_trials.plan`."""

    def load(name: str) -> ModuleType:
        for shared in ("_sealed", "_worlds"):  # what all makers have
            script(shared)
        top = name.partition(".")[0]
        if top not in sys.modules:
            places = [str(SCRIPTS / top)]
            spec = importlib.util.spec_from_file_location(
                top, SCRIPTS / top / "__init__.py", submodule_search_locations=places
            )
            assert spec is not None and spec.loader is not None
            sys.modules[top] = module = importlib.util.module_from_spec(spec)
            spec.loader.exec_module(module)
        return importlib.import_module(name)

    return load


@pytest.fixture
def office_site(script: Callable[[str], ModuleType], tmp_path: Path) -> Callable[[float], tuple[Any, Any, Path]]:
    """Make an office of four zones a site that has the building as its model: device, plant, and the site's file."""
    pytest.importorskip("rusty_bacnet", reason="needs a BACnet device of another stack: pip install rusty-bacnet")
    pytest.importorskip("bacpypes3", reason="needs the extra [live]")
    from mpc.loop.make import save_pilot
    from thermal.pilot.building import pilot_building

    def make(days: float) -> tuple[Any, Any, Path]:
        for name in ("_bacnet_device", "_site_files", "_plant_site"):
            script(name)
        pilot = script("_pilot_site")
        building = pilot_building(1, floor_area=200.0, zones=4, name="office")
        plant = pilot.OwnControl(building, "2023-01-09", days, 1)
        save_pilot(tmp_path / "case", building, plant.settings, start="2023-01-08", days=1, setpoints=pilot.OWN)
        own = {"air": ["13 degC", "13 degC"], "water": ["75 degC", "75 degC"]}
        model = {"building": "../case", "own_control": own}
        file, plant_site = plant.described("office", "2023-01-09"), script("_plant_site").PlantSite
        device = plant_site(file, plant, tmp_path / "site", 1.001, pilot.CONTROL_STEP)
        return device, plant, device.begin("postgresql:///none", more={"controller": "mpc", "model": model})

    return make
