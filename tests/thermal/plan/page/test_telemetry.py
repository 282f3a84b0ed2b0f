"""Telemetry on the page: read, matched, corrected, plotted, put into the case whole or not at all, and checked."""

from __future__ import annotations

import io
import json
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import yaml

from thermal.case.load import load_case
from thermal.plan.page import drawings as uploads
from thermal.plan.page import store as _store
from thermal.plan.page.desk import LabelDesk
from thermal.plan.page.draft import Draft
from thermal.plan.page.jobs import REPORTS, Jobs
from thermal.plan.page.outline import outline
from thermal.plan.page.places import find_places

Make = Callable[..., Draft]
STEPS = 288 * 3


def table(offset: str = "+01:00", **more: Any) -> pd.DataFrame:
    """Three days of two rooms under the names of an automation system; the first stamp is local midnight."""
    hours = np.arange(STEPS) / 12.0
    stamps = pd.date_range("2024-01-10", periods=STEPS, freq="5min").strftime("%Y-%m-%dT%H:%M:%S") + offset
    day = np.sin(2 * np.pi * hours / 24)
    noise = np.random.default_rng(0).normal(0.0, 0.05, (4, STEPS))
    columns = {
        "OAT [degF]": 41.0 + 9.0 * day + noise[0], "vav-A ZAT": 21.0 + day + noise[1], "VAV_B ZAT": 20.0 + day + noise[2],
        "VAV_A Airflow": 0.1 + 0.02 * day + 0.01 * np.abs(noise[3]), "Lobby lighting kWh": np.arange(STEPS) * 0.1,
    }  # fmt: skip
    return pd.DataFrame({"timestamp": stamps, **columns, **more})


def text_of(frame: pd.DataFrame) -> bytes:
    """Write a table as CSV."""
    return frame.to_csv(index=False).encode("utf-8")


def wait(browser: Any, answer: Any) -> dict[str, Any]:
    """Wait for a job that was asked for."""
    assert answer.status_code == 200, answer.text
    job = answer.json()
    for _ in range(600):
        if job["state"] not in ("waiting", "runs"):
            return job  # type: ignore[no-any-return]
        time.sleep(0.02)
        job = browser.get(browser.at(f"api/jobs/{job['number']}")).json()
    raise AssertionError(job)


def give(browser: Any, body: bytes, name: str = "export.csv", **source: Any) -> dict[str, Any]:
    """Give the page a file, and let it be read."""
    answer = browser.post(browser.at("api/telemetry/files", name=name), content=body)
    assert answer.json() == {"file": name}, answer.text
    return wait(browser, browser.post(browser.at("api/telemetry/look"), json={"file": name, **source}))


def take(browser: Any) -> dict[str, Any]:
    """Put what was read into the case."""
    return wait(browser, browser.post(browser.at("api/telemetry/take")))


@pytest.fixture
def labelled(browser: Any, draft_with: Make) -> Any:
    """A browser whose page has a valid case without telemetry."""
    draft = json.loads(draft_with().model_dump_json(by_alias=True))
    assert browser.put(browser.at("api/draft"), json=draft).json()["written"]
    return browser


def test_a_table_is_matched_plotted_taken_and_checked(labelled: Any, desk: LabelDesk) -> None:
    assert give(labelled, text_of(table()))["result"] == {"where": "export.csv", "columns": 5}
    state = labelled.get(labelled.at("api/telemetry")).json()
    rows = {row["column"]: row for row in state["table"]["columns"]}
    assert {name: (row["entity"], row["point"]) for name, row in rows.items() if not row["remark"]} == {
        "OAT [degF]": ("weather_station", "outside_air_temperature_sensor"),
        "vav-A ZAT": ("VAV_A", "zone_air_temperature_sensor"),
        "VAV_B ZAT": ("VAV_B", "zone_air_temperature_sensor"),
        "VAV_A Airflow": ("VAV_A", "supply_air_flowrate_sensor"),
    }
    assert rows["Lobby lighting kWh"]["remark"] and rows["Lobby lighting kWh"]["heat"]
    assert rows["OAT [degF]"]["unit"] == "degF" and len(rows["OAT [degF]"]["low"]) == 60
    assert {"A", "B", "VAV_A", "weather_station"} <= {*state["entities"]}
    plot = labelled.get(labelled.at("api/telemetry/plot", column="OAT [degF]", of="table")).json()
    assert max(plot["high"]) == pytest.approx(50.0, abs=0.3) and plot["start"] == "2024-01-10T00:00:00+01:00"

    job = take(labelled)
    assert job["state"] == "done", job
    found = job["result"]
    points = {point["column"]: point for point in found["points"]}
    outdoor = points["weather_station/outside_air_temperature_sensor"]
    assert outdoor["unit"] == "degC" and outdoor["highest"] == pytest.approx(10.0, abs=0.2)
    assert found["step"] == 300.0 and any("no windows" in remark for remark in found["remarks"])
    plot = labelled.get(labelled.at("api/telemetry/plot", column="VAV_A/zone_air_temperature_sensor")).json()
    assert plot["unit"] == "degC" and max(plot["high"]) == pytest.approx(22.0, abs=0.3)
    case = load_case(desk.store.folder)
    assert case.telemetry.frame["VAV_B/zone_air_temperature_sensor"].mean() == pytest.approx(293.15, abs=0.05)
    assert labelled.get(labelled.at("api/state")).json()["telemetry"] == desk.store.telemetry
    assert (desk.store.folder / "points.csv").is_file()
    taken = labelled.get(labelled.at("api/telemetry")).json()["taken"]
    assert taken["where"] == "export.csv" and taken["unmatched_heat"] == ["Lobby lighting kWh"]


def test_what_a_person_says_counts_and_is_remembered(labelled: Any, desk: LabelDesk, tmp_path: Path) -> None:
    give(labelled, text_of(table()))
    said = [
        {"column": "Lobby lighting kWh", "entity": "B", "point": "electric_power_sensor", "unit": "kWh"},
        {"column": "VAV_A Airflow"},
    ]
    known = labelled.get(labelled.at("api/telemetry")).json()["points"]
    said[0]["point"] = next(point for point in known if "power" in point)
    answer = labelled.put(labelled.at("api/telemetry/points"), json={"points": said})
    rows = {row["column"]: row for row in answer.json()["columns"]}
    assert rows["VAV_A Airflow"]["remark"] == "left out" and rows["Lobby lighting kWh"]["confidence"] == 1.0
    half = {"points": [{"column": "VAV_B ZAT", "entity": "VAV_B"}]}
    rows = labelled.put(labelled.at("api/telemetry/points"), json=half).json()["columns"]
    assert {row["column"]: row["remark"] for row in rows}["VAV_B ZAT"] == "no point type yet"
    assert give(labelled, text_of(table()))["state"] == "done"
    again = {row["column"]: row for row in labelled.get(labelled.at("api/telemetry")).json()["table"]["columns"]}
    assert again["VAV_A Airflow"]["remark"] == "left out" and again["Lobby lighting kWh"]["entity"] == "B"
    points = {point["column"] for point in take(labelled)["result"]["points"]}
    assert f"B/{said[0]['point']}" in points and "VAV_A/supply_air_flowrate_sensor" not in points
    assert not any(point.startswith("VAV_B/") for point in points)


def test_a_second_table_replaces_the_first_and_a_file_of_somebody_else_stays(labelled: Any, desk: LabelDesk) -> None:
    give(labelled, text_of(table()))
    take(labelled)
    first = desk.store.telemetry
    body = io.BytesIO()
    table().to_parquet(body)
    assert give(labelled, body.getvalue(), "export.parquet")["state"] == "done"
    assert [p.name for p in desk.telemetry.folder.iterdir() if p.name.startswith("export")] == ["export.parquet"]
    take(labelled)
    assert desk.store.telemetry != first and not (desk.store.folder / first).exists()
    own = desk.store.folder / "mine.parquet"
    (desk.store.folder / desk.store.telemetry).rename(own)
    file = desk.store.folder / "building.yaml"
    content = yaml.safe_load(file.read_text(encoding="utf-8")) | {"telemetry": "mine.parquet"}
    file.write_text(yaml.safe_dump(content), encoding="utf-8")
    take(labelled)
    assert own.is_file() and load_case(desk.store.folder).telemetry.frame.shape[1] == 4


def test_telemetry_that_cannot_be_written_leaves_the_case_as_it_was(
    labelled: Any, desk: LabelDesk, monkeypatch: pytest.MonkeyPatch
) -> None:
    give(labelled, text_of(table()))
    before = {p: p.read_bytes() for p in desk.store.folder.rglob("*") if p.is_file()}

    def full(path: Path, content: bytes) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(_store, "write_whole", full)
    job = take(labelled)
    assert (job["state"], job["error"]["error"]) == ("failed", "OSError")
    assert {p: p.read_bytes() for p in desk.store.folder.rglob("*") if p.is_file()} == before


@pytest.mark.parametrize(
    ("name", "body", "told"),
    [
        ("a.csv", b"", "expected a CSV file, found an empty file"),
        ("a.parquet", b"hello", None),
        ("a.xlsx", b"hello", None),
        ("a.png", b"hello", "expected a file that ends in"),
        ("../a.csv", b"timestamp,a\n", "expected the plain name"),
        ("points.csv", b"column,entity\n", "expected another name"),
    ],
)  # fmt: skip
def test_a_file_that_is_no_table_is_refused_by_name(
    labelled: Any, desk: LabelDesk, name: str, body: bytes, told: str | None
) -> None:
    answer = labelled.post(labelled.at("api/telemetry/files", name=name), content=body)
    if told is None:  # its first bytes do not say it: reading does
        assert answer.status_code == 200
        job = wait(labelled, labelled.post(labelled.at("api/telemetry/look"), json={"file": name}))
        assert job["error"]["error"] == "PlanError" and name in job["error"]["message"]
    else:
        assert answer.status_code == 400 and answer.json()["error"] == "PlanError" and told in answer.json()["message"]
        assert not list(desk.telemetry.folder.iterdir())


@pytest.mark.parametrize(
    ("source", "error", "told"),
    [
        ({}, "PlanError", "the name of a file on the page"),
        ({"file": "spam.csv"}, "PlanError", "the name of a file on the page"),
        ({"file": "../labelling.json"}, "PlanError", "a file in the folder"),
        ({"address": "file:///etc/passwd"}, "LabelError", "postgresql://"),
        ({"address": "mysql://me:secret@host/db"}, "LabelError", "postgresql://"),
        ({"file": "export.csv", "timezone": "Mars/Olympus"}, "PlanError", "an IANA name"),
        ({"file": "export.csv"}, "PlanError", "stamps with an offset"),
    ],
)
def test_a_source_that_cannot_be_read_says_why(labelled: Any, source: dict[str, Any], error: str, told: str) -> None:
    give(labelled, text_of(table(offset="")))
    job = wait(labelled, labelled.post(labelled.at("api/telemetry/look"), json=source))
    assert (job["state"], job["error"]["error"]) == ("failed", error) and told in job["error"]["message"]
    assert "secret" not in json.dumps(job)
    assert give(labelled, text_of(table(offset="")), timezone="Europe/Berlin")["state"] == "done"


@pytest.mark.parametrize(
    ("path", "body", "told"),
    [
        ("look", {"file": 1}, "source: file"),
        ("look", {"spam": 1}, "source: spam"),
        ("look", [], "source"),
        ("look", {"file": "a", "step": float("1e999")}, "source: step"),
        ("points", {}, "'points'"),
        ("points", [], "'points'"),
        ("points", {"points": [{"entity": "A"}]}, "points: 0.column"),
        ("points", {"points": [{"column": "spam"}]}, "a column of the table"),
        ("points", {"points": [{"column": "OAT [degF]", "entity": "Z", "point": "spam"}]}, "a device, a zone"),
        ("points", {"points": [{"column": "OAT [degF]", "entity": "A", "point": "spam"}]}, "a point type"),
    ],
)
def test_a_body_that_does_not_fit_is_refused_by_name(labelled: Any, path: str, body: Any, told: str) -> None:
    give(labelled, text_of(table()))
    method, headers = ("PUT" if path == "points" else "POST"), {"content-type": "application/json"}
    content = json.dumps(body).replace("Infinity", "1e999")
    answer = labelled.request(method, labelled.at(f"api/telemetry/{path}"), content=content, headers=headers)
    assert answer.status_code == 400 and answer.json()["error"] in ("LabelError", "PlanError")
    assert told in answer.json()["message"], answer.text


def test_what_cannot_be_taken_says_why(labelled: Any, desk: LabelDesk) -> None:
    job = take(labelled)
    assert job["error"] == {
        "error": "LabelError",
        "message": "telemetry: expected a table that was read, found none; choose a file or a database first",
    }
    give(labelled, text_of(table()))
    twice = {"points": [{"column": "VAV_B ZAT", "entity": "VAV_A", "point": "zone_air_temperature_sensor"}]}
    labelled.put(labelled.at("api/telemetry/points"), json=twice)
    job = take(labelled)
    assert job["error"]["error"] == "PlanError" and "expected one column" in job["error"]["message"]
    unit = [{"column": "VAV_B ZAT", "entity": "VAV_B", "point": "zone_air_temperature_sensor", "unit": "kWh"}]
    labelled.put(labelled.at("api/telemetry/points"), json={"points": unit})
    job = take(labelled)
    assert job["error"]["error"] == "CaseError" and "kWh" in job["error"]["message"]
    for query in ({"column": "spam", "of": "table"}, {"column": "spam"}, {"column": "OAT [degF]", "of": "moon"}):
        assert labelled.get(labelled.at("api/telemetry/plot", **query)).json()["error"] == "PlanError"
    assert labelled.get(labelled.at("api/telemetry/plot")).json()["error"] == "LabelError"
    assert not desk.store.has_telemetry


def test_a_draft_that_is_no_case_takes_no_telemetry(browser: Any) -> None:
    assert browser.post(browser.at("api/telemetry/files", name="a.csv"), content=text_of(table())).status_code == 200
    job = wait(browser, browser.post(browser.at("api/telemetry/look"), json={"file": "a.csv"}))
    assert job["error"]["error"] == "LabelError" and "a valid case" in job["error"]["message"]
    assert wait(browser, browser.post(browser.at("api/telemetry/check")))["result"] == {"points": []}


def test_another_window_changes_no_telemetry(labelled: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    give(labelled, text_of(table()))
    labelled.window = "w2"
    for answer in (
        labelled.post(labelled.at("api/telemetry/files", name="b.csv"), content=b"a"),
        labelled.post(labelled.at("api/telemetry/look"), json={"file": "export.csv"}),
        labelled.put(labelled.at("api/telemetry/points"), json={"points": []}),
        labelled.post(labelled.at("api/telemetry/take")),
    ):
        assert (answer.status_code, answer.json()["error"]) == (409, "SessionHeldError")
    labelled.window = "w1"
    monkeypatch.setattr(uploads, "MOST_BYTES", 1000)
    answer = labelled.post(labelled.at("api/telemetry/files", name="b.csv"), content=bytes(5000))
    assert (answer.status_code, answer.json()["error"]) == (413, "OversizedFileError")


def test_an_outline_keeps_every_extreme_and_every_gap() -> None:
    stamps = pd.date_range("2024-01-01", periods=10_000, freq="min", tz="UTC")
    values = pd.Series(np.zeros(10_000), index=stamps)
    values.iloc[1234], values.iloc[5000:6000] = 99.0, np.nan
    found = outline(values, 100, "Europe/Berlin")
    assert found["high"][12] == 99.0 and sum(high is None for high in found["high"]) == 10
    assert found["start"] == "2024-01-01T01:00:00+01:00"
    assert outline(values[:0], 10) == {"start": None, "end": None, "low": [], "high": []}
    assert outline(values[:1], 3)["high"] == [0.0, None, None]


def test_reports_wait_for_each_other_and_the_page_waits_for_none(browser: Any) -> None:
    jobs, begun = Jobs(at_once=1), []

    def work(name: str) -> Callable[[Any], str]:
        def run(progress: Any) -> str:
            begun.append(name)
            while name == "long":
                progress("working", 0, 1)
                time.sleep(0.005)
            return name

        return run

    long, later = (jobs.start(name, work(name), REPORTS) for name in ("long", "later"))
    page = jobs.start("page", work("page"))
    end = time.monotonic() + 10.0
    while page.state != "done" and time.monotonic() < end:
        time.sleep(0.01)
    assert begun == ["long", "page"] or begun == ["page", "long"]
    assert [job["kind"] for job in jobs.unfinished()] == ["long", "later"]
    jobs.stop(later)
    assert later.state == "stopped"
    jobs.stop(long)
    while jobs.unfinished() and time.monotonic() < end:
        time.sleep(0.01)
    assert (long.state, "later" in begun) == ("stopped", False)
    jobs.end()


def test_places_are_found_by_name_and_by_coordinates(browser: Any) -> None:
    berlin = browser.get(browser.at("api/places", name="berlin")).json()["places"][0]
    assert (berlin["name"], berlin["timezone"]) == ("Berlin, Germany", "Europe/Berlin")
    assert (berlin["latitude"], berlin["longitude"]) == pytest.approx((52.5, 13.37), abs=0.02)
    assert {place["timezone"] for place in find_places("switzerland")} == {"Europe/Zurich"}
    for text in ("37.4, -122.1", "37.4 N 122.1 W", "37.4° N; 122.1° W"):
        (place,) = find_places(text)
        assert (place["latitude"], place["longitude"]) == (37.4, -122.1)
        assert place["timezone"] == "America/Los_Angeles"
    assert find_places("Atlantis") == []
    assert len(find_places("a")) == 8
    for name in ("", "   ", "91, 0", "0, 181"):
        answer = browser.get(browser.at("api/places", name=name))
        assert (answer.status_code, answer.json()["error"]) == (400, "LabelError")
    assert browser.get(browser.at("api/places")).json()["error"] == "LabelError"
