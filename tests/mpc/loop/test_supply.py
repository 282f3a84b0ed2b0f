"""Setpoints become actions; what does not change is not laid out again, and what does is."""

from __future__ import annotations

import pytest

from mpc.loop.sensors import plant_devices
from mpc.loop.supply import SupplySetpoints
from thermal import Building
from thermal.hvac._system import HvacSystem

AIR, WATER = "supply_air_temperature_setpoint", "supply_water_temperature_setpoint"


def test_actions_are_those_that_were_given(building: Building, system: HvacSystem) -> None:
    devices = plant_devices(building, system)
    first, second = devices.air_handlers
    given = {f"{first}/{AIR}": 287.0, f"{second}/{AIR}": 289.0, f"{devices.boiler}/{WATER}": 333.0}
    supply = SupplySetpoints(devices, system)
    actions, reach = supply.actions(given, (1.0, 0.0), 0.5)
    assert actions.supply_air_temperature == (287.0, 289.0) and actions.supply_water_temperature == 333.0
    assert actions.static_pressure == system.static_pressures and actions.differential_pressure is None
    assert (actions.running, actions.boiler, actions.ventilation, reach) == ((1.0, 0.0), 1.0, 0.5, (1.0, 0.0))
    assert supply.actions(dict(given), (1.0, 0.0), 0.5)[0] is actions

    low = f"{first}/supply_air_static_pressure_setpoint"
    given[low] = 0.25 * system.static_pressures[0]  # the same mapping, changed since
    changed, reach = supply.actions(given, (1.0, 1.0), 0.5)
    assert changed.static_pressure == (given[low], system.static_pressures[1])
    assert reach == pytest.approx((0.5, 1.0))
