"""Many cases at once: workers are killed, executors break, runs are repeated, and nothing that is finished is lost."""

from __future__ import annotations

import json
import os
import shutil
from concurrent.futures import BrokenExecutor, Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from dataclasses import replace
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from calibration import CalibrationSettings, Interval, calibrate, calibrate_many
from calibration.errors import CalibrationError, ResultsExistError
from calibration.fit.least_squares import INTERRUPTED
from calibration.fleet.case import CaseTask
from calibration.fleet.diagnose import diagnose_many
from calibration.fleet.job import Job, calibrated, data_files
from calibration.fleet.outcome import RECORD, CaseOutcome
from calibration.fleet.run import case_folders
from calibration.fleet.settings import check_settings
from calibration.fleet.task import do_one
from mpc.reports.calibration import calibration_files
from thermal import load_case
from thermal.errors import EffectError

SETTINGS = {"horizon": "1h", "starts": 1}
Finished = tuple[Path, tuple[CaseOutcome, ...], int]  # results, what came back, the process that was killed

JOB = Job(check_settings, calibrated, data_files)


@pytest.fixture(scope="module")
def finished(cases: Path, kill_at_first: Any) -> Finished:
    """Results over two local processes, one of which was killed in the middle of a case."""
    out = cases / "results"  # inside of the folder of cases, which is no case for that
    kill = kill_at_first(out)
    outcomes = calibrate_many(case_folders(cases), out, SETTINGS, files=calibration_files, workers=2, progress=kill)
    return out, outcomes, kill.killed


@pytest.mark.long
def test_a_killed_process_loses_nothing(finished: Finished, check_nothing_is_lost: Any) -> None:
    check_nothing_is_lost(*finished)
    with pytest.raises(ProcessLookupError):
        os.kill(finished[2], 0)


@pytest.mark.long
def test_a_worker_finds_what_calibrate_finds(cases: Path, finished: Finished) -> None:
    result = calibrate(load_case(cases / "office 1"), settings=CalibrationSettings(horizon="1h", starts=1))
    content = json.loads((finished[0] / "office 1" / "calibration.json").read_text(encoding="utf-8"))
    for p in result.parameters:
        assert content["parameters"][p.name]["value"] == pytest.approx(p.value, rel=1e-6), p.name


def test_a_second_run_takes_over_what_is_done(cases: Path, finished: Finished) -> None:
    out, before, _ = finished
    stamps = {p: p.stat().st_mtime_ns for p in out.glob("office*/*")}
    told: list[tuple[int, int]] = []
    with ThreadPoolExecutor(1) as pool:
        outcomes = calibrate_many(
            case_folders(cases),
            out,
            SETTINGS,
            workers=pool,
            progress=lambda _, done, total: told.append((done, total)),
        )
    assert told == [(2, 3), (3, 3)]  # the broken one was tried again
    assert [o.resumed for o in outcomes] == [False, True, True]
    assert [o.held_out_mae_after for o in outcomes] == [o.held_out_mae_after for o in before]
    assert {p: p.stat().st_mtime_ns for p in out.glob("office*/*")} == stamps


class Idle(Executor):
    """Refuses all work."""

    def submit(self, *_: Any, **__: Any) -> Future[Any]:
        raise BrokenExecutor("no hands left")


@pytest.fixture
def one(cases: Path, finished: Finished, tmp_path: Path) -> tuple[Path, Path]:
    """A copy of one case and of its results."""
    shutil.copytree(cases / "office 0", tmp_path / "cases" / "office 0")
    shutil.copytree(finished[0] / "office 0", tmp_path / "out" / "office 0")
    return tmp_path / "cases" / "office 0", tmp_path / "out"


def test_results_of_other_settings_are_refused(one: tuple[Path, Path], monkeypatch: pytest.MonkeyPatch) -> None:
    case, out = one
    assert calibrate_many([case], out, SETTINGS, workers=Idle())[0].resumed
    with pytest.raises(ResultsExistError, match=r"settings: horizon is '1h' there and '2h' here; .* --force"):
        calibrate_many([case], out, SETTINGS | {"horizon": "2h"}, workers=Idle())
    (case / "notes.txt").write_text("not a part of the case", encoding="utf-8")
    assert calibrate_many([case], out, SETTINGS, workers=Idle())[0].resumed
    with (case / "building.yaml").open("a", encoding="utf-8") as stream:
        stream.write("# surveyed again\n")
    with pytest.raises(ResultsExistError, match="other plans or telemetry"):
        calibrate_many([case], out, SETTINGS, workers=Idle())
    shutil.copy(out / "office 0" / RECORD, case)  # what a broken record looks like must not matter
    (out / "office 0" / RECORD).write_text('{"outcome": null}', encoding="utf-8")
    with pytest.raises(ResultsExistError, match="holds no results of such a run"):
        calibrate_many([case], out, SETTINGS, workers=Idle())
    (out / "office 0" / RECORD).unlink()
    with pytest.raises(ResultsExistError, match="found office 0"):
        calibrate_many([case], out, SETTINGS, workers=Idle())
    assert not (out / ".running").exists()


def test_results_of_another_version_are_refused(one: tuple[Path, Path], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("calibration.fleet.case.version", lambda _: "99")
    with pytest.raises(ResultsExistError, match="version .*, and this is 99"):
        calibrate_many([one[0]], one[1], SETTINGS, workers=Idle())


@pytest.mark.long
def test_force_calibrates_anew_and_keeps_what_it_did_not_make(one: tuple[Path, Path]) -> None:
    case, out = one
    (out / "office 0" / "notes.txt").write_text("mine", encoding="utf-8")
    tune = [Interval(*load_case(case).stamps[[0, 60]])]
    with ThreadPoolExecutor(1) as pool:
        done = calibrate_many(
            [case], out, {"starts": 1, "horizon": "2h", "tune": tune}, files=calibration_files, workers=pool, force=True
        )
    assert [(o.status, o.resumed) for o in done] == [("calibrated", False)]
    assert {p.name for p in (out / "office 0").iterdir()} > {"calibration.json", "report.html", RECORD, "notes.txt"}
    text = f"{tune[0].start.isoformat()}/{tune[0].end.isoformat()}"
    again = calibrate_many([case], out, {"starts": 1, "horizon": "2h", "tune": [text]}, workers=Idle())
    assert again[0].resumed


@pytest.mark.long
def test_a_case_that_ends_its_workers_is_given_up_alone(cases: Path, tmp_path: Path, kill_always: Any) -> None:
    with kill_always(tmp_path, "office 0"):
        lost, other = calibrate_many([cases / "office 0", cases / "office 1"], tmp_path, SETTINGS, workers=2, retries=1)
    assert (lost.status, lost.error, lost.attempts, lost.bad_input) == ("lost", "WorkerLostError", 2, False)
    assert "lost 2 times, at last: worker process" in str(lost.message)
    assert "SIGKILL, as when memory runs out" in str(lost.message)
    assert (other.status, other.attempts) == ("calibrated", 1)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["office 1", "summary.json", "tables"]


def test_an_executor_that_breaks_as_a_whole_is_reported(cases: Path, tmp_path: Path, kill_always: Any) -> None:
    paths = [cases / "office 0", cases / "office 1"]
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool, kill_always(tmp_path, "*"):
        outcomes = calibrate_many(paths, tmp_path, SETTINGS, workers=pool)
    assert [o.status for o in outcomes] == ["lost", "lost"]
    assert all("the executor takes no more cases" in str(o.message) for o in outcomes)


def task(cases: Path, tmp_path: Path, **changes: Any) -> CaseTask:
    running = tmp_path / ".running" / "run"
    running.mkdir(parents=True)
    given = {"attempt": 0, "retries": 2, "force": False} | changes
    return CaseTask(case=cases / "office 0", out=tmp_path / "office 0", running=running, settings=SETTINGS, run="run", job=JOB, **given)


def test_an_executor_that_tries_again_by_itself_is_stopped(cases: Path, tmp_path: Path) -> None:
    """As dask does: the case is given to worker after worker, and each dies."""
    given = task(cases, tmp_path)
    for _ in range(3):
        given.begin()
    outcome = do_one(given)
    assert (outcome.status, outcome.attempts) == ("lost", 3)
    assert "its worker died 3 times (host, process: " in str(outcome.message)


def test_a_worker_that_does_not_see_the_folder_says_so(cases: Path, tmp_path: Path) -> None:
    given = task(cases, tmp_path)
    shutil.rmtree(tmp_path / ".running")
    outcome = do_one(given)
    assert (outcome.status, outcome.error) == ("failed", "CalibrationError")
    assert "every worker sees under the same path" in str(outcome.message)


def test_results_whose_worker_died_before_it_could_answer_are_found(one: tuple[Path, Path], tmp_path: Path) -> None:
    case, out = one
    record = json.loads((out / "office 0" / RECORD).read_text(encoding="utf-8"))
    given = CaseTask(case=case, out=out / "office 0", running=out, settings=SETTINGS, run=record["run"], attempt=1, retries=2, force=True, job=JOB)
    assert do_one(given).status == "calibrated"
    assert given.starts() == []


def test_the_best_so_far_of_an_interrupted_solve_is_not_kept(
    cases: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As where Ctrl-C reaches a worker of an executor that was passed in."""

    def stopped(*args: Any, **settings: Any) -> Any:
        result = calibrate(*args, **settings)
        return replace(result, solver=replace(result.solver, success=False, status=INTERRUPTED))

    monkeypatch.setattr("calibration.fleet.job.calibrate", stopped)
    given = task(cases, tmp_path)
    assert do_one(given).status == "interrupted"
    assert not given.out.exists()


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"dz": 1.0}, "settings: calibrate takes no 'dz'; the nearest valid one is 'dx'"),
        ({"progress": print}, "calibrate takes no 'progress'"),
        ({"tune": "2023-10-02/2023-10-03"}, r"settings\.tune: expected a list of intervals"),
        ({"fixed": {"x": object()}}, r"settings\.fixed: expected plain values"),
    ],
)
def test_settings_are_checked_before_anything_is_done(cases: Path, tmp_path: Path, settings: Any, message: str) -> None:
    with pytest.raises(CalibrationError, match=message):
        calibrate_many(case_folders(cases), tmp_path / "out", settings)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.long
def test_diagnoses_go_on_and_say_what_they_found(cases: Path, tmp_path: Path) -> None:
    settings = {"horizon": "1h", "ruled_out": ["sensor_bias"], "hold_out": []}
    two = [cases / "office 0", cases / "office 1"]
    outcomes = diagnose_many(two, tmp_path / "out", settings, workers=1)
    assert [(o.status, o.resumed, o.message) for o in outcomes] == [("diagnosed", False, None)] * 2
    for o in outcomes:
        found = json.loads((tmp_path / "out" / o.case / "diagnosis.json").read_text(encoding="utf-8"))
        assert (o.verdict, o.held_out_mae_before) == (found["verdict"], found["gap"]["mae"])
        assert list(o.effects) == (found["how_far"][-1]["effects"] if found["how_far"] else [])
    again = diagnose_many(two, tmp_path / "out", settings, workers=1)
    assert [replace(o, resumed=False) for o in again] == list(outcomes) and all(o.resumed for o in again)
    with pytest.raises(ResultsExistError, match="other settings: ruled_out"):
        diagnose_many(two, tmp_path / "out", {**settings, "ruled_out": []}, workers=1)
    for wrong, message in (({"dxx": 1.0}, "diagnose takes no 'dxx'"), ({"known": ["sun"]}, "it may be solar_gain")):
        with pytest.raises((CalibrationError, EffectError), match=message):
            diagnose_many(two, tmp_path / "other", wrong, workers=1)
    with pytest.raises(ResultsExistError):  # results of a calibration are something else
        calibrate_many(two, tmp_path / "out", SETTINGS, workers=1)


def test_settings_are_spelled_with_their_defaults() -> None:
    spelled = check_settings({"fixed": {"a": np.float64(1.5)}, "scopes": {"b": "zone"}})
    assert (spelled["fixed"], spelled["scopes"], spelled["horizon"]) == ({"a": 1.5}, {"b": "zone"}, "6h")
    assert spelled == check_settings(spelled) == json.loads(json.dumps(spelled))


def test_cases_that_cannot_go_together_are_refused(cases: Path, tmp_path: Path) -> None:
    def refused(message: str, paths: list[Path], out: Path = tmp_path / "out", **options: Any) -> None:
        with pytest.raises(CalibrationError, match=message):
            calibrate_many(paths, out, **{"workers": Idle(), **options})
        assert not (tmp_path / "out").exists()

    office = cases / "office 0"
    with pytest.raises(CalibrationError, match="at least one case folder, found none"):
        calibrate_many(case_folders(tmp_path), tmp_path / "out")
    refused("expected each name once", [office, office])
    refused("expected each name once", [office, tmp_path / "office 0"])
    refused("names results can take, got '.hidden'", [tmp_path / ".hidden"])
    refused("names results can take, got 'summary.json'", [tmp_path / "summary.json"])
    refused("would land in the case", [office], cases)
    refused("would land in the case", [office], office / "results")
    refused("found a file", [office], office / "building.yaml")
    refused("can be written to", [office], office / "building.yaml" / "out")
    refused("retries: expected at least 0, found -1", [office], retries=-1)
    refused("workers: expected at least 1, found 0", [office], workers=0)


def test_a_folder_of_something_else_is_refused(cases: Path, tmp_path: Path) -> None:
    (tmp_path / "thesis.tex").write_text("", encoding="utf-8")
    (tmp_path / ".hidden").mkdir()
    with pytest.raises(ResultsExistError, match=r"found thesis\.tex; .* --force"):
        calibrate_many([cases / "office 0"], tmp_path, workers=Idle())
    assert calibrate_many([cases / "office 0"], tmp_path, workers=Idle(), force=True)[0].status == "lost"
    assert sorted(p.name for p in tmp_path.iterdir()) == [".hidden", "summary.json", "tables", "thesis.tex"]


def test_two_runs_do_not_write_to_one_folder(cases: Path, tmp_path: Path) -> None:
    class Again(Executor):
        def submit(self, *_: Any, **__: Any) -> Future[Any]:
            calibrate_many([cases / "office 0"], tmp_path, workers=Idle())
            raise AssertionError

    with pytest.raises(CalibrationError, match="another run"):
        calibrate_many([cases / "office 0"], tmp_path, workers=Again())
    left = tmp_path / ".running" / "killed"
    left.mkdir(parents=True)  # as a run leaves behind that was killed: its lock went with it
    assert calibrate_many([cases / "office 0"], tmp_path, workers=Idle())[0].status == "lost"
    assert sorted(p.name for p in tmp_path.iterdir()) == ["summary.json", "tables"]


def test_hidden_folders_are_no_cases(cases: Path) -> None:
    (cases / ".old").mkdir()
    shutil.copy(cases / "broken" / "building.yaml", cases / ".old")
    assert [p.name for p in case_folders(cases)] == ["broken", "office 0", "office 1"]
    shutil.rmtree(cases / ".old")
