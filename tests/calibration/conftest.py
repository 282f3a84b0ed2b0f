"""Small cases for runs over many, and what kills the workers of such a run."""

from __future__ import annotations

import json
import os
import shutil
import signal
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from threading import Event, Thread
from typing import Any

import pytest

from calibration import CaseOutcome
from calibration._many_record import RECORD
from thermal.pilot import generate_pilot

FILES = ["calibration.json", RECORD, "evaluation.json", "predictions.parquet", "report.html"]
PATIENCE = 60.0  # s, for what a busy machine is slow to do


def wait_for(what: Callable[[], Any]) -> Any:
    """Wait until something is true; return it."""
    end = time.monotonic() + PATIENCE
    while not (found := what()):
        assert time.monotonic() < end, "waited too long"
        time.sleep(0.02)
    return found


def begun(out: Path, case: str = "*") -> list[int]:
    """Processes that have begun a case without results, the latest last."""
    try:
        files = [p for p in out.glob(f".running/*/{case}.starts") if not (out / p.stem / RECORD).exists()]
        lines = [line for file in files for line in file.read_text(encoding="utf-8").splitlines()]
    except FileNotFoundError:  # the run ended while they were looked for, and took its folder along
        return []
    return [int(line.rpartition(" ")[2]) for line in lines]


class KillAtFirst:
    """A progress that kills a worker in the middle of a case as soon as another case is done."""

    def __init__(self, out: Path) -> None:
        self.out, self.killed = out, 0

    def __call__(self, stage: str, done: int, total: int) -> None:
        if done and not self.killed:
            self.killed = wait_for(lambda: begun(self.out))[-1]
            os.kill(self.killed, signal.SIGKILL)


class KillAlways(Thread):
    """Kills every worker that begins a case."""

    def __init__(self, out: Path, case: str) -> None:
        super().__init__(daemon=True)
        self.out, self.case, self.stop = out, case, Event()

    def run(self) -> None:
        killed: set[int] = set()
        while not self.stop.wait(0.01):
            for pid in set(begun(self.out, self.case)) - killed:
                killed.add(pid)
                with suppress(ProcessLookupError):  # the scheduler's own end of it came first
                    os.kill(pid, signal.SIGKILL)

    def __enter__(self) -> KillAlways:
        self.start()
        return self

    def __exit__(self, *error: object) -> None:
        self.stop.set()
        self.join()


def _nothing_is_lost(out: Path, outcomes: tuple[CaseOutcome, ...], killed: int) -> None:
    assert killed
    assert [o.case for o in outcomes] == ["broken", "office 0", "office 1"]
    assert [o.status for o in outcomes] == ["failed", "calibrated", "calibrated"]
    assert sorted(o.attempts for o in outcomes) == [1, 1, 2]
    assert (outcomes[0].error, outcomes[0].bad_input) == ("UnknownZoneError", True)
    assert "nearest valid one is 'F1_" in str(outcomes[0].message)
    assert sorted(p.name for p in out.iterdir()) == ["office 0", "office 1", "summary.json"]
    for o in outcomes[1:]:
        assert sorted(p.name for p in (out / o.case).iterdir()) == sorted(FILES)
        content = json.loads((out / o.case / "calibration.json").read_text(encoding="utf-8"))
        assert content["calibrated"]["held_out"]["mae"] == o.held_out_mae_after
        assert content["uncalibrated"]["held_out"]["mae"] == o.held_out_mae_before
        assert content["solver"] == o.solver
    summary = json.loads((out / "summary.json").read_text(encoding="utf-8"))
    assert summary["cases"] == {o.case: o.to_dict() for o in outcomes}
    assert summary["settings"]["horizon"] == "1h" and summary["settings"]["seed"] == 0


@pytest.fixture(scope="session")
def cases(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two offices of one zone, and one that does not load."""
    folder = tmp_path_factory.mktemp("many") / "all cases"
    for seed in range(2):
        generate_pilot(folder / f"office {seed}", seed=seed, days=2.0, spin_up_days=0.5, step_seconds=1800.0,
                       floor_area=40.0, zones=1, floors=1, cell_size=1.0)  # fmt: skip
    shutil.copytree(folder / "office 0", folder / "broken")
    text = (folder / "broken" / "building.yaml").read_text(encoding="utf-8")
    (folder / "broken" / "building.yaml").write_text(text.replace("zone: F1", "zone: G1"), encoding="utf-8")
    return folder


@pytest.fixture(scope="session")
def wait_until() -> Callable[[Callable[[], Any]], Any]:
    """Waits until something is true, and returns it."""
    return wait_for


@pytest.fixture(scope="session")
def kill_at_first() -> type[KillAtFirst]:
    """Kills a worker in the middle of a case as soon as another case is done: a progress."""
    return KillAtFirst


@pytest.fixture(scope="session")
def kill_always() -> type[KillAlways]:
    """Kills every worker that begins a case: a context."""
    return KillAlways


@pytest.fixture(scope="session")
def check_nothing_is_lost() -> Callable[[Path, tuple[CaseOutcome, ...], int], None]:
    """Compares a folder of results of `cases` with what a run returned, in which one worker was killed."""
    return _nothing_is_lost
