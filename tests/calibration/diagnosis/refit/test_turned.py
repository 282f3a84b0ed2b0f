"""A building whose drawing has north somewhere else: the sun in the bundled case, which EnergyPlus made, says where."""

from __future__ import annotations

from dataclasses import replace

import pytest

from calibration.diagnosis.baseline import fit_baseline
from calibration.diagnosis.refit.comparison import ModelComparison
from calibration.diagnosis.refit.refit import held_out
from calibration.diagnosis.refit.search import search
from calibration.diagnosis.refit.turned import turn
from calibration.evaluation.settings import ModelSettings
from thermal import Case, load_bundled_case

SOUGHT = ("solar_gain", "infiltration")


@pytest.mark.parametrize("wrong", [0.0, 70.0, -150.0])
def test_north_is_found_by_the_sun(wrong: float) -> None:
    case = load_bundled_case()
    drawn = replace(case.building, orientation=case.building.orientation - wrong)
    models, baseline = fit_baseline(ModelComparison(Case(drawn, case.telemetry), ModelSettings(dx=1.0)), {})
    rounds = search(models, baseline, held_out(models, baseline), SOUGHT)
    assert ("solar_gain" in rounds[-1].after.effects) is (abs(wrong) < 60.0)
    found, again = turn(models, rounds, SOUGHT)
    if not wrong:
        assert (found, again) == (models, rounds)
        return
    assert found.settings.structure.turned == pytest.approx(wrong, abs=8.0)
    assert again[-1].after_held_out.mae < 0.8 * rounds[-1].after_held_out.mae
    assert (found.tuned, found.judged) == (models.tuned, models.judged)


def test_without_sun_nothing_says_where_north_is() -> None:
    models, baseline = fit_baseline(ModelComparison(load_bundled_case(), ModelSettings(dx=1.0)), {})
    rounds = search(models, baseline, held_out(models, baseline), ("infiltration",))
    assert turn(models, rounds, SOUGHT) == (models, rounds)
