"""Plants in one call, and the pilot as a case folder."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mpc.errors import PlantError
from mpc.loop.make import PlantSettings, pilot_weather, save_pilot, simulated_plant
from mpc.loop.noise import SensorNoise
from thermal import Building
from thermal.case.points import POINT_TYPES
from thermal.pilot.building import pilot_building

START, END = "2023-01-09", "2023-01-10"
SETTINGS = PlantSettings(dx=1.0, noise=SensorNoise(), seed=1)


@pytest.fixture(scope="module")
def office() -> Building:
    """Twelve zones."""
    return pilot_building(1, floor_area=600.0, zones=12)


def test_the_pilot_has_the_papers_devices() -> None:
    building = pilot_building()
    kinds = [d.type for d in building.devices]
    assert len(kinds) == 127 and len(building.zone_names) == 123
    assert [kinds.count(kind) for kind in ("vav", "ahu", "boiler", "chiller")] == [123, 2, 1, 1]


def test_a_case_of_the_pilot_is_a_case_like_any_other(office: Building, tmp_path: Path) -> None:
    case = save_pilot(tmp_path / "small", office, SETTINGS, days=1)
    assert len(case.building.devices) == 16 and case.step == 300.0 and len(case.stamps) == 288
    points = {column.rpartition("/")[2] for column in case.telemetry.frame}
    assert points <= set(POINT_TYPES) and {"heating_water_valve_percentage_command", "gas_power_sensor"} <= points
    assert np.isfinite(case.zone_heat().to_numpy()).all()
    again = save_pilot(tmp_path / "again", office, SETTINGS, days=1)
    np.testing.assert_array_equal(case.telemetry.frame, again.telemetry.frame)


def test_setpoints_and_noise_are_choices(office: Building, tmp_path: Path) -> None:
    exact = replace(SETTINGS, noise=SensorNoise(0.0, 0.0, 0.0, 0.0))
    setpoints = {"supply_water_temperature_setpoint": 345.15}
    case = save_pilot(tmp_path / "small", office, exact, days=1, setpoints=setpoints)
    assert (case.telemetry.frame["BOILER/supply_water_temperature_setpoint"].round(6) == 345.15).all()


@pytest.mark.parametrize("kind", ["reduced", "grid", "random"])
def test_each_kind_of_model_runs(office: Building, kind: str) -> None:
    settings = PlantSettings(kind=kind, dx=1.0, horizon=6, warm_up_days=0)  # type: ignore[arg-type]
    plant = simulated_plant(office, pilot_weather(1, START, 1.0), START, END, settings)
    plant.reset()
    plant.step(plant.default_actions)
    assert len(plant.forecast().table) == 6


def test_an_unknown_kind_is_refused() -> None:
    with pytest.raises(PlantError, match="one of reduced, grid, random, found 'fine'"):
        PlantSettings(kind="fine")  # type: ignore[arg-type]
