"""One case of many as it travels to a worker, and what a worker does with it."""

from __future__ import annotations

import hashlib
import os
import platform
import signal
import socket
import sys
import time
from collections.abc import Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from dataclasses import asdict, dataclass, replace
from importlib.metadata import version
from pathlib import Path
from typing import Self

from calibration.errors import CalibrationError, WorkerLostError
from calibration.fleet.job import Job, Status
from calibration.fleet.outcome import RECORD, CaseOutcome, key_of
from calibration.fleet.settings import Settings
from calibration.results import Content
from calibration.stages import stages_kept
from thermal.errors import ThermalError

#: Time since what was kept last, from which the end of a stage of a case is kept [s]: at 123 zones three weeks of
#: telemetry take 0.3 GB and a second to write, and a stage up to a minute.
EVERY = 60.0


@dataclass(frozen=True, kw_only=True)
class Task:
    """One case as it travels to a worker; where it lies is known to the classes below this one.

    Parameters
    ----------
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
    limit : float, optional
        Longest time that it may take a worker, which is ended then [s]; none by default.
    """

    settings: Settings
    run: str
    attempt: int
    retries: int
    force: bool
    job: Job
    limit: float | None = None

    @property
    def name(self) -> str:
        """Name of the case."""
        raise NotImplementedError

    def starts(self) -> list[str]:
        """Hosts and processes that began the case and did not finish it, one line each."""
        raise NotImplementedError

    def finished(self) -> CaseOutcome | None:
        """Find results that are there: a worker may die, or be cut off, before it can say so."""
        raise NotImplementedError

    def opened(self) -> AbstractContextManager[tuple[Path, str]]:
        """Make the case a folder of this machine, with the digest by which a later run knows it again."""
        raise NotImplementedError

    def commit(self, files: Mapping[str, Content]) -> None:
        """Write the results, whole or not at all.

        Parameters
        ----------
        files : mapping of str to bytes, str, dict or DataFrame
            By name.
        """
        raise NotImplementedError

    def mark(self, line: str) -> None:
        """Write down that a worker begins the case.

        Parameters
        ----------
        line : str
            Host and process.
        """
        raise NotImplementedError

    def survived(self) -> None:
        """Write down that the case ended without results and without ending its worker."""
        raise NotImplementedError

    def read_stage(self, name: str) -> bytes:
        """Read what a stage of the case ended with.

        Parameters
        ----------
        name : str
            Of a file.

        Raises
        ------
        FileNotFoundError
            When no attempt came so far.
        """
        raise NotImplementedError

    def keep_stage(self, name: str, content: bytes) -> None:
        """Keep what a stage of the case ended with, whole or not at all, until it has results.

        Parameters
        ----------
        name : str
            Of a file.
        content : bytes
            For a later attempt.
        """
        raise NotImplementedError

    def again(self) -> Self:
        """Make the next attempt."""
        return replace(self, attempt=self.attempt + 1)

    def begin(self) -> None:
        """Write down that a worker begins the case; refuse one that has outlived more workers than it may.

        An executor may give a case to another worker by itself when one dies, as dask does, and then tells only after
        many deaths, and blames cases that merely waited at that worker. What is written here is exact.
        """
        begun = self.starts()
        if len(begun) > self.retries:
            raise WorkerLostError(
                f"its worker died {len(begun)} times (host, process: {', '.join(begun)}), perhaps out of memory"
                + ("" if self.limit is None else f" or beyond {self.limit:g} s")
            )
        self.mark(f"{socket.gethostname()} {os.getpid()}")

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


def do_one(task: Task) -> CaseOutcome:
    """Do a case of many and write its results, whole or not at all; runs in a worker.

    Parameters
    ----------
    task : Task
        The case.
    """
    try:
        return task.finished() or _do_one(task)
    except Exception as error:  # travels as text: an error of another library may not survive being pickled
        status: Status = "lost" if isinstance(error, WorkerLostError) else "failed"
        outcome = task.finished() or task.unfinished(status, error)
        if outcome.status == "failed":
            task.survived()
        return outcome


def _do_one(task: Task) -> CaseOutcome:
    began = time.perf_counter()
    task.begin()
    with _ended_after(task.limit), task.opened() as (folder, files):
        made_of = {"settings": task.job.spell(task.settings), "files": files, "version": version("buildingmpc")}
        case = task.job.load(folder)
        with stages_kept(_Kept(task, key_of(made_of)), EVERY):
            done = task.job.work(case, task.settings)
        if done.status == "interrupted":  # the best so far is not what a later run should take over
            task.survived()
            return task.unfinished("interrupted")
        contents = task.job.files(done.result, case)
    seconds, attempts = time.perf_counter() - began, len(task.starts())
    outcome = CaseOutcome(
        task.name, done.status, done.before, done.after, seconds, attempts=attempts, solver=done.solver,
        verdict=done.verdict, effects=done.effects, has_windows=done.has_windows, memory=_peak_memory(),
    )  # fmt: skip
    record = {**made_of, "run": task.run, "outcome": asdict(outcome), "tables": done.tables}
    task.commit({**contents, RECORD: record})
    return outcome


@dataclass(frozen=True)
class _Kept:
    """Ends of a case's stages: of the same contents, settings and program, and of this run where results are forced."""

    task: Task
    key: str

    def read(self, name: str) -> bytes:
        return self.task.read_stage(self._file(name))

    def write(self, name: str, content: bytes) -> None:
        self.task.keep_stage(self._file(name), content)

    def _file(self, name: str) -> str:
        task = self.task
        program = (platform.python_version(), *(version(name) for name in ("numpy", "scipy", "pandas", "casadi")))
        made = f"{name} {self.key} {program} {task.run if task.force else ''}"
        return f"{name.partition(' ')[0]}-{hashlib.sha256(made.encode()).hexdigest()[:24]}.pickle"


@contextmanager
def _ended_after(limit: float | None) -> Iterator[None]:
    """End this process when a case takes it too long, also where a library does not give the interpreter a turn."""
    if limit is None or not hasattr(signal, "setitimer"):
        yield
        return
    signal.setitimer(signal.ITIMER_REAL, limit)  # nobody handles its signal, so the system ends the process
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)


def _peak_memory() -> float | None:
    """Largest resident memory of this process so far [MB]."""
    try:
        import resource
    except ImportError:  # not on this system
        return None
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / (1024.0 if sys.platform != "darwin" else 1024.0**2)
