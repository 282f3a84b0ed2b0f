"""Fidelity: N-step prediction error, calibration by least squares, and what the data determine."""

from calibration._calibrate import calibrate, check_on_grid
from calibration._estimate import Problem, estimate
from calibration._evaluate import HORIZONS, Evaluation, Metrics, Predictions, evaluate_model, spatial_metrics
from calibration._intervals import Interval, Runs, default_intervals, horizon_steps, parse_interval, select_runs
from calibration._least_squares import LeastSquaresResult, solve_least_squares
from calibration._result import CalibrationResult, GridCheck, ParameterEstimate, SolverReport, load_parameters
from calibration.errors import CalibrationError

__all__ = [
    "HORIZONS",
    "CalibrationError",
    "CalibrationResult",
    "Evaluation",
    "GridCheck",
    "Interval",
    "LeastSquaresResult",
    "Metrics",
    "ParameterEstimate",
    "Predictions",
    "Problem",
    "Runs",
    "SolverReport",
    "calibrate",
    "check_on_grid",
    "default_intervals",
    "estimate",
    "evaluate_model",
    "horizon_steps",
    "load_parameters",
    "parse_interval",
    "select_runs",
    "solve_least_squares",
    "spatial_metrics",
]
