"""Cases that others made: what calibration reaches on buildings in EnergyPlus and on a measured house."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import pytest

from calibration import CalibrationResult, CalibrationSettings, calibrate
from thermal import load_case

CASES = Path(__file__).parents[2].parent / "shared" / "cases"


@cache
def calibrated(name: str) -> CalibrationResult:
    if not (CASES / name).is_dir():
        pytest.skip(f"the shared case is not here: {CASES / name}")
    return calibrate(load_case(CASES / name), settings=CalibrationSettings(starts=1))


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
