"""Reports: those that are there are listed and shown in a box; others are made when asked for, with progress."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from thermal.plan.page.desk import LabelDesk
from thermal.plan.page.serve import create_app

Progress = Callable[[str, int, int], None]


def write_report(case: Path, out: Path, progress: Progress, units: str) -> None:
    """Make a report of one sentence."""
    progress("writing", 1, 2)
    out.mkdir(parents=True, exist_ok=True)
    (out / "check.json").write_text("{}", encoding="utf-8")
    (out / "report.html").write_text(f'<p class="verdict bad">Fine &amp;\n {case.name}</p>', encoding="utf-8")


def fail(case: Path, out: Path, progress: Progress, units: str) -> None:
    """Fail as a fit without telemetry does."""
    raise ValueError("no telemetry")


def run_on(case: Path, out: Path, progress: Progress, units: str) -> None:
    """Work until stopped."""
    while True:
        progress("working", 0, 1)
        time.sleep(0.01)


@pytest.fixture
def busy_desk(tmp_path: Path) -> Any:
    """A desk that can make reports."""
    desk = LabelDesk(
        tmp_path / "case", reports=[tmp_path / "results"], makers={"check": write_report, "fail": fail, "long": run_on}
    )
    yield desk
    desk.end()


@pytest.fixture
def reader(busy_desk: LabelDesk, browser: Any) -> Any:
    """A browser of that desk."""
    return type(browser)(
        create_app(busy_desk, "t0ken"), base_url="http://127.0.0.1:8000", raise_server_exceptions=False
    )


def wait(reader: Any, number: int) -> Any:
    """Wait for a job."""
    for _ in range(500):
        job = reader.get(reader.at(f"api/jobs/{number}")).json()
        if job["state"] not in ("waiting", "runs"):
            return job
        time.sleep(0.02)
    raise AssertionError(job)


def test_a_report_is_made_and_shown_in_a_box(reader: Any, busy_desk: LabelDesk) -> None:
    assert reader.get(reader.at("api/reports")).json() == {"reports": [], "running": []}
    job = wait(reader, reader.post(reader.at("api/reports/check")).json()["number"])
    assert job["state"] == "done" and job["stage"] == "writing"
    (listed,) = reader.get(reader.at("api/reports")).json()["reports"]
    assert (listed["kind"], listed["title"], listed["verdict"]) == ("check", "", "Fine & case")
    assert job["result"] == listed
    shown = reader.get(reader.at(f"reports/{listed['key']}/report.html"))
    assert "case</p>" in shown.text
    assert shown.headers["content-security-policy"].startswith("sandbox allow-scripts")  # no access to the page


def test_reports_of_results_are_found_and_links_out_are_not(reader: Any, busy_desk: LabelDesk, tmp_path: Path) -> None:
    write_report(tmp_path, tmp_path / "results" / "first", lambda *_: None, "si")
    write_report(tmp_path, tmp_path / "secret", lambda *_: None, "si")
    (busy_desk.store.folder / "link").symlink_to(tmp_path / "secret")
    listed = reader.get(reader.at("api/reports")).json()["reports"]
    assert [report["title"] for report in listed] == ["first"]


def test_a_report_leads_to_those_below_it_and_to_nothing_else(reader: Any, tmp_path: Path) -> None:
    for name in ("demo", "demo/check", "other"):
        write_report(tmp_path, tmp_path / "results" / name, lambda *_: None, "si")
    (tmp_path / "results" / "demo" / "demo.json").write_text("{}", encoding="utf-8")
    listed = {report["title"]: report for report in reader.get(reader.at("api/reports")).json()["reports"]}
    assert listed["demo"]["kind"] == "from check to control"
    below = f"reports/{listed['demo']['key']}/"
    assert reader.get(reader.at(below + "check/report.html")).status_code == 200
    for name in ("demo.json", "%2e%2e/other/report.html", "none/report.html", "check"):
        assert reader.get(reader.at(below + name)).status_code in (400, 404)


def test_what_goes_wrong_is_said_and_what_takes_long_is_stopped(reader: Any) -> None:
    job = wait(reader, reader.post(reader.at("api/reports/fail")).json()["number"])
    assert (job["state"], job["error"]) == ("failed", {"error": "ValueError", "message": "no telemetry"})
    first, second = (reader.post(reader.at("api/reports/long")).json()["number"] for _ in range(2))
    assert first == second  # one at a time
    assert reader.get(reader.at("api/reports")).json()["running"][0]["kind"] == "long"
    reader.post(reader.at(f"api/jobs/{first}/stop"))
    assert wait(reader, first)["state"] == "stopped"
    answer = reader.post(reader.at("api/reports/chek"))
    assert answer.status_code == 404 and "'check'" in answer.json()["message"]
    assert reader.get(reader.at("api/jobs/99")).status_code == 404
