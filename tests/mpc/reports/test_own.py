"""Pages of what the library does not know: an effect, a controller and an indicator of one's own."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from calibration.fit.result import ParameterEstimate
from mpc.kpi.kpis import KPIS, Indicator, Kpis
from mpc.reports.control import own_indicators
from mpc.reports.diagnosis_words import called
from mpc.reports.figures.calibration import parameter_ranges
from mpc.reports.page import render, spell
from thermal.effects.catalogue import CATALOGUE


def test_an_effect_is_called_by_its_own_title_or_its_id(monkeypatch: pytest.MonkeyPatch) -> None:
    assert called("draught_of_the_cat_flap", ["A"]) == "draught of the cat flap, in zone A"
    own = replace(CATALOGUE["roof_exchange"], id="draught_of_the_cat_flap", title="air through the cat flap")
    monkeypatch.setitem(CATALOGUE, own.id, own)
    assert called(own.id) == "air through the cat flap"


def test_a_parameter_of_an_effect_that_was_added_later_is_drawn(monkeypatch: pytest.MonkeyPatch) -> None:
    first, *_ = CATALOGUE["roof_exchange"].parameters
    own = replace(CATALOGUE["roof_exchange"], id="cat_flap", parameters=(replace(first, name="cat_flap_area"),))
    monkeypatch.setitem(CATALOGUE, own.id, own)
    estimate = ParameterEstimate("cat_flap_area", "m^2", 0.1, 0.0, 1.0, 0.0, False, 0.02, True, "made up", (0.05, 0.15))
    (picture,) = parameter_ranges([estimate])
    assert picture.source


def test_an_indicator_is_a_card(monkeypatch: pytest.MonkeyPatch) -> None:
    known: dict[str, Any] = dict.fromkeys(Kpis.__annotations__, 1.0) | {"zones": (), "currency": "EUR", "own": {}}
    assert own_indicators(Kpis(**known)) == []
    monkeypatch.setitem(KPIS, "window_openings", Indicator(lambda run: 12.0, "times", "windows were opened"))
    assert own_indicators(Kpis(**known | {"own": {"window_openings": 12.0}})) == [("12.0 times", "windows were opened")]


def test_tables_take_records_and_lists() -> None:
    assert spell(None) == spell(float("nan"), ".2f") == "–"
    assert spell("a-b") == "a-b" and spell(-1.5, ".1f") == "−1.5"
    with pytest.raises(Exception, match="not_there"):
        render("not_there", {})
