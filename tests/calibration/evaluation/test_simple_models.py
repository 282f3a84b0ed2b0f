"""Yardsticks: what anyone fits in an hour, on the runs of an evaluation and without their targets."""

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from calibration import calibrate
from calibration.errors import CalibrationError
from calibration.evaluation.case_model import CaseModel, case_model, evaluate_case
from calibration.evaluation.intervals import Interval, default_intervals
from calibration.evaluation.n_step import Evaluation, EvaluationSettings
from calibration.evaluation.simple_models import rest_of, with_yardsticks
from calibration.evaluation.yardsticks import Yardsticks
from mpc.reports.evaluation import beside_sentence
from thermal.case.case import Case
from thermal.data import load_bundled_case


@pytest.fixture(scope="module")
def case() -> Case:
    return load_bundled_case()


@pytest.fixture(scope="module")
def model(case: Case) -> CaseModel:
    return case_model(case, dx=1.5)


def _judged(
    model: CaseModel, case: Case, held_out: Sequence[Interval] | None = None
) -> tuple[Evaluation, list[Interval]]:
    tuned, rest = default_intervals(case)
    judged = held_out or rest
    reduced, _ = model.certified(judged[0], round(6 * 3600 / model.inputs.step))
    found = model.evaluate(reduced, judged, EvaluationSettings("6h"))
    return with_yardsticks(found, case, model.inputs, model.grid.network.anatomy, tuned), tuned


def test_models_that_know_heat_and_weather_beat_persistence(model: CaseModel, case: Case) -> None:
    evaluation, _ = _judged(model, case)
    found = evaluation.yardsticks
    assert found is not None and found.arx is not None and found.rc is not None
    assert found.rc < 0.5 * found.persistence
    assert found.arx < 0.5 * found.persistence
    errors = [p.initial - p.measured[:, -1] for p in evaluation.predictions]
    assert found.persistence == pytest.approx(abs(errors[0]).mean(), rel=1e-6)
    content = evaluation.to_dict()
    assert content["yardsticks"] == found.to_dict()
    assert content["useful"] == (evaluation.metrics.mae < min(found.made.values()))


def test_nothing_is_fitted_to_what_is_held_out(model: CaseModel, case: Case) -> None:
    _, (held_out,) = default_intervals(case)
    day = Interval(held_out.start, held_out.start + pd.Timedelta(days=1))
    zone = model.inputs.zone.copy()
    zone[model.inputs.stamps > day.end] += 4.0
    later = replace(model, inputs=replace(model.inputs, zone=zone, bridged=zone, held=zone))
    plain, changed = (_judged(m, case, [day])[0].yardsticks for m in (model, later))
    assert plain is not None and changed is not None
    assert plain.to_dict() == changed.to_dict()


def test_one_zone_without_irradiance_has_its_yardsticks(model: CaseModel, case: Case) -> None:
    name = case.building.zone_names[0]
    zone = np.full_like(model.inputs.zone, np.nan)
    zone[:, 0] = model.inputs.zone[:, 0]
    frame = case.telemetry.frame
    dark = frame.drop(columns=[c for c in frame if "irradiance" in c])
    dark_case = replace(case, telemetry=replace(case.telemetry, frame=dark), judged=None)
    alone = replace(model, case=dark_case, inputs=replace(model.inputs, zone=zone))
    found = _judged(alone, dark_case)[0].yardsticks
    assert found is not None and found.rc is not None and found.arx is not None, name
    assert found.rc < 0.5 * found.persistence


def test_without_tuning_days_only_persistence_is_left(model: CaseModel, case: Case) -> None:
    evaluation, _ = _judged(model, case)
    found = with_yardsticks(evaluation, case, model.inputs, model.grid.network.anatomy, []).yardsticks
    assert found is not None
    assert found.arx is None and found.rc is None
    assert "none is left" in found.reasons["arx"]


def test_what_intervals_leave_is_found(case: Case) -> None:
    tuned, held_out = default_intervals(case)
    (rest,) = rest_of(case.stamps, held_out)
    assert rest == tuned[0]
    assert rest_of(case.stamps, [Interval(case.stamps[0], case.stamps[-1])]) == []


def test_a_model_that_is_beaten_is_not_yet_useful() -> None:
    yardsticks = Yardsticks(1.0, 0.5, 0.4)
    assert not yardsticks.useful(0.45) and yardsticks.useful(0.39)
    assert "not yet useful" in beside_sentence(0.45, yardsticks)
    assert "coupled 2R2C" in beside_sentence(0.45, yardsticks)
    assert "beats them all" in beside_sentence(0.3, yardsticks)


@pytest.mark.long
def test_simple_models_see_what_the_calibration_was_tuned_on(case: Case, tmp_path: Path) -> None:
    (tuned,), (judged,) = default_intervals(case)
    short = Interval(tuned.start, tuned.start + pd.Timedelta(days=4))
    result = calibrate(case, [short], [judged], settings={"starts": 1, "yardsticks": True})
    path = tmp_path / "calibration.json"
    path.write_text(json.dumps(result.to_dict()), encoding="utf-8")
    again = evaluate_case(case, [judged], parameters=path).yardsticks
    own = result.calibrated["held_out"].yardsticks
    assert again is not None and own is not None
    assert (again.persistence, again.arx, again.rc) == (own.persistence, own.arx, own.rc)
    for entries in ([{"start": "2023-03-01"}], [{"start": "2023-03-01", "end": "2023-03-05"}], 3):
        path.write_text(json.dumps({**result.to_dict(), "intervals": {"tuning": entries}}), encoding="utf-8")
        with pytest.raises(CalibrationError, match=r"intervals\.tuning: expected what `calibrate` writes"):
            evaluate_case(case, [judged], parameters=path)
