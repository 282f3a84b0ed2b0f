"""Worker processes of this machine that are replaced one by one when they die."""

from __future__ import annotations

import os
import pickle
import signal
import subprocess
import sys
from collections.abc import Callable
from concurrent.futures import BrokenExecutor, Future, ThreadPoolExecutor
from contextlib import suppress
from queue import SimpleQueue
from threading import Lock, Thread, local
from typing import Any, BinaryIO, ParamSpec, TypeVar

P = ParamSpec("P")
T = TypeVar("T")

#: Linear algebra of a worker runs on one thread: as many workers as cores, each with a thread a core, get in each
#: other's way. It must stand in the environment before NumPy is loaded.
ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")


def available_cores() -> int:
    """Count the cores that this process may use."""
    affinity = getattr(os, "sched_getaffinity", None)  # a container or a batch system may leave fewer than there are
    return len(affinity(0)) if affinity is not None else os.cpu_count() or 1


class LocalProcesses(ThreadPoolExecutor):
    """Runs calls in processes of their own, one at a time each, that stay alive from call to call.

    Each thread of the pool keeps one process. `ProcessPoolExecutor` breaks as a whole when a process dies; here the
    call that it had in hand fails alone, with the exit code, the others go on, and the next call gets a new process.
    The processes are in sessions of their own, so that Ctrl-C on a terminal reaches only the one that started them, and
    they leave when that one is gone, however it went.

    Parameters
    ----------
    workers : int
        Number of processes, started when first needed.
    """

    def __init__(self, workers: int) -> None:
        super().__init__(workers, thread_name_prefix="local_process")
        self._mine = local()
        self._lock = Lock()
        self._processes: set[_Process] = set()
        self._closed = False

    def submit(self, fn: Callable[P, T], /, *args: P.args, **kwargs: P.kwargs) -> Future[T]:
        """Run a call in one of the processes.

        Parameters
        ----------
        fn : callable
            Importable by name.
        *args, **kwargs
            What it takes; must be possible to pickle.
        """
        return super().submit(self._call, fn, args, kwargs)

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """End the processes.

        Parameters
        ----------
        wait : bool
            Finish what is submitted; otherwise the processes are killed in the middle of it.
        cancel_futures : bool
            Give up what has not begun.
        """
        super().shutdown(wait=wait, cancel_futures=cancel_futures)
        with self._lock:
            self._closed = True
            for process in self._processes:
                process.kill()
            self._processes.clear()

    def _call(self, fn: Callable[..., T], args: tuple[Any, ...], kwargs: dict[str, Any]) -> T:
        message = pickle.dumps((fn, args, kwargs))
        process: _Process | None = getattr(self._mine, "process", None)
        if process is None:
            process = self._mine.process = self._start()
        try:
            answer = process.ask(message)
        except (OSError, EOFError, pickle.UnpicklingError) as error:
            self._mine.process = None
            with self._lock:
                self._processes.discard(process)
            raise BrokenExecutor(process.end()) from error
        value, raised = pickle.loads(answer)
        if raised is not None:
            raise raised
        result: T = value
        return result

    def _start(self) -> _Process:
        with self._lock:
            if self._closed:
                raise BrokenExecutor("the executor is shut down")
            process = _Process()
            self._processes.add(process)
            return process


class _Process:
    """A process that answers pickled calls on its standard input and output."""

    def __init__(self) -> None:
        code = f"import sys; sys.path[:] = {sys.path!r}; from calibration.fleet.local import _serve; _serve()"
        self._popen = subprocess.Popen(
            [sys.executable, "-c", code],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env={**os.environ, **ONE_THREAD},
            start_new_session=True,
        )
        self._asked = Lock()

    def ask(self, message: bytes) -> bytes:
        """Send a call and wait for its answer."""
        requests, replies = self._popen.stdin, self._popen.stdout
        with self._asked:
            if requests is None or replies is None or replies.closed:
                raise EOFError
            pickle.dump(message, requests)
            requests.flush()
            answer: bytes = pickle.load(replies)
            return answer

    def kill(self) -> None:
        """End the process at once, and whoever waits for its answer."""
        self._popen.kill()
        self._popen.wait()
        with self._asked:  # a pipe is not closed under a thread that reads it: the end of the process wakes that thread
            for pipe in (self._popen.stdin, self._popen.stdout):
                if pipe is not None:
                    with suppress(OSError):  # flushing what a dead reader will not take
                        pipe.close()

    def end(self) -> str:
        """Clear away a process that stopped answering, and say how it ended."""
        try:
            code = self._popen.wait(timeout=10.0)
        except subprocess.TimeoutExpired:
            code = None
        self.kill()
        if code is None:
            return f"worker process {self._popen.pid} stopped answering"
        if code >= 0:
            return f"worker process {self._popen.pid} left with exit code {code}"
        names = {int(s): s.name for s in signal.Signals}
        hint = ", as when memory runs out" if names.get(-code) == "SIGKILL" else ""
        return f"worker process {self._popen.pid} was ended by {names.get(-code, f'signal {-code}')}{hint}"


def _serve() -> None:
    """Answer calls until the one who asks is gone: the main loop of a worker process."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    replies = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what a library prints must not get between the answers
    calls: SimpleQueue[bytes] = SimpleQueue()
    Thread(target=_listen, args=(sys.stdin.buffer, calls), daemon=True).start()
    while True:
        pickle.dump(_answer(calls.get()), replies)
        replies.flush()


def _listen(requests: BinaryIO, calls: SimpleQueue[bytes]) -> None:
    """Queue calls; leave at once when no more can come, even in the middle of one."""
    while True:
        try:
            calls.put(pickle.load(requests))
        except (EOFError, pickle.UnpicklingError):
            os._exit(1)


def _answer(message: bytes) -> bytes:
    """Pickle what a call returns and what it raises."""
    try:
        fn, args, kwargs = pickle.loads(message)
        return pickle.dumps((fn(*args, **kwargs), None))
    except BaseException as error:  # also what asks to leave: the answer must come
        try:
            pickle.loads(answer := pickle.dumps((None, error)))
            return answer
        except Exception:  # an error that cannot travel
            return pickle.dumps((None, RuntimeError(f"{type(error).__name__}: {error}")))
