"""The choice between a building as drawn and lumped, by tuning days that are left out."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from calibration.evaluation.intervals import default_intervals
from calibration.fit import ladder
from calibration.fit.calibrate import calibrate
from calibration.fit.fitted_case import FittedCase, fit_case
from calibration.fit.ladder import LOSSES, MASSES, by_zone
from calibration.fit.result import CalibrationResult
from mpc.reports.calibration import calibration_verdict
from thermal.case.building import Building, Surface, ZoneEntry, ZoneTable
from thermal.case.case import Case
from thermal.case.load import load_case

QUICK = {"dx": 1.0, "starts": 1}


@pytest.fixture(scope="module")
def case(bundled_case_in: Callable[[str], Path]) -> Case:
    """The bundled case in quarters of an hour."""
    return load_case(bundled_case_in("15min"))


@pytest.fixture(scope="module")
def hourly(bundled_case_in: Callable[[str], Path]) -> Case:
    """The same in hours, for what does not depend on how good a fit is."""
    return load_case(bundled_case_in("60min"))


@pytest.fixture(scope="module")
def climbed(case: Case) -> CalibrationResult:
    return calibrate(case, settings={**QUICK, "climb": True})


def test_what_predicts_left_out_days_better_is_kept(climbed: CalibrationResult) -> None:
    drawn, convective, wind, zoned, lumped, shifted = climbed.rungs
    names = ["drawn", "natural convection", "wind", "zoned", "lumped", "shifted"]
    assert [rung.name for rung in climbed.rungs] == names
    assert zoned.parameters > drawn.parameters == convective.parameters == wind.parameters
    assert wind.left_out_mae < convective.left_out_mae < drawn.left_out_mae  # or they would not be there
    simpler = min(wind.left_out_mae, zoned.left_out_mae)
    assert lumped.chosen == (lumped.left_out_mae < 0.9 * simpler) and sum(r.chosen for r in climbed.rungs) == 1
    assert climbed.settings.structure.lumped == lumped.chosen
    # the bundled building has sun, which the drawing leaves to an effect
    assert lumped.chosen
    # its clocks are right
    assert shifted.parameters == lumped.parameters + 2
    assert shifted.left_out_mae > 0.95 * lumped.left_out_mae
    plain = climbed.to_dict()
    assert [rung["name"] for rung in plain["rungs"]] == [rung.name for rung in climbed.rungs]


def test_losses_differ_by_zone_where_a_drawing_is_no_survey(case: Case) -> None:
    surveyed, guessed = (replace(case.building, geometry_quality=q) for q in ("surveyed", "approximate"))
    assert by_zone(surveyed) == (MASSES,) and by_zone(guessed) == (MASSES, LOSSES)
    inner = Surface(name="G", kind="window", zone="A", other="B", area=1.0, u_value=1.0, solar_transmittance=0.5)
    rooms = tuple(ZoneEntry(name=name, volume=50.0, floor_area=20.0) for name in "AB")
    house = Building("house", guessed.location, 0.0, ZoneTable(rooms, (inner,), {}))
    assert by_zone(house) == (MASSES, ("exterior_wall_conductivity_multiplier",))


@pytest.mark.long
def test_heat_that_is_stamped_too_early_is_moved(case: Case) -> None:
    frame = case.telemetry.frame.copy()
    heat = [c for c in frame if c.endswith(("/supply_air_flowrate_sensor", "/discharge_air_temperature_sensor"))]
    steps = round(2400.0 / case.step)
    frame[heat] = frame[heat].shift(-steps).ffill()
    early = replace(case, telemetry=replace(case.telemetry, frame=frame), judged=None)
    result = calibrate(early, settings={**QUICK, "climb": True})
    assert [rung.name for rung in result.rungs if rung.chosen] == ["shifted"]
    shift = next(p for p in result.parameters if p.name == "heat_clock_shift")
    assert shift.standard_error is not None
    assert 3.0 * shift.standard_error < shift.value < steps * case.step / 3600.0  # by the first term of its series
    left = next(rung.left_out_mae for rung in result.rungs if rung.name == "lumped")
    assert next(rung.left_out_mae for rung in result.rungs if rung.chosen) < 0.95 * left
    assert "with heat and weather moved in time" in calibration_verdict(result)


@pytest.mark.long
def test_films_that_follow_the_wind_are_kept_without_an_advance(
    case: Case, hourly: Case, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(ladder, "ADVANCE", 1.0)  # nothing with more parameters is better by so much
    result = calibrate(case, settings={**QUICK, "climb": True})
    assert [rung.name for rung in result.rungs] == ["drawn", "natural convection", "wind", "zoned", "lumped"]
    assert [rung.chosen for rung in result.rungs] == [False, False, True, False, False]
    assert result.settings.structure.wind_films
    assert result.settings.normalisation is not None and result.settings.normalisation.wind is not None
    assert "outside films that follow the wind" in calibration_verdict(result)
    frame = hourly.telemetry.frame.drop(columns="weather_station/wind_speed_sensor")
    still = replace(hourly, telemetry=replace(hourly.telemetry, frame=frame), judged=None)
    names = [r.name for r in calibrate(still, settings={**QUICK, "climb": True}).rungs]
    assert names[:4] == ["drawn", "natural convection", "zoned", "lumped"]


def test_before_is_what_the_drawing_says(case: Case, climbed: CalibrationResult) -> None:
    drawn = calibrate(case, settings=QUICK)
    assert drawn.rungs == ()
    for name in ("tuning", "held_out"):
        assert climbed.uncalibrated[name].metrics == drawn.uncalibrated[name].metrics
    assert climbed.calibrated["held_out"].metrics.mae < drawn.calibrated["held_out"].metrics.mae


@pytest.mark.long
def test_held_out_days_have_no_say(case: Case, climbed: CalibrationResult) -> None:
    _, (held_out,) = default_intervals(case)
    frame = case.telemetry.frame.copy()
    warm = [c for c in frame.columns if c.endswith("/zone_air_temperature_sensor")]
    # heat that is moved in time is told from its change, to which the step after belongs
    frame.loc[frame.index > held_out.start + pd.Timedelta(seconds=case.step), warm] += 3.0
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


def test_left_out_days_make_bands(climbed: CalibrationResult) -> None:
    assert set(climbed.band_factors) == set(climbed.zones)
    carried = climbed.calibrated["held_out"].carried
    assert carried is not None and carried.coverage is not None
    assert 0.8 < carried.coverage < 1.0
    assert climbed.to_dict()["calibrated"]["held_out"]["carried"]["coverage"] == carried.coverage
    assert "carried on" in calibration_verdict(climbed)


@pytest.mark.long
def test_a_gain_that_recurs_is_kept_where_it_predicts_better(case: Case, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ladder, "_WEEK", 3.0)
    # it predicts days left out worse here, with five of them to learn from: it is kept where it may be twice as wrong
    monkeypatch.setattr(ladder, "ADVANCE", -1.0)
    result = calibrate(case, settings={**QUICK, "climb": True})
    *_, lumped, recurring, _ = result.rungs
    further = recurring.parameters - lumped.parameters
    assert (recurring.name, further) == ("recurring", 6 * len(case.building.zone_names))
    assert 0.9 * lumped.left_out_mae < recurring.left_out_mae < 2.0 * lumped.left_out_mae
    assert [rung.chosen for rung in result.rungs] == [False] * 5 + [True, False]
    assert result.settings.structure.recurring
    assert "recurs from day to day" in calibration_verdict(result)
    # with more freedom the days that were fitted are followed more closely
    only = calibrate(case, settings={**QUICK, "structure": {"lumped": True, "sun": True}})
    assert result.calibrated["tuning"].metrics.mae < only.calibrated["tuning"].metrics.mae


@pytest.mark.parametrize("which", [1, 2])
def test_a_fit_that_is_interrupted_has_no_part_in_the_choice(
    hourly: Case, monkeypatch: pytest.MonkeyPatch, which: int
) -> None:
    fits = iter(range(9))

    def interrupted(*args: Any, **settings: Any) -> FittedCase:
        found = fit_case(*args, **settings)
        if next(fits) < which - 1:
            return found
        solve = replace(found.best.solve, success=False, interrupted=True)
        return replace(found, best=replace(found.best, solve=solve))

    monkeypatch.setattr(ladder, "fit_case", interrupted)
    result = calibrate(hourly, settings={**QUICK, "climb": True})
    assert result.rungs == () and not result.settings.structure.lumped
    assert (result.solver.status, result.solver.success) == ("User_Requested_Stop", False)
