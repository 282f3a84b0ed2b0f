"""What a controller that begins anew is told: the inputs of its last plans, as telemetry up to the step before now."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from mpc.live.audit import AuditLog
from mpc.live.past import SPAN, past_table, recent_past

STEP, NOW = 900.0, 1_673_300_700.0
ZONE, OUTDOOR = "north/zone_air_temperature_sensor", "outside_air_temperature_sensor"


def inputs(begin: float, zone: float | None) -> dict[str, Any]:
    columns = [OUTDOOR, "north/internal_gain", "north/comfort_lower_temperature", "electricity_price"]
    values = [[270.0 + begin % 7.0, 280.0], [100.0, 0.0], [294.15, 294.15], [0.2, None]]
    means = {ZONE: zone, "other/point": 1.0}
    return {"begin": begin, "means": means, "forecast": {"columns": columns, "values": values}}


def written(folder: Path, *contents: dict[str, Any]) -> AuditLog:
    log = AuditLog(folder, "controller", dict)
    log.append("start", {})
    for content in contents:
        log.append("plan", {"inputs": content, "plan": {}})
    log.close()
    return log


def test_the_last_two_days_are_read_over_files_and_what_is_damaged_is_left_out(tmp_path: Path) -> None:
    old = [inputs(NOW - SPAN - STEP, 280.0), inputs(NOW - 5 * STEP, 291.0), inputs(NOW - 4 * STEP, None)]
    written(tmp_path, *old)
    last = written(tmp_path, inputs(NOW - 3 * STEP, 293.0) | {"forecast": None}, inputs(NOW, 300.0))
    with last.path.open("ab") as file:
        file.write(b'{"kind":"plan","content":{"inp\n{"kind":"plan","content":{}}\n')
    past = recent_past(tmp_path, NOW, [ZONE])
    assert [one["begin"] for one in past] == [NOW - k * STEP for k in (5, 4, 3)]
    assert past[0]["means"] == {ZONE: 291.0} and past[2]["ahead"] == {}
    assert set(past[0]["ahead"]) == {OUTDOOR, "north/internal_gain"}
    assert recent_past(tmp_path / "nothing", NOW, [ZONE]) == []
    (tmp_path / "controller-000000.jsonl.gz").write_bytes(b"damaged")
    (tmp_path / "controller-000000.jsonl").unlink()
    assert [one["begin"] for one in recent_past(tmp_path, NOW, [ZONE])] == [NOW - 3 * STEP]

    table = past_table(past, NOW, STEP, "Europe/Brussels", "station")
    stamps = [pd.Timestamp(NOW - k * STEP, unit="s", tz="UTC") for k in (5, 4, 3, 2, 1)]
    assert list(table.index) == stamps and table.index.tz is not None
    np.testing.assert_array_equal(table[ZONE], [291.0, np.nan, 293.0, np.nan, np.nan])
    ahead = [270.0 + (NOW - k * STEP) % 7.0 for k in (5, 4)]  # of the step that ends a stamp later
    np.testing.assert_array_equal(table[f"station/{OUTDOOR}"], [np.nan, *ahead, np.nan, np.nan])
    assert "other/point" not in table and "electricity_price" not in table
