"""Progress of the page's jobs: it never falls, and says how long it will take once that can be known."""

from __future__ import annotations

import time

import pytest

pytest.importorskip("fastapi", reason="needs the extra [pages]")

from thermal.plan.page.jobs import Jobs, Progress, _Job


def test_a_share_never_falls_whatever_is_told() -> None:
    job = _Job(1, "calibrate")
    seen = []
    for done, total in ((0, 0), (1, 4), (1, 10), (0, 3), (6, 10), (0, 0), (9, 8)):
        job.tell("fitting", done, total)
        seen.append(job.done / job.total if job.total else 0.0)
    assert seen == [0.0, 0.25, 0.25, 0.25, 0.6, 0.6, 1.0]
    assert job.stage == "fitting"


def test_the_time_left_is_told_once_there_is_a_pace() -> None:
    job = _Job(1, "calibrate", state="runs", done=1, total=4)
    assert job.left(60.0) == pytest.approx(180.0)
    assert job.left(1.0) is None  # loading is no pace
    assert _Job(1, "calibrate", state="runs").left(60.0) is None
    assert _Job(1, "calibrate", state="done", done=4, total=4).left(60.0) is None


def test_a_job_that_counts_anew_goes_on_from_where_it_was() -> None:
    def work(progress: Progress) -> str:
        progress("first", 3, 4)
        progress("second", 0, 4)
        return "made"

    jobs = Jobs()
    job = jobs.start("check", work)
    while job.state in ("waiting", "runs"):
        time.sleep(0.005)
    jobs.end()
    assert (job.result, job.stage, job.done, job.total) == ("made", "second", 3, 4)
