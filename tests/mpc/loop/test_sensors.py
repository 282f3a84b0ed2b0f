"""What sensors say is what happened, with noise of the size that was asked for."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml

from mpc.errors import PlantError
from mpc.loop.noise import SensorNoise
from mpc.loop.sensors import plant_devices
from mpc.loop.simulated import SimulatedPlant
from thermal import Building, load_case, save_case
from thermal.case.building import Device
from thermal.case.points import POINT_TYPES, split_column
from thermal.system.system import HvacSystem

Drive = Callable[..., SimulatedPlant]


def test_metered_heat_is_what_the_zones_received(make_plant: Drive, drive: Drive) -> None:
    """By the case format's own formula, of the telemetry alone."""
    plant = drive(make_plant(), 150)
    metered = plant.case().zone_heat().to_numpy()
    given = np.array([plant.loop.hvac.heat(step.done) for step in plant._steps])
    np.testing.assert_allclose(metered, given, atol=1e-6)


def test_meters_add_up_to_the_power_taken(make_plant: Drive, drive: Drive) -> None:
    plant = drive(make_plant(), 150)
    frame, record = plant.telemetry(), plant.record()
    power = frame.filter(regex="/(electrical|pump)_power_sensor").sum(axis=1)
    np.testing.assert_allclose(power, record.electricity, atol=1e-6)
    assert record.gas is not None
    np.testing.assert_allclose(frame.filter(regex="/gas_power_sensor").sum(axis=1), record.gas, atol=1e-6)
    assert frame["CHILLER/electrical_power_sensor"].max() > 0.0


def test_noise_is_of_its_size_and_leaves_commands_alone(make_plant: Drive, drive: Drive) -> None:
    noise = SensorNoise(temperature=0.1, resolution=0.0, flow=0.05, power=0.02)
    clean, noisy = drive(make_plant()).telemetry(), drive(make_plant(noise=noise)).telemetry()
    change = noisy - clean
    assert change.filter(like="zone_air_temperature_sensor").to_numpy().std() == pytest.approx(0.1, rel=0.05)
    for point, size in (("supply_air_flowrate_sensor", 0.05), ("gas_power_sensor", 0.02)):
        share = (change.filter(like=point) / clean.filter(like=point)).to_numpy()
        assert np.nanstd(share) == pytest.approx(size, rel=0.1)
    for like in ("_setpoint", "_command"):
        assert not change.filter(like=like).to_numpy().any()


def test_temperatures_come_in_steps_of_the_resolution(make_plant: Drive, drive: Drive) -> None:
    frame = drive(make_plant(noise=SensorNoise(resolution=0.5)), 5).telemetry()
    degrees = frame.filter(like="temperature_sensor").to_numpy() - 273.15
    np.testing.assert_allclose(degrees * 2.0, np.round(degrees * 2.0), atol=1e-9)


def test_all_values_are_possible_ones(make_plant: Drive, drive: Drive) -> None:
    """Day and night, by the ranges of the case format."""
    frame = drive(make_plant(count_people=True)).telemetry()
    for column in frame:
        point = POINT_TYPES[split_column(str(column), "test")[1]]
        assert frame[column].between(point.lowest, point.highest).all(), column


def test_a_device_too_few_or_too_many_is_named(building: Building, system: HvacSystem) -> None:
    devices = building.devices
    assert plant_devices(building, system).count == len(devices) == 16
    with pytest.raises(PlantError, match="zone 'F1_.*'vav'"):
        plant_devices(replace(building, devices=devices[1:]), system)
    with pytest.raises(PlantError, match="'extra'"):
        more = Device(name="extra", type="vav", zone=building.zone_names[0])
        plant_devices(replace(building, devices=(*devices, more)), system)
    with pytest.raises(PlantError, match="'ahu'"):
        plant_devices(replace(building, devices=tuple(d for d in devices if d.name != "AHU_F1")), system)
    with pytest.raises(PlantError, match="'chiller'"):
        plant_devices(replace(building, devices=(*devices, Device(name="second", type="chiller"))), system)
    with pytest.raises(PlantError, match="sensor noise: flow"):
        SensorNoise(flow=-0.1)


def test_pressures_are_in_the_telemetry_and_in_the_case(make_plant: Drive, drive: Drive, tmp_path: Path) -> None:
    """Of format 2, which a saved case then says; nothing else is measured otherwise."""
    setpoints = {"AHU_F1/supply_air_static_pressure_setpoint": 150.0, "BOILER/differential_pressure_setpoint": 4e4}
    plant = drive(make_plant(pressures=True, noise=SensorNoise()), 150, setpoints)
    plain = drive(make_plant(noise=SensorNoise()), 150, setpoints)
    frame = plant.telemetry()
    assert frame["AHU_F1/supply_air_static_pressure_setpoint"].eq(150.0).all()
    on = frame["AHU_F1/supply_air_static_pressure_sensor"].iloc[120:]
    assert on.mean() == pytest.approx(150.0, rel=0.01) and on.std() > 0.0
    assert frame["BOILER/differential_pressure_sensor"].iloc[-1] == pytest.approx(4e4, rel=0.05)
    saved = [yaml.safe_load((save_case(p.case(), tmp_path / name) / "building.yaml").read_text())
             for name, p in (("with", plant), ("without", plain))]  # fmt: skip
    assert [content["format"] for content in saved] == [3, 3]
    assert saved[0]["units"]["differential_pressure_sensor"] == "Pa"
    again = load_case(tmp_path / "with").telemetry.frame
    np.testing.assert_allclose(again[frame.columns], frame)
    commands = [c for c in plain.columns if c.endswith(("_setpoint", "_command"))]
    assert plain.telemetry()[commands].equals(frame[commands])
