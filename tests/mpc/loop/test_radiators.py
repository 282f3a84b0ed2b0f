"""Radiators that a case has are in its closed loop: heat of air and surfaces, points, and a balance that closes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mpc.loop.make import PlantSettings, pilot_weather, simulated_plant
from thermal.case.building import Device
from thermal.pilot.building import pilot_building


def test_radiators_warm_their_zones_and_energy_closes() -> None:
    office = pilot_building(1, floor_area=600.0, zones=12, name="office")
    warm = office.zone_names[:3]
    more = [Device(name=f"RAD_{zone}", type="radiator", zone=zone) for zone in warm]
    ends = []
    for building in (office, replace(office, devices=(*office.devices, *more))):
        plant = simulated_plant(
            building, pilot_weather(1, "2023-01-09", 2), "2023-01-09", "2023-01-10", PlantSettings(dx=1.0)
        )
        plant.reset()
        for _ in range(120):
            plant.step(plant.default_actions)
            balance = plant.balance()
            assert abs(balance.residual) < 1e-9 * balance.turnover
        ends.append(plant.record().zone_temperature[84:].mean(axis=0))
    gained = ends[1] - ends[0]
    assert (gained[:3] > 0.02).all() and gained[:3].min() > np.abs(gained[6:]).max()
    frame = plant.telemetry()
    assert (frame[[f"RAD_{zone}/heating_power_sensor" for zone in warm]].max() > 100.0).all()
    assert plant.loop.radiant  # what falls on surfaces goes there


def test_a_floor_takes_the_heat_of_its_heater_and_energy_closes() -> None:
    office = pilot_building(1, floor_area=600.0, zones=12, name="office")
    warm, ends, signals = office.zone_names[0], [], []
    for emitter in ("air", "floor"):
        heater = Device(name="RAD", type="radiator", zone=warm, emitter=emitter)
        building = replace(office, devices=(*office.devices, heater))
        plant = simulated_plant(
            building, pilot_weather(1, "2023-01-09", 2), "2023-01-09", "2023-01-10", PlantSettings(dx=1.0)
        )
        plant.reset()
        for _ in range(108):
            plant.step(plant.default_actions)
            balance = plant.balance()
            assert abs(balance.residual) < 1e-9 * balance.turnover
        assert plant.telemetry()["RAD/heating_power_sensor"].max() > 100.0
        signals.append([s.name for s in plant.model.network.signals])
        ends.append(plant.record().zone_temperature[84:, 0])
        # air comes into the room too, from which a heat that is only planned is not told apart
        assert not plant.model.network.emitted.any()
    assert f"heat by floor in {warm}" in signals[1] and f"heat by floor in {warm}" not in signals[0]
    assert np.abs(ends[1] - ends[0]).mean() > 0.02
