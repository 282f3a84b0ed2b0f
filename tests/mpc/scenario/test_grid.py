"""Clock and calendar: days of 23 and 25 hours, steps off the full hour, kinds of days."""

from __future__ import annotations

from datetime import date

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mpc.errors import ScenarioError
from mpc.scenario.grid import Calendar, StepGrid, regular_steps
from thermal import Building
from thermal.errors import CaseError

ZONE = "America/Los_Angeles"


def grid(start: str, step: float, n_steps: int, zone: str = ZONE) -> StepGrid:
    return StepGrid(pd.Timestamp(start, tz=zone), step, n_steps)


@pytest.mark.parametrize(("day", "hours"), [("2023-03-12", 23), ("2023-07-03", 24), ("2023-11-05", 25)])
def test_a_day_has_the_hours_of_the_local_clock(building: Building, day: str, hours: int) -> None:
    after = str(pd.Timestamp(day) + pd.Timedelta(days=1))
    whole = StepGrid.between(day, after, 3600.0, building)
    assert whole.n_steps == hours
    assert whole.stamps[-1] == pd.Timestamp(after, tz=ZONE)
    assert whole.days == (date.fromisoformat(day),)


def test_stamps_end_their_steps() -> None:
    steps = grid("2023-07-03 08:00", 300.0, 3)
    assert [s.strftime("%H:%M") for s in steps.stamps] == ["08:05", "08:10", "08:15"]
    assert np.diff(steps.edges).tolist() == [300, 300, 300]
    assert steps.per_step == 1 and steps.middles[0].strftime("%H:%M:%S") == "08:02:30"


@given(step=st.sampled_from([60, 300, 420, 900, 3600]), shift=st.integers(0, 3599), count=st.integers(1, 30))
@settings(max_examples=40, deadline=None)
def test_no_piece_lies_across_five_minutes_of_the_clock(step: int, shift: int, count: int) -> None:
    steps = StepGrid(pd.Timestamp("2023-11-05", tz=ZONE) + pd.Timedelta(seconds=shift), float(step), count)
    piece = step / steps.per_step
    middle = np.asarray(steps.middles.as_unit("ns").asi8) / 1e9
    assert np.array_equal((middle - piece / 2) // 300, (middle + piece / 2 - 1e-3) // 300)
    assert len(middle) == count * steps.per_step


def test_the_mean_of_a_constant_is_the_constant() -> None:
    steps = grid("2023-07-03", 3600.0, 5)
    assert steps.mean(np.full(len(steps.middles), 0.1)).tolist() == [0.1] * 5


def test_kinds_of_days() -> None:
    calendar = Calendar([date(2023, 7, 4)])
    days = grid("2023-07-03", 86400.0, 7)
    assert calendar.kinds_on(days.middles[:: days.per_step]).tolist() == [0, 2, 0, 0, 0, 1, 2]
    assert Calendar().kind([date(2023, 7, 4)]).tolist() == [0]


def test_what_is_no_grid_is_refused(building: Building) -> None:
    with pytest.raises(ScenarioError, match="in a time zone"):
        StepGrid(pd.Timestamp("2023-07-03"), 300.0, 1)
    with pytest.raises(ScenarioError, match="whole number of seconds"):
        grid("2023-07-03", 0.5, 1)
    with pytest.raises(ScenarioError, match="whole number of steps of 420 s"):
        StepGrid.between("2023-07-03", "2023-07-04", 420.0, building)
    with pytest.raises(ScenarioError, match="whole number of steps"):
        StepGrid.between("2023-07-04", "2023-07-03", 300.0, building)
    with pytest.raises(CaseError, match="clocks of America/Los_Angeles show once"):
        StepGrid.between("2023-03-12 02:30", "2023-03-13", 300.0, building)


@pytest.mark.parametrize("odd", ["9999-12-31T23:50", "1500-01-01", "NaT"])
def test_stamps_of_years_that_no_stamp_can_lie_in(odd: str) -> None:
    stamps = pd.DatetimeIndex(np.array(["2023-01-01", odd], dtype="datetime64[us]")).tz_localize("UTC")
    with pytest.raises(ScenarioError, match="weather: row 2: expected time stamps of the years 1900 to 2199, found"):
        regular_steps(stamps, "weather", ScenarioError)
