"""``buildingmpc calibrate`` over a folder of cases: interrupted, killed, repeated, and on a cluster."""

from __future__ import annotations

import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq
import pytest
from typer.testing import CliRunner

import calibration.fleet.cluster
import calibration.fleet.run  # before a cluster is replaced: it takes the class as it is then
from calibration import calibrate
from mpc.cli.app import app
from thermal.pilot.building import PilotSettings, generate_pilot

OPTIONS = ("--horizon", "1h", "--starts", "1", "--structure", "drawn")
NAMES = [f"office {k}" for k in range(3)]

pytestmark = pytest.mark.usefixtures("blank_pictures")


def run(*arguments: str | Path) -> Any:
    """Run the command in this process."""
    return CliRunner().invoke(app, [str(a) for a in arguments])


def wait_for(what: Callable[[], Any]) -> Any:
    """Wait until something is true; return it."""
    end = time.monotonic() + 60.0
    while not (found := what()):
        assert time.monotonic() < end, "waited too long"
        time.sleep(0.02)
    return found


def processes(out: Path) -> set[int]:
    """Workers that have begun a case."""
    files = out.glob(".running/*/*.starts")
    return {int(line.rpartition(" ")[2]) for file in files for line in file.read_text(encoding="utf-8").splitlines()}


def is_alive(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    return True


@pytest.fixture(scope="module")
def cases(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Offices of one zone, and a folder that is no case."""
    folder = tmp_path_factory.mktemp("many") / "all cases"
    for seed, name in enumerate(NAMES):
        generate_pilot(folder / name, PilotSettings(days=2.0, spin_up_days=0.5, step_seconds=1800.0, floor_area=40.0, zones=1, floors=1, cell_size=1.0), seed=seed)  # fmt: skip
    (folder / "photographs").mkdir()
    return folder


@pytest.fixture
def on_threads(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """A cluster that is a thread of this process; what it was called with."""
    called: list[Any] = []

    def executor(scheduler: str, folders: list[Path]) -> ThreadPoolExecutor:
        called.append((scheduler, folders))
        return ThreadPoolExecutor(1)

    monkeypatch.setattr(calibration.fleet.cluster, "ClusterExecutor", executor)
    return called


def start(cases: Path, out: Path, workers: str) -> subprocess.Popen[str]:
    places = (str(cases), "--out", str(out))
    command = [sys.executable, "-m", "mpc.cli", "calibrate", *places, "--workers", workers, *OPTIONS]
    return subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True,
        # who runs the tests in the background has them ignore Ctrl-C, and their children would too
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )  # fmt: skip


@pytest.mark.long
@pytest.mark.skipif(os.name != "posix", reason="sends signals")
def test_a_run_that_is_killed_or_interrupted_goes_on(cases: Path, tmp_path: Path, on_threads: list[Any]) -> None:
    """Killed: no worker outlives it. Interrupted: what is finished stays. Repeated: the rest is done."""
    out = tmp_path / "results"
    with start(cases, out, "2") as command:
        killed = wait_for(lambda: processes(out))
        command.kill()
    wait_for(lambda: not any(map(is_alive, killed)))
    assert [p.name for p in out.iterdir()] == [".running"]

    with start(cases, out, "1") as command:
        workers = wait_for(lambda: processes(out))
        wait_for(lambda: list(out.glob("*/case.json")))
        workers |= processes(out)
        os.killpg(command.pid, signal.SIGINT)
        stdout, stderr = command.communicate(timeout=60.0)
    assert (command.returncode, stdout) == (130, "")
    assert f"interrupted: what is finished is in {out}" in stderr and "Traceback" not in stderr
    assert not any(map(is_alive, workers))
    kept = sorted(p.name for p in out.iterdir())
    assert kept[-2:] == ["summary.json", "tables"] and 3 <= len(kept) <= len(NAMES) + 1
    kept.remove("tables")
    summary = json.loads((out / "summary.json").read_text(encoding="utf-8"))["cases"]
    assert [name for name, entry in summary.items() if entry["status"] == "calibrated"] == kept[:-1]
    assert {entry["status"] for name, entry in summary.items() if name not in kept} == {"interrupted"}

    answer = run("calibrate", cases, "--out", out, "--scheduler", "tcp://somewhere:8786", "--json", *OPTIONS)
    assert (answer.exit_code, answer.stderr) == (0, "left out, for want of building.yaml: photographs\n")
    assert on_threads == [("tcp://somewhere:8786", [cases])]
    entries = json.loads(answer.stdout)["cases"]
    assert entries == json.loads((out / "summary.json").read_text(encoding="utf-8"))["cases"]
    assert [name for name, entry in entries.items() if entry["resumed"]] == kept[:-1]
    assert {entry["status"] for entry in entries.values()} == {"calibrated"}
    kept = ["fleet.parquet", *NAMES, "report.html", "summary.json", "tables"]
    assert sorted(p.name for p in out.iterdir()) == sorted(kept)

    answer = run("calibrate", cases, "--out", out, *OPTIONS)
    assert answer.exit_code == 0
    for text in ("Held-out error 1h ahead", "office 1", "calibrated, done before", f"Report: {out / 'report.html'}"):
        assert text in answer.stdout
    assert run("priors", out, "--out", tmp_path / "taught").exit_code == 0
    options = ("--priors", tmp_path / "taught" / "priors.json", *OPTIONS)
    answer = run("calibrate", cases / NAMES[0], "--out", tmp_path / "new", *options, "--json")
    alone = json.loads((out / NAMES[0] / "calibration.json").read_text(encoding="utf-8"))["parameters"]
    taught = json.loads(answer.stdout)["parameters"]
    assert answer.exit_code == 0 and taught.keys() and taught != alone
    times = ("--start", "2023-10-02T06:00", "--end", "2023-10-02T12:00", "--controllers", "schedule")
    answer = run("compare", cases, "--parameters", out, *times, "--scheduler", "tcp://x", "--out", tmp_path / "compared")
    assert answer.exit_code == 0, answer.output
    rows = pq.read_table(tmp_path / "compared" / "tables" / "controllers").to_pylist()
    assert [(r["case"], r["controller"]) for r in rows] == [(name, "schedule") for name in NAMES]
    answer = run("calibrate", cases, "--out", out, *OPTIONS, "--horizon", "2h")
    assert (answer.exit_code, answer.stdout) == (2, "")
    assert "error: ResultsExistError: " in answer.stderr and "horizon is '1h' there and '2h' here" in answer.stderr


def test_a_solver_that_does_not_converge_fails_the_run_and_keeps_the_results(
    cases: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, on_threads: list[Any]
) -> None:
    def stopped(*args: Any, **settings: Any) -> Any:
        result = calibrate(*args, **settings)
        return replace(result, solver=replace(result.solver, success=False, status="Maximum_Iterations_Exceeded"))

    monkeypatch.setattr("calibration.fleet.job.calibrate", stopped)
    shutil.copytree(cases / NAMES[0], tmp_path / "cases" / NAMES[0])
    answer = run("calibrate", tmp_path / "cases", "--out", tmp_path / "out", "--scheduler", "x", *OPTIONS)
    assert answer.exit_code == 1
    assert "error: office 0: ipopt did not converge: Maximum_Iterations_Exceeded" in answer.stderr
    assert "not converged" in answer.stdout
    assert (tmp_path / "out" / NAMES[0] / "report.html").is_file()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--workers", "2", "--scheduler", "tcp://127.0.0.1:9"), "CalibrationError: --workers and --scheduler"),
        (("--workers", "0"), "CalibrationError: workers: expected at least 1, found 0"),
        (("--scheduler", "nonsense://x"), "CalibrationError: scheduler 'nonsense://x': expected an answer within 10 s"),
    ],
)
def test_bad_requests(cases: Path, tmp_path: Path, options: tuple[str, ...], message: str) -> None:
    answer = run("calibrate", cases, "--out", tmp_path / "out", *options)
    assert (answer.exit_code, answer.stdout) == (2, "")
    assert f"error: {message}" in answer.stderr and "Traceback" not in answer.stderr
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("folder", ["office 0", "photographs"])
def test_workers_are_for_folders_of_cases(cases: Path, tmp_path: Path, folder: str) -> None:
    answer = run("calibrate", cases / folder, "--out", tmp_path / "out", "--workers", "2")
    assert (answer.exit_code, answer.stdout) == (2, "")
    assert "--workers and --scheduler are for a folder of cases" in answer.stderr


def test_the_missing_extra_is_named(cases: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    answer = run("calibrate", cases, "--out", tmp_path / "out", "--scheduler", "tcp://127.0.0.1:9")
    assert answer.exit_code == 2
    assert "MissingExtraError: " in answer.stderr and 'pip install "buildingmpc[cluster]"' in answer.stderr


@pytest.mark.long
def test_workers_load_the_plugins(cases: Path, tmp_path: Path) -> None:
    """An effect that only a plugin has is known in the processes of the workers."""
    text = Path(__file__).parents[2].joinpath("docs", "own_effect.md").read_text(encoding="utf-8")
    code = re.search(r"```python[^\n]*\n(.*?)```", text, re.DOTALL)
    assert code is not None
    (tmp_path / "night_machines.py").write_text(code[1], encoding="utf-8")
    shutil.copytree(cases / NAMES[0], tmp_path / "cases" / NAMES[0])
    options = ("--plugin", "night_machines.py", "calibrate", "cases", "--out", "out", "--effects", "night_machines")
    command = [sys.executable, "-m", "mpc.cli", *options, "--workers", "1", *OPTIONS]
    here = os.pathsep.join([str(Path(__file__).parents[2]), *os.environ.get("PYTHONPATH", "").split(os.pathsep)])
    answer = subprocess.run(
        command, cwd=tmp_path, env={**os.environ, "PYTHONPATH": here}, capture_output=True, text=True, timeout=120.0,
        check=False,
    )  # fmt: skip
    assert answer.returncode == 0, answer.stderr
    found = json.loads((tmp_path / "out" / NAMES[0] / "calibration.json").read_text(encoding="utf-8"))
    assert [e["effect"] for e in found["effects"]] == ["night_machines"]


def test_doctor_knows_the_extra() -> None:
    answer = run("doctor", "--json")
    assert json.loads(answer.stdout)["extras"]["cluster"]["install"] == 'pip install "buildingmpc[cluster]"'
