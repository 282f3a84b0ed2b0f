"""Fidelity: N-step prediction error, calibration by least squares, and what the data determine."""

from calibration.fit.calibrate import calibrate
from calibration.evaluation.case_model import CaseModel, case_model, check_on_grid, evaluate_case
from calibration.estimation.filtered import evaluate_filter, filter_interval
from calibration.fit.cross_validation import CrossValidation, Fold, ParameterSpread, cross_validate
from calibration.estimation.disturbance import DisturbanceModel, DisturbedSpace
from calibration.fit.estimate import Estimate, estimate
from calibration.evaluation.n_step import HORIZONS, Evaluation, Metrics, Predictions, evaluate_model, spatial_metrics
from calibration.estimation.gains import Gain
from calibration.estimation.heat_balance import HeatBalance, HeatFit, heat_balance
from calibration.identifiability.information import (
    Combination,
    Direction,
    Information,
    ParameterInformation,
    fisher_information,
    information_of,
)
from calibration.estimation.innovations import DISTURBANCE_PRIORS, DisturbancePrior, TunedDisturbance, tune_disturbance
from calibration.evaluation.intervals import Interval, Runs, default_intervals, horizon_steps, parse_interval, select_runs
from calibration.estimation.kalman import Filtered, KalmanFilter
from calibration.fit.least_squares import INTERRUPTED, LeastSquaresResult, solve_least_squares
from calibration.fleet.run import calibrate_many, case_folders
from calibration.fleet.cluster import ClusterExecutor
from calibration.fleet.record import CaseOutcome
from calibration.identifiability.power import ParameterPower, Power, power_of_data, tuning_problem
from calibration.fit.problem import Problem
from calibration.identifiability.profile import Profile, ProfileInterval, profile_likelihood
from mpc.reports.calibration import calibration_verdict, write_calibration
from mpc.reports.case import (
    check_verdict,
    quality_rows,
    simulation_summary,
    simulation_verdict,
    write_check,
    write_simulation,
)
from mpc.reports.evaluation import evaluation_verdict, predictions_table, write_evaluation
from calibration.fit.result import CalibrationResult, GridCheck, ParameterEstimate, SolverReport, load_parameters
from calibration.results import check_results_folder, to_json, write_results
from calibration.fit.selection import select_structure
from calibration.fit.selection_verdict import Candidate, HeldOutDifference, LikelihoodRatio, Selection
from calibration.evaluation.settings import ModelSettings, read_settings
from calibration.estimation.smoother import Smoothed, smooth
from calibration.estimation.state_space import StateSpace, state_space
from calibration.estimation.whiteness import Whiteness, ZoneWhiteness, whiteness
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
