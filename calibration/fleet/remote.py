"""Many cases at any fsspec URL: what is listed is handed out as workers need it, and results go to a URL too."""

from __future__ import annotations

import json
import re
import tempfile
import time
import uuid
from collections import Counter
from collections.abc import Iterator, Mapping
from contextlib import closing, contextmanager
from dataclasses import dataclass, field, replace
from importlib.metadata import version
from pathlib import Path, PurePosixPath
from typing import Any

from calibration.errors import CalibrationError, ResultsExistError
from calibration.fleet.case import STAGES
from calibration.fleet.data_set import TABLES, write_data_set
from calibration.fleet.handling import Handling
from calibration.fleet.job import Job, Status
from calibration.fleet.loop import outcomes_of
from calibration.fleet.outcome import RECORD, CaseOutcome, key_of, outcome_of, parse_record
from calibration.fleet.settings import Settings
from calibration.fleet.store import Store, is_url
from calibration.fleet.task import Task
from calibration.progress import Progress
from calibration.results import Content, content_bytes, to_json

#: File of the results that says what all of them were made with.
FLEET = "fleet.json"

#: Folder of the results that holds which workers began the cases that are not finished.
_BEGUN = ".begun"

#: Folder of this machine that a case is copied to, and where its name stands in an error.
_PREFIX = "buildingmpc-case-"
_COPY = re.compile(rf"[^\s'\":]*{_PREFIX}\w+[/\\]")

#: Stage of the progress.
_STAGE = "cases"


@dataclass(frozen=True, kw_only=True)
class RemoteTask(Task):
    """One case at a URL.

    Parameters
    ----------
    settings, run, attempt, retries, force, job, limit
        As in `Task`; the limit in seconds [s].
    cases, out : str
        URLs of the folder of cases and of that of the results.
    case : str
        Name of the case.
    """

    cases: str
    out: str
    case: str

    @property
    def name(self) -> str:
        """Name of the case."""
        return self.case

    def starts(self) -> list[str]:
        """Hosts and processes that began the case and did not finish it, in this run or an earlier one."""
        begun = Store(self.out).files(f"{_BEGUN}/{self.case}")
        return [PurePosixPath(name).name.rpartition(" ")[0] for name in begun]

    def mark(self, line: str) -> None:
        """Write down that a worker begins the case.

        Parameters
        ----------
        line : str
            Host and process.
        """
        Store(self.out).write(f"{_BEGUN}/{self.case}/{line} {uuid.uuid4().hex[:8]}", b"")

    def survived(self) -> None:
        """Write down that the case ended without results and without ending its worker."""
        Store(self.out).remove(f"{_BEGUN}/{self.case}")

    def read_stage(self, name: str) -> bytes:
        """As `Task.read_stage`.

        Parameters
        ----------
        name : str
            Of a file.
        """
        return Store(self.out).read(f"{STAGES}/{self.case}/{name}")

    def keep_stage(self, name: str, content: bytes) -> None:
        """As `Task.keep_stage`.

        Parameters
        ----------
        name : str
            Of a file.
        content : bytes
            For a later attempt.
        """
        Store(self.out).write(f"{STAGES}/{self.case}/{name}", content)

    def finished(self) -> CaseOutcome | None:
        """Find results of this run; or of an earlier one with the same key, which are taken over."""
        try:
            record = parse_record(Store(self.out).read(f"{self.case}/{RECORD}"))
        except FileNotFoundError:
            return None
        if record is None:
            return None
        found = outcome_of(record, PurePosixPath(self.case))
        if record["run"] == self.run:
            return found
        if self.force:
            return None
        here = {
            "files": Store(self.cases).at(self.case).digest(),
            "settings": self.job.spell(self.settings),
            "version": version("buildingmpc"),
        }
        return replace(found, resumed=True) if key_of(here) == key_of(record) else None

    def unfinished(self, status: Status, error: Exception | None = None) -> CaseOutcome:
        """Describe an end without results, in the words that any worker would find.

        Parameters
        ----------
        status : str
            One of `Status`.
        error : Exception, optional
            What went wrong.
        """
        found = super().unfinished(status, error)
        told = None if found.message is None else _COPY.sub(f"{self.cases}/", found.message)
        return replace(found, message=told)

    @contextmanager
    def opened(self) -> Iterator[tuple[Path, str]]:
        """Copy the case to this machine."""
        store = Store(self.cases).at(self.case)
        with tempfile.TemporaryDirectory(prefix=_PREFIX) as made:
            folder = Path(made) / self.case
            files = store.digest()
            store.fetch(folder)
            if not (folder / self.job.entry).is_file():
                raise CalibrationError(f"{store.url}", f"a case with {self.job.entry}", "none")
            yield folder, files

    def commit(self, files: Mapping[str, Content]) -> None:
        """Write the results, the record last: what has none is not there.

        Parameters
        ----------
        files : mapping of str to bytes, str, dict or DataFrame
            By name.
        """
        store = Store(self.out)
        for name in sorted(files, key=lambda name: name == RECORD):
            store.write(f"{self.case}/{name}", content_bytes(name, files[name]))
        store.remove(f"{_BEGUN}/{self.case}")
        store.remove(f"{STAGES}/{self.case}")


@dataclass(frozen=True)
class FleetOutcome:
    """How a run over many cases went.

    Parameters
    ----------
    counts : mapping of str to int
        Number of cases by status [-].
    resumed : int
        How many of them were done by an earlier run [-].
    troubled : tuple of CaseOutcome
        Those without results; ``lost`` are set aside until the run is forced.
    seconds : float
        Wall time [s].
    """

    counts: Mapping[str, int]
    resumed: int
    troubled: tuple[CaseOutcome, ...] = field(default=(), repr=False)
    seconds: float = 0.0

    def to_dict(self) -> dict[str, Any]:
        """Contents of ``summary.json``: counts, and the cases without results by name."""
        troubled = {o.case: {"status": o.status, "error": o.error, "message": o.message} for o in self.troubled}
        return {"counts": dict(self.counts), "resumed": self.resumed, "troubled": troubled, "seconds": self.seconds}


def do_fleet(
    job: Job,
    cases: str,
    out: str,
    settings: Settings,
    how: Handling,
    progress: Progress | None = None,
) -> FleetOutcome:
    """Do a job with every folder at a URL; what is finished is never lost, and not done again.

    Results go into a folder a case, its record last, and at the end into a data set of tables, see
    `calibration.fleet.data_set`. A case whose contents changed is done again. A case that ends its workers too often is
    set aside, also in later runs.

    Parameters
    ----------
    job : Job
        What is done.
    cases, out : str
        URLs of the folder of cases, and of that of the results, see `calibration.fleet.store.Store`.
    settings : CalibrationSettings, or mapping of str to Any
        Of the job.
    how : Handling
        By whom, how often, for how long.
    progress : callable, optional
        Called with stage, done, total after each case.

    Raises
    ------
    CalibrationError
        When there are no cases, or results would land among them.
    ResultsExistError
        When there are results with other settings or of another version, and `Handling.force` is not set.
    """
    began = time.perf_counter()
    source, target, spelled = Store(cases), Store(out), job.spell(settings)
    inside = (target.url + "/").startswith(source.url + "/") or (source.url + "/").startswith(target.url + "/")
    CalibrationError.unless(not inside, str(out), "results beside the cases, not among them", cases)
    _check_made_with(target, spelled, how.force)
    count = sum(1 for name in source.folders() if name != TABLES)
    CalibrationError.unless(count > 0, cases, "at least one folder", "none")
    run = uuid.uuid4().hex[:12]
    names = (name for name in source.folders() if name != TABLES)
    tasks = (
        RemoteTask(
            cases=source.url, out=target.url, case=name, settings=settings, run=run, attempt=0,
            retries=how.retries, force=how.force, job=job, limit=how.limit,
        )
        for name in names
    )  # fmt: skip
    if how.force:
        target.remove(_BEGUN)
    counts: Counter[str] = Counter()
    troubled: dict[str, CaseOutcome] = {}
    resumed = 0
    tell = progress or (lambda stage, done, total: None)
    try:
        tell(_STAGE, 0, count)
        with closing(outcomes_of(tasks, count, how.workers)) as coming:
            for outcome in coming:
                counts[outcome.status] += 1
                resumed += outcome.resumed
                if outcome.error is not None or outcome.status == "interrupted":
                    troubled[outcome.case] = outcome
                tell(_STAGE, counts.total(), count)
    finally:
        found = FleetOutcome(
            dict(counts), resumed, tuple(troubled[n] for n in sorted(troubled)), time.perf_counter() - began
        )
        target.write("summary.json", (to_json(found.to_dict()) + "\n").encode())
        write_data_set(target, (troubled.get(name) or CaseOutcome(name, "interrupted") for name in source.folders()))
    return found


def _check_made_with(target: Store, spelled: Mapping[str, Any], force: bool) -> None:
    """Refuse a place that holds results of other settings or another version; write down what these are made with."""
    here = {"settings": dict(spelled), "version": version("buildingmpc")}
    try:
        there = json.loads(target.read(FLEET))
    except FileNotFoundError:
        there = None
    except ValueError:
        there = {}
    if there is not None and there != here and not force:
        different = [k for k in spelled if there.get("settings", {}).get(k) != spelled[k]] or ["version"]
        raise ResultsExistError(
            f"{target.url}: holds results with another {', '.join(different)}; choose another --out, or --force "
            "(force=True) to replace them"
        )
    if there != here:
        target.write(FLEET, (to_json(here) + "\n").encode())


def as_url(place: str | Path) -> str:
    """Name a place by a URL: a path becomes ``file://``.

    Parameters
    ----------
    place : str or Path
        URL or path.
    """
    return str(place) if is_url(place) else f"file://{Path(place).absolute().as_posix()}"
