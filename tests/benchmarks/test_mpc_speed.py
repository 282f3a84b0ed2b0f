"""The table of the controller's speed: peers and ours solve the same problem, a short one here."""

from __future__ import annotations

from types import ModuleType
from typing import Any

import pytest


@pytest.fixture(scope="module")
def speed(script) -> ModuleType:
    parts = [script(name) for name in ("_table", "_pilot", "_common_control", "_do_mpc_peer", "mpc_speed")]
    with pytest.MonkeyPatch.context() as patch:
        for module in parts[2:]:
            patch.setattr(module, "STEPS", 6)
        yield parts[-1]


@pytest.fixture(scope="module")
def given(speed) -> tuple[Any, Any]:
    return speed.instances(1)


def test_ours_cost_the_same(speed, given) -> None:
    assert len(given[0]) == 2 and given[0][0].parameters.shape == (6, 13)
    rows = [speed.compare(name, *given) for name in speed.STAGES]
    assert all(row["solved"] == "2 of 2" and abs(row["over"]) < 0.5 for row in rows), rows


def test_the_peer_costs_the_same(speed, given) -> None:
    pytest.importorskip("do_mpc", reason="do-mpc comes with the extra [benchmarks]", exc_type=Exception)
    rows = [speed.compare(name, *given) for name in list(speed.SETTINGS)[::2]]
    assert all(row["solved"] == "2 of 2" and abs(row["over"]) < 0.5 for row in rows), rows


def test_both_tables_have_theirs_and_ours(speed) -> None:
    rows = [
        {"solver": name, "warm_median": t, "warm_largest": t, "iterations": 9.0, "over": 0.1, "solved": "2 of 2"}
        for name, t in zip((*speed.SETTINGS, *speed.STAGES), (0.9, 0.5, 0.4, 0.6, 0.3, 0.2), strict=True)
    ]
    whole, short = speed.peer_tables(rows)
    assert whole.count("\n") == 8 and short.splitlines()[-1].startswith("| ours: fatrop in stages | 0.2 | 4.5 |")
    assert "barrier 3e-4" in short and "barrier 1e-3" not in short
