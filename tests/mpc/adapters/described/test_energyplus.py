"""A described building of EnergyPlus: overwrites and their release, EnergyPlus' own means, and its weather ahead."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest

from mpc.adapters.described.load import load_plant
from mpc.errors import PlantError
from mpc.loop.plant import Measurements
from mpc.loop.run import run_closed_loop
from mpc.scenario.forecast import Forecast

pytestmark = pytest.mark.energyplus
pytest.importorskip("pyenergyplus", reason="needs the extra [energyplus]")
SETPOINT = "core/zone_air_heating_temperature_setpoint"
DESCRIPTION = """
format: 1
name: small_office
location: {latitude: 41.98, longitude: -87.92, elevation: 201.0, timezone: Etc/GMT+6}
plant:
  kind: energyplus
  model: RefBldgSmallOfficeNew2004_Chicago
  weather: USA_IL_Chicago-OHare.Intl.AP.725300_TMY3
  steps_per_hour: 6
control_step: 1800.0
period: {start: 2023-01-10, days: 1}
zones:
  core: {temperature: "CORE_ZN, Zone Mean Air Temperature", floor_area: 149.66}
measurements:
  core/zone_air_temperature_sensor: "CORE_ZN, Zone Mean Air Temperature"
  core/zone_air_heating_temperature_setpoint: "CORE_ZN, Zone Thermostat Heating Setpoint Temperature"
  site/electrical_power_sensor: "Electricity:HVAC"
  site/outside_air_temperature_sensor: "Environment, Site Outdoor Air Drybulb Temperature"
actuators:
  core/zone_air_heating_temperature_setpoint:
    {signal: "CORE_ZN, Zone Temperature Control, Heating Setpoint", range: [15 degC, 25 degC]}
energy: {electricity: ["Electricity:HVAC"]}
prices: {electricity: 0.2}
forecast: {hours: 6.0}
"""


class Warmer:
    """A setpoint of 23 degC in the third and fourth half-hour, and the building's own otherwise."""

    def __init__(self) -> None:
        self.taken, self.outdoor = 0, list[float]()

    def step(self, measurements: Measurements, forecast: Forecast | None) -> Mapping[str, float]:
        assert forecast is not None
        self.outdoor.append(float(forecast.table["outside_air_temperature_sensor"].iloc[0]))
        self.taken += 1
        return {SETPOINT: 296.15} if self.taken in (3, 4) else {}


def test_a_building_of_energyplus_by_single_signals(tmp_path: Path) -> None:
    path = tmp_path / "plant.yaml"
    path.write_text(DESCRIPTION)
    controller = Warmer()
    with load_plant(path) as plant:
        run = run_closed_loop(plant, controller, forecasts=True, steps=8)
    seen = run.measurements
    own = 273.15 + 15.6  # of the file's schedule at night
    np.testing.assert_allclose(seen[SETPOINT].iloc[:8], [own, own, 296.15, 296.15, own, own, own, own])
    assert seen["core/zone_air_temperature_sensor"].iloc[3] > seen["core/zone_air_temperature_sensor"].iloc[1] + 2.0
    np.testing.assert_allclose(seen["site/outside_air_temperature_sensor"], controller.outdoor, atol=0.2)
    assert (run.record.step, run.record.n_steps) == (600.0, 24)
    np.testing.assert_allclose(run.record.electricity.reshape(8, 3).mean(axis=1), seen["site/electrical_power_sensor"])
    assert seen["site/electrical_power_sensor"].iloc[2] > 100.0 and str(seen.index[-1]) == "2023-01-10 04:00:00-06:00"


def test_names_that_energyplus_lacks(tmp_path: Path) -> None:
    path = tmp_path / "plant.yaml"
    path.write_text(DESCRIPTION)
    wrong = {"actuators": {SETPOINT: "CORE_ZN, Heating Setpoint"}}
    with pytest.raises(PlantError, match=r"expected a signal 'KEY, Component Type, Control Type', found 'CORE_ZN, Heating"):
        load_plant(path, changes=wrong)
    with pytest.raises(PlantError, match="expected whole steps of 600 s, found 900 s"):
        load_plant(path, changes={"control_step": 900.0})
    with pytest.raises(PlantError, match="expected midnight in a time zone, found 2023-01-10 06:00"):
        load_plant(path, changes={"period": {"start": "2023-01-10 06:00", "days": 1}})
