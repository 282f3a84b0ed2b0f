"""The error family of the package."""

from thermal.errors import Described


class CalibrationError(Described, Exception):
    """Base of every error that `calibration` raises on purpose."""


class HorizonError(CalibrationError):
    """A prediction horizon that is not a whole number of steps."""


class NotEnoughDataError(CalibrationError):
    """Too little usable telemetry for what was asked."""


class ResultsExistError(CalibrationError):
    """Results would be written over a folder that holds something."""


class WorkerLostError(CalibrationError):
    """A case whose workers died more often than it may be tried again."""


class FilterError(CalibrationError):
    """A filter, disturbance or innovations that do not fit each other or the data."""
