"""Jobs of the labelling page: work with progress, one piece after another, that can be stopped."""

import os
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from threading import Event, Lock
from typing import Any

from thermal.errors import LabelError

Progress = Callable[[str, int, int], None]
Work = Callable[[Progress], Any]

_KEPT = 50  # jobs whose end is remembered

#: Share of a job from which on the time left is estimated [-], and how long it has run by then [s]: loading is no pace.
_TOLD_FROM, _RAN = 0.03, 3.0


class _StoppedError(LabelError):
    """A job that was stopped."""


@dataclass
class _Job:
    """A piece of work.

    Parameters
    ----------
    number : int
        To ask for it [-].
    kind : str
        What is being done.
    """

    number: int
    kind: str
    state: str = "waiting"
    stage: str = ""
    done: int = 0
    total: int = 0
    result: Any = None
    error: dict[str, str] | None = None
    started: float = field(default_factory=time.monotonic)
    stop: Event = field(default_factory=Event)

    def to_dict(self) -> dict[str, Any]:
        """Give it as plain types, for JSON."""
        keys = ("number", "kind", "state", "stage", "done", "total", "result", "error")
        seconds = time.monotonic() - self.started
        told = {"seconds": round(seconds, 1), "left": self.left(seconds)}
        return {key: getattr(self, key) for key in keys} | told

    def tell(self, stage: str, done: int, total: int) -> None:
        """Note how far it is; a share that is smaller than the one before leaves that standing.

        Parameters
        ----------
        stage : str
            What is being done.
        done, total : int
            How much of the whole [-]; a total of 0 is not known.
        """
        self.stage = stage
        if total > 0 and done * max(self.total, 1) >= self.done * total:
            self.done, self.total = min(done, total), total

    def left(self, seconds: float) -> float | None:
        """Estimate the time that it will still take, at the pace until now [s]; None while nobody can say.

        Parameters
        ----------
        seconds : float
            Since it began [s].
        """
        share = self.done / self.total if self.total else 0.0
        if self.state != "runs" or share < _TOLD_FROM or seconds < _RAN:
            return None
        return round(seconds * (1.0 - share) / share, 1)


#: Who waits for whom: what the page itself does takes seconds, and does not wait for a report, which takes minutes.
PAGE, REPORTS = "page", "reports"

#: Reports made at a time, each in a process of one thread: a calibration and a diagnosis, where there are cores.
AT_ONCE = min(2, os.cpu_count() or 1)


class Jobs:
    """The work of a page, done one piece after another; reports side by side.

    Parameters
    ----------
    at_once : int
        Reports that are made at a time [-].
    """

    def __init__(self, at_once: int = AT_ONCE) -> None:
        workers = {PAGE: 1, REPORTS: at_once}
        self._pools = {lane: ThreadPoolExecutor(n, thread_name_prefix=lane) for lane, n in workers.items()}
        self._jobs: dict[int, _Job] = {}
        self._lock = Lock()
        self._count = 0

    def start(self, kind: str, work: Work, lane: str = PAGE) -> _Job:
        """Begin a piece of work.

        Parameters
        ----------
        kind : str
            What is being done.
        work : callable
            Called with a progress callback; returns plain types.
        lane : str
            `PAGE` or `REPORTS`.

        Returns
        -------
        _Job
            To be asked for by its number.
        """
        with self._lock:
            self._count += 1
            job = self._jobs[self._count] = _Job(self._count, kind)
            for number in [n for n in self._jobs if n <= self._count - _KEPT]:
                del self._jobs[number]
        self._pools[lane].submit(self._run, job, work)
        return job

    def get(self, number: int) -> _Job | None:
        """Look a job up.

        Parameters
        ----------
        number : int
            Of the job [-].

        Returns
        -------
        _Job or None
            None when there is none of that number.
        """
        return self._jobs.get(number)

    def busy(self, kind: str) -> _Job | None:
        """Find a job of a kind that is not done.

        Parameters
        ----------
        kind : str
            What is being done.

        Returns
        -------
        _Job or None
            The first.
        """
        return next(
            (job for job in list(self._jobs.values()) if job.kind == kind and job.state in ("waiting", "runs")), None
        )

    def stop(self, job: _Job) -> None:
        """Stop a job: at once while it waits, else at its next sign of progress.

        Parameters
        ----------
        job : _Job
            To stop.
        """
        job.stop.set()
        if job.state == "waiting":
            job.state = "stopped"

    def unfinished(self) -> list[dict[str, Any]]:
        """Give the jobs that are not done, oldest first, as plain types: a page loaded anew goes on with them."""
        return [job.to_dict() for job in list(self._jobs.values()) if job.state in ("waiting", "runs")]

    def end(self) -> None:
        """Stop what is being done, at its next sign of progress."""
        for job in list(self._jobs.values()):
            job.stop.set()
        for pool in self._pools.values():
            pool.shutdown(wait=False, cancel_futures=True)

    def _run(self, job: _Job, work: Work) -> None:
        def progress(stage: str, done: int, total: int) -> None:
            if job.stop.is_set():
                raise _StoppedError("stopped")
            job.tell(stage, done, total)

        try:
            progress("", 0, 0)
            job.state, job.started = "runs", time.monotonic()
            job.result = work(progress)
            job.state = "done"
        except _StoppedError:
            job.state = "stopped"
        except Exception as error:  # whatever it is, the page says so
            job.error = {"error": type(error).__name__, "message": str(error)}
            job.state = "failed"
