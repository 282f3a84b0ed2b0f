"""Optimal control of supply setpoints over a receding horizon."""

from mpc.control._action import Action, ControllerSettings, Source
from mpc.control._assembly import ComfortOperation, Expected, Schedule, expect, peak_data
from mpc.control._back_off import BackOff, Margin
from mpc.control._channels import Channel, supply_channels
from mpc.control._controller import MpcController
from mpc.control._data import HorizonData, PeakData
from mpc.control._heat import HeatChannel, HeatPredictor, HeatQuantity, heat_channels
from mpc.control._horizon import LONGEST_STEP, Horizon
from mpc.control._ipopt import IpoptSolver
from mpc.control._linear import LinearSolver
from mpc.control._moving_horizon import MovingHorizonObserver
from mpc.control._observer import Observer
from mpc.control._predictor import Predictor, Rollout, Sensitivity
from mpc.control._problem import ControlProblem, CostTerms, Penalty
from mpc.control._quadratic import QuadraticResult, solve_quadratic
from mpc.control._reading import SitePoints
from mpc.control._rules import ResetRule
from mpc.control._scenarios import ScenarioSolver, outdoor_scenarios
from mpc.control._sequential import SequentialSolver
from mpc.control._signals import ForecastSignals
from mpc.control._solution import Solution, Solver, Status
from mpc.control._stage_solver import StageMethod, StageSolution, StageSolver
from mpc.control._stages import StageData, StageProblem
from mpc.control._watch import FarFromModel, StuckSensors

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
