"""Calibration of many cases at once, on any executor, so that nothing that is finished is ever lost."""

import os
import shutil
import time
import uuid
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import Executor
from contextlib import closing, contextmanager
from importlib.metadata import version
from pathlib import Path
from typing import Any

from calibration.errors import CalibrationError, ResultsExistError
from calibration.fleet.case import CaseTask, earlier_outcome
from calibration.fleet.data_set import TABLES, LocalFolder, write_data_set
from calibration.fleet.handling import Handling
from calibration.fleet.job import Files, Job, calibration_job, data_files
from calibration.fleet.loop import outcomes_of
from calibration.fleet.outcome import RECORD, CaseOutcome
from calibration.fleet.settings import Settings
from calibration.progress import Progress
from calibration.results import check_results_folder, to_json
from thermal.case.load import NAME
from thermal.errors import some_of

#: File in the folder of results with an entry a case.
SUMMARY = "summary.json"

#: Files of all cases together, which a run with pages adds beside it.
_TOGETHER = (SUMMARY, TABLES, "fleet.parquet", "fleet.csv", "fleet.xlsx", "report.html")

#: Folder beside the results that a run keeps while it lasts.
RUNNING = ".running"

#: Stage of the progress.
STAGE = "cases"


def case_folders(folder: str | Path, entry: str = NAME) -> tuple[Path, ...]:
    """Find the case folders in a folder, in the order of their names.

    Parameters
    ----------
    folder : str or Path
        Whose sub-folders with that file are cases; hidden ones are not.
    entry : str
        File that makes a folder a case.
    """
    found = (path.parent for path in Path(folder).glob(f"*/{entry}"))
    return tuple(sorted(path for path in found if not path.name.startswith(".")))


def calibrate_many(
    cases: Sequence[str | Path],
    out: str | Path,
    settings: Settings | None = None,
    *,
    files: Files = data_files,
    workers: Executor | int | None = None,
    retries: int = 2,
    force: bool = False,
    progress: Progress | None = None,
) -> tuple[CaseOutcome, ...]:
    """Calibrate many cases side by side, each in a worker, which writes its results when it is done.

    A case that fails is reported beside the others. A case whose worker dies is given to another; one that goes on to
    end its workers is given up. Run again, it goes on with the cases that have no results yet: results are taken over
    when settings, plans, telemetry and version are the same, and refused when they are not. After Ctrl-C what is
    finished stays, and a summary is written before `KeyboardInterrupt` goes on.

    Parameters
    ----------
    cases : sequence of str or Path
        Case folders, such as `case_folders` finds; results are named after them.
    out : str or Path
        Folder of the results: one folder a case with the files of its results and a record ``case.json``, and
        ``summary.json``. Workers elsewhere must see it, and the cases, under the same path.
    settings : CalibrationSettings, or mapping of str to Any, optional
        Of each calibration; a mapping may also have ``tune`` and ``hold_out``, lists of `Interval` or texts
        ``START/END``.
    files : callable
        Makes the files of a case's results, importable by name: their data alone by default,
        `mpc.reports.calibration.calibration_files` with predictions and a page to read.
    workers : int or Executor, optional
        Number of processes of this machine, each with one thread of linear algebra and replaced when it dies; by
        default one a core, and never more than cases. Or where to calibrate, such as a `ClusterExecutor`; it is left
        open. One that breaks as a whole when a worker dies, as `ProcessPoolExecutor`, cannot be mended from outside:
        its unfinished cases are lost.
    retries : int
        How often a case is given to another worker after its own died.
    force : bool
        Calibrate anew what has results; they are replaced one by one.
    progress : callable, optional
        Called with stage, done, total after each case.

    Returns
    -------
    tuple of CaseOutcome
        In the order of the cases.

    Raises
    ------
    CalibrationError
        When there are no cases, two have the same name, or results would land in a case.
    ResultsExistError
        When the folder holds results of other settings, or something else, and `force` is not set.
    CalibrationError
        When another run writes to the folder.
    CalibrationError
        When a setting is unknown, or a number out of range.

    Examples
    --------
    >>> outcomes = calibrate_many(case_folders("cases"), "results", {"dx": 1.0})  # doctest: +SKIP
    >>> [o.case for o in outcomes if o.status != "calibrated"]  # doctest: +SKIP
    []
    """
    job = calibration_job(files)
    return do_many(job, cases, out, settings or {}, Handling(workers, retries, force), progress)


def do_many(
    job: Job,
    cases: Sequence[str | Path],
    out: str | Path,
    settings: Settings,
    how: Handling,
    progress: Progress | None = None,
) -> tuple[CaseOutcome, ...]:
    """Do a job with many cases, as `calibrate_many` calibrates them.

    Parameters
    ----------
    job : Job
        What is done.
    cases, out, progress
        As in `calibrate_many`.
    settings : CalibrationSettings, or mapping of str to Any
        Of the job.
    how : Handling
        By whom, how often, for how long.
    """
    began = time.perf_counter()
    spelled = job.spell(settings)
    folder = _absolute(check_results_folder(out, force=True))
    paths = _check_cases(cases, folder)
    if not how.force:
        _refuse_other_contents(folder)
    with _claimed(folder) as running:
        tasks = [
            CaseTask(
                case=path, out=folder / path.name, running=running, settings=settings, run=running.name, attempt=0,
                retries=how.retries, force=how.force, job=job, limit=how.limit,
            )
            for path in paths
        ]  # fmt: skip
        there = {} if how.force else {t.name: earlier_outcome(t.case, t.out, spelled) for t in tasks}
        found = {name: outcome for name, outcome in there.items() if outcome is not None}
        todo = [task for task in tasks if task.name not in found]
        tell = progress or (lambda stage, done, total: None)
        try:
            tell(STAGE, len(found), len(tasks))
            with closing(outcomes_of(todo, len(todo), how.workers)) as coming:
                for outcome in coming:
                    found[outcome.case] = outcome
                    tell(STAGE, len(found), len(tasks))
        finally:
            outcomes = tuple(found.get(t.name) or t.finished() or t.unfinished("interrupted") for t in tasks)
            _write_summary(running, outcomes, spelled, time.perf_counter() - began)
            write_data_set(LocalFolder(folder), outcomes)
    return outcomes


def _check_cases(cases: Sequence[str | Path], out: Path) -> list[Path]:
    """Refuse cases whose results would get in each other's way; return their absolute paths."""
    paths = [_absolute(case) for case in cases]
    CalibrationError.unless(paths, "cases", "at least one case folder", "none")
    for name, count in Counter(path.name for path in paths).items():
        if count > 1:
            both = ", ".join(str(path) for path in paths if path.name == name)
            raise CalibrationError(
                f"cases: expected each name once, got {both}; both would write to {out / name}: rename one, or "
                "calibrate them into different folders"
            )
        if not name or name.startswith(".") or name in _TOGETHER:
            raise CalibrationError(f"cases: expected folders whose names results can take, got {name!r}; rename it")
    real = out.resolve()
    for path in paths:
        if path.resolve() in (real, *real.parents, (real / path.name).resolve()):
            raise CalibrationError(f"{out}: results would land in the case {path}; choose another --out")
    return paths


def _absolute(path: str | Path) -> Path:
    """Spell a path for a worker with another working folder; links stay, for a case has the name of its link."""
    return Path(os.path.abspath(path))


def _is_of_all(path: Path) -> bool:
    """Whether a file is of all cases together: their summary, table, page or a figure of it."""
    return path.name in _TOGETHER or (path.name.startswith("figure_") and path.suffix in (".svg", ".png"))


def _refuse_other_contents(out: Path) -> None:
    """Refuse a folder that holds anything but results of such a run; hidden files are nobody's results."""
    held = sorted(path for path in out.iterdir() if not path.name.startswith(".")) if out.is_dir() else []
    other = [path.name for path in held if not _is_of_all(path) and not (path / RECORD).is_file()]
    if other:
        raise ResultsExistError(
            f"{out}: expected a new folder, or results of an earlier run to go on with, found "
            f"{some_of(other, most=4)}; choose another, or --force (force=True)"
        )


@contextmanager
def _claimed(out: Path) -> Iterator[Path]:
    """Make the run's own folder, which no other run may have at the same time.

    The lock goes with the process that holds it, so what a killed run leaves behind does not stand in the way.
    """
    lock = out / RUNNING / "lock"
    try:
        lock.parent.mkdir(parents=True, exist_ok=True)
        stream = lock.open("w")
    except OSError as error:
        raise CalibrationError(f"{out}: expected a place that can be written to: {error}; choose another") from error
    with stream:
        _lock(stream.fileno(), out)
        for left in lock.parent.iterdir():
            if left != lock:
                shutil.rmtree(left, ignore_errors=True)
        running = lock.parent / uuid.uuid4().hex[:12]
        running.mkdir()
        try:
            yield running
        finally:
            shutil.rmtree(lock.parent, ignore_errors=True)


def _lock(descriptor: int, out: Path) -> None:
    try:
        import fcntl
    except ImportError:  # not on this system: two runs in one folder are not noticed
        return
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError as error:
        raise CalibrationError(f"{out}: another run writes its results here; wait for it, or choose another") from error
    except OSError:  # a file system without locks
        return


def _write_summary(running: Path, outcomes: Sequence[CaseOutcome], settings: Mapping[str, Any], seconds: float) -> None:
    """Write ``summary.json`` into the folder of the results, whole or not at all."""
    content = {
        "cases": {outcome.case: outcome for outcome in outcomes},
        "settings": settings,
        "seconds": seconds,
        "version": version("buildingmpc"),
    }
    new = running / SUMMARY
    new.write_text(to_json(content) + "\n", encoding="utf-8")
    new.replace(running.parents[1] / SUMMARY)
