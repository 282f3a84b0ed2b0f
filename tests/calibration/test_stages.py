"""Stages of long work: what an earlier attempt had done is taken over, in memory and by cases of many."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import casadi as ca
import pytest

from calibration import stages
from calibration.fleet.case import STAGES, CaseTask
from calibration.fleet.job import Done, Job
from calibration.fleet.outcome import RECORD
from calibration.fleet.remote import RemoteTask
from calibration.fleet.task import Task, do_one
from calibration.stages import stage, stages_kept

DONE: list[str] = []  # names of the stages that were done
BREAKS: set[str] = set()  # those whose end is not survived


class Memory(dict[str, bytes]):
    """Keeps stages in memory."""

    def read(self, name: str) -> bytes:
        return self[name]

    def write(self, name: str, content: bytes) -> None:
        self[name] = content


def do(name: str, found: Any = None) -> Any:
    if name in BREAKS:
        raise KeyboardInterrupt(name)
    DONE.append(name)
    return name if found is None else found


def work() -> str:
    """Three stages, the second in two parts of one name."""

    def second() -> str:
        return str(stage("part", lambda: do("b")) + stage("part", lambda: do("c")))

    return str(stage("first", lambda: do("a")) + stage("second", second) + stage("third", lambda: do("d")))


@pytest.fixture(autouse=True)
def nothing_done() -> None:
    DONE.clear()
    BREAKS.clear()


def test_stages_are_just_done_where_nobody_keeps_them() -> None:
    assert work() == "abcd" and work() == "abcd"
    assert DONE == list("abcdabcd")


def test_an_attempt_goes_on_where_the_last_was_ended() -> None:
    kept = Memory()
    for ended in ("c", "d"):
        BREAKS.add(ended)
        with pytest.raises(KeyboardInterrupt, match=ended), stages_kept(kept, every=0.0):
            work()
        BREAKS.clear()
    with stages_kept(kept, every=0.0):
        assert work() == "abcd"
    assert DONE == list("abcd")
    assert list(kept) == ["1 first", "2.1 part", "2.2 part", "2 second", "3 third"]
    assert work() == "abcd" and DONE == list("abcdabcd")  # nobody keeps them any more


def test_ends_are_kept_every_so_often(monkeypatch: pytest.MonkeyPatch) -> None:
    now = iter([0.0, 30.0, 61.0, 61.0, 100.0, 110.0, 200.0, 200.0])
    monkeypatch.setattr(stages.time, "monotonic", lambda: next(now))
    kept = Memory()
    with stages_kept(kept, every=60.0):
        assert work() == "abcd"
    assert list(kept) == ["2.1 part", "3 third"]  # after 61 s and 200 s; not after 30, 100 and 110


def test_symbols_that_are_kept_together_stay_the_same() -> None:
    kept = Memory()
    x = ca.SX.sym("x")
    for _ in range(2):
        with stages_kept(kept, every=0.0):
            symbol, square = stage("symbols", lambda: do("symbols", (x, x**2)))
        assert float(ca.Function("square", [symbol], [square])(3.0)) == 9.0
    assert DONE == ["symbols"]


def plain(settings: Any) -> dict[str, Any]:
    return dict(settings or {})


def same(path: Path) -> Path:
    return path


def worked(case: Path, settings: Any) -> Done:
    return Done(work(), "calibrated")


def told(result: str, case: Path) -> dict[str, Any]:
    return {"result.json": {"result": result}}


@pytest.fixture(params=["folder", "url"])
def task(request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Task:
    """A case in a folder, and one at a URL, whose stages are all kept."""
    monkeypatch.setattr("calibration.fleet.task.EVERY", 0.0)
    (tmp_path / "cases" / "one").mkdir(parents=True)
    (tmp_path / "cases" / "one" / "x.yaml").write_text("a", encoding="utf-8")
    job = Job(plain, worked, told, same, "x.yaml")
    given: dict[str, Any] = {"settings": {}, "run": "r", "attempt": 0, "retries": 9, "force": False, "job": job}
    if request.param == "url":
        return RemoteTask(cases=f"file://{tmp_path}/cases", out=f"file://{tmp_path}/out", case="one", **given)
    (tmp_path / "out" / ".running").mkdir(parents=True)
    return CaseTask(case=tmp_path / "cases" / "one", out=tmp_path / "out" / "one", running=tmp_path / "out" / ".running", **given)


def ended(task: Task, where: str) -> None:
    """End an attempt in a stage."""
    BREAKS.add(where)
    with pytest.raises(KeyboardInterrupt):
        do_one(task)
    BREAKS.clear()


def test_a_case_of_many_goes_on_with_another_worker(task: Task, tmp_path: Path) -> None:
    ended(task, "c")
    ended(task.again(), "d")
    assert list((tmp_path / "out" / STAGES / "one").iterdir())
    assert do_one(replace(task, run="next") if isinstance(task, RemoteTask) else task).status == "calibrated"
    assert DONE == list("abcd")
    assert '"abcd"' in (tmp_path / "out" / "one" / "result.json").read_text(encoding="utf-8")
    assert (tmp_path / "out" / "one" / RECORD).is_file()
    assert not (tmp_path / "out" / STAGES / "one").exists()


def test_what_was_cut_off_is_done_again(task: Task, tmp_path: Path) -> None:
    ended(task, "d")
    for file in (tmp_path / "out" / STAGES / "one").iterdir():
        file.write_bytes(b"")
    assert do_one(task).status == "calibrated"
    assert DONE == [*"abc", *"abcd"]


@pytest.mark.parametrize("other", [{"settings": {"dx": 1.0}}, {"force": True, "run": "next"}, "contents"])
def test_stages_of_something_else_are_not_taken_over(task: Task, tmp_path: Path, other: Any) -> None:
    ended(task, "d")
    if other == "contents":
        (tmp_path / "cases" / "one" / "x.yaml").write_text("b", encoding="utf-8")
        other = {}
    assert do_one(replace(task, **other)).status == "calibrated"
    assert DONE == [*"abc", *"abcd"]


def test_a_stage_that_cannot_be_kept_costs_nothing(task: Task, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(self: Task, name: str, content: bytes) -> None:
        raise OSError("no space left on device")

    monkeypatch.setattr(type(task), "keep_stage", full)
    ended(task, "d")
    assert do_one(task).status == "calibrated"
    assert DONE == [*"abc", *"abcd"]
