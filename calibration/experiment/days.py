"""When an experiment begins, and the measured days that it is designed on."""

import pandas as pd

from calibration.errors import CalibrationError
from calibration.experiment.library import AFTER
from thermal.case.case import Case, local_timestamp


def begin_of(case: Case, wanted: pd.Timestamp | None = None) -> pd.Timestamp:
    """When an experiment begins, local to the building.

    Parameters
    ----------
    case : Case
        With telemetry.
    wanted : Timestamp, optional
        Start; the first midnight after the telemetry by default.

    Raises
    ------
    CalibrationError
        When that is before the end of the telemetry.
    """
    if wanted is None:
        return _midnight_after(case)
    start, last = local_timestamp(wanted, case.building), case.stamps[-1]
    advice = "what is measured cannot be moved any more"
    CalibrationError.unless(
        start >= last, "experiment: start", f"{last}, the end of the telemetry, or later", start, advice
    )
    return start


def days_like(case: Case, start: pd.Timestamp, hours: float) -> pd.Timestamp:
    """Find when the measured days begin that an experiment is designed on: whole weeks before it, or else whole days.

    Parameters
    ----------
    case : Case
        With telemetry.
    start : Timestamp
        Of the experiment.
    hours : float
        Its length [h].

    Raises
    ------
    CalibrationError
        When the telemetry is too short.
    """
    length, first, last = pd.Timedelta(hours=hours + AFTER), case.stamps[0] + pd.Timedelta(days=1), case.stamps[-1]
    begin = _before(start, last - length, 7)
    if begin < first:  # other days of the week, at the same time of day: the sun is where it was
        begin = _before(start, last - length, 1)
    enough = begin >= first
    expected = f"a day and {hours + AFTER:g} h more of telemetry"
    CalibrationError.unless(
        enough, "experiment", expected, f"{first - pd.Timedelta(days=1)} to {last}", "give fewer hours"
    )
    return begin


def _before(start: pd.Timestamp, latest: pd.Timestamp, days: int) -> pd.Timestamp:
    """Go back by so many days at a time, on the same clock."""
    turns = max(0, (start - latest) // pd.Timedelta(days=days))
    begin = start - pd.DateOffset(days=days * turns)
    while begin > latest:
        begin -= pd.DateOffset(days=days)
    return begin


def _midnight_after(case: Case) -> pd.Timestamp:
    """Give the first local midnight at or after the end of the telemetry."""
    last = case.stamps[-1]
    day = last.normalize()
    return day if day == last else day + pd.DateOffset(days=1)
