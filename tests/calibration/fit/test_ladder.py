"""The choice between a building as drawn and lumped, by tuning days that are left out."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from calibration.evaluation.intervals import Interval, default_intervals
from calibration.fit.calibrate import calibrate
from calibration.fit.ladder import _parts
from calibration.fit.result import CalibrationResult
from mpc.reports.calibration import calibration_verdict
from thermal.case.case import Case
from thermal.data import load_bundled_case

QUICK = {"dx": 1.0, "starts": 1}


@pytest.fixture(scope="module")
def case() -> Case:
    return load_bundled_case()


@pytest.fixture(scope="module")
def climbed(case: Case) -> CalibrationResult:
    return calibrate(case, settings={**QUICK, "climb": True})


def test_what_predicts_left_out_days_better_is_kept(climbed: CalibrationResult) -> None:
    drawn, lumped = climbed.rungs
    assert (drawn.name, lumped.name) == ("drawn", "lumped")
    assert lumped.chosen == (lumped.left_out_mae < 0.9 * drawn.left_out_mae) != drawn.chosen
    assert climbed.settings.structure.lumped == lumped.chosen
    # the bundled building has sun, which the drawing leaves to an effect
    assert lumped.chosen
    plain = climbed.to_dict()
    assert [rung["name"] for rung in plain["rungs"]] == ["drawn", "lumped"]


def test_before_is_what_the_drawing_says(case: Case, climbed: CalibrationResult) -> None:
    drawn = calibrate(case, settings=QUICK)
    assert drawn.rungs == ()
    for name in ("tuning", "held_out"):
        assert climbed.uncalibrated[name].metrics == drawn.uncalibrated[name].metrics
    assert climbed.calibrated["held_out"].metrics.mae < drawn.calibrated["held_out"].metrics.mae


def test_held_out_days_have_no_say(case: Case, climbed: CalibrationResult) -> None:
    _, (held_out,) = default_intervals(case)
    frame = case.telemetry.frame.copy()
    warm = [c for c in frame.columns if c.endswith("/zone_air_temperature_sensor")]
    frame.loc[frame.index >= held_out.start, warm] += 3.0
    other = replace(case, telemetry=replace(case.telemetry, frame=frame), judged=None)
    again = calibrate(other, settings={**QUICK, "climb": True})
    assert again.rungs == climbed.rungs
    assert np.array_equal(again.theta, climbed.theta)


def test_what_is_far_from_the_drawing_is_said(climbed: CalibrationResult) -> None:
    far = climbed.against_drawing()
    assert far, "the bundled building's furniture is no air"
    for entry in far:
        low, high = entry["interval90"]
        assert low > 1.5 or high < 1 / 1.5
    text = calibration_verdict(climbed)
    assert "lumped into air and mass a zone" in text
    assert "Farthest from the drawing" in text


def test_effects_that_were_asked_for_are_kept(case: Case) -> None:
    result = calibrate(case, settings={**QUICK, "climb": True, "effects": ["solar_gain"]})
    assert result.rungs == ()
    assert list(result.settings.effects) == ["solar_gain"]


def test_tuning_days_are_cut_into_parts_that_meet() -> None:
    start = pd.Timestamp("2024-01-01", tz="UTC")
    whole = Interval(start, start + pd.Timedelta(days=10))
    parts = _parts([whole])
    assert len(parts) == 4
    assert parts[0].start == whole.start and parts[-1].end == whole.end
    days = [Interval(start + pd.Timedelta(days=2 * k), start + pd.Timedelta(days=2 * k + 1)) for k in range(5)]
    assert _parts(days) == days
    assert len(_parts([Interval(start, start + pd.Timedelta(hours=20))])) == 1
