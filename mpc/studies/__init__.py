"""Controllers put together, run on plants and compared: what the commands ``control`` and ``compare`` do."""

from mpc.studies._bound import KnownState
from mpc.studies._controller import default_horizon, held_space, make_controller, site_points
from mpc.studies._equip import equip
from mpc.studies._model import ORDER, control_model
from mpc.studies._run import ControllerName, ControlRun, Decision, controller_of, prediction_errors, run_controller
from mpc.studies._study import CONTROL_STEP, HORIZON_HOURS, PlantKind, Study, make_study

__all__ = [
    "CONTROL_STEP",
    "HORIZON_HOURS",
    "ORDER",
    "ControlRun",
    "ControllerName",
    "Decision",
    "KnownState",
    "PlantKind",
    "Study",
    "control_model",
    "controller_of",
    "default_horizon",
    "equip",
    "held_space",
    "make_controller",
    "make_study",
    "prediction_errors",
    "run_controller",
    "site_points",
]
