"""A folder of buildings: one row each, one page for all, and what is to be done first."""

from __future__ import annotations

from pathlib import Path

import pandas as pd

from calibration.fleet.outcome import CaseOutcome
from mpc.reports.fleet import fleet_verdict, write_fleet

DONE = CaseOutcome("lit", "diagnosed", 0.5, 0.2, 3.0, verdict="named", effects=("solar_gain",), has_windows=True)
DARK = CaseOutcome("dark & low", "diagnosed", 0.7, 0.4, 3.0, verdict="no_gap", has_windows=False)
FAILED = CaseOutcome("broken", "failed", error="CaseError", message="building.yaml: no name", bad_input=True)


def test_a_fleet_has_a_row_a_building_and_a_page_that_leads_to_each(tmp_path: Path) -> None:
    page = write_fleet((DONE, DARK, FAILED), tmp_path, "diagnose", "6h").read_text(encoding="utf-8")
    table = pd.read_parquet(tmp_path / "fleet.parquet")
    assert table.index.tolist() == ["lit", "dark & low", "broken"]
    assert table.loc["lit", "held_out_mae_after"] == 0.2 and table.loc["lit", "effects"] == "solar_gain"
    assert table["has_windows"].isna().tolist() == [False, False, True]
    assert 'href="lit/report.html"' in page and 'href="dark%20%26%20low/report.html"' in page
    assert 'href="broken/report.html"' not in page and "building.yaml: no name" in page
    assert page.index("dark &amp; low</a>") < page.index("lit</a>")  # the largest error first
    assert "Put right what the table says of broken" in page


def test_the_verdict_is_of_the_median_building() -> None:
    told = fleet_verdict((DONE, DARK, FAILED), "diagnose", "6h")
    assert "2 of 3 buildings have a model" in told and "by 0.60 K" in told and "by 0.30 K" in told
    assert "sun through the windows (1 building)" in told
    assert fleet_verdict((FAILED,), "calibrate", "6h") == "0 of 1 building have a model."
