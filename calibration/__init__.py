"""Fidelity: N-step prediction error, calibration by least squares, and what the data determine."""

from calibration._calibrate import calibrate
from calibration._case_model import CaseModel, case_model, check_on_grid, evaluate_case
from calibration._estimate import Problem, estimate
from calibration._evaluate import HORIZONS, Evaluation, Metrics, Predictions, evaluate_model, spatial_metrics
from calibration._intervals import Interval, Runs, default_intervals, horizon_steps, parse_interval, select_runs
from calibration._least_squares import LeastSquaresResult, solve_least_squares
from calibration._report import calibration_verdict, write_calibration
from calibration._report_case import (
    check_verdict,
    quality_rows,
    simulation_summary,
    simulation_verdict,
    write_check,
    write_simulation,
)
from calibration._report_evaluation import evaluation_verdict, predictions_table, write_evaluation
from calibration._result import CalibrationResult, GridCheck, ParameterEstimate, SolverReport, load_parameters
from calibration._results import check_results_folder, to_json, write_results
from calibration._settings import ModelSettings
from calibration.errors import CalibrationError

__all__ = [
    "HORIZONS",
    "CalibrationError",
    "CalibrationResult",
    "CaseModel",
    "Evaluation",
    "GridCheck",
    "Interval",
    "LeastSquaresResult",
    "Metrics",
    "ModelSettings",
    "ParameterEstimate",
    "Predictions",
    "Problem",
    "Runs",
    "SolverReport",
    "calibrate",
    "calibration_verdict",
    "case_model",
    "check_on_grid",
    "check_results_folder",
    "check_verdict",
    "default_intervals",
    "estimate",
    "evaluate_case",
    "evaluate_model",
    "evaluation_verdict",
    "horizon_steps",
    "load_parameters",
    "parse_interval",
    "predictions_table",
    "quality_rows",
    "select_runs",
    "simulation_summary",
    "simulation_verdict",
    "solve_least_squares",
    "spatial_metrics",
    "to_json",
    "write_calibration",
    "write_check",
    "write_evaluation",
    "write_results",
    "write_simulation",
]
