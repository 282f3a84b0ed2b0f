"""Heat of unknown cause with the catalogue taken away: another season, what counts, and the table."""

from __future__ import annotations

from collections.abc import Callable
from datetime import date
from types import ModuleType

import pytest


@pytest.fixture(scope="module")
def corrections(script: Callable[[str], ModuleType], package: Callable[[str], ModuleType]) -> ModuleType:
    package("energyplus_trials.drawing")
    for name in ("_table", "_code", "_seeds", "_trial_scores", "_trial_answers"):
        script(name)
    return script("corrections")


def test_another_season_is_four_months_off_and_nothing_else_differs(corrections: ModuleType) -> None:
    for seed in range(20):
        spec = corrections.draw_spec(seed, "single")
        moved = corrections.later(spec)
        days = (date.fromisoformat(moved.climate.start) - date.fromisoformat(spec.climate.start)).days
        assert 60 <= abs(days) <= 305 and (days % 365) in range(90, 290)
        first = date.fromisoformat(moved.climate.start).timetuple().tm_yday
        assert first > 30 and first + spec.days <= 366
        assert (moved.effects, moved.layout, moved.fabric) == (spec.effects, spec.layout, spec.fabric)


def test_shares_are_of_the_gap_to_the_twin(corrections: ModuleType) -> None:
    row = {"before": 0.5, "twin": 0.1, "after": 0.2, "learnt": 0.4}
    assert corrections.closed(row) == pytest.approx(0.75)
    assert corrections.closed(row, "learnt") == pytest.approx(0.25)
    assert corrections.closed({"before": 0.5, "twin": 0.1}) == 0.0


def test_the_table_counts_what_leaves_a_gap_and_says_which_driver_came_first(corrections: ModuleType) -> None:
    later = {"before": 0.4, "twin": 0.1, "after": 0.1}
    gap = {"before": 0.5, "twin": 0.1, "learnt": 0.3, "trial": "a"}
    rows = [
        {**gap, "effect": "solar_gain", "after": 0.1, "drivers": ["heat_by_sun"], "later": later},
        {**gap, "effect": "solar_gain", "after": 0.3, "drivers": ["heat_always"], "later": later},
        {**gap, "effect": "longwave_sky", "later": {"before": 0.4, "twin": 0.1}},
        {"effect": "wind_film", "before": 0.05, "twin": 0.05, "trial": "b"},
    ]
    lines = corrections.table(rows).splitlines()
    assert [line.split(" | ")[0].strip("| ") for line in lines[2:]] == ["longwave_sky", "solar_gain", "all"]
    assert "| 2 | 2 | 1 of 2 | 75% | 75% | 100% | 50% |" in lines[3]
    assert "| 3 | 2 | 1 of 2 | 50% | 75% | 100% | 50% |" in lines[4]
    with pytest.raises(SystemExit, match="leaves a gap"):
        corrections.table(rows[3:])
