"""Controllers put together, run on plants and compared: what the commands ``control`` and ``compare`` do."""

from mpc.studies.bound import KnownState
from mpc.studies.compare import Comparison, compare_controllers
from mpc.studies.controller import default_horizon, held_space, make_controller, site_points
from mpc.studies.demo import Demo, run_demo
from mpc.studies.devices import equip
from mpc.studies.model import ORDER, control_model
from mpc.reports.control import write_comparison, write_control
from mpc.studies.run import (
    ControllerName,
    ControlRun,
    Decision,
    check_controller,
    controller_of,
    prediction_errors,
    run_controller,
)
from mpc.studies.study import CONTROL_STEP, HORIZON_HOURS, PlantKind, Study, check_kind, make_study
from mpc.reports.control_tables import comparison_rows, comparison_summary, control_summary, trajectory
from mpc.reports.control_words import comparison_verdict, control_verdict

__all__ = [
    "CONTROL_STEP",
    "HORIZON_HOURS",
    "ORDER",
    "Comparison",
    "ControlRun",
    "ControllerName",
    "Decision",
    "Demo",
    "KnownState",
    "PlantKind",
    "Study",
    "check_controller",
    "check_kind",
    "compare_controllers",
    "comparison_rows",
    "comparison_summary",
    "comparison_verdict",
    "control_model",
    "control_summary",
    "control_verdict",
    "controller_of",
    "default_horizon",
    "equip",
    "held_space",
    "make_controller",
    "make_study",
    "prediction_errors",
    "run_controller",
    "run_demo",
    "site_points",
    "trajectory",
    "write_comparison",
    "write_control",
]
