"""The table of the controller's speed: peers and ours solve the same problem, a short one here."""

from __future__ import annotations

import pytest


def test_peers_and_ours_cost_the_same(script, monkeypatch) -> None:
    pytest.importorskip("do_mpc", reason="do-mpc comes with the extra [benchmarks]", exc_type=Exception)
    parts = [script(name) for name in ("_table", "simulator_speed", "_common_control", "_do_mpc_peer", "mpc_speed")]
    speed = parts[-1]
    for module in parts[2:]:
        monkeypatch.setattr(module, "STEPS", 12)
    horizons, reference = speed.instances(2)
    assert len(horizons) == 3 and horizons[0].parameters.shape == (12, 13)
    rows = [speed.compare(name, horizons, reference) for name in (*speed.SETTINGS, *speed.STAGES)]
    assert all(row["solved"] == "3 of 3" and abs(row["over"]) < 0.5 for row in rows), rows
