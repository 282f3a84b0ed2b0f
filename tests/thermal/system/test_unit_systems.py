"""Systems of units in zones, with what makes water for them: sized from a case's devices, in balance, differentiable."""

from __future__ import annotations

from dataclasses import replace

import casadi
import numpy as np
import pytest

from thermal import Building
from thermal.case.building import Device
from thermal.components.component import Conditions
from thermal.components.mixing_valve import MixingValve
from thermal.pilot.building import pilot_building
from thermal.system.devices import device_graph
from thermal.system.plant import HvacPlant
from thermal.system.points import HvacPoints, energy_balance
from thermal.system.sizing import size_system
from thermal.system.smooth import SmoothHvac
from thermal.system.symbolic import hvac_function
from thermal.system.system import HvacSystem

KINDS = {
    "heaters": (("electric_heater", "heat_recovery_ventilator"), ("battery",)),
    "floors": (("floor_heating", "radiator"), ("heat_pump", "storage_tank", "mixing_valve")),
    "district": (("radiator",), ("district_heating",)),
    "coils": (("fan_coil",), ("heat_pump", "chilled_water_plant")),
    "warm coils": (("fan_coil",), ("boiler",)),
    "unitary": (("unitary_heat_pump",), ()),
    "air and radiators": (("vav", "radiator"), ("ahu", "heat_pump", "storage_tank")),
}


@pytest.fixture(scope="module")
def house() -> Building:
    return pilot_building(1, floor_area=200.0, zones=4, name="house")


def of(house: Building, kind: str) -> Building:
    """Give the house the devices of a kind of system, one in each zone and one of each plant component."""
    in_zones, plant = KINDS[kind]
    devices = [Device(name=f"{each}_{zone}", type=each, zone=zone) for each in in_zones for zone in house.zone_names]
    return replace(house, devices=(*devices, *(Device(name=each, type=each) for each in plant)))


def met(temperature: float, outdoor: float, inside: float = 0.006) -> Conditions:
    zone = temperature + 0.1 * np.arange(4)
    return Conditions(zone, np.full(4, 293.0), np.full(4, 298.0), outdoor, 0.003, inside)


def told(system: HvacSystem) -> dict[str, float]:
    usual = {"supply_water_temperature_setpoint": 315.0, "supply_air_temperature_setpoint": 288.0}
    return system.actions(**{point: value for point, value in usual.items() if point in system.by_point})


@pytest.mark.parametrize("kind", KINDS)
def test_a_case_of_these_devices_is_sized_stepped_in_balance_and_a_function(house: Building, kind: str) -> None:
    building = of(house, kind)
    assert not device_graph(building).unused
    system = size_system(building)
    assert set(system.components) >= {each.upper() for each in KINDS[kind][0]}
    assert bool(system.air_handlers) == ("ahu" in KINDS[kind][1])
    plant, function = HvacPlant(system), hvac_function(system, 0.0)
    for conditions in (met(292.3, 268.0), met(299.0, 306.0, 0.011)):
        state, actions = plant.start(), told(system)
        first = state
        for _ in range(3):
            state, step = plant.step(state, conditions, actions, 300.0)
            balance = energy_balance(system, conditions, step)
            assert abs(balance.residual) <= 1e-9 * balance.turnover
            assert balance.electricity == pytest.approx(step.electric_power)
            assert balance.zones == pytest.approx(plant.heat(step).sum(), abs=1e-9)
        _, step = plant.step(first, conditions, actions, 300.0)
        chosen = system.defaults | actions
        found = function(**{
            **{key.replace("/", "_"): value for key, value in zip(system.states, first.values, strict=True)},
            "seconds": 300.0, **conditions._asdict(),
            **{point: [chosen[key] for key in keys] for point, keys in system.by_point.items()},
        })  # fmt: skip
        assert np.array(found["heat"]).ravel() == pytest.approx(plant.heat(step), rel=1e-9, abs=1e-6)
        assert float(found["electric_power"]) == pytest.approx(step.electric_power, rel=1e-9)
    heats = plant.heat(plant.step(plant.start(), met(292.3, 268.0), told(system), 300.0)[1])
    assert (heats > 0.0).all() or kind == "air and radiators"
    points = HvacPoints(system)
    assert len(points.columns) == len(points.read(met(292.3, 268.0), system.defaults | told(system), step))


@pytest.mark.parametrize("kind", ["floors", "coils", "unitary"])
def test_derivatives_are_finite_differences(house: Building, kind: str) -> None:
    system = size_system(of(house, kind))
    smooth, conditions = hvac_function(system, 0.02), met(292.6, 270.0)
    chosen = system.defaults | told(system)
    given = {key.replace("/", "_"): value for key, value in system.start().items()}
    given |= {"seconds": 300.0, **conditions._asdict()}
    given |= {point: [chosen[key] for key in keys] for point, keys in system.by_point.items()}
    symbols = {name: casadi.SX.sym(name, smooth.size1_in(name)) for name in smooth.name_in()}
    done = smooth(**symbols)
    out = casadi.vertcat(done["heat"], done["electric_power"])
    value = casadi.Function("v", list(symbols.values()), [out])
    names = [n for n in ("zone_temperature", "outdoor_temperature", "supply_water_temperature_setpoint") if n in symbols]
    for name in names:
        slope = casadi.Function("d", list(symbols.values()), [casadi.jacobian(out, symbols[name])])
        exact, point = np.array(slope(*(given[n] for n in symbols))), np.atleast_1d(given[name]).astype(float)
        for k in range(len(point)):
            ends = [np.array(value(*((given | {name: point + s * 1e-4 * np.eye(len(point))[k]})[n] for n in symbols)))
                    for s in (1.0, -1.0)]  # fmt: skip
            assert exact[:, k] == pytest.approx((ends[0] - ends[1]).ravel() / 2e-4, rel=1e-3, abs=0.05)
    assert SmoothHvac(system).n_zone == 4


def test_the_valve_holds_its_setpoint_and_floors_are_fed_by_it(house: Building) -> None:
    system = size_system(of(house, "floors"))
    feeds = {(c.consumer, c.port): c.suppliers for c in system.connections}
    assert feeds["FLOOR_HEATING", "hot_water"] == ("MIXING_VALVE",) and feeds["RADIATOR", "hot_water"] == (
        "STORAGE_TANK",
    )
    assert feeds["MIXING_VALVE", "primary"] == ("STORAGE_TANK",) and feeds["STORAGE_TANK", "charge"] == ("HEAT_PUMP",)
    plant = HvacPlant(system)
    start = plant.start(**{key: 325.0 for key in system.states})
    actions = system.actions(supply_water_temperature_setpoint=325.0, mixed_water_temperature_setpoint=308.0)
    _, step = plant.step(start, met(292.3, 268.0), actions, 60.0)
    done = step.results["MIXING_VALVE"]
    assert done.mixed_water_temperature == pytest.approx(308.0, abs=0.2) and 0.0 < done.position < 1.0
    fresh = step.results["STORAGE_TANK"].load - sum(step.results["RADIATOR"].heat)
    assert fresh == pytest.approx(done.load)
    assert isinstance(system.components["MIXING_VALVE"], MixingValve)


def test_a_zone_without_a_unit_gets_air(house: Building) -> None:
    some = replace(house, devices=(Device(name="one", type="electric_heater", zone=house.zone_names[0]),))
    assert device_graph(some).has_air and "VAV" in size_system(some).components
