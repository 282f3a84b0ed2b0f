"""What is done with each case of many: calibrated, or whatever else a `Job` says."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

from calibration.fit.calibrate import calibrate
from calibration.fit.least_squares import INTERRUPTED
from calibration.fit.result import CalibrationResult
from calibration.fleet.settings import Settings, check_settings, read_intervals, split_settings
from calibration.results import Content, plain
from thermal.case.case import Case
from thermal.case.load import NAME, load_case
from thermal.case.validation import has_windows

Status = Literal["calibrated", "diagnosed", "identified", "compared", "not_converged", "failed", "lost", "interrupted"]

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
    before, after : float, optional
        Held-out error [K].
    solver : mapping of str to Any, optional
        How the solve went.
    verdict : str, optional
        Of a diagnosis.
    effects : tuple of str
        That it found.
    has_windows : bool, optional
        Whether the building has glazing at all.
    tables : mapping of str to sequence of mapping
        Rows of further tables of the data set of results, by table, in plain types.
    """

    result: Any
    status: Status
    before: float | None = None
    after: float | None = None
    solver: Mapping[str, Any] | None = None
    verdict: str | None = None
    effects: tuple[str, ...] = ()
    has_windows: bool | None = None
    tables: Mapping[str, Sequence[Mapping[str, Any]]] = field(default_factory=dict)


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
    load : callable
        Loads a case from its folder.
    entry : str
        File by which a folder is known as a case.
    """

    spell: Callable[[Settings | None], dict[str, Any]]
    work: Callable[[Any, Settings], Done]
    files: Files
    load: Callable[[Path], Any] = load_case
    entry: str = NAME


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
    tables = {"parameters": parameter_rows(result)}
    return Done(
        result, status, before, after, result.solver.to_dict(), has_windows=has_windows(case.building), tables=tables
    )


def calibration_job(files: Files = data_files) -> Job:
    """Make the job of calibrating a case.

    Parameters
    ----------
    files : callable
        Makes the files of the results.
    """
    return Job(check_settings, calibrated, files)


def parameter_rows(result: CalibrationResult) -> list[dict[str, Any]]:
    """Rows of the table ``parameters``: what was found, and what the data alone say of it on the estimation scale.

    Parameters
    ----------
    result : CalibrationResult
        From `calibrate`.
    """
    told = {} if result.told is None else result.told.rows()
    kept = ("name", "unit", "value", "lower", "upper", "start", "standard_error", "at_bound", "identifiable")
    rows = [{k: plain(getattr(p, k)) for k in kept} | {"base": p.base} for p in result.parameters]
    return [row | told.get(row["name"], {}) for row in rows]
