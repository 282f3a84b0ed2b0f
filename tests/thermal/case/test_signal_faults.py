"""Flows and discharge temperatures that stand still while those of other devices move."""

import numpy as np
import pytest

from thermal.case.signal_faults import stuck_meters

STEP, MOVING = 300.0, np.random.default_rng(1).uniform(0.1, 0.2, 1152)


def held(value: float, start: int, end: int) -> np.ndarray:
    """A meter that stands at a value for some steps."""
    values = MOVING[::-1].copy()
    values[start:end] = value
    return values


@pytest.mark.parametrize(("start", "end"), [(0, 600), (400, 688), (800, 1152)])
def test_a_meter_that_stands_for_a_day_is_stuck(start: int, end: int) -> None:
    found = stuck_meters(held(0.15, start, end), [MOVING], STEP)
    assert [(a, b) for a, b, _ in found] == [(start, end - 1)]


def test_what_control_holds_is_not_stuck() -> None:
    twice = held(0.15, 400, 720)
    twice[20] = 0.15
    for values in (
        held(0.15, 400, 687),
        held(0.0, 400, 800),
        held(0.05, 400, 800),
        held(0.5, 400, 800),
        held(0.15, 0, 1152),
        twice,
    ):
        assert stuck_meters(values, [MOVING], STEP) == []


def test_the_others_must_move() -> None:
    values, still = held(0.15, 400, 800), np.full(1152, 0.3)
    assert stuck_meters(values, [], STEP) == []
    assert stuck_meters(values, [still], STEP) == []
    assert len(stuck_meters(values, [still, MOVING], STEP)) == 1
