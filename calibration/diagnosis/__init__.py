"""Diagnosis of the sim-to-real gap: where it lies, which effect causes it, and how far it shrinks with it."""

from calibration.diagnosis._diagnose import Diagnosis, diagnose
from calibration.diagnosis._page import write_diagnosis
from calibration.diagnosis._words import called, diagnosis_verdict, in_zones

__all__ = ["Diagnosis", "called", "diagnose", "diagnosis_verdict", "in_zones", "write_diagnosis"]
