"""Cases that others made: what calibration reaches on buildings in EnergyPlus and on a measured house."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import pytest

from calibration import CalibrationResult, CalibrationSettings, calibrate
from calibration.diagnosis.seek import seek
from thermal import Case, Telemetry, load_case

CASES = Path(__file__).parents[2].parent / "shared" / "cases"


def shared(name: str) -> Case:
    if not (CASES / name).is_dir():
        pytest.skip(f"the shared case is not here: {CASES / name}")
    return load_case(CASES / name)


@cache
def calibrated(name: str) -> CalibrationResult:
    return calibrate(shared(name), settings=CalibrationSettings(starts=1))


def without_irradiance(case: Case) -> Case:
    frame = case.telemetry.frame
    frame = frame.drop(columns=frame.filter(regex="irradiance").columns)
    return Case(case.building, Telemetry(frame, case.step, case.telemetry.missing_rows))


LIMITS = {"practice_none_schedule": 0.10, "practice_none_prbs": 0.16, "twinhouse_N2_exp1": 0.8}


@pytest.mark.long
@pytest.mark.parametrize("name", LIMITS)
def test_held_out_error_after_calibration(name: str) -> None:
    """Mean absolute error six hours ahead, on the last third of the telemetry."""
    found = calibrated(name)
    assert found.solver.success, found.solver.status
    assert found.horizon == "6h"
    assert found.calibrated["held_out"].metrics.mae < LIMITS[name]
    assert found.grid_check.max_difference < 0.01


@pytest.mark.parametrize("name", ["practice_none_schedule", "practice_none_prbs"])
def test_cases_without_an_effect_leave_no_parameter_on_a_bound(name: str) -> None:
    found = calibrated(name)
    assert [p.name for p in found.parameters if p.at_bound] == []
    assert found.calibrated["held_out"].metrics.mae < 0.5 * found.uncalibrated["held_out"].metrics.mae


@pytest.mark.long
def test_sun_that_nobody_measures_has_its_part_in_a_lumped_model() -> None:
    """The sun of each day is estimated from the range of its outdoor temperature; without it this house errs by 1.13 K."""
    found = calibrate(without_irradiance(shared("measured_lboro")), settings=CalibrationSettings(starts=1, climb=True))
    assert found.settings.structure.lumped and found.settings.structure.sun
    assert found.calibrated["held_out"].metrics.mae < 1.05


@pytest.mark.long
def test_sun_that_nobody_measures_is_named_where_the_drawing_does_not_hold() -> None:
    found = seek(without_irradiance(shared("measured_quebec9zone")))
    assert found.free is not None
    assert found.verdict.name in ("named", "group") and found.verdict.candidates[0].effect == "solar_gain"


@pytest.mark.long
def test_the_sun_of_a_free_structure_is_named_and_what_predicts_better_is_handed_on() -> None:
    found = seek(shared("measured_quebec9zone"))
    assert (found.verdict.name, found.verdict.candidates[0].effect) == ("named", "solar_gain")
    assert [step["effects"] for step in found.to_dict()["how_far"]] == [("solar_gain",)]
    assert found.structures is not None and found.structures.kept is not None
    *others, named = found.structures.rungs
    (chosen,) = (rung for rung in (*others, named) if rung.chosen)
    assert named.name == "found" and chosen.left_out_mae <= named.left_out_mae
    assert ("solar_gain" in found.structures.kept.settings.effects) == named.chosen


#: One effect each that is named, or nothing.
LABELLED = {
    "practice_duct_loss": "duct_loss", "practice_flow_gain": "flow_gain",
    "practice_ground_exchange": "ground_exchange", "practice_hidden_mass": "hidden_mass",
    "practice_infiltration": "infiltration", "practice_interfloor_exchange": "interfloor_exchange",
    "practice_internal_gains": "internal_gains", "practice_none_prbs": "", "practice_none_schedule": "",
    "practice_roof_exchange": "roof_exchange", "practice_sensor_bias": "sensor_bias",
    "practice_solar_gain": "solar_gain", "practice_zone_mixing": "zone_mixing",
}  # fmt: skip


@pytest.mark.long
@pytest.mark.parametrize(("name", "effect"), LABELLED.items())
def test_a_labelled_case_is_told_what_it_holds(name: str, effect: str) -> None:
    verdict = seek(shared(name)).verdict
    if effect:
        assert verdict.name in ("named", "group") and effect in verdict.candidates[0].group
    else:
        assert verdict.name == "no_gap"
