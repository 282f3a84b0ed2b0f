"""Rows of the table of practice cases."""

from __future__ import annotations

from collections.abc import Callable
from types import ModuleType

import pytest


@pytest.fixture(scope="module")
def practice(script: Callable[[str], ModuleType], package: Callable[[str], ModuleType]) -> ModuleType:
    package("energyplus_trials.drawing")
    for name in ("_table", "_code", "_trial_scores", "_trial_answers"):
        script(name)
    return script("practice_cases")


def answer(verdict: str, effect: str, probability: float, group: list[str], steps: list[dict]) -> dict:
    return {
        "verdict": verdict, "gap": {"mae": 0.4, "floor": 0.1}, "seconds": 12.4, "how_far": steps,
        "which": [{"effect": effect, "probability": probability, "group": group}],
    }  # fmt: skip


def test_a_row_says_what_was_held_and_what_was_found(practice: ModuleType) -> None:
    steps = [
        {"effects": ["roof_exchange"], "held_out_mae_after": 0.3, "share_closed": 0.33},
        {"effects": ["roof_exchange", "sensor_lag"], "held_out_mae_after": 0.16, "share_closed": 0.8},
    ]
    answers = {
        "b": answer("group", "roof_exchange", 0.97, ["roof_exchange", "ground_exchange"], steps),
        "a": answer("no_gap", "wind_film", 0.001, ["wind_film"], []),
        "house": answer("unexplained", "wind_film", 0.3, ["wind_film"], []),
    }
    assert practice.rows(answers, {"a": [], "b": ["roof_exchange", "sensor_lag"]}) == [
        ["a", "nothing", "no_gap", "-", "-", "-", "0.400 (floor 0.100)", "-", "12"],
        [
            "b", "roof_exchange, sensor_lag", "group", "roof_exchange (97%)", "ground_exchange",
            "roof_exchange, sensor_lag", "0.400 → 0.160 (floor 0.100)", "80%", "12",
        ],
        ["house", "measured", "unexplained", "wind_film (30%)", "-", "-", "0.400 (floor 0.100)", "-", "12"],
    ]  # fmt: skip
