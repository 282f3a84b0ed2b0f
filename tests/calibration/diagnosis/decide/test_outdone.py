"""A regression that predicts held-out days better says that something is missing; it is the yardstick of evaluations."""

from __future__ import annotations

import numpy as np
import pytest

from calibration.diagnosis.decide.outdone import is_outdone, regression_held_out
from calibration.diagnosis.refit.comparison import ModelComparison
from calibration.diagnosis.refit.refit import HeldOut
from calibration.diagnosis.seek import seek
from calibration.evaluation.settings import ModelSettings
from calibration.evaluation.simple_models import with_yardsticks
from thermal.pilot.building import pilot_building
from thermal.pilot.twin import TwinRanges, TwinSettings, generate_twin


def errors(*daily: float) -> HeldOut:
    """Of one run a day [K]."""
    return HeldOut(np.arange(len(daily)), np.array(daily), np.ones(len(daily)))


def test_it_must_be_better_by_much_and_on_most_days() -> None:
    model = errors(0.3, 0.28, 0.33, 0.29, 0.31, 0.3)
    assert is_outdone(model, errors(0.1, 0.12, 0.11, 0.1, 0.13, 0.12))
    assert not is_outdone(model, errors(0.25, 0.24, 0.26, 0.25, 0.24, 0.26))  # a sixth
    assert not is_outdone(errors(0.04, 0.05, 0.04), errors(0.02, 0.025, 0.02))  # what does not matter
    assert not is_outdone(errors(0.1, 0.1, 0.1, 1.8), errors(0.2, 0.2, 0.2, 0.1))  # one day
    assert not is_outdone(model, None)


@pytest.fixture(scope="module")
def models() -> ModelComparison:
    office = pilot_building(3, floor_area=80.0, zones=2, floors=1, name="office")
    quiet = TwinRanges(disturbance_deviation=(0.05, 0.1), noise=(0.01, 0.02))
    settings = TwinSettings(days=10.0, step_seconds=900.0, dx=1.0, meter="exact", ranges=quiet)
    return ModelComparison(generate_twin(office, 3, settings)[0], ModelSettings(dx=2.0))


def test_it_is_the_yardstick_of_an_evaluation(models: ModelComparison) -> None:
    fit = models.fit({}, [{}])
    found, spin_up = regression_held_out(models, fit), models.settings.spin_up_seconds
    judged = fit.evaluate(models.judged, models.horizon)
    beside = with_yardsticks(judged, models.case, fit.built.inputs, models.anatomy, models.tuned, spin_up)
    assert found is not None and beside.yardsticks is not None
    assert found.mae == pytest.approx(beside.yardsticks.arx, rel=1e-9)


def test_a_model_that_is_outdone_leaves_something_out(models: ModelComparison, monkeypatch: pytest.MonkeyPatch) -> None:
    plain = seek(models.case, dx=2.0)
    assert (plain.verdict.name, plain.outdone) == ("no_gap", None)
    days = plain.rounds[-1].after_held_out.days
    oracle = HeldOut(days, np.full(days.size, 1e-3), np.ones(days.size))
    monkeypatch.setattr("calibration.diagnosis.seek.regression_held_out", lambda *_: oracle)
    monkeypatch.setattr("calibration.diagnosis.decide.outdone.MATTERS", 0.0)
    found = seek(models.case, dx=2.0)
    assert found.verdict.name == "unexplained" and found.outdone == pytest.approx(1e-3)
    assert found.structures is not None and found.to_dict()["gap"]["outdone"] == found.outdone
