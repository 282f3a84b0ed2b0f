from datetime import UTC, date, datetime
from typing import Any

import pandas as pd
import pytest

from thermal.case.case import Case, local_timestamp
from thermal.case.load import load_case
from thermal.errors import CaseError


@pytest.fixture
def case(plan_draft: Any) -> Case:
    plan_draft.content["location"]["timezone"] = "America/Chicago"
    return load_case(plan_draft.write())


@pytest.mark.parametrize(
    ("time", "expected"),
    [
        ("2023-03-01T01:00", "2023-03-01T01:00:00-06:00"),
        (" 2023-03-01 01:00:30 ", "2023-03-01T01:00:30-06:00"),
        ("2023-07-01", "2023-07-01T00:00:00-05:00"),
        ("20230301T0100", "2023-03-01T01:00:00-06:00"),
        ("2023-03-01T07:00Z", "2023-03-01T01:00:00-06:00"),
        ("2023-03-01T08:00+01:00", "2023-03-01T01:00:00-06:00"),
        (datetime(2023, 3, 1, 1), "2023-03-01T01:00:00-06:00"),
        (datetime(2023, 3, 1, 7, tzinfo=UTC), "2023-03-01T01:00:00-06:00"),
        (pd.Timestamp("2023-03-01T01:00", tz="America/Chicago"), "2023-03-01T01:00:00-06:00"),
    ],
)
def test_times_are_local_to_the_building(case: Case, time: str | datetime, expected: str) -> None:
    assert local_timestamp(time, case.building).isoformat() == expected


@pytest.mark.parametrize(
    "time", ["", "now", "yesterday", "01.03.2023", "2023-02-30", "2023-03-01T25:00", "NaT", pd.NaT]
)
def test_what_is_no_time(case: Case, time: str) -> None:
    with pytest.raises(CaseError, match="time: expected ISO 8601, such as 2023-07-06T07:10, found "):
        local_timestamp(time, case.building)


@pytest.mark.parametrize("time", ["2023-03-12T02:30", "2023-11-05T01:30"])
def test_times_that_the_clock_skips_or_shows_twice(case: Case, time: str) -> None:
    with pytest.raises(CaseError, match=r"America/Chicago show once.*with its offset"):
        local_timestamp(time, case.building)
    assert local_timestamp(time + "-06:00", case.building).tzinfo is not None


def test_slice_holds_both_ends(case: Case) -> None:
    part = case.slice("2023-03-01T01:00", "2023-03-01T02:00")
    assert part.stamps[0].isoformat() == "2023-03-01T01:00:00-06:00"
    assert part.stamps[-1].isoformat() == "2023-03-01T02:00:00-06:00"
    assert len(part.stamps) == 13
    assert part.building is case.building and part.step == case.step
    pd.testing.assert_frame_equal(part.zone_heat(), case.zone_heat().loc[part.stamps], check_freq=False)


def test_slice_between_stamps_and_without_ends(case: Case) -> None:
    assert case.slice("2023-03-01T01:02", "2023-03-01T01:13").stamps[0].minute == 5
    assert len(case.slice().stamps) == len(case.stamps)
    assert case.slice(end="2023-03-01T01:00").stamps[0] == case.stamps[0]
    assert case.slice("2023-03-01T01:00").stamps[-1] == case.stamps[-1]


@pytest.mark.parametrize(
    ("start", "end"),
    [
        ("2022-01-01", "2022-02-01"),
        ("2023-03-01T02:00", "2023-03-01T01:00"),
        ("2023-03-01T01:00", "2023-03-01T01:04"),
    ],
)
def test_slice_without_stamps(case: Case, start: str, end: str) -> None:
    message = r"interval: expected an interval with stamps of the telemetry, 2023-03-01 00:05:00-06:00 to"
    with pytest.raises(CaseError, match=message):
        case.slice(start, end)


def test_slice_of_no_time(case: Case) -> None:
    with pytest.raises(CaseError):
        case.slice("soon")


def test_date_is_not_a_text(case: Case) -> None:
    assert local_timestamp(date(2023, 3, 1), case.building).isoformat() == "2023-03-01T00:00:00-06:00"  # type: ignore[arg-type]


@pytest.mark.parametrize("time", ["9999-12-31T23:50", "0001-01-01", "1677-09-20T00:00Z", datetime(2200, 1, 1)])
def test_a_year_that_no_stamp_can_lie_in(case: Case, time: str | datetime) -> None:
    with pytest.raises(CaseError, match="time: expected time stamps of the years 1900 to 2199, found"):
        local_timestamp(time, case.building)
