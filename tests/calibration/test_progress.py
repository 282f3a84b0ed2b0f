"""Progress moves forward, whatever is done inside, and counts starts and iterations."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import pytest

from calibration import calibrate
from calibration.diagnosis.diagnosis import diagnose
from calibration.progress import USUAL_ITERATIONS, WHOLE, Forward, count_iterations
from thermal import Case, load_case
from thermal.effects.catalogue import CATALOGUE

Told = list[tuple[str, int, int]]


@pytest.fixture
def case(bundled_case_in: Callable[[str], Path]) -> Case:
    return load_case(bundled_case_in("30min"))


def shares(told: Told) -> list[float]:
    assert told and all(total > 0 for _, _, total in told)
    return [done / total for _, done, total in told]


def assert_forward(told: Told) -> None:
    steps = shares(told)
    assert all(after >= before for before, after in pairwise(steps)) and 0.0 <= steps[0] <= steps[-1] <= 1.0


def test_parts_take_shares_of_what_is_left() -> None:
    told: Told = []
    whole = Forward(lambda *one: told.append(one))
    first = whole.part(0.5, "first")
    first("step 1", 1, 4)
    first("again", 0, 4)  # a part that starts over does not take the whole back
    whole.part(0.5)("second", 1, 2)  # the first is over, though it was a quarter done
    inner = Forward(whole.part(1.0, "third"))
    inner.part(0.9)("", 1, 1)
    whole.say("the end")
    assert [round(s, 3) for s in shares(told)] == [0.125, 0.125, 0.625, 0.975, 1.0]
    assert [stage for stage, *_ in told] == ["first, step 1", "first, again", "second", "third", "the end"]


def test_iterations_never_end_and_never_go_back() -> None:
    told: Told = []
    one = count_iterations(lambda *a: told.append(a))
    for _ in range(50):
        one()
    assert_forward(told)
    assert told[USUAL_ITERATIONS - 1][1] / told[USUAL_ITERATIONS - 1][2] == 0.5 and shares(told)[-1] < 1.0
    count_iterations(None)()


def test_a_calibration_counts_starts_and_iterations_forward(case: Case) -> None:
    told: Told = []
    calibrate(case, settings={"dx": 2.0, "starts": 2}, progress=lambda *one: told.append(one))
    assert_forward(told)
    stages = [stage for stage, *_ in told]
    assert any(s.startswith("start 1 of 2, iteration 3") for s in stages)
    assert any(s.startswith("start 2 of 2, iteration") for s in stages)
    assert told[-1][2] == WHOLE and shares(told)[-1] > 0.95


@pytest.mark.long
def test_a_diagnosis_moves_forward(case: Case) -> None:
    told: Told = []
    others = [effect for effect in CATALOGUE if effect != "solar_gain"]  # one effect is quicker to look for
    diagnose(case, dx=2.0, ruled_out=others, progress=lambda *one: told.append(one))
    assert_forward(told)
    assert any("round 2" in stage for stage, *_ in told)
