"""Fidelity: N-step prediction error, calibration by least squares, and what the data determine."""

from calibration._calibrate import calibrate
from calibration._case_model import CaseModel, case_model, check_on_grid, evaluate_case
from calibration._corrected import evaluate_filter, filter_interval
from calibration._cross_validation import CrossValidation, Fold, ParameterSpread, cross_validate
from calibration._disturbance import DisturbanceModel, DisturbedSpace
from calibration._estimate import Estimate, estimate
from calibration._evaluate import HORIZONS, Evaluation, Metrics, Predictions, evaluate_model, spatial_metrics
from calibration._gain import Gain
from calibration._heat_balance import HeatBalance, HeatFit, heat_balance
from calibration._information import (
    Combination,
    Direction,
    Information,
    ParameterInformation,
    fisher_information,
    information_of,
)
from calibration._innovations import DISTURBANCE_PRIORS, DisturbancePrior, TunedDisturbance, tune_disturbance
from calibration._intervals import Interval, Runs, default_intervals, horizon_steps, parse_interval, select_runs
from calibration._kalman import Filtered, KalmanFilter
from calibration._least_squares import INTERRUPTED, LeastSquaresResult, solve_least_squares
from calibration._many import calibrate_many, case_folders
from calibration._many_cluster import ClusterExecutor
from calibration._many_record import CaseOutcome
from calibration._power import ParameterPower, Power, power_of_data, tuning_problem
from calibration._problem import Problem
from calibration._profile import Profile, ProfileInterval, profile_likelihood
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
from calibration._selection import select_structure
from calibration._selection_verdict import Candidate, HeldOutDifference, LikelihoodRatio, Selection
from calibration._settings import ModelSettings, read_settings
from calibration._smoother import Smoothed, smooth
from calibration._state_space import StateSpace, state_space
from calibration._whiteness import Whiteness, ZoneWhiteness, whiteness
from calibration.errors import CalibrationError

__all__ = [
    "DISTURBANCE_PRIORS",
    "HORIZONS",
    "INTERRUPTED",
    "CalibrationError",
    "CalibrationResult",
    "Candidate",
    "CaseModel",
    "CaseOutcome",
    "ClusterExecutor",
    "Combination",
    "CrossValidation",
    "Direction",
    "DisturbanceModel",
    "DisturbancePrior",
    "DisturbedSpace",
    "Estimate",
    "Evaluation",
    "Filtered",
    "Fold",
    "Gain",
    "GridCheck",
    "HeatBalance",
    "HeatFit",
    "HeldOutDifference",
    "Information",
    "Interval",
    "KalmanFilter",
    "LeastSquaresResult",
    "LikelihoodRatio",
    "Metrics",
    "ModelSettings",
    "ParameterEstimate",
    "ParameterInformation",
    "ParameterPower",
    "ParameterSpread",
    "Power",
    "Predictions",
    "Problem",
    "Profile",
    "ProfileInterval",
    "Runs",
    "Selection",
    "Smoothed",
    "SolverReport",
    "StateSpace",
    "TunedDisturbance",
    "Whiteness",
    "ZoneWhiteness",
    "calibrate",
    "calibrate_many",
    "calibration_verdict",
    "case_folders",
    "case_model",
    "check_on_grid",
    "check_results_folder",
    "check_verdict",
    "cross_validate",
    "default_intervals",
    "estimate",
    "evaluate_case",
    "evaluate_filter",
    "evaluate_model",
    "evaluation_verdict",
    "filter_interval",
    "fisher_information",
    "heat_balance",
    "horizon_steps",
    "information_of",
    "load_parameters",
    "parse_interval",
    "power_of_data",
    "predictions_table",
    "profile_likelihood",
    "quality_rows",
    "read_settings",
    "select_runs",
    "select_structure",
    "simulation_summary",
    "simulation_verdict",
    "smooth",
    "solve_least_squares",
    "spatial_metrics",
    "state_space",
    "to_json",
    "tune_disturbance",
    "tuning_problem",
    "whiteness",
    "write_calibration",
    "write_check",
    "write_evaluation",
    "write_results",
    "write_simulation",
]
