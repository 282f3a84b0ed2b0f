"""Diagnosis of many cases at once, as `calibration.fleet.run` calibrates them."""

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from pathlib import Path
from typing import Any

from calibration.diagnosis.diagnosis import Diagnosis, diagnose
from calibration.diagnosis.known import reasons_of
from calibration.errors import CalibrationError
from calibration.fleet.handling import Handling
from calibration.fleet.job import Done, Files, Job
from calibration.fleet.outcome import CaseOutcome
from calibration.fleet.run import do_many
from calibration.fleet.settings import Settings, read_intervals, spelled, split_intervals
from calibration.progress import Progress
from calibration.results import Content, plain
from thermal.case.case import Case
from thermal.case.validation import has_windows
from thermal.errors import nearest

#: Settings of a diagnosis beside its intervals, with their defaults.
_DEFAULTS: dict[str, Any] = {"dx": None, "horizon": "6h", "known": (), "ruled_out": ()}


def diagnosis_data(result: Diagnosis, case: Case) -> dict[str, Content]:
    """Files of a case's results with their data alone, ``diagnosis.json`` and ``calibration.json``.

    Parameters
    ----------
    result : Diagnosis
        From `diagnose`.
    case : Case
        The case it was made on.
    """
    return {"diagnosis.json": result.to_dict(), "calibration.json": result.calibration()}


def diagnose_many(
    cases: Sequence[str | Path],
    out: str | Path,
    settings: Mapping[str, Any] | None = None,
    *,
    files: Files = diagnosis_data,
    workers: Executor | int | None = None,
    retries: int = 2,
    force: bool = False,
    progress: Progress | None = None,
) -> tuple[CaseOutcome, ...]:
    """Diagnose many cases side by side; what is finished is never lost, as in `calibration.fleet.run.calibrate_many`.

    Parameters
    ----------
    cases : sequence of str or Path
        Case folders.
    out : str or Path
        Folder of the results: one folder a case, and ``summary.json``.
    settings : mapping of str to Any, optional
        Arguments of `diagnose` by name; ``tune`` and ``hold_out`` may be texts ``START/END``.
    files : callable
        Makes the files of a case's results: their data alone by default, `mpc.reports.diagnosis.diagnosis_files` with
        tables and a page to read.
    workers, retries, force, progress
        As in `calibrate_many`.

    Returns
    -------
    tuple of CaseOutcome
        In the order of the cases.

    Raises
    ------
    CalibrationError
        As `calibrate_many` does.
    EffectError
        When an effect is not in the catalogue.
    """
    job = diagnosis_job(files)
    return do_many(job, cases, out, settings or {}, Handling(workers, retries, force), progress)


def diagnosis_job(files: Files = diagnosis_data) -> Job:
    """Make the job of diagnosing a case.

    Parameters
    ----------
    files : callable
        Makes the files of the results.
    """
    return Job(_spell, _diagnosed, files)


def _spell(settings: Settings | None) -> dict[str, Any]:
    """Refuse what `diagnose` does not take, and spell the rest as a record does."""
    if not isinstance(settings, Mapping):
        raise CalibrationError("settings", "arguments of diagnose by name", repr(settings))
    intervals, given = split_intervals(settings)
    for name in given:
        if name not in _DEFAULTS:
            raise CalibrationError(f"settings: diagnose takes no {name!r}; {nearest(name, _DEFAULTS)}")
    chosen = {**_DEFAULTS, **given}
    reasons_of(chosen["known"], chosen["ruled_out"])
    return spelled(intervals, chosen)


def _diagnosed(case: Case, settings: Settings) -> Done:
    """Diagnose a case of many."""
    if not isinstance(settings, Mapping):  # pragma: no cover - refused when it was spelled
        raise TypeError
    intervals, given = split_intervals(settings)
    tune, hold_out = read_intervals(intervals, case)
    result = diagnose(case, tune, hold_out, **given)
    tables = {"effects": effect_rows(result)}
    return Done(
        result, "diagnosed", result.gap_as_read, result.predicts, verdict=result.verdict.name, effects=result.found,
        has_windows=has_windows(case.building), tables=tables,
    )  # fmt: skip


def effect_rows(result: Diagnosis) -> list[dict[str, Any]]:
    """Rows of the table ``effects``: every effect of the catalogue, the likeliest first.

    Parameters
    ----------
    result : Diagnosis
        From `diagnose`.
    """
    kept = ("effect", "probability", "score", "retained_share", "testable", "zones", "group")
    found = set(result.found)
    return [
        {name: plain(getattr(c, name)) for name in kept} | {"found": c.effect in found}
        for c in result.verdict.candidates
    ]
