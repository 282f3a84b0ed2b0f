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


class OtherResultsError(ResultsExistError):
    """Earlier results of other settings, or of a case that has changed since."""


class CaseFoldersError(CalibrationError):
    """Case folders that cannot be calibrated together."""


class AnotherRunError(CalibrationError):
    """Another run is writing to the same folder of results."""


class WorkerLostError(CalibrationError):
    """A case whose workers died more often than it may be tried again."""


class ClusterError(CalibrationError):
    """No scheduler, no workers, or workers that cannot do the job."""


class MissingExtraError(CalibrationError):
    """A package that only an extra of the installation brings."""


class FilterError(CalibrationError):
    """A filter, disturbance or innovations that do not fit each other or the data."""
