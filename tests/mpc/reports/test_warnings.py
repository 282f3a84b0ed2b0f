"""A building without windows is said on the pages of calibrations and diagnoses, and of folders of cases."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

import calibration.fleet.run
from calibration.fleet.outcome import CaseOutcome
from mpc.cli import many as _many
from mpc.reports.means import Means
from mpc.reports.page import render
from mpc.reports.warnings import case_warnings
from thermal import Case, FloorPlans, load_bundled_case


@pytest.fixture
def dark() -> Case:
    """Make the bundled case without its windows."""
    case = load_bundled_case()
    plans = case.building.geometry
    assert isinstance(plans, FloorPlans) and plans.glazing
    return replace(case, building=replace(case.building, geometry=replace(plans, glazing={})), path=Path("some/where"))


def test_a_page_begins_with_what_spoils_its_numbers(dark: Case) -> None:
    assert case_warnings(load_bundled_case()) == []
    (told,) = case_warnings(dark)
    assert told.startswith("The building has no windows") and "buildingmpc label where," in told
    means = Means("It fits.", "On few days.", "Go on.")
    page = render("base", {"subtitle": "", "verdict": "It fits well.", "warnings": [told], "means": means})
    assert '<p class="warning" role="alert">The building has no windows' in page
    assert page.index("no windows") < page.index("It fits well.")


def test_a_folder_of_cases_says_which_have_none(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    outcomes = [CaseOutcome(name, "calibrated", 0.5, 0.4, has_windows=name == "lit") for name in ("lit", "dark")]
    monkeypatch.setattr(calibration.fleet.run, "do_many", lambda *_, **__: outcomes)
    settings = {"horizon": "6h"}
    for name in ("lit", "dark"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "building.yaml").touch()
    how = _many.How(workers=1)
    assert _many.of_folder("calibrate", str(tmp_path), str(tmp_path / "out"), settings, how) == 0
    told = capsys.readouterr()
    assert "warning: dark: 1 of 2 buildings has no windows" in told.err
    assert "calibrated, no windows" in told.out and told.out.count("no windows") == 1
    assert outcomes[1].to_dict()["has_windows"] is False
