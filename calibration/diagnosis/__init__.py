"""Diagnosis of the sim-to-real gap: where it lies, which effect causes it, and how far it shrinks with it."""

from calibration.diagnosis._diagnose import Diagnosis, diagnose

__all__ = ["Diagnosis", "diagnose"]
