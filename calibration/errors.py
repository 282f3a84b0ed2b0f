"""The error family of the package."""

from __future__ import annotations


class CalibrationError(Exception):
    """Base of every error that `calibration` raises on purpose."""


class IntervalError(CalibrationError):
    """An interval that is not two ordered times within the telemetry."""


class HorizonError(CalibrationError):
    """A prediction horizon that is not a whole number of steps."""


class NotEnoughDataError(CalibrationError):
    """Too little usable telemetry for what was asked."""


class ParameterFileError(CalibrationError):
    """A file of parameters that cannot be read or is of another building."""


class ResultsExistError(CalibrationError):
    """Results would be written over a folder that holds something."""
