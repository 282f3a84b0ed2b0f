"""What goes wrong in a chaos run, and the books on it: workers and schedulers are killed, and started again."""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from threading import Event, Thread

from calibration.fleet.local import ONE_THREAD

#: Looks at the log and the processes are this far apart [s].
LOOK = 0.05

#: Memory of a worker at which dask's nanny ends it.
MEMORY = "1500MB"


@dataclass(frozen=True)
class Entry:
    """A line of the log."""

    time: float
    process: int
    event: str
    what: str


def read_log(path: Path) -> list[Entry]:
    """Read what workers began and finished; a line that is not whole yet is left."""
    if not path.is_file():
        return []
    lines = path.read_text(encoding="utf-8").split("\n")[:-1]
    parts = (line.split(" ", 3) for line in lines)
    return [Entry(float(at), int(process), event, what) for at, process, event, what in parts]


@dataclass
class Cluster:
    """A dask scheduler with workers under a nanny each, started again whenever they are gone."""

    folder: Path
    workers: int
    port: int
    environment: dict[str, str]
    scheduler: subprocess.Popen[bytes] | None = None
    worker: subprocess.Popen[bytes] | None = None

    def keep(self) -> None:
        """Start what is not there."""
        if self.scheduler is None or self.scheduler.poll() is not None:
            self.scheduler = self._dask("scheduler", "--host", "127.0.0.1", "--port", str(self.port))
        if self.worker is None or self.worker.poll() is not None:
            number, local = str(self.workers), str(self.folder / "dask")
            self.worker = self._dask(
                "worker", self.address, "--nworkers", number, "--nthreads", "1", "--memory-limit", MEMORY,
                "--local-directory", local, "--death-timeout", "60",
            )  # fmt: skip

    @property
    def address(self) -> str:
        """Of the scheduler."""
        return f"tcp://127.0.0.1:{self.port}"

    def kill_scheduler(self) -> None:
        """End the scheduler at once."""
        if self.scheduler is not None:
            self.scheduler.kill()
            self.scheduler.wait()

    def stop(self) -> None:
        """End everything."""
        for process in (self.worker, self.scheduler):
            if process is not None:
                process.terminate()
                try:
                    process.wait(30.0)
                except subprocess.TimeoutExpired:
                    process.kill()
                    process.wait()

    def _dask(self, *arguments: str) -> subprocess.Popen[bytes]:
        command = [sys.executable, "-m", "dask", *arguments, "--no-dashboard", "--dashboard-address", ":0"]
        with (self.folder / "dask.log").open("ab") as stream:
            return subprocess.Popen(command, env=self.environment, stdout=stream, stderr=stream)


@dataclass(eq=False)
class Chaos(Thread):
    """Kills workers and schedulers when so many cases are done, and writes down when every worker was gone."""

    cluster: Cluster
    log: Path
    worker_kills: list[int]
    scheduler_kills: list[int]
    seed: int
    gone: dict[int, float] = field(default_factory=dict)
    killed: list[int] = field(default_factory=list)
    schedulers: int = 0
    stop: Event = field(default_factory=Event)

    def __post_init__(self) -> None:
        super().__init__(daemon=True)
        self._draw = random.Random(self.seed)

    def run(self) -> None:
        """Look, kill, start again."""
        while not self.stop.wait(LOOK):
            self.cluster.keep()
            entries = read_log(self.log)
            done = sum(e.event == "done" for e in entries)
            for process in {e.process for e in entries} - set(self.gone) - {os.getpid()}:
                if not is_alive(process):
                    self.gone[process] = time.time()
            if self.scheduler_kills and done >= self.scheduler_kills[0]:
                self.scheduler_kills.pop(0)
                self.schedulers += 1
                self.cluster.kill_scheduler()
            if self.worker_kills and done >= self.worker_kills[0]:
                self._kill_one(entries)

    def _kill_one(self, entries: list[Entry]) -> None:
        """Kill a worker in the middle of a case, at a random moment of it."""
        busy = self._busy(entries)
        if not busy:
            return
        process = self._draw.choice(sorted(busy))
        self.stop.wait(self._draw.random() * self._typical(entries))
        if process not in self._busy(read_log(self.log)):  # done in time; another moment
            return
        with suppress(ProcessLookupError):
            os.kill(process, signal.SIGKILL)
            self.gone[process] = time.time()
            self.killed.append(process)
            self.worker_kills.pop(0)

    def _busy(self, entries: list[Entry]) -> set[int]:
        last = {e.process: e.event for e in entries if e.event in ("begun", "done")}
        return {p for p, event in last.items() if event == "begun" and p not in self.gone}

    def _typical(self, entries: list[Entry]) -> float:
        spans = [span for *_, span, _ in attempts(entries, self.gone)]
        return sum(spans) / len(spans) if spans else 1.0


def attempts(entries: list[Entry], gone: dict[int, float]) -> Iterator[tuple[int, str, float, bool]]:
    """List attempts at cases in order: process, case, how long [s], and whether the results were the case's first."""
    begun: dict[int, Entry] = {}
    finished: set[str] = set()
    for e in sorted(entries, key=lambda e: e.time):
        if e.event == "begun":
            begun[e.process] = e
        elif e.event == "done" and e.process in begun:
            start = begun.pop(e.process)
            yield e.process, e.what, e.time - start.time, e.what not in finished
            finished.add(e.what)
    for process, start in begun.items():
        yield process, start.what, max(0.0, gone.get(process, start.time) - start.time), False


def is_alive(process: int) -> bool:
    """Whether a process is there."""
    try:
        state = Path(f"/proc/{process}/stat").read_text(encoding="ascii").rpartition(")")[2].split()[0]
    except OSError:
        return False
    return state != "Z"


@contextmanager
def chaos(
    cluster: Cluster, log: Path, worker_kills: list[int], scheduler_kills: list[int], seed: int
) -> Iterator[Chaos]:
    """Have it go on while a run lasts."""
    thread = Chaos(cluster, log, sorted(worker_kills), sorted(scheduler_kills), seed)
    try:
        thread.start()
        yield thread
    finally:
        thread.stop.set()
        thread.join()
        cluster.stop()


def environment(log: Path, share: float) -> dict[str, str]:
    """Environment of the workers."""
    here = os.pathsep.join(sys.path)
    return {**os.environ, **ONE_THREAD, "PYTHONPATH": here, "FAULTY_LOG": str(log), "FAULTY_SHARE": str(share)}
