"""Optimal control of supply setpoints over a receding horizon."""

from mpc.control._channels import Channel, middle, supply_channels
from mpc.control._data import HorizonData, PeakData
from mpc.control._horizon import LONGEST_STEP, Horizon
from mpc.control._ipopt import IpoptSolver
from mpc.control._predictor import Predictor, Rollout, Sensitivity
from mpc.control._problem import ControlProblem, CostTerms, Penalty
from mpc.control._quadratic import solve_quadratic
from mpc.control._sequential import SequentialSolver
from mpc.control._solution import Solution, Solver, Status
