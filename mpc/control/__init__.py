"""Optimal control of supply setpoints over a receding horizon."""

from mpc.control._assembly import ComfortOperation, Expected, Schedule, expect, peak_data
from mpc.control._channels import Channel, supply_channels
from mpc.control._controller import Action, ControllerSettings, MpcController, Source
from mpc.control._data import HorizonData, PeakData
from mpc.control._horizon import LONGEST_STEP, Horizon
from mpc.control._ipopt import IpoptSolver
from mpc.control._observer import Observer
from mpc.control._predictor import Predictor, Rollout, Sensitivity
from mpc.control._problem import ControlProblem, CostTerms, Penalty
from mpc.control._quadratic import QuadraticResult, solve_quadratic
from mpc.control._reading import SitePoints
from mpc.control._rules import ResetRule
from mpc.control._sequential import SequentialSolver
from mpc.control._signals import ForecastSignals
from mpc.control._solution import Solution, Solver, Status

__all__ = [
    "LONGEST_STEP",
    "Action",
    "Channel",
    "ComfortOperation",
    "ControlProblem",
    "ControllerSettings",
    "CostTerms",
    "Expected",
    "ForecastSignals",
    "Horizon",
    "HorizonData",
    "IpoptSolver",
    "MpcController",
    "Observer",
    "PeakData",
    "Penalty",
    "Predictor",
    "QuadraticResult",
    "ResetRule",
    "Rollout",
    "Schedule",
    "Sensitivity",
    "SequentialSolver",
    "SitePoints",
    "Solution",
    "Solver",
    "Source",
    "Status",
    "expect",
    "peak_data",
    "solve_quadratic",
    "supply_channels",
]
