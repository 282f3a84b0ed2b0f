"""What is done with each case of many: calibrated, or whatever else a `Job` says."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Literal

from calibration.fit.calibrate import calibrate
from calibration.fit.least_squares import INTERRUPTED
from calibration.fit.result import CalibrationResult
from calibration.fleet.settings import Settings, read_intervals, split_settings
from calibration.results import Content
from thermal.case.case import Case

Status = Literal["calibrated", "diagnosed", "not_converged", "failed", "lost", "interrupted"]

#: Makes the files of a case's results, by name; importable by name, for it travels to the workers.
Files = Callable[[Any, Case], Mapping[str, Content]]


@dataclass(frozen=True)
class Done:
    """What was made of a case.

    Parameters
    ----------
    result : object
        What the files of its results are made of.
    status : str
        One of `Status`.
    before, after : float
        Held-out error [K].
    solver : mapping of str to Any, optional
        How the solve went.
    verdict : str, optional
        Of a diagnosis.
    effects : tuple of str
        That it found.
    """

    result: Any
    status: Status
    before: float
    after: float
    solver: Mapping[str, Any] | None = None
    verdict: str | None = None
    effects: tuple[str, ...] = ()


@dataclass(frozen=True)
class Job:
    """What is done with each case of many; its parts are importable by name, for they travel to the workers.

    Parameters
    ----------
    spell : callable
        Refuses settings that are not right, and spells them as a record does.
    work : callable
        Does it.
    files : callable
        Makes the files of the results.
    """

    spell: Callable[[Settings | None], dict[str, Any]]
    work: Callable[[Case, Settings], Done]
    files: Files


def data_files(result: CalibrationResult, case: Case) -> dict[str, Content]:
    """Files of a case's results with their data alone, ``calibration.json`` and ``evaluation.json``.

    Parameters
    ----------
    result : CalibrationResult
        From `calibrate`.
    case : Case
        The case it was calibrated on.
    """
    return {"calibration.json": result.to_dict(), "evaluation.json": result.calibrated["held_out"].to_dict()}


def calibrated(case: Case, settings: Settings) -> Done:
    """Calibrate a case of many.

    Parameters
    ----------
    case : Case
        The case.
    settings : CalibrationSettings, or mapping of str to Any
        Of `calibrate`.
    """
    intervals, chosen = split_settings(settings)
    tune, hold_out = read_intervals(intervals, case)
    result = calibrate(case, tune, hold_out, settings=chosen)
    before, after = (e["held_out"].metrics.mae for e in (result.uncalibrated, result.calibrated))
    status: Status = "calibrated" if result.solver.success else "not_converged"
    if result.solver.status == INTERRUPTED:
        status = "interrupted"
    return Done(result, status, before, after, result.solver.to_dict())
