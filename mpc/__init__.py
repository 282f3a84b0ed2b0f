"""Control of what `calibration` has fitted: plants, scenarios, optimal control, closed loops, indicators.

Names are looked up when they are first used, so that the console command starts at once.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
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
    from mpc.plugins import load_plugins
    from mpc.scenario.scenario import Scenario, build_scenario
    from mpc.scenario.weather import Weather
    from mpc.scenario.weather_files import weather_of_case
    from mpc.studies.controller import make_controller
    from mpc.studies.controllers import register_controller
    from mpc.studies.model import control_model
    from mpc.studies.run import compare_controllers, run_controller
    from mpc.studies.study import StudySettings, make_study

#: Modules that have the names; a name is looked for in one after the other, and only when it is used.
_HOMES = (
    "errors", "plugins", "scenario.scenario", "scenario.weather_files", "kpi.kpis", "loop.plant", "loop.noise",
    "loop.run", "loop.make", "control.problem.horizon", "control.controller.controller", "studies.model",
    "studies.controller", "studies.controllers", "studies.study", "studies.run",
)  # fmt: skip

__all__ = [
    "Controller", "ControllerSettings", "FixedSetpoints", "Horizon", "Kpis", "MpcController", "MpcError", "Plant",
    "PlantSettings", "Scenario", "SensorNoise", "SimulatedPlant", "StudySettings", "Weather", "build_scenario",
    "compare_controllers", "control_model", "load_plugins", "make_controller", "make_study", "measure_kpis",
    "pilot_weather", "register_controller", "run_closed_loop", "run_controller", "save_pilot", "simulated_plant",
    "weather_of_case",
]  # fmt: skip


def __getattr__(name: str) -> Any:
    if name in __all__:
        for home in _HOMES:
            module = import_module(f"{__name__}.{home}")
            if hasattr(module, name):
                return getattr(module, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
