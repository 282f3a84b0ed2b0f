"""Optimal control against rules on a tiny office, and the table of it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import pytest


@pytest.fixture(scope="module")
def loop(script: Callable[[str], ModuleType]) -> ModuleType:
    script("_table")
    script("_threads")
    return script("mpc_closed_loop")


@pytest.mark.long
def test_a_smoke_run_goes_on_where_it_stopped(
    loop: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("OMP_NUM_THREADS", "1")
    tiny = ["--out", str(tmp_path), "--days", "0.25", "--seasons", "winter", "--zones", "2", "--floor-area", "100",
            "--dx", "1.0", "--controllers", "schedule", "mpc"]  # fmt: skip
    rows = loop.main(tiny)
    assert [row["controller"] for row in rows] == ["schedule", "mpc"]
    assert rows[1]["sources"] == {"optimal plan": 24} and rows[1]["cost"] < rows[0]["cost"]
    monkeypatch.setattr(loop, "run", lambda *_: pytest.fail("it was run already"))
    assert loop.main([*tiny, "--no-run"]) == rows
    assert "optimal control" in (tmp_path / "mpc_closed_loop.md").read_text(encoding="utf-8")


def test_the_way_to_the_bound_counts_from_the_best_rule(loop: ModuleType) -> None:
    each = {"season": "winter", "days": 7, "tdis": 0.1, "energy": 1.0, "peak": 2.0, "zones": 123, "floor_area": 6317.0,
            "price": 1.0}  # fmt: skip
    costs = {"schedule": 100.0, "reset": 80.0, "guideline36": 70.0, "mpc": 52.0, "bound": 50.0}
    rows = [each | {"controller": name, "cost": cost, "objective": cost} for name, cost in costs.items()]
    assert loop.shares(rows)["winter", "mpc"] == pytest.approx(18.0 / 20.0)
    assert "| 90% |" in loop.table(rows) and "a week a season" in loop.table(rows) and "| 90% |" in loop.short(rows)
    assert loop.shares(rows[:-1]) == {}
