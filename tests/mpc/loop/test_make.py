"""Plants in one call, and the pilot as a case folder."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from mpc.errors import PlantError
from mpc.loop.make import pilot_weather, save_pilot, simulated_plant
from mpc.loop.noise import SensorNoise
from thermal.case.points import POINT_TYPES
from thermal.pilot.building import pilot_building

START, END = "2023-01-09", "2023-01-10"


def test_the_pilot_has_the_papers_devices() -> None:
    building = pilot_building()
    kinds = [d.type for d in building.devices]
    assert len(kinds) == 127 and len(building.zone_names) == 123
    assert [kinds.count(kind) for kind in ("vav", "ahu", "boiler", "chiller")] == [123, 2, 1, 1]


def test_a_case_of_the_pilot_is_a_case_like_any_other(tmp_path: Path) -> None:
    case = save_pilot(tmp_path / "small", seed=1, days=1, floor_area=600.0, zones=12, dx=1.0)
    assert len(case.building.devices) == 16 and case.step == 300.0 and len(case.stamps) == 288
    points = {column.rpartition("/")[2] for column in case.telemetry.frame}
    assert points <= set(POINT_TYPES) and {"heating_water_valve_percentage_command", "gas_power_sensor"} <= points
    assert np.isfinite(case.zone_heat().to_numpy()).all()
    again = save_pilot(tmp_path / "again", seed=1, days=1, floor_area=600.0, zones=12, dx=1.0)
    np.testing.assert_array_equal(case.telemetry.frame, again.telemetry.frame)


def test_setpoints_and_noise_are_choices(tmp_path: Path) -> None:
    case = save_pilot(
        tmp_path / "small", seed=1, days=1, floor_area=600.0, zones=12, dx=1.0,
        noise=SensorNoise(0.0, 0.0, 0.0, 0.0), setpoints={"supply_water_temperature_setpoint": 345.15},
    )  # fmt: skip
    assert (case.telemetry.frame["BOILER/supply_water_temperature_setpoint"].round(6) == 345.15).all()


@pytest.mark.parametrize("kind", ["reduced", "grid", "random"])
def test_each_kind_of_model_runs(kind: str) -> None:
    building = pilot_building(1, floor_area=600.0, zones=12)
    plant = simulated_plant(
        building, pilot_weather(1, START, 1.0), START, END, model=kind, dx=1.0, horizon=6, warm_up_days=0,  # type: ignore[arg-type]
    )  # fmt: skip
    plant.reset()
    plant.step(plant.default_actions)
    assert len(plant.forecast().table) == 6


def test_an_unknown_kind_is_refused() -> None:
    building = pilot_building(1, floor_area=600.0, zones=12)
    with pytest.raises(PlantError, match="'reduced', 'grid' or 'random'"):
        simulated_plant(building, pilot_weather(1, START, 1.0), START, END, model="fine")  # type: ignore[arg-type]
