"""A real scheduler and workers in processes of their own: workers die, lack the package, or are not there."""

from __future__ import annotations

import gc
import json
import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import distributed
import pytest

from calibration import calibrate_many
from calibration.errors import CalibrationError
from calibration.fleet.cluster import ClusterExecutor
from calibration.fleet.local import ONE_THREAD
from calibration.fleet.run import case_folders
from mpc.reports.calibration import calibration_files
from thermal.errors import MissingExtraError

SETTINGS = {"horizon": "1h", "starts": 1}
WITHOUT = "import sys; sys.modules['calibration'] = None"  # as where the package is not installed
LONG = 60.0  # s, for what a busy machine is slow to do


def dask(*arguments: str | Path, log: Path, code: str = "") -> subprocess.Popen[bytes]:
    """A process of `dask`, quiet and without a dashboard."""
    program = f"{code}\nfrom dask.__main__ import main\nmain()"
    command = [sys.executable, "-c", program, *map(str, arguments), "--no-dashboard", "--dashboard-address", ":0"]
    with log.open("ab") as stream:
        return subprocess.Popen(command, env={**os.environ, **ONE_THREAD}, stdout=stream, stderr=stream)


@pytest.fixture(scope="module")
def scheduler(
    tmp_path_factory: pytest.TempPathFactory, wait_until: Callable[[Callable[[], Any]], Any]
) -> Iterator[str]:
    """Address of a dask scheduler in a process of its own, which has no need of the package."""
    folder = tmp_path_factory.mktemp("scheduler")
    file = folder / "scheduler.json"
    options = ("--host", "127.0.0.1", "--port", "0", "--scheduler-file", file)
    process = dask("scheduler", *options, log=folder / "log", code=WITHOUT)
    try:
        wait_until(lambda: file.is_file() and file.read_text(encoding="utf-8").rstrip().endswith("}"))
        yield str(json.loads(file.read_text(encoding="utf-8"))["address"])
    finally:
        process.kill()
        process.wait()


@pytest.fixture
def start_worker(scheduler: str, tmp_path: Path) -> Iterator[Callable[..., None]]:
    """Start workers of it, each a process of its own that nothing brings back."""
    started: list[subprocess.Popen[bytes]] = []

    def start(code: str = "") -> None:
        options = ("--nthreads", "1", "--no-nanny", "--local-directory", tmp_path / "dask")
        started.append(dask("worker", scheduler, *options, log=tmp_path / "log", code=code))

    yield start
    for process in started:
        process.kill()
        process.wait()


@pytest.mark.long
def test_a_killed_worker_of_a_cluster_loses_nothing(
    cases: Path,
    tmp_path: Path,
    scheduler: str,
    start_worker: Callable[..., None],
    kill_at_first: Any,
    check_nothing_is_lost: Any,
) -> None:
    start_worker()
    start_worker()
    kill = kill_at_first(tmp_path / "out")
    with ClusterExecutor(scheduler, timeout=LONG, folders=[cases]) as executor:
        outcomes = calibrate_many(
            case_folders(cases), tmp_path / "out", SETTINGS, files=calibration_files, workers=executor, progress=kill
        )
        check_nothing_is_lost(tmp_path / "out", outcomes, kill.killed)
    with pytest.raises(CalibrationError, match=r"does not see .*nowhere; .* under the same path"):
        ClusterExecutor(scheduler, timeout=LONG, folders=[tmp_path / "nowhere"])


def test_a_cluster_that_cannot_do_it_is_refused(scheduler: str, start_worker: Callable[..., None]) -> None:
    with pytest.raises(CalibrationError, match=r"at least one worker, found none within 0\.2 s; start some"):
        ClusterExecutor(scheduler, timeout=0.2)
    start_worker(WITHOUT)
    with pytest.raises(CalibrationError, match=r"worker tcp://.*: expected buildingmpc .*, found ModuleNotFoundError"):
        ClusterExecutor(scheduler, timeout=LONG)


@pytest.mark.parametrize("address", ["tcp://127.0.0.1:9", "nonsense://x", "127.0.0.1"])
def test_no_scheduler(address: str) -> None:
    with pytest.raises(CalibrationError, match=r"expected an answer within 0\.3 s"):
        ClusterExecutor(address, timeout=0.3)
    # what is left to the garbage collector may close itself while the next client starts, and then both hang
    assert {x.status for x in gc.get_objects() if type(x) is distributed.Client} <= {"closed"}


def test_no_address() -> None:
    with pytest.raises(CalibrationError, match="expected an address such as tcp://HOST:8786, got none"):
        ClusterExecutor(" ")


def test_without_the_extra_the_error_says_how_to_add_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(MissingExtraError, match=r'needs distributed, .*: pip install "buildingmpc\[cluster\]"'):
        ClusterExecutor("tcp://127.0.0.1:8786")


def test_a_cluster_that_dies_is_given_up(
    cases: Path, tmp_path: Path, scheduler: str, start_worker: Callable[..., None], kill_always: Any
) -> None:
    start_worker()
    with ClusterExecutor(scheduler, timeout=LONG, patience=1.0) as executor, kill_always(tmp_path / "out", "*"):
        (lost,) = calibrate_many([cases / "office 0"], tmp_path / "out", SETTINGS, workers=executor)
    assert (lost.status, lost.attempts) == ("lost", 1)
    assert "had no worker for 1 s; the same command goes on from here" in str(lost.message)


def test_a_scheduler_that_hangs_is_given_up(
    scheduler: str, start_worker: Callable[..., None], wait_until: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("calibration.fleet.cluster.LOOK", 0.2)
    start_worker()
    with distributed.Client(scheduler, timeout=LONG, set_as_default=False) as client:
        process = client.run_on_scheduler(os.getpid)
    with ClusterExecutor(scheduler, timeout=LONG, patience=1.0) as executor:
        assert executor.trouble() is None
        os.kill(process, signal.SIGSTOP)
        try:
            assert str(wait_until(executor.trouble)).endswith("did not answer for 1 s")
        finally:
            os.kill(process, signal.SIGCONT)
