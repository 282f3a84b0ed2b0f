"""Fidelity: N-step prediction error, calibration by least squares, and what the data determine.

Names are looked up when they are first used, so that what needs one module does not wait for all.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
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

#: Module of each name; it is imported when the name is first used.
_MODULES = {
    "CalibrationError": "errors", "CalibrationResult": "fit.result",
    "CalibrationSettings": "evaluation.settings", "CrossValidation": "fit.cross_validation",
    "Diagnosis": "diagnosis.diagnosis", "DisturbanceModel": "estimation.disturbance",
    "Evaluation": "evaluation.n_step", "Information": "identifiability.information",
    "Interval": "evaluation.intervals", "KalmanFilter": "estimation.kalman", "Metrics": "evaluation.n_step",
    "ModelSettings": "evaluation.settings", "Power": "identifiability.power",
    "Profile": "identifiability.profile", "Selection": "fit.selection", "StateSpace": "estimation.state_space",
    "calibrate": "fit.calibrate", "calibrate_many": "fleet.run", "cross_validate": "fit.cross_validation",
    "diagnose": "diagnosis.diagnosis", "evaluate_case": "evaluation.case_model",
    "evaluate_model": "evaluation.n_step", "fisher_information": "identifiability.information",
    "heat_balance": "estimation.heat_balance", "load_parameters": "evaluation.settings",
    "power_of_data": "identifiability.power", "profile_likelihood": "identifiability.profile",
    "select_structure": "fit.selection", "smooth": "estimation.smoother",
    "tune_disturbance": "estimation.innovations",
}  # fmt: skip

__all__ = [
    "CalibrationError", "CalibrationResult", "CalibrationSettings", "CrossValidation", "Diagnosis",
    "DisturbanceModel", "Evaluation", "Information", "Interval", "KalmanFilter", "Metrics", "ModelSettings",
    "Power", "Profile", "Selection", "StateSpace", "calibrate", "calibrate_many", "cross_validate", "diagnose",
    "evaluate_case", "evaluate_model", "fisher_information", "heat_balance", "load_parameters", "power_of_data",
    "profile_likelihood", "select_structure", "smooth", "tune_disturbance",
]  # fmt: skip


def __getattr__(name: str) -> Any:
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_MODULES[name]}"), name)
