"""The name of a verdict at given levels, by what a search ends with."""

from dataclasses import replace

import pytest

from calibration.diagnosis.decide.levels import Levels
from calibration.diagnosis.decide.name import Summary

LEVELS = Levels(left_over=0.2, left_of_change=0.1, explained=0.4, explained_of_much=0.6, generic=8.0)

QUIET = Summary(
    accepted=False, group=0, tuning=0.0, held_out=0.0, left=0.1, change=1.0, peak=1.0, generic=0.0, generic_level=0.0
)
FOUND = replace(QUIET, accepted=True, group=1, tuning=0.5, held_out=0.3)


@pytest.mark.parametrize(
    ("told", "name"),
    [
        (QUIET, "no_gap"),
        (replace(QUIET, generic=9.0), "unexplained"),
        (replace(QUIET, generic=9.0, generic_level=10.0), "no_gap"),  # the case's own nulls show as much
        (replace(QUIET, left=0.3), "unexplained"),
        (replace(QUIET, left=0.15, peak=4.0), "unexplained"),  # in one zone
        (replace(QUIET, left=0.15, peak=4.0, change=2.0), "no_gap"),  # which is driven hard
        (FOUND, "named"),
        (replace(FOUND, group=3), "group"),
        (replace(FOUND, group=9), "unexplained"),
        (replace(FOUND, tuning=0.3), "unexplained"),
        (replace(FOUND, tuning=0.3, held_out=0.5), "named"),
        (replace(FOUND, tuning=0.5, held_out=0.9, left=0.3), "unexplained"),  # much is left, so tuning days count
        (replace(FOUND, tuning=0.7, left=0.3), "named"),
        (replace(FOUND, left=0.3, comes_back=False, found=1.0), "named"),
        (replace(QUIET, left=0.3, generic=9.0, comes_back=False, found=0.0), "no_gap"),
        (replace(QUIET, comes_back=True, found=0.0), "unexplained"),
    ],
)
def test_verdicts(told: Summary, name: str) -> None:
    assert told.name(LEVELS) == name


@pytest.mark.parametrize(
    ("more", "alone"), [({}, True), ({"left": 0.3, "peak": 4.0}, False), ({"generic": 9.0}, False), ({"accepted": True}, False)]
)
def test_errors_all_over_the_building_say_little_by_themselves(more: dict[str, float], alone: bool) -> None:
    assert replace(QUIET, **{"left": 0.5, **more}).by_size_alone(LEVELS) == alone
