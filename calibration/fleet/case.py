"""One case of many: what travels to a worker, what it does there, and the record by which it is known again."""

from __future__ import annotations

import hashlib
import json
import os
import socket
import time
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields, replace
from importlib.metadata import version
from pathlib import Path
from typing import Any, ClassVar

from calibration.errors import CalibrationError, ResultsExistError, WorkerLostError
from calibration.fleet.job import Job, Status
from calibration.fleet.settings import Settings
from calibration.results import Plain, write_results
from thermal.case.load import NAME, load_case, read_building_file
from thermal.case.validation import has_windows
from thermal.errors import CaseError, ThermalError

#: File in the results of each case: what they were made from, and how it went.
RECORD = "case.json"


@dataclass(frozen=True)
class CaseOutcome(Plain):
    """How one of many calibrations or diagnoses went.

    Parameters
    ----------
    case : str
        Name of the case folder, and of the folder of its results.
    status : {"calibrated", "diagnosed", "not_converged", "failed", "lost", "interrupted"}
        The first three have results. A case is lost when its worker died more often than it may, and interrupted when
        the run ended before it.
    held_out_mae_before, held_out_mae_after : float, optional
        Held-out error before and after calibration [K]; of a diagnosis, of the calibrated baseline and of the model
        that it hands on.
    seconds : float
        Wall time of loading, calibrating and writing [s]; of the run that did it, for a case that was done before.
    resumed : bool
        Whether the results are of an earlier run.
    attempts : int
        How many workers began it.
    solver : mapping of str to Any, optional
        Entry ``solver`` of its ``calibration.json``; None without results, and of a diagnosis.
    verdict : str, optional
        Of a diagnosis.
    effects : tuple of str
        That it found, in order.
    error, message : str, optional
        Name and text of what went wrong.
    bad_input : bool
        Whether that is for the user to mend in the case or the settings, rather than a failure.
    has_windows : bool, optional
        Whether the building has glazing at all; None without results.
    """

    case: str
    status: Status
    held_out_mae_before: float | None = None
    held_out_mae_after: float | None = None
    seconds: float = 0.0
    resumed: bool = False
    attempts: int = 0
    solver: Mapping[str, Any] | None = None
    verdict: str | None = None
    effects: tuple[str, ...] = ()
    error: str | None = None
    message: str | None = None
    bad_input: bool = False
    has_windows: bool | None = None
    key: ClassVar[str] = "case"


@dataclass(frozen=True)
class CaseTask:
    """One case as it travels to a worker; paths are absolute and mean the same there.

    Parameters
    ----------
    case, out, running : Path
        Case folder, folder of its results, and the run's own folder beside them.
    settings : CalibrationSettings, or mapping of str to Any
        Of the job; a mapping may have its intervals too.
    run : str
        Name of the run.
    attempt, retries : int
        How often it was given to another worker, and how often it may be.
    force : bool
        Do it although there are results of an earlier run.
    job : Job
        What is done.
    """

    case: Path
    out: Path
    running: Path
    settings: Settings
    run: str
    attempt: int
    retries: int
    force: bool
    job: Job

    @property
    def name(self) -> str:
        """Name of the case."""
        return self.out.name

    def again(self) -> CaseTask:
        """Make the next attempt."""
        return replace(self, attempt=self.attempt + 1)

    def starts(self) -> list[str]:
        """Hosts and processes that began the case in this run, one line each."""
        try:
            return self._starts.read_text(encoding="utf-8").splitlines()
        except OSError:
            return []

    def begin(self) -> None:
        """Write down that a worker begins the case; refuse one that has outlived more workers than it may.

        An executor may give a case to another worker by itself when one dies, as dask does, and then tells only after
        many deaths, and blames cases that merely waited at that worker. What is written here is exact.
        """
        self.check_running()
        begun = self.starts()
        if len(begun) > self.retries:
            raise WorkerLostError(
                f"its worker died {len(begun)} times (host, process: {', '.join(begun)}), perhaps out of memory"
            )
        with self._starts.open("a", encoding="utf-8") as stream:
            stream.write(f"{socket.gethostname()} {os.getpid()}\n")

    def check_running(self) -> None:
        """Refuse to work where the run cannot be seen, or for a run that is over."""
        if not self.running.is_dir():
            raise CalibrationError(
                f"{self.running}: expected on worker {socket.gethostname()} as where the run was started, and not "
                "found; cases and results must lie on a file system that every worker sees under the same path"
            )

    def finished(self) -> CaseOutcome | None:
        """Find results of this run: a worker may die, or be cut off, before it can say that they are there."""
        there = read_record(self.out)
        return outcome_of(there, self.out) if there is not None and there["run"] == self.run else None

    def unfinished(self, status: Status, error: Exception | None = None) -> CaseOutcome:
        """Describe an end without results.

        Parameters
        ----------
        status : str
            One of `Status`.
        error : Exception, optional
            What went wrong.
        """
        bad = status == "failed" and isinstance(error, ThermalError | CalibrationError)
        kind, text = (type(error).__name__, str(error)) if error is not None else (None, None)
        return CaseOutcome(self.name, status, attempts=len(self.starts()), error=kind, message=text, bad_input=bad)

    @property
    def _starts(self) -> Path:
        return self.running / f"{self.name}.starts"


def do_one(task: CaseTask) -> CaseOutcome:
    """Calibrate or diagnose a case and write its results, whole or not at all; runs in a worker.

    Parameters
    ----------
    task : CaseTask
        The case.
    """
    try:
        return task.finished() or _do_one(task)
    except Exception as error:  # travels as text: an error of another library may not survive being pickled
        status: Status = "lost" if isinstance(error, WorkerLostError) else "failed"
        return task.finished() or task.unfinished(status, error)


def _do_one(task: CaseTask) -> CaseOutcome:
    began = time.perf_counter()
    task.begin()
    files = digest(task.case)  # before it is loaded: what changes from here on counts as another case
    case = load_case(task.case)
    done = task.job.work(case, task.settings)
    if done.status == "interrupted":  # the best so far is not what a later run should take over
        return task.unfinished("interrupted")
    contents = task.job.files(done.result, case)
    seconds, attempts = time.perf_counter() - began, len(task.starts())
    outcome = CaseOutcome(
        task.name, done.status, done.before, done.after, seconds, attempts=attempts, solver=done.solver,
        verdict=done.verdict, effects=done.effects, has_windows=has_windows(case.building),
    )  # fmt: skip
    record = {
        "settings": task.job.spell(task.settings),
        "files": files,
        "version": version("buildingmpc"),
        "run": task.run,
        "outcome": asdict(outcome),
    }
    task.check_running()  # a cluster cannot stop what it has begun when a run is interrupted
    work = None if task.out.is_symlink() else task.running  # the run clears it away, also after a killed worker
    write_results(task.out, {**contents, RECORD: record}, task.force, work)
    return outcome


def earlier_outcome(case: Path, out: Path, settings: Mapping[str, Any]) -> CaseOutcome | None:
    """Read what an earlier run with the same settings, on the same case, left behind.

    Parameters
    ----------
    case, out : Path
        Case folder, and folder of its results.
    settings : mapping of str to Any
        From `check_settings`.

    Returns
    -------
    CaseOutcome or None
        None without results.

    Raises
    ------
    ResultsExistError
        When the results there are of other settings, other telemetry, or another version.
    """
    there = read_record(out)
    if there is None:
        if out.exists() or out.is_symlink():
            raise ResultsExistError(f"{out}: holds no results of such a run; choose another --out or --force")
        return None
    here = {"settings": dict(settings), "files": digest(case), "version": version("buildingmpc")}
    for what in here:
        if there[what] != here[what]:
            raise ResultsExistError(
                f"{out}: holds results of {_difference(what, there[what], here[what])}; "
                "choose another --out, or --force (force=True) to replace them"
            )
    return replace(outcome_of(there, out), resumed=True)


def _difference(what: str, there: Any, here: Any) -> str:
    if what == "files":
        return "other plans or telemetry than the case holds now"
    if what == "version":
        return f"version {there}, and this is {here}"
    name = next(n for n in {**there, **here} if there.get(n) != here.get(n))
    return f"other settings: {name} is {there.get(name)!r} there and {here.get(name)!r} here"


def read_record(out: Path) -> dict[str, Any] | None:
    """Read the record of finished results; None where there are none, or they are of no such run.

    Parameters
    ----------
    out : Path
        Folder of the results of a case.
    """
    try:
        content = json.loads((out / RECORD).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    whole = isinstance(content, dict) and set(content) == {"settings", "files", "version", "run", "outcome"}
    outcome = content["outcome"] if whole else None
    return content if isinstance(outcome, dict) and set(outcome) == {f.name for f in fields(CaseOutcome)} else None


def outcome_of(record: Mapping[str, Any], out: Path) -> CaseOutcome:
    """Outcome in a record.

    Parameters
    ----------
    record : mapping of str to Any
        From `read_record`.
    out : Path
        Folder that it lies in.
    """
    outcome = record["outcome"]
    return CaseOutcome(**{**outcome, "case": out.name, "effects": tuple(outcome["effects"])})


def digest(case: Path) -> str:
    """SHA-256 of the files that make up a case, by which a later run knows it again; empty when they cannot be read.

    Parameters
    ----------
    case : Path
        Case folder.
    """
    total = hashlib.sha256()
    try:
        parsed = read_building_file(case)
        for name in (NAME, *(floor.plan for floor in parsed.floors or ()), parsed.telemetry):
            with (case / name).open("rb") as stream:
                total.update(hashlib.file_digest(stream, "sha256").digest())
    except (CaseError, OSError):
        return ""
    return total.hexdigest()
