"""Devices make the graph: who feeds whom, what emits heat beside the terminals, and what nobody knows."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest

from mpc.loop.make import equip
from thermal import Building
from thermal.case.building import Device
from thermal.case.validation import unknown_device_types
from thermal.components.component import Component, Conditions
from thermal.components.radiators import Radiators
from thermal.components.registry import COMPONENTS, register_component
from thermal.errors import ModelError
from thermal.pilot.building import pilot_building
from thermal.system.devices import device_graph
from thermal.system.plant import HvacPlant
from thermal.system.sizing import size_system


@dataclass(frozen=True)
class Fed:
    """A device with what feeds it, as cases of format 3 have it."""

    name: str
    type: str
    zone: str | None = None
    fed_by: tuple[str, ...] = ()


@pytest.fixture(scope="module")
def office() -> Building:
    return pilot_building(1, floor_area=600.0, zones=12, name="office")


def test_without_fed_by_each_floor_has_its_air_handler(office: Building) -> None:
    graph = device_graph(office)
    assert graph.air_handlers == ("AHU_F1", "AHU_F2")
    assert [graph.air_handlers[k][-2:] for k in graph.serving] == [name[:2] for name in office.zone_names]
    assert graph.emitters == {} and graph.unused == {}


def test_fed_by_decides(office: Building) -> None:
    first = next(d for d in office.devices if d.type == "vav")
    assert device_graph(office).serving[office.zone_names.index(str(first.zone))] == 0
    devices = tuple(
        Fed(d.name, d.type, d.zone, ("AHU_F2",)) if d is first else d for d in office.devices
    )  # fmt: skip
    graph = device_graph(replace(office, devices=devices))  # type: ignore[arg-type]
    assert graph.serving[office.zone_names.index(str(first.zone))] == 1
    astray = (*office.devices, Fed("more", "vav", office.zone_names[0], ("AHU_F9",)))
    with pytest.raises(ModelError, match=r"device 'more': fed_by: expected a device, .*'AHU_F9'.*AHU_F"):
        device_graph(replace(office, devices=astray))  # type: ignore[arg-type]


def test_radiators_of_a_case_are_sized_and_connected_and_unknown_types_are_named(office: Building) -> None:
    zone = office.zone_names[3]
    more = [Device(name=name, type="radiator", zone=zone) for name in ("RAD_A", "RAD_B")]
    building = replace(office, devices=(*office.devices, *more, Device(name="ODD", type="ice_storage")))
    assert device_graph(building).unused == {"ODD": "no component has the type 'ice_storage'"}
    plain, system = size_system(office), size_system(building)
    radiators = system.components["RADIATOR"]
    assert isinstance(radiators, Radiators) and radiators.zone.tolist() == [3, 3]
    assert radiators.nominal_heat[0] == radiators.nominal_heat[1] > 100.0
    assert system.loop.pump.design_flow == pytest.approx(plain.loop.pump.design_flow + radiators.water_flow.sum())
    n = system.zone_count
    conditions = Conditions(np.full(n, 292.0), np.full(n, 294.0), np.full(n, 298.0), 270.0)
    chosen = {"supply_air_temperature_setpoint": 289.0, "supply_water_temperature_setpoint": 345.0}
    heats = []
    for each in (plain, system):
        plant = HvacPlant(each)
        _, step = plant.step(plant.start(supply_water_temperature=345.0), conditions, each.actions(**chosen), 300.0)
        heats.append(plant.heat(step))
    gained = heats[1] - heats[0]
    assert gained[3] > 100.0 and np.abs(np.delete(gained, 3)).max() < 1e-6


def test_a_registered_device_that_no_rule_connects_is_known_and_said_to_be_left_out(office: Building) -> None:
    class ExhaustFan(Component):
        label, device = "exhaust fan", "exhaust_fan"

    odd = Device(name="FAN", type="exhaust_fan")
    building = replace(office, devices=(*office.devices, odd))
    assert unknown_device_types(building) == {"FAN": "exhaust_fan"}
    register_component(ExhaustFan)
    try:
        assert unknown_device_types(building) == {}
        assert device_graph(building).unused == {"FAN": "exhaust_fan, no rule connects it: pass the system"}
        _, notes = equip(building)
        assert [n for n in notes if "FAN (exhaust_fan, no rule connects it" in n]
        with pytest.raises(ModelError, match="component ExhaustFan: expected a class with a classmethod `sized`"):
            ExhaustFan.sized(1.0)
    finally:
        del COMPONENTS["exhaust_fan"]
