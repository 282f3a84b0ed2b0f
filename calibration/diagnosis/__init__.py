"""Diagnosis of the sim-to-real gap: where it lies, which effect causes it, and how far it shrinks with it."""

from calibration.diagnosis.diagnosis import Diagnosis, baseline_gap, diagnose
from mpc.reports.diagnosis import write_diagnosis
from benchmarks._trial_scores import LEAST_GAP, Rate, Trial, gap_of, score, trial_of
from mpc.reports.diagnosis_words import called, diagnosis_verdict, in_zones

__all__ = [
    "LEAST_GAP",
    "Diagnosis",
    "Rate",
    "Trial",
    "baseline_gap",
    "called",
    "diagnose",
    "diagnosis_verdict",
    "gap_of",
    "in_zones",
    "score",
    "trial_of",
    "write_diagnosis",
]
