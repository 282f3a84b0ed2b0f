"""Workers of a `dask.distributed` cluster (extra ``[cluster]``)."""

import math
import pickle
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor, Future
from contextlib import suppress
from importlib import import_module
from importlib.metadata import version
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

from calibration.errors import CalibrationError
from thermal.errors import MissingExtraError

P = ParamSpec("P")
T = TypeVar("T")

#: How long a cluster may be without any worker before its cases are given up [s].
PATIENCE = 60.0

#: Time between looks at the workers that are there, and for an answer to each [s].
LOOK = 2.0


class ClusterExecutor(Executor):
    """Runs calls on the workers of a `dask.distributed` scheduler.

    Start the workers with one thread each, ``dask worker ADDRESS --nworkers N --nthreads 1``: calls in threads of one
    process hinder each other, and die together.

    Parameters
    ----------
    scheduler : str
        Its address, such as ``tcp://10.0.0.1:8786``.
    timeout : float
        How long to wait for it, and then for a first worker [s].
    patience : float
        How long it may be without any worker later on [s].
    folders : sequence of str or Path
        What each worker must see under the same path.

    Raises
    ------
    MissingExtraError
        When `distributed` is not installed.
    CalibrationError
        When no scheduler answers, it has no workers, or a worker has not this version of the package or does not see a
        folder.

    Examples
    --------
    >>> with ClusterExecutor("tcp://10.0.0.1:8786") as executor:  # doctest: +SKIP
    ...     outcomes = calibrate_many(case_folders("cases"), "results", executor=executor)
    """

    def __init__(
        self, scheduler: str, *, timeout: float = 10.0, patience: float = PATIENCE, folders: Sequence[str | Path] = ()
    ) -> None:
        if not scheduler.strip():  # dask would start a cluster of its own
            raise CalibrationError("scheduler: expected an address such as tcp://HOST:8786, got none")
        self._client = _connected(scheduler, timeout)
        self._address, self._patience = scheduler, patience
        self.connection = -1  # schedulers that came after the first
        self._scheduler = ""
        try:
            self._check_workers(timeout, [str(Path(folder).resolve()) for folder in folders])
        except BaseException:
            self._client.close()
            raise
        self._executor: Executor = self._client.get_executor(pure=False)
        self._seen = self._looked = time.monotonic()
        self._workers()

    def submit(self, fn: Callable[P, T], /, *args: P.args, **kwargs: P.kwargs) -> Future[T]:
        """Run a call on one of the workers.

        Parameters
        ----------
        fn : callable
            Importable by name on the workers.
        *args, **kwargs
            What it takes; must be possible to pickle.
        """
        message = pickle.dumps((fn, args, kwargs))
        future: Future[T] = self._executor.submit(_unpacking(), message)
        return future

    @property
    def ready(self) -> bool:
        """Whether calls can be submitted: not while a lost scheduler is waited for."""
        return bool(self._client.status == "running")

    def trouble(self) -> str | None:
        """Say why no more answers will come, if that is so; a scheduler that is there again is taken up again."""
        now = time.monotonic()
        if self._client.status == "closed":
            self._connect_again()
        if not self.ready:
            lost = now - self._seen > self._patience
            return f"scheduler {self._address}: the connection was lost for {self._patience:g} s" if lost else None
        if now - self._looked > LOOK or now - self._seen > self._patience:
            self._looked, workers = now, self._workers()
            if not self.ready:  # lost while it was asked
                return None
            if workers:
                self._seen = now
            elif now - self._seen > self._patience:
                what = "did not answer" if workers is None else "had no worker"
                return f"scheduler {self._address}: {what} for {self._patience:g} s"
        return None

    def look_now(self) -> None:
        """Look at the scheduler before anything else is handed out: a call was cancelled."""
        self._looked = -math.inf

    def _connect_again(self) -> None:
        """Connect to a scheduler that was started again at the same address, if there is one yet."""
        with suppress(CalibrationError):
            self._client = _connected(self._address, LOOK)
            self._executor = self._client.get_executor(pure=False)
            self.look_now()

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Close the connection; the cluster itself stays.

        Parameters
        ----------
        wait : bool
            Finish what is submitted first.
        cancel_futures : bool
            Give up what is not finished.
        """
        self._executor.shutdown(wait=wait and not cancel_futures)
        self._client.close()

    def _workers(self) -> int | None:
        """Count the workers; None when the scheduler does not answer, be it that it hangs."""
        if self._client.status != "running":
            return None
        try:
            known: Mapping[str, Any] = self._client.sync(self._client.scheduler.identity, callback_timeout=LOOK)
        except OSError:  # so are a lost connection and a timeout
            return None
        if known["id"] != self._scheduler:  # another one took its place, and knows of no call of before
            self._scheduler = known["id"]
            self.connection += 1
        return len(known["workers"])

    def _check_workers(self, timeout: float, folders: list[str]) -> None:
        try:
            self._client.wait_for_workers(1, timeout=timeout)
        except TimeoutError as error:
            raise CalibrationError(
                f"scheduler {self._address}: expected at least one worker, found none within {timeout:g} s; start some "
                f"with: dask worker {self._address} --nworkers N --nthreads 1"
            ) from error
        answers: Mapping[str, Any] = self._client.run(_probe(), folders, on_error="return")
        for worker, answer in sorted(answers.items()):
            if isinstance(answer, OSError):  # gone again: the scheduler knows by now, or soon will
                continue
            if isinstance(answer, BaseException) or answer[0] != version("buildingmpc"):
                found = f"{type(answer).__name__}: {answer}" if isinstance(answer, BaseException) else answer[0]
                raise CalibrationError(
                    f"worker {worker}: expected buildingmpc {version('buildingmpc')}, found {found}; install the same "
                    "version in the environment of every worker"
                )
            if answer[1]:
                raise CalibrationError(
                    f"worker {worker}: does not see {', '.join(answer[1])}; cases and results must lie on a file "
                    "system that every worker sees under the same path"
                )


def _connected(scheduler: str, timeout: float) -> Any:
    """Make a client of a scheduler; leave nothing behind when that fails."""
    try:
        distributed: Any = import_module("distributed")
    except ImportError as error:
        raise MissingExtraError(
            f'a scheduler needs {error.name}, which the extra brings: pip install "buildingmpc[cluster]"'
        ) from error
    client = distributed.Client.__new__(distributed.Client)
    try:
        try:
            client.__init__(scheduler, timeout=timeout, set_as_default=False)
        except BaseException:
            # A client that failed half-way would close itself when the garbage collector comes upon it; if that is
            # while the next one starts, it waits for ever for a lock of dask that the start holds.
            with suppress(AttributeError):  # there was nothing to close yet
                client.close()
            raise
    except (OSError, ValueError, TypeError) as error:
        raise CalibrationError(
            f"scheduler {scheduler!r}: expected an answer within {timeout:g} s, as from tcp://HOST:8786: {error}"
        ) from error
    return client


def _unpacking() -> Callable[[bytes], Any]:
    """Make what runs a pickled call on a worker, so that the scheduler can do without the package."""

    def run(message: bytes) -> Any:
        import pickle

        fn, args, kwargs = pickle.loads(message)
        return fn(*args, **kwargs)

    return run


def _probe() -> Callable[[list[str]], tuple[str, list[str]]]:
    """Make what asks a worker for its version, and the folders that it does not see.

    A function inside of a function travels with its code, so it also runs where the package is missing (as does the
    one above).
    """

    def ask(folders: list[str]) -> tuple[str, list[str]]:
        import importlib
        import os
        from importlib import metadata

        importlib.import_module("calibration")
        return metadata.version("buildingmpc"), [folder for folder in folders if not os.path.isdir(folder)]

    return ask


def killed_worker(error: Exception) -> bool:
    """Whether a cluster says with this error that workers died under a call.

    Parameters
    ----------
    error : Exception
        What a future raised.
    """
    distributed = sys.modules.get("distributed")
    return distributed is not None and isinstance(error, distributed.KilledWorker)
