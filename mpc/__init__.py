"""Control of what `calibration` has fitted: plants, scenarios, optimal control, closed loops, indicators.

Names are looked up when they are first used, so that the console command starts at once.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from mpc.adapters.described.load import load_plant
    from mpc.control.controller.controller import MpcController
    from mpc.control.controller.site import ControllerSettings
    from mpc.control.problem.horizon import Horizon
    from mpc.errors import MpcError
    from mpc.kpi.kpis import Kpis, measure_kpis
    from mpc.loop.make import PlantSettings, pilot_weather, save_pilot, simulated_plant
    from mpc.loop.noise import SensorNoise
    from mpc.loop.plant import Controller, Plant
    from mpc.loop.run import FixedSetpoints, run_closed_loop
    from mpc.loop.simulated import SimulatedPlant
    from mpc.model import control_model
    from mpc.plugins import load_plugins
    from mpc.scenario.scenario import Scenario, build_scenario
    from mpc.scenario.weather import Weather
    from mpc.scenario.weather_files import weather_of_case
    from mpc.studies.optimal_control import make_controller
    from mpc.studies.registry import register_controller
    from mpc.studies.run import compare_controllers, run_controller
    from mpc.studies.study import StudySettings, make_study

#: Module of each name; it is imported when the name is first used.
_MODULES = {
    "Controller": "loop.plant", "ControllerSettings": "control.controller.site", "FixedSetpoints": "loop.run",
    "Horizon": "control.problem.horizon", "Kpis": "kpi.kpis", "MpcController": "control.controller.controller",
    "MpcError": "errors", "Plant": "loop.plant", "PlantSettings": "loop.make", "Scenario": "scenario.scenario",
    "SensorNoise": "loop.noise", "SimulatedPlant": "loop.simulated", "StudySettings": "studies.study",
    "Weather": "scenario.weather", "build_scenario": "scenario.scenario", "compare_controllers": "studies.run",
    "control_model": "model", "load_plant": "adapters.described.load", "load_plugins": "plugins",
    "make_controller": "studies.optimal_control", "make_study": "studies.study", "measure_kpis": "kpi.kpis",
    "pilot_weather": "loop.make", "register_controller": "studies.registry", "run_closed_loop": "loop.run",
    "run_controller": "studies.run", "save_pilot": "loop.make", "simulated_plant": "loop.make",
    "weather_of_case": "scenario.weather_files",
}  # fmt: skip

__all__ = [
    "Controller", "ControllerSettings", "FixedSetpoints", "Horizon", "Kpis", "MpcController", "MpcError", "Plant",
    "PlantSettings", "Scenario", "SensorNoise", "SimulatedPlant", "StudySettings", "Weather", "build_scenario",
    "compare_controllers", "control_model", "load_plant", "load_plugins", "make_controller", "make_study",
    "measure_kpis", "pilot_weather", "register_controller", "run_closed_loop", "run_controller", "save_pilot",
    "simulated_plant", "weather_of_case",
]  # fmt: skip


def __getattr__(name: str) -> Any:
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_MODULES[name]}"), name)
