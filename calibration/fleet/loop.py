"""Handing cases out to workers and taking back how they went, whatever happens to these."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Generator, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, CancelledError, Executor, Future, wait
from contextlib import suppress

from calibration.errors import WorkerLostError
from calibration.fleet.cluster import ClusterExecutor, killed_worker
from calibration.fleet.local import LocalProcesses, available_cores
from calibration.fleet.outcome import CaseOutcome
from calibration.fleet.task import Task, do_one

#: The executor is looked at this often while nothing happens [s].
TICK = 1.0

#: Cases that are handed out at a time, so that of a hundred thousand only these are in memory [-]: enough for a cluster
#: of some hundred workers, each with a second case at hand.
AHEAD = 512


def outcomes_of(
    tasks: Iterable[Task], count: int, workers: Executor | int | None
) -> Generator[CaseOutcome, None, None]:
    """Outcome of each case as it comes; whatever happens, no work is left behind.

    Parameters
    ----------
    tasks : iterable of Task
        Taken one by one as workers need them.
    count : int
        How many there are about [-].
    workers : Executor or int, optional
        As `calibration.calibrate_many` takes them.
    """
    if not count:
        return
    own = not isinstance(workers, Executor)
    pool = workers if isinstance(workers, Executor) else LocalProcesses(min(workers or available_cores(), count))
    handed = _Handed(pool, iter(tasks))
    try:
        while handed.out():
            for future in wait(handed.pending, TICK, FIRST_COMPLETED).done:
                task = handed.pending.pop(future)
                answer = _answer(future, task, isinstance(pool, ClusterExecutor))
                if isinstance(answer, Task):
                    handed.again.append(answer)
                    if answer is task and isinstance(pool, ClusterExecutor):
                        pool.look_now()
                else:
                    yield answer
        for task in handed.left():
            error = WorkerLostError(f"{handed.trouble}; the same command goes on from here")
            yield task.finished() or task.unfinished("lost", error)
    finally:
        begun = [task for future, task in handed.pending.items() if not future.cancel()]
        if own:
            pool.shutdown(wait=False, cancel_futures=True)
            for task in begun:  # it is this run that ends their workers, not they
                with suppress(OSError):
                    task.survived()


class _Handed:
    """Cases that workers have, those that are worth another worker, and those that were not handed out yet."""

    def __init__(self, pool: Executor, tasks: Iterator[Task]) -> None:
        self.pool, self.tasks = pool, tasks
        self.pending: dict[Future[CaseOutcome], Task] = {}
        self.again: deque[Task] = deque()
        self.trouble: str | None = None
        self._connection = 0

    def out(self) -> bool:
        """Hand out what fits; False when all is done, or the executor will never do the rest."""
        if isinstance(self.pool, ClusterExecutor):
            self.trouble = self.pool.trouble()
            if self.pool.connection != self._connection:  # what the lost one was to answer never comes
                self._connection = self.pool.connection
                self.again.extend(self.pending.values())
                for future in self.pending:
                    future.cancel()
                self.pending.clear()
            if self.trouble is None and not self.pool.ready:
                time.sleep(TICK / 10.0)
                return True
        while self.trouble is None and len(self.pending) < AHEAD and (task := self._next()) is not None:
            try:
                self.pending[self.pool.submit(do_one, task)] = task
            except RuntimeError as error:  # broken or shut down
                self.again.appendleft(task)
                self.trouble = f"the executor takes no more cases: {error}"
        return self.trouble is None and bool(self.pending)

    def left(self) -> Iterator[Task]:
        """Cases that were not answered."""
        yield from self.pending.values()
        yield from self.again
        yield from self.tasks

    def _next(self) -> Task | None:
        return self.again.popleft() if self.again else next(self.tasks, None)


def _answer(future: Future[CaseOutcome], task: Task, cluster: bool) -> CaseOutcome | Task:
    """Outcome of a future that is done; the next attempt when the case is worth another worker."""
    try:
        return future.result()
    except CancelledError as error:
        if cluster:  # the scheduler was lost, and that was not the case's doing
            return task
        reason: Exception = error
    except BrokenExecutor as error:
        reason = error
    except Exception as error:
        if not killed_worker(error):
            return task.unfinished("failed", error)
        reason = error
    if task.attempt < task.retries:
        return task.again()
    times = f"{task.attempt + 1} times, at last" if task.attempt else "once"
    text = str(reason) or type(reason).__name__
    return task.unfinished("lost", WorkerLostError(f"its worker was lost {times}: {text}"))
