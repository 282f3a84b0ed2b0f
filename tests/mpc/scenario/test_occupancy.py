"""People: schedules, the closed form of random coming and going, and draws that depend on the seed alone."""

from __future__ import annotations

from datetime import date

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad

from mpc.errors import ScenarioError
from mpc.scenario.grid import Calendar, StepGrid
from mpc.scenario.occupancy import OFFICE_PRESENCE, RandomOccupancy, ScheduledOccupancy

ZONE = "America/Los_Angeles"
LAWS = ("exponential", "uniform")


def grid(start: str, step: float, n_steps: int) -> StepGrid:
    return StepGrid(pd.Timestamp(start, tz=ZONE), step, n_steps)


def test_an_office_by_the_clock() -> None:
    office = ScheduledOccupancy({"a": 10.0, "b": 4.0})
    monday = office.expected(grid("2023-07-03", 3600.0, 24), ["a", "b", "c"])
    assert monday[:, 0] == pytest.approx(10.0 * np.array(OFFICE_PRESENCE[0]))
    assert monday[12].tolist() == [5.0, 2.0, 0.0]
    assert np.array_equal(office.draw(grid("2023-07-03", 3600.0, 24), ["a", "b", "c"], 5), monday)


def test_days_of_the_week_and_holidays() -> None:
    office = ScheduledOccupancy(1.0, calendar=Calendar([date(2023, 7, 4)]))
    means = office.expected(grid("2023-07-03", 86400.0, 7), ["a"])[:, 0] * 24.0
    assert means == pytest.approx([sum(OFFICE_PRESENCE[k]) for k in (0, 2, 0, 0, 0, 1, 2)])


@pytest.mark.parametrize("day", ["2023-03-13", "2023-11-06"])
def test_work_begins_by_the_local_clock_after_a_change_of_clocks(day: str) -> None:
    before = str(pd.Timestamp(day) - pd.Timedelta(days=3))
    office = ScheduledOccupancy(1.0)
    for start in (before, day):
        assert office.expected(grid(f"{start} 07:00", 3600.0, 2), ["a"])[:, 0] == pytest.approx([0.2, 0.95])


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("step", [300.0, 2700.0, 3600.0])
def test_the_expected_number_is_the_integral_of_the_chance(law: str, step: float) -> None:
    people = RandomOccupancy(1.0, law=law)  # type: ignore[arg-type]
    found = people.expected(grid("2023-07-03", step, int(86400 // step)), ["a"])[:, 0]
    for k in range(0, len(found), max(1, len(found) // 12)):
        edges = np.array([k, k + 1]) * step / 3600.0
        corners = [hour for hour in (3.0, 12.0, 13.0, 23.0) if edges[0] < hour < edges[1]]
        exact = quad(lambda hour: float(people.chance(hour)), *edges, points=corners or None)[0]
        assert found[k] == pytest.approx(exact / (step / 3600.0), abs=1e-6)


def test_the_chance_worked_by_hand() -> None:
    people = RandomOccupancy()
    assert people.chance(7.5) == pytest.approx(1.0 - np.exp(-1.0))  # half of the window of arrivals
    assert people.chance(12.5) == pytest.approx(1.0 - np.exp(-2.0))  # who has not come by then stays away
    assert people.chance(18.0) == pytest.approx((1.0 - np.exp(-2.0)) * np.exp(-1.0))
    assert people.chance([2.0, 23.0]).tolist() == [0.0, 0.0]
    assert RandomOccupancy(law="uniform").chance([7.5, 12.5, 18.0]).tolist() == [0.5, 1.0, 0.5]


def test_the_chance_is_that_of_trials_in_every_step() -> None:
    # the paper's simulator tries each 5 minutes with the chance 2 / (steps of the window)
    steps = np.arange(108)
    tried = 1.0 - (1.0 - 2.0 / 108.0) ** steps
    assert RandomOccupancy().chance(3.0 + steps / 12.0) == pytest.approx(tried, abs=0.006)


@pytest.mark.parametrize("law", LAWS)
def test_draws_have_the_expected_mean(law: str) -> None:
    people = RandomOccupancy(400.0, law=law)  # type: ignore[arg-type]
    week = grid("2023-07-03", 3600.0, 5 * 24)
    drawn = people.draw(week, ["a"], 1).reshape(5, 24).mean(axis=0)
    expected = people.expected(week, ["a"])[:24, 0]
    share = expected / 400.0
    deviation = np.sqrt(400.0 * share * (1.0 - share) / 5.0)  # binomial, five days
    assert np.all(np.abs(drawn - expected) <= 4.0 * deviation + 1e-9)


@given(
    seed=st.integers(0, 10**6),
    first=st.integers(0, 500),
    count=st.integers(1, 200),
    step=st.sampled_from([300.0, 600.0, 900.0]),
)
@settings(max_examples=15, deadline=None)
def test_a_persons_day_does_not_depend_on_what_is_asked(seed: int, first: int, count: int, step: float) -> None:
    people = RandomOccupancy({"a": 3.0, "b": 2.0})
    whole = people.draw(grid("2023-07-03", 300.0, 3 * 288), ["a", "b"], seed)
    start = pd.Timestamp("2023-07-03", tz=ZONE) + pd.Timedelta(seconds=300 * first)
    count = max(1, min(count, int((3 * 288 - first) * 300 // step) - 1))
    part = people.draw(StepGrid(start, step, count), ["b"], seed)[:, 0]
    per = int(step // 300)
    assert part == pytest.approx(whole[first : first + count * per, 1].reshape(count, per).mean(axis=1), abs=1e-9)


def test_seeds_zones_and_days_differ() -> None:
    people, week = RandomOccupancy(5.0), grid("2023-07-03", 300.0, 2 * 288)
    drawn = people.draw(week, ["a", "b"], 1)
    assert not np.array_equal(drawn[:, 0], drawn[:, 1])
    assert not np.array_equal(drawn[:288], drawn[288:])
    assert not np.array_equal(drawn, people.draw(week, ["a", "b"], 2))
    assert np.array_equal(drawn, people.draw(week, ["a", "b"], 1))


def test_everybody_goes_home_and_nobody_comes_on_days_off() -> None:
    people = RandomOccupancy(20.0, calendar=Calendar([date(2023, 7, 4)]))
    drawn = people.draw(grid("2023-07-03", 3600.0, 7 * 24), ["a"], 3)[:, 0].reshape(7, 24)
    assert (drawn[:, [0, 1, 2, 23]] == 0.0).all() and (drawn >= 0.0).all() and drawn.max() <= 20.0
    assert (drawn[[1, 5, 6]] == 0.0).all() and (drawn[[0, 2, 3, 4], 12] > 10.0).all()


def test_clocks_that_change_while_people_come() -> None:
    calendar, start = Calendar(), pd.Timestamp("2023-03-12", tz=ZONE)
    early = RandomOccupancy(2000.0, arrival=(1.0, 4.0), departure=(5.0, 6.0), law="uniform", calendar=calendar)
    monday = early.draw(grid("2023-03-13", 3600.0, 24), ["a"], 0)[:, 0]
    assert monday[4] == 2000.0
    assert early.draw(StepGrid(start, 3600.0, 23), ["a"], 0).max() == 0.0  # a Sunday
    berlin = StepGrid(pd.Timestamp("2023-10-30", tz="Europe/Berlin"), 3600.0, 24)
    assert early.draw(berlin, ["a"], 0)[4, 0] == 2000.0


def test_what_cannot_be_is_refused() -> None:
    for build, message in (
        (lambda: ScheduledOccupancy(1.0, [[0.5] * 24] * 2), "3 rows"),
        (lambda: ScheduledOccupancy(1.0, [[1.5] * 24] * 3), "shares from 0 to 1"),
        (lambda: ScheduledOccupancy(-1.0), "0 or more"),
        (lambda: RandomOccupancy(1.5), "whole numbers of people"),
        (lambda: RandomOccupancy(arrival=(8.0, 14.0)), "rising multiples"),
        (lambda: RandomOccupancy(arrival=(8.01, 9.0)), "multiples of 5 minutes"),
        (lambda: RandomOccupancy(law="normal"), "'exponential' or 'uniform'"),  # type: ignore[arg-type]
        (lambda: RandomOccupancy().draw(grid("2023-07-03", 300.0, 1), ["a"], -1), "0 or more"),
    ):
        with pytest.raises(ScenarioError, match=message):
            build()
