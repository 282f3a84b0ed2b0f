"""Cases and results at URLs: on a server that speaks S3, in a file system whose writes fail, and their tables."""

from __future__ import annotations

import io
import json
import os
import random
import shutil
from collections.abc import Iterator
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from pathlib import Path
from typing import Any

import duckdb
import fsspec
import pyarrow.parquet as pq
import pytest
from fsspec.implementations.local import LocalFileSystem

from calibration.errors import CalibrationError, ResultsExistError
from calibration.fleet import data_set, store
from calibration.fleet.data_set import LocalFolder
from calibration.fleet.handling import Handling
from calibration.fleet.job import Done, Job, calibration_job
from calibration.fleet.priors import population_of
from calibration.fleet.remote import RemoteTask, do_fleet
from calibration.fleet.store import Store
from calibration.fleet.task import do_one
from thermal.errors import MissingExtraError

SETTINGS: dict[str, Any] = {"horizon": "1h", "starts": 1}
JOB = calibration_job()


@pytest.fixture(scope="module")
def offices(cases: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The three small cases, one of which does not load."""
    folder = tmp_path_factory.mktemp("remote") / "cases"
    folder.mkdir()
    for case in sorted(cases.iterdir()):
        if (case / "building.yaml").is_file():
            shutil.copytree(case, folder / case.name)
    return folder


@pytest.fixture(scope="module")
def bucket(offices: Path) -> Iterator[str]:
    """A bucket of a server that speaks S3, with the cases."""
    server = pytest.importorskip("moto.server").ThreadedMotoServer("127.0.0.1", 0)
    server.start()
    host, port = server.get_host_and_port()
    with pytest.MonkeyPatch.context() as patch:
        for name, value in (("ENDPOINT_URL", f"http://{host}:{port}"), ("ACCESS_KEY_ID", "x"), ("SECRET_ACCESS_KEY", "x"), ("DEFAULT_REGION", "us-east-1")):
            patch.setenv(f"AWS_{name}", value)
        try:
            there = fsspec.filesystem("s3")
            there.mkdir("fleet")
            for path in offices.glob("*/*"):
                there.pipe_file(f"fleet/cases/{path.parent.name}/{path.name}", path.read_bytes())
            yield "s3://fleet"
        finally:
            server.stop()
            fsspec.filesystem("s3").clear_instance_cache()


def parts(folder: Any) -> dict[str, bytes]:
    """Tables but for that of times."""
    return {n: folder.read(n) for n in folder.files("tables") if "/runs/" not in n}


@pytest.mark.long
def test_cases_on_s3(bucket: str, offices: Path, tmp_path: Path) -> None:
    """Done once, taken over afterwards, redone where a case changed; the tables are those of local files."""
    told: list[tuple[int, int]] = []
    with ThreadPoolExecutor(1) as pool:
        run = lambda out, **more: do_fleet(JOB, f"{bucket}/cases", out, SETTINGS, Handling(pool), **more)  # noqa: E731
        first = run(f"{bucket}/results", progress=lambda _, done, total: told.append((done, total)))
        assert (first.counts, first.resumed) == ({"failed": 1, "calibrated": 2}, 0)
        assert told == [(0, 3), (1, 3), (2, 3), (3, 3)]
        assert [(o.case, o.error, o.bad_input) for o in first.troubled] == [("broken", "CaseError", True)]
        assert str(first.troubled[0].message).startswith(f"{bucket}/cases/broken: building.yaml: ")
        there = Store(f"{bucket}/results")
        assert sorted(there.files("office 0")) == [f"office 0/{n}" for n in ("calibration.json", "case.json", "evaluation.json")]
        assert there.files(".begun") == []
        tables, stamps = parts(there), there.read("office 0/case.json")

        again = run(f"{bucket}/results")
        assert (again.resumed, there.read("office 0/case.json")) == (2, stamps)
        assert parts(there) == tables

        fsspec.filesystem("s3").pipe_file("fleet/cases/office 0/notes.txt", b"surveyed again")
        changed = run(f"{bucket}/results")
        assert (changed.resumed, there.read("office 0/case.json") == stamps) == (1, False)
        with pytest.raises(ResultsExistError, match=r"results with another horizon; choose another --out, or --force"):
            do_fleet(JOB, f"{bucket}/cases", f"{bucket}/results", SETTINGS | {"horizon": "2h"}, Handling(pool))

        here = do_fleet(JOB, f"file://{offices}", f"file://{tmp_path / 'out'}", SETTINGS, Handling(pool))
    assert here.counts == first.counts
    local = parts(LocalFolder(tmp_path / "out"))
    assert local.keys() == tables.keys()
    for name, content in local.items():  # a store's own digests make other keys, and one case changed
        one, other = (pq.read_table(io.BytesIO(c)) for c in (content, tables[name]))
        kept = [c for c in one.column_names if c not in ("key", "message")]
        assert one.select(kept) == other.select(kept)
    summary = json.loads((tmp_path / "out" / "summary.json").read_text(encoding="utf-8"))
    assert summary["counts"] == here.counts and list(summary["troubled"]) == ["broken"]


def test_duckdb_reads_the_tables(offices: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The queries of the documentation, over tables of several parts."""
    monkeypatch.setattr(data_set, "PART", 2)
    with ThreadPoolExecutor(1) as pool:
        do_fleet(JOB, f"file://{offices}", f"file://{tmp_path}/results", SETTINGS, Handling(pool))
    assert len(list((tmp_path / "results/tables/cases").iterdir())) == 2
    page = (Path(__file__).parents[3] / "docs" / "fleets.md").read_text(encoding="utf-8")
    queries = [q.split("```")[0] for q in page.split("```sql\n")[1:]]
    assert len(queries) == 2
    monkeypatch.chdir(tmp_path)
    rows = [duckdb.sql(query).fetchall() for query in queries]
    assert [row[0] for row in rows[0]] == ["office 0", "office 1"] or [row[0] for row in rows[0]] == ["office 1", "office 0"]
    assert {name for name, *_ in rows[1]} >= {"window_u_value"}
    learned = population_of(LocalFolder(tmp_path / "results"))
    assert learned.members == ("office 0", "office 1") and "window_u_value" in learned.names


class Failing(LocalFileSystem):
    """A file system of which two writes in five fail half-way."""

    protocol = "failing"
    draw = random.Random(1)
    failed = 0

    @classmethod
    def _strip_protocol(cls, path: Any) -> Any:
        return super()._strip_protocol(str(path).removeprefix("failing://"))

    def pipe_file(self, path: str, value: bytes, mode: str = "overwrite", **kwargs: Any) -> None:
        if self.draw.random() < 0.4:
            type(self).failed += 1
            super().pipe_file(path, value[: len(value) // 2], mode, **kwargs)
            raise OSError("the disk is full, for once")
        super().pipe_file(path, value, mode, **kwargs)


def test_writes_that_fail_are_tried_again_and_nothing_is_half_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    fsspec.register_implementation("failing", Failing, clobber=True)
    monkeypatch.setattr(store, "PAUSE", 0.0)
    monkeypatch.setattr(store, "TRIES", 20)
    there = Store(f"failing://{tmp_path}/a")
    for number in range(40):
        there.write(f"{number}/file.txt", b"whole")
    assert Failing.failed > 5
    assert {p.read_bytes() for p in tmp_path.rglob("*") if p.is_file()} == {b"whole"}
    assert len(there.files()) == 40 and len(list(there.folders())) == 40
    monkeypatch.setattr(store, "TRIES", 1)
    failed = 0
    for number in range(40):
        try:
            there.write(f"{number}/file.txt", b"newer")
        except OSError:
            failed += 1
    assert 0 < failed < 40
    assert {p.read_bytes() for p in tmp_path.rglob("*") if p.is_file()} == {b"whole", b"newer"}


def stall(case: Path, settings: Any) -> Done:
    """Never end, and never give the interpreter a turn that a timer of its own would need; or end the worker."""
    if case.name == "stalls":
        import time

        time.sleep(1000.0)
    if case.name == "kills":
        os.kill(os.getpid(), 9)
    return Done(None, "calibrated")


def plain(settings: Any) -> dict[str, Any]:
    return dict(settings or {})


def nothing(result: Any, case: Any) -> dict[str, Any]:
    return {}


def same(path: Path) -> Path:
    return path


@pytest.mark.long
@pytest.mark.skipif(os.name != "posix", reason="sends signals")
def test_poisoned_cases_are_set_aside_by_name(tmp_path: Path) -> None:
    """One that kills its worker, and one that never ends: each takes the workers it may, and none in a later run."""
    for name in ("fine", "kills", "stalls"):
        (tmp_path / "cases" / name).mkdir(parents=True)
        (tmp_path / "cases" / name / "x.yaml").write_text("", encoding="utf-8")
    job = Job(plain, stall, nothing, same, "x.yaml")
    urls = f"file://{tmp_path / 'cases'}", f"file://{tmp_path / 'out'}"
    found = do_fleet(job, *urls, {}, Handling(2, retries=0, limit=1.0))
    assert found.counts == {"calibrated": 1, "lost": 2}
    assert [(o.case, o.status, o.attempts) for o in found.troubled] == [("kills", "lost", 1), ("stalls", "lost", 1)]
    assert "SIGALRM" in str(found.troubled[1].message)
    with ThreadPoolExecutor(1) as pool:  # would be ended by them, this process
        again = do_fleet(job, *urls, {}, Handling(pool, retries=0))
    assert again.counts == {"calibrated": 1, "lost": 2} and again.resumed == 1
    assert "its worker died 1 times" in str(again.troubled[0].message)
    rows = pq.read_table(tmp_path / "out" / "tables" / "cases").to_pylist()
    assert [(r["case"], r["status"]) for r in rows] == [("fine", "calibrated"), ("kills", "lost"), ("stalls", "lost")]


def test_results_that_two_workers_made_are_the_same(offices: Path, tmp_path: Path) -> None:
    """As after a scheduler was lost: one case begun twice gives one outcome, whoever comes first."""
    given: dict[str, Any] = {"settings": SETTINGS, "attempt": 0, "retries": 2, "force": False, "job": JOB, "case": "office 0"}
    task = RemoteTask(cases=f"file://{offices}", out=f"file://{tmp_path}", run="run", **given)
    first = do_one(task)
    text = (tmp_path / "office 0" / "case.json").read_text(encoding="utf-8")
    assert do_one(task) == first and do_one(task.again()) == first
    assert (tmp_path / "office 0" / "case.json").read_text(encoding="utf-8") == text
    (tmp_path / "office 0" / "case.json").write_text("{", encoding="utf-8")  # no record: nothing is there
    assert task.finished() is None
    other = RemoteTask(cases=f"file://{offices}", out=f"file://{tmp_path}", run="next", **given)
    assert not do_one(other).resumed and do_one(task).resumed


class Counting(Executor):
    """Answers at once, and counts how many cases were waiting."""

    def __init__(self) -> None:
        self.most, self.open = 0, 0

    def submit(self, fn: Any, /, task: Any, **_: Any) -> Future[Any]:
        future: Future[Any] = Future()
        self.open += 1
        self.most = max(self.most, self.open)

        def close(_: Any) -> None:
            self.open -= 1

        future.add_done_callback(close)
        if self.open >= 5:
            future.set_result(task.unfinished("interrupted"))
        else:
            self.open -= 1
            future = Future()
            future.set_result(task.unfinished("interrupted"))
        return future


def test_cases_are_handed_out_as_workers_need_them(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of many cases only some are in memory at a time."""
    from calibration.fleet import loop

    monkeypatch.setattr(loop, "AHEAD", 3)
    made: list[str] = []

    def tasks() -> Iterator[RemoteTask]:
        for number in range(20):
            made.append(f"{number}")
            yield RemoteTask(cases="file:///nowhere", out=f"file://{tmp_path}", run="r", case=f"{number}", settings={}, attempt=0, retries=0, force=False, job=JOB)

    seen = 0
    for outcome in loop.outcomes_of(tasks(), 20, Counting()):
        seen += 1
        assert len(made) <= seen + 3 + 3
        assert outcome.status == "interrupted"
    assert seen == 20


def test_bad_places(offices: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(CalibrationError, match="expected a URL that fsspec knows, got: Protocol not known"):
        Store("nonsense://x")
    with pytest.raises(CalibrationError, match="results beside the cases, not among them"):
        do_fleet(JOB, f"file://{offices}", f"file://{offices}/results", SETTINGS, Handling())
    with pytest.raises(CalibrationError, match="at least one folder, found none"):
        do_fleet(JOB, f"file://{tmp_path}/none", f"file://{tmp_path}/out", SETTINGS, Handling())
    for given, message in (({"retries": -1}, "retries: expected at least 0"), ({"limit": 0.0}, "limit: expected a positive")):
        with pytest.raises(CalibrationError, match=message):
            Handling(**given)
    monkeypatch.setitem(__import__("sys").modules, "fsspec.core", None)
    with pytest.raises(MissingExtraError, match=r'needs the extra: pip install "buildingmpc\[fleet\]"'):
        Store(f"file://{tmp_path}")
