"""Optimal control of supply setpoints over a receding horizon."""

from mpc.control.controller.action import Action, ControllerSettings, Source
from mpc.control.problem.assembly import ComfortOperation, Expected, Schedule, expect, peak_data
from mpc.control.problem.back_off import BackOff, Margin
from mpc.control.problem.channels import Channel, supply_channels
from mpc.control.controller.controller import MpcController
from mpc.control.problem.data import HorizonData, PeakData
from mpc.control.predictor.heat import HeatChannel, HeatPredictor, HeatQuantity, heat_channels
from mpc.control.problem.horizon import LONGEST_STEP, Horizon
from mpc.control.solvers.ipopt import IpoptSolver
from mpc.control.solvers.linear import LinearSolver
from mpc.control.controller.moving_horizon import MovingHorizonObserver
from mpc.control.controller.observer import Observer
from mpc.control.predictor.predictor import Predictor, Rollout, Sensitivity
from mpc.control.problem.problem import ControlProblem, CostTerms, Penalty
from mpc.control.solvers.quadratic import QuadraticResult, solve_quadratic
from mpc.control.controller.reading import SitePoints
from mpc.control.controller.rules import ResetRule
from mpc.control.solvers.scenarios import ScenarioSolver, outdoor_scenarios
from mpc.control.solvers.sequential import SequentialSolver
from mpc.control.predictor.forecast_signals import ForecastSignals
from mpc.control.solvers.solution import Solution, Solver, Status
from mpc.control.solvers.stage_solver import StageMethod, StageSolution, StageSolver
from mpc.control.problem.stages import StageData, StageProblem
from mpc.control.controller.watch import FarFromModel, StuckSensors

__all__ = [
    "LONGEST_STEP",
    "Action",
    "BackOff",
    "Channel",
    "ComfortOperation",
    "ControlProblem",
    "ControllerSettings",
    "CostTerms",
    "Expected",
    "FarFromModel",
    "ForecastSignals",
    "HeatChannel",
    "HeatPredictor",
    "HeatQuantity",
    "Horizon",
    "HorizonData",
    "IpoptSolver",
    "LinearSolver",
    "Margin",
    "MovingHorizonObserver",
    "MpcController",
    "Observer",
    "PeakData",
    "Penalty",
    "Predictor",
    "QuadraticResult",
    "ResetRule",
    "Rollout",
    "ScenarioSolver",
    "Schedule",
    "Sensitivity",
    "SequentialSolver",
    "SitePoints",
    "Solution",
    "Solver",
    "Source",
    "StageData",
    "StageMethod",
    "StageProblem",
    "StageSolution",
    "StageSolver",
    "Status",
    "StuckSensors",
    "expect",
    "heat_channels",
    "outdoor_scenarios",
    "peak_data",
    "solve_quadratic",
    "supply_channels",
]
