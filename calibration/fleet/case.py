"""One case of many in a folder that every worker sees, and what an earlier run left of it."""

from __future__ import annotations

import hashlib
import shutil
import socket
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from importlib.metadata import version
from pathlib import Path
from typing import Any

from calibration.errors import CalibrationError, ResultsExistError
from calibration.fleet.outcome import CaseOutcome, outcome_of, read_record
from calibration.fleet.task import Task
from calibration.results import Content, write_results
from thermal.case.load import NAME, read_building_file
from thermal.errors import CaseError

#: Folder of the results that holds ends of stages of the cases that are not finished.
STAGES = ".stages"


@dataclass(frozen=True, kw_only=True)
class CaseTask(Task):
    """One case in a folder; paths are absolute and mean the same on every worker.

    Parameters
    ----------
    case, out, running : Path
        Case folder, folder of its results, and the run's own folder beside them.
    settings, run, attempt, retries, force, job, limit
        As in `Task`; the limit in seconds [s].
    """

    case: Path
    out: Path
    running: Path

    @property
    def name(self) -> str:
        """Name of the case."""
        return self.out.name

    def starts(self) -> list[str]:
        """Hosts and processes that began the case in this run, one line each."""
        try:
            return self._starts.read_text(encoding="utf-8").splitlines()
        except OSError:
            return []

    def begin(self) -> None:
        """As `Task.begin`, where the run can be seen."""
        self._check_running()
        super().begin()

    def mark(self, line: str) -> None:
        """Write down that a worker begins the case.

        Parameters
        ----------
        line : str
            Host and process.
        """
        with self._starts.open("a", encoding="utf-8") as stream:
            stream.write(f"{line}\n")

    def survived(self) -> None:
        """Keep the marks: they go with the run."""

    def read_stage(self, name: str) -> bytes:
        """As `Task.read_stage`.

        Parameters
        ----------
        name : str
            Of a file.
        """
        return (self._stages / name).read_bytes()

    def keep_stage(self, name: str, content: bytes) -> None:
        """As `Task.keep_stage`.

        Parameters
        ----------
        name : str
            Of a file.
        content : bytes
            For a later attempt.
        """
        self._stages.mkdir(parents=True, exist_ok=True)
        new = self.running / f"{self.name}-{name}"
        new.write_bytes(content)
        new.replace(self._stages / name)

    def finished(self) -> CaseOutcome | None:
        """Find results of this run."""
        there = read_record(self.out)
        return outcome_of(there, self.out) if there is not None and there["run"] == self.run else None

    @contextmanager
    def opened(self) -> Iterator[tuple[Path, str]]:
        """Give the folder, and its digest before it is loaded: what changes from here on counts as another case."""
        yield self.case, digest(self.case)

    def commit(self, files: Mapping[str, Content]) -> None:
        """Write the results, whole or not at all.

        Parameters
        ----------
        files : mapping of str to bytes, str, dict or DataFrame
            By name.
        """
        self._check_running()  # a cluster cannot stop what it has begun when a run is interrupted
        work = None if self.out.is_symlink() else self.running  # the run clears it away, also after a killed worker
        write_results(self.out, files, self.force, work)
        shutil.rmtree(self._stages, ignore_errors=True)
        with suppress(OSError):  # of other cases
            self._stages.parent.rmdir()

    def _check_running(self) -> None:
        """Refuse to work where the run cannot be seen, or for a run that is over."""
        if not self.running.is_dir():
            raise CalibrationError(
                f"{self.running}: expected on worker {socket.gethostname()} as where the run was started, and not "
                "found; cases and results must lie on a file system that every worker sees under the same path"
            )

    @property
    def _stages(self) -> Path:
        return self.out.parent / STAGES / self.name

    @property
    def _starts(self) -> Path:
        return self.running / f"{self.name}.starts"


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


def digest(case: Path) -> str:
    """SHA-256 of the files that make up a case, by which a later run knows it again; empty when they cannot be read.

    Parameters
    ----------
    case : Path
        Case folder.
    """
    total = hashlib.sha256()
    try:
        for path in _parts(case):
            with path.open("rb") as stream:
                total.update(hashlib.file_digest(stream, "sha256").digest())
    except (CaseError, OSError):
        return ""
    return total.hexdigest()


def _parts(case: Path) -> list[Path]:
    """Files that make up a case; of a folder that describes no building all that it holds."""
    if not (case / NAME).is_file():
        return sorted(path for path in case.rglob("*") if path.is_file())
    parsed = read_building_file(case)
    return [case / name for name in (NAME, *(floor.plan for floor in parsed.floors or ()), parsed.telemetry)]
