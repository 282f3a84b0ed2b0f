"""Fidelity: N-step prediction error, calibration by least squares, and what the data determine."""

from calibration.diagnosis.diagnosis import Diagnosis, diagnose
from calibration.errors import CalibrationError
from calibration.estimation.disturbance import DisturbanceModel
from calibration.estimation.heat_balance import heat_balance
from calibration.estimation.innovations import tune_disturbance
from calibration.estimation.kalman import KalmanFilter
from calibration.estimation.smoother import smooth
from calibration.estimation.state_space import StateSpace
from calibration.evaluation.case_model import evaluate_case
from calibration.evaluation.intervals import Interval
from calibration.evaluation.n_step import Evaluation, Metrics, evaluate_model
from calibration.evaluation.settings import CalibrationSettings, ModelSettings, load_parameters
from calibration.fit.calibrate import calibrate
from calibration.fit.cross_validation import CrossValidation, cross_validate
from calibration.fit.result import CalibrationResult
from calibration.fit.selection import Selection, select_structure
from calibration.fleet.run import calibrate_many
from calibration.identifiability.information import Information, fisher_information
from calibration.identifiability.power import Power, power_of_data
from calibration.identifiability.profile import Profile, profile_likelihood

__all__ = [
    "CalibrationError",
    "CalibrationResult",
    "CalibrationSettings",
    "CrossValidation",
    "Diagnosis",
    "DisturbanceModel",
    "Evaluation",
    "Information",
    "Interval",
    "KalmanFilter",
    "Metrics",
    "ModelSettings",
    "Power",
    "Profile",
    "Selection",
    "StateSpace",
    "calibrate",
    "calibrate_many",
    "cross_validate",
    "diagnose",
    "evaluate_case",
    "evaluate_model",
    "fisher_information",
    "heat_balance",
    "load_parameters",
    "power_of_data",
    "profile_likelihood",
    "select_structure",
    "smooth",
    "tune_disturbance",
]
