"""A controller on a plant."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
import pytest

from mpc.errors import PlantError
from mpc.loop.plant import Measurements, Plant, RestorablePlant
from mpc.loop.run import FixedSetpoints, run_closed_loop
from mpc.loop.simulated import SimulatedPlant
from mpc.scenario.forecast import Forecast, Forecaster
from mpc.scenario.scenario import Scenario

Make = Callable[..., SimulatedPlant]
AIR, WATER = "supply_air_temperature_setpoint", "supply_water_temperature_setpoint"


def test_our_plant_is_a_plant(make_plant: Make) -> None:
    plant: Plant = make_plant()
    other: RestorablePlant = make_plant()
    assert plant.zone_names == other.zone_names


def test_setpoints_by_kind_by_name_and_by_hour(make_plant: Make) -> None:
    plant = make_plant()
    night = {18.0: {WATER: 320.0}, 6.0: {WATER: 340.0, f"AHU_F1/{AIR}": 288.0}}
    fixed = FixedSetpoints({AIR: 286.0, WATER: 330.0}, plant.actuators, night)
    assert fixed.at_hour(12.0) == {f"AHU_F1/{AIR}": 288.0, f"AHU_F2/{AIR}": 286.0, f"BOILER/{WATER}": 340.0}
    assert fixed.at_hour(2.0)[f"BOILER/{WATER}"] == fixed.at_hour(23.0)[f"BOILER/{WATER}"] == 320.0
    with pytest.raises(PlantError, match="nearest valid one is 'supply_air_temperature_setpoint'"):
        FixedSetpoints({"supply_air_temperature": 286.0}, plant.actuators)
    with pytest.raises(PlantError, match="hours"):
        FixedSetpoints({}, plant.actuators, {24.0: {}})


def test_a_run_keeps_what_was_seen_and_set(make_plant: Make) -> None:
    plant = make_plant(control_steps=3)
    run = run_closed_loop(plant, FixedSetpoints({AIR: 286.0, WATER: 330.0}, plant.actuators), steps=20, seed=1)
    assert run.measurements.shape == (20, len(plant.columns)) and run.actions.shape == (20, 3)
    assert run.record.n_steps == 60
    assert run.record.controller_seconds is not None and len(run.record.controller_seconds) == 20
    assert (run.actions[f"BOILER/{WATER}"] == 330.0).all()
    np.testing.assert_array_equal(run.measurements[f"BOILER/{WATER}"], 330.0)


def test_a_controller_gets_forecasts_where_asked(make_plant: Make, scenario: Callable[..., Scenario]) -> None:
    sc, asked = scenario(), []

    class Listener:
        def step(self, measurements: Measurements, forecast: Forecast | None) -> Mapping[str, float]:
            assert forecast is not None
            asked.append(forecast.table.index[0] - measurements.stamp)
            return plant.default_actions

    plant = make_plant(sc, forecaster=Forecaster(sc, 6))
    run_closed_loop(plant, Listener(), steps=5, forecasts=True)
    assert [a.total_seconds() for a in asked] == [300.0] * 5
