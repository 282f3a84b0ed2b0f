"""Buildings without air handlers in closed loop: floors on a heat pump, fan coils, unitary heat pumps, heaters."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mpc.loop.make import PlantSettings, equip, pilot_weather, simulated_plant
from mpc.loop.simulated import SimulatedPlant
from thermal.case.building import Device
from thermal.pilot.building import pilot_building

KINDS = {
    "floors": (("floor_heating",), ("heat_pump", "storage_tank", "mixing_valve")),
    "coils": (("fan_coil",), ("heat_pump", "chilled_water_plant")),
    "unitary": (("unitary_heat_pump",), ()),
    "heaters": (("electric_heater", "heat_recovery_ventilator"), ("battery",)),
}


def plant_of(kind: str) -> SimulatedPlant:
    house = pilot_building(1, floor_area=200.0, zones=4, name="house")
    in_zones, single = KINDS[kind]
    devices = [Device(name=f"{each}_{zone}", type=each, zone=zone) for each in in_zones for zone in house.zone_names]
    building = replace(house, devices=(*devices, *(Device(name=f"THE_{each}", type=each) for each in single)))
    equipped, notes = equip(building)
    assert equipped.devices == building.devices and notes == ()
    weather = pilot_weather(1, "2023-01-09", 1.0)
    return simulated_plant(building, weather, "2023-01-09", "2023-01-09T12:00", PlantSettings(dx=1.0))


@pytest.mark.parametrize("kind", KINDS)
def test_it_holds_its_zones_in_balance(kind: str) -> None:
    plant = plant_of(kind)
    plant.reset()
    while not plant.finished:
        plant.step(plant.default_actions)
        balance = plant.balance()
        assert abs(balance.residual) <= 1e-9 * balance.turnover
    record = plant.record()
    occupied = record.zone_temperature[-24:]  # from 10 o'clock on
    assert 292.5 < occupied.min() and occupied.max() < 299.0
    assert np.sum(record.electricity) > 0.0 and not np.any(record.gas)


def test_what_a_floor_gives_goes_into_it() -> None:
    names = [signal.name for signal in plant_of("floors").model.network.signals]
    assert sum(name.startswith("heat by floor in ") for name in names) == 4
