"""Small cases for runs over many, what kills the workers of such a run, and a small model with made-up telemetry."""

from __future__ import annotations

import json
import os
import shutil
import signal
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from threading import Event, Thread
from typing import Any

import numpy as np
import pandas as pd
import pytest
from numpy.typing import NDArray

from calibration import DisturbanceModel, StateSpace
from calibration.estimation.state_space import state_space
from calibration.fleet.outcome import RECORD, CaseOutcome
from thermal import Inputs
from thermal.model.matrices import Matrices
from thermal.pilot.building import PilotSettings, generate_pilot

FILES = ["calibration.json", RECORD, "evaluation.json", "predictions.parquet", "report.html"]
FloatArray = NDArray[np.float64]

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
            self.killed = wait_for(self._kill)

    def _kill(self) -> int:
        """Kill a worker that has begun a case, stopped first: it might finish between the look and the kill."""
        for pid in reversed(begun(self.out)):
            os.kill(pid, signal.SIGSTOP)
            if pid in begun(self.out):
                os.kill(pid, signal.SIGKILL)
                return pid
            os.kill(pid, signal.SIGCONT)
        return 0


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
    assert (outcomes[0].error, outcomes[0].bad_input) == ("CaseError", True)
    assert "nearest valid one is 'F1_" in str(outcomes[0].message)
    assert sorted(p.name for p in out.iterdir()) == ["office 0", "office 1", "summary.json", "tables"]
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
        generate_pilot(folder / f"office {seed}", PilotSettings(days=2.0, spin_up_days=0.5, step_seconds=1800.0, floor_area=40.0, zones=1, floors=1, cell_size=1.0), seed=seed)  # fmt: skip
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


# A small model


STEP, REFERENCE = 300.0, 293.15
DISTURBANCE = DisturbanceModel(np.array([150.0, 60.0, 100.0]), 3600.0, np.array([0.05, 0.1, 0.07]))


def _pencil(n_zone: int = 3, n: int = 9, seed: int = 0) -> Matrices:
    rng = np.random.default_rng(seed)
    links = np.triu(rng.random((n, n)), 1) * 60.0
    links += links.T
    leak = 20.0 * rng.random(n)
    observation = np.eye(n)[:n_zone]
    return Matrices(
        capacity=np.diag(np.concatenate([rng.uniform(1e5, 3e5, n_zone), rng.uniform(1e6, 2e7, n - n_zone)])),
        flow=np.hstack([np.diag(links.sum(axis=1) + leak) - links, -leak[:, None]]),
        heating=observation.T.copy(),
        observation=observation,
        uniform=np.ones(n),
        capacity_sensitivities=[],
        flow_sensitivities=[],
    )


def _telemetry(zone: FloatArray, heat: FloatArray, boundary: FloatArray, airflow: FloatArray | None = None) -> Inputs:
    frame = pd.DataFrame(zone)
    return Inputs(
        stamps=pd.date_range("2024-01-01", periods=len(zone), freq=f"{STEP:g}s", tz="UTC"),
        step=STEP,
        heat=heat,
        boundary=boundary,
        airflow=np.zeros((len(zone), 0)) if airflow is None else airflow,
        zone=zone,
        bridged=frame.ffill(limit=6).to_numpy(),
        held=frame.ffill().bfill().to_numpy(),
        complete=np.ones(len(zone), dtype=bool),
    )


def _gaps(inputs: Inputs) -> Inputs:
    zone = inputs.zone.copy()
    zone[10, 0] = zone[20:25, 1] = np.nan
    zone[30:90, 2] = zone[60:70, 0] = np.nan
    zone[120:123] = np.nan
    return replace(inputs, zone=zone)


@pytest.fixture(scope="session")
def pencil() -> Callable[..., Matrices]:
    """Random symmetric models: the first volumes are the zones' air, light; the others walls, heavy."""
    return _pencil


@pytest.fixture(scope="session")
def telemetry() -> Callable[..., Inputs]:
    """Makes inputs of zone temperatures, heat, boundaries and airflows."""
    return _telemetry


@pytest.fixture(scope="session")
def gaps() -> Callable[[Inputs], Inputs]:
    """Makes sensors come and go: short, long, all at once."""
    return _gaps


@pytest.fixture(scope="session")
def building(pencil: Callable[..., Matrices]) -> StateSpace:
    """A small model's state space."""
    return state_space(pencil().modal.modes, STEP)


@pytest.fixture(scope="session")
def simulate(building: StateSpace) -> Callable[..., tuple[Inputs, FloatArray]]:
    """Simulates a small model with a known disturbance: telemetry from row 1 on, and the disturbance of its rows [W]."""
    space = building

    def simulated(count: int, seed: int, disturbance: DisturbanceModel = DISTURBANCE) -> tuple[Inputs, FloatArray]:
        rng = np.random.default_rng(seed)
        keep, drive = disturbance.discrete(STEP)
        heat, boundary = 500.0 * rng.random((count + 1, 3)), 283.15 + 3.0 * rng.random((count + 1, 1))
        d, x = np.asarray(disturbance.deviation) * rng.standard_normal(3), np.zeros(space.order)
        zone, truth = np.full((count + 1, 3), REFERENCE), np.zeros((count + 1, 3))
        for k in range(1, count + 1):
            u = space.drives(boundary[k], heat[k] + d)
            zone[k] = space.observation @ x + space.feedthrough @ u + REFERENCE
            x, truth[k] = space.advance(x) + space.drive @ u, d
            d = keep * d + drive * rng.standard_normal(3)
        noise = np.asarray(disturbance.sensor_deviation) * rng.standard_normal(zone.shape)
        return _telemetry(zone + noise, heat, boundary), truth[1:]

    return simulated
