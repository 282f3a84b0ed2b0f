"""Heat that follows from dampers and valves is fitted about as well as metered heat, and their sizes are found."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from calibration import calibrate
from calibration.fit.result import CalibrationResult
from thermal.case.case import Case
from thermal.case.load import load_case
from thermal.case.plan import zone_sizes

LUMPED = {"starts": 1, "structure": {"lumped": True, "sun": True}}


@pytest.fixture(scope="module")
def metered(bundled_case_in: Callable[[str], Path]) -> Case:
    return load_case(bundled_case_in("15min"))


@pytest.fixture(scope="module")
def with_meters(metered: Case) -> float:
    """Error where the flows are metered [K]."""
    return error(calibrate(metered, settings=LUMPED))


def told(case: Case, kind: str) -> tuple[Case, dict[str, float]]:
    """Replace flows by dampers, or all heat by valves; the sizes by device are [kg/s/m2] or [W/m2]."""
    frame, heat, truth = case.telemetry.frame.copy(), case.zone_heat(), {}
    areas = {zone: area for zone, (area, _) in zone_sizes(case.building).items()}
    for number, device in enumerate(case.building.devices):
        given = frame.pop(f"{device.name}/supply_air_flowrate_sensor")
        point = "supply_air_damper_percentage_command"
        if kind == "valve":
            frame = frame.drop(columns=f"{device.name}/discharge_air_temperature_sensor")
            given, point = heat[device.zone].clip(lower=0.0), "heating_water_valve_percentage_command"
        largest = float(given.max()) * (1.2 + 0.1 * number)
        frame[f"{device.name}/{point}"] = given / largest
        truth[device.name] = largest / areas[str(device.zone)]
    return replace(case, telemetry=replace(case.telemetry, frame=frame), judged=None), truth


def error(result: CalibrationResult) -> float:
    return result.calibrated["held_out"].metrics.mae


@pytest.mark.parametrize(("kind", "name"), [("damper", "damper_airflow"), pytest.param("valve", "valve_heat", marks=pytest.mark.long)])
def test_sizes_are_found_and_errors_are_those_with_meters(
    metered: Case, with_meters: float, kind: str, name: str
) -> None:
    case, truth = told(metered, kind)
    assert {own.kind for own in case.building.commanded} == {kind}
    found = calibrate(case, settings={**LUMPED, "yardsticks": kind == "valve"})
    assert error(found) < 1.05 * with_meters
    intervals = {p.name.partition("@")[2]: p.interval90 for p in found.parameters if p.base == name}
    held = [low < truth[device] < high for device, (low, high) in intervals.items()]
    assert len(held) == 5 and np.mean(held) >= 0.8
    if kind == "valve":
        beside = found.calibrated["held_out"].yardsticks
        assert beside is not None and beside.rc is not None and beside.rc < beside.persistence / 3.0
        assert "no meter tells" in beside.reasons["rc"]
