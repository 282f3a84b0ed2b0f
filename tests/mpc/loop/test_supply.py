"""Setpoints become actions; what does not change is not laid out again, and what does is."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from mpc.loop.operation import scheduled_operation
from mpc.loop.schedule import Schedule
from mpc.loop.sensors import plant_devices
from mpc.scenario.scenario import Scenario
from thermal import Building
from thermal.system.system import HvacSystem

AIR, WATER = "supply_air_temperature_setpoint", "supply_water_temperature_setpoint"


def test_actions_are_those_that_were_given(
    building: Building, system: HvacSystem, scenario: Callable[..., Scenario]
) -> None:
    devices = plant_devices(building, system)
    first, second = devices.air_handlers
    given = {f"{first}/{AIR}": 287.0, f"{second}/{AIR}": 289.0, f"{devices.boiler}/{WATER}": 333.0}
    supply = Schedule(scheduled_operation(scenario(), 2), devices.named(system), building.zone_names)
    actions, air, reach = supply.actions(given, (1.0, 0.0), 0.5)
    assert air == (287.0, 289.0) and actions[f"{devices.boiler}/{WATER}"] == 333.0
    assert set(actions) - set(given) == {f"{name}/{switch}" for name in devices.air_handlers
                                         for switch in ("fan_running", "ventilation")} | {"BOILER/boiler_running"}  # fmt: skip
    assert [actions[f"{name}/fan_running"] for name in devices.air_handlers] == [1.0, 0.0]
    assert (actions["BOILER/boiler_running"], actions[f"{first}/ventilation"], reach) == (1.0, 0.5, (1.0, 0.0))
    assert supply.actions(dict(given), (1.0, 0.0), 0.5)[0] is actions

    low = f"{first}/supply_air_static_pressure_setpoint"
    given[low] = 0.25 * system.static_pressures[0]  # the same mapping, changed since
    changed, _, reach = supply.actions(given, (1.0, 1.0), 0.5)
    assert changed[low] == given[low]
    assert reach == pytest.approx((0.5, 1.0))
