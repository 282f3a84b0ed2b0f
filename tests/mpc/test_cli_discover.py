"""``buildingmpc discover``: a model of points becomes a proposal, which counts once it is confirmed."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from mpc.cli.app import app
from thermal import load_bundled_case, load_case
from thermal.data import bundled_case_path


def run(*words: str) -> int:
    with pytest.raises(SystemExit) as ended:
        app(list(words))
    return int(ended.value.code or 0)


def test_a_proposal_counts_once_it_is_confirmed(tmp_path: Path, capsys: Any) -> None:
    device = next(d for d in load_bundled_case().building.devices if d.type == "vav")
    rows = [
        {"id": "r:v", "dis": device.name, "equip": "m:", "vav": "m:"},
        {"id": "r:p1", "dis": "t", "point": "m:", "equipRef": "r:v", **dict.fromkeys(("zone", "air", "temp", "sensor"), "m:")},
        {"id": "r:p2", "dis": "odd", "point": "m:", "equipRef": "r:v"},
    ]  # fmt: skip
    (tmp_path / "site.json").write_text(json.dumps({"rows": rows}))
    case, out = str(bundled_case_path()), tmp_path / "found"
    assert run("discover", case, "--model", str(tmp_path / "site.json"), "--out", str(out)) == 0
    assert "2 points: 1 matched, 0 doubtful, 1 unmatched" in capsys.readouterr().out
    index = pd.date_range("2026-01-05", periods=49, freq="30min", tz="UTC", name="timestamp")
    pd.DataFrame({"p1": 21.0, "p2": 5.0}, index=index).to_parquet(tmp_path / "export.parquet")
    proposal = out / "proposal.yaml"
    given = ("import-telemetry", case, str(tmp_path / "export.parquet"), "--points", str(proposal), "--out")
    assert run(*given, str(tmp_path / "none")) == 2
    assert "a column that is matched to a point" in capsys.readouterr().err
    text = proposal.read_text()
    at = text.index("address: p1")
    proposal.write_text(text[:at] + text[at:].replace("confirmed: false", "confirmed: true", 1))
    assert run(*given, str(tmp_path / "case")) == 0
    assert list(load_case(tmp_path / "case").telemetry.frame) == [f"{device.name}/zone_air_temperature_sensor"]
    assert run("discover", case, "--out", str(tmp_path / "neither")) == 2
