"""Hours in which nothing is given, whatever is asked."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from mpc.identify.hours import HOURS, RunningHours, hours_of


def test_an_hour_is_closed_by_what_was_asked_in_vain_and_opened_by_what_was_given() -> None:
    hours = RunningHours.of(900.0, (), 2)
    asked, nothing = np.ones((7, 2), dtype=bool), np.zeros((7, 2), dtype=bool)
    hours.learn(np.full(7, 3), asked, nothing)
    assert not hours.closed.any()  # an hour and three quarters
    hours.learn(np.full(1, 3), asked[:1], np.array([[False, True]]))
    assert np.argwhere(hours.closed).tolist() == [[0, 3]]
    assert hours.running(np.array([2, 3])).tolist() == [[True, True], [False, True]]
    again = RunningHours.of(900.0, hours.counts, 2)
    again.learn(np.full(1, 3), asked[:1], asked[:1])
    assert hours.closed.any() and not again.closed.any()
    again.learn(np.full(99, 5), nothing[:1].repeat(99, axis=0), nothing[:1].repeat(99, axis=0))
    assert not again.closed.any() and again.counts[0][0][5] == 0.0  # nobody asked


@pytest.mark.parametrize("timezone", ["Europe/Brussels", "Etc/GMT+6"])
def test_hours_are_those_of_the_local_clock_at_the_begin_of_a_step(timezone: str) -> None:
    ends = pd.date_range("2023-03-24 12:00", "2023-03-27 12:00", freq="15min", tz=timezone)[1:]
    found = hours_of(ends.tz_convert("UTC"), 900.0, timezone)
    begins = [end - pd.Timedelta(minutes=15) for end in ends]
    assert found.tolist() == [t.hour + 24 * (t.day_of_week >= 5) for t in begins] and found.max() == HOURS - 1
