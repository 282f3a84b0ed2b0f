"""One case of many: what travels to a worker, and what the worker does with it."""

from __future__ import annotations

import os
import socket
import tempfile
import time
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from calibration.errors import CalibrationError, WorkerLostError
from calibration.evaluation.intervals import parse_interval
from calibration.fit.calibrate import calibrate
from calibration.fit.least_squares import INTERRUPTED
from calibration.fit.result import CalibrationResult
from calibration.fleet.record import (
    INTERVALS,
    RECORD,
    CaseOutcome,
    Status,
    check_settings,
    digest,
    outcome_of,
    read_record,
)
from calibration.results import write_results
from mpc.reports.calibration import write_calibration
from thermal.case.case import Case
from thermal.case.load import load_case
from thermal.errors import ThermalError


@dataclass(frozen=True)
class CaseTask:
    """One case as it travels to a worker; paths are absolute and mean the same there.

    Parameters
    ----------
    case, out, running : Path
        Case folder, folder of its results, and the run's own folder beside them.
    settings : mapping of str to Any
        Of `calibrate`.
    run : str
        Name of the run.
    attempt, retries : int
        How often it was given to another worker, and how often it may be.
    force : bool
        Calibrate although there are results of an earlier run.
    """

    case: Path
    out: Path
    running: Path
    settings: Mapping[str, Any]
    run: str
    attempt: int
    retries: int
    force: bool

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
        """Describe an end without results."""
        bad = status == "failed" and isinstance(error, ThermalError | CalibrationError)
        kind, text = (type(error).__name__, str(error)) if error is not None else (None, None)
        return CaseOutcome(self.name, status, attempts=len(self.starts()), error=kind, message=text, bad_input=bad)

    @property
    def _starts(self) -> Path:
        return self.running / f"{self.name}.starts"


def calibrate_one(task: CaseTask) -> CaseOutcome:
    """Calibrate a case and write its results, whole or not at all; runs in a worker.

    Parameters
    ----------
    task : CaseTask
        The case.
    """
    try:
        return task.finished() or _calibrate_one(task)
    except Exception as error:  # travels as text: an error of another library may not survive being pickled
        status: Status = "lost" if isinstance(error, WorkerLostError) else "failed"
        return task.finished() or task.unfinished(status, error)


def _calibrate_one(task: CaseTask) -> CaseOutcome:
    began = time.perf_counter()
    task.begin()
    files = digest(task.case)  # before it is loaded: what changes from here on counts as another case
    case = load_case(task.case)
    result = calibrate(case, **_settings_of(case, task.settings))
    if result.solver.status == INTERRUPTED:  # the best so far is not what a later run should take over
        return task.unfinished("interrupted")
    with tempfile.TemporaryDirectory(prefix="buildingmpc-") as work:
        staged = Path(work) / task.name
        write_calibration(result, case, staged)
        outcome = _outcome(task, result, time.perf_counter() - began)
        record = {
            "settings": check_settings(task.settings),
            "files": files,
            "version": result.version,
            "run": task.run,
            "outcome": asdict(outcome),
        }
        task.check_running()  # a cluster cannot stop what it has begun when a run is interrupted
        contents = {path.name: path.read_bytes() for path in sorted(staged.iterdir())}
        write_results(task.out, {**contents, RECORD: record}, task.force)
    return outcome


def _settings_of(case: Case, settings: Mapping[str, Any]) -> dict[str, Any]:
    """Read the intervals of the settings in the time of a case."""
    read = {
        name: [parse_interval(entry, case) if isinstance(entry, str) else entry for entry in settings[name]]
        for name in INTERVALS
        if name in settings
    }
    return {**settings, **read}


def _outcome(task: CaseTask, result: CalibrationResult, seconds: float) -> CaseOutcome:
    before, after = (e["held_out"].metrics.mae for e in (result.uncalibrated, result.calibrated))
    status: Status = "calibrated" if result.solver.success else "not_converged"
    solver = result.solver.to_dict()
    return CaseOutcome(task.name, status, before, after, seconds, attempts=len(task.starts()), solver=solver)
