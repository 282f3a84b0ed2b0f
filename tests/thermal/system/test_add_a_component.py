"""The page that adds a component, followed to the letter."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from mpc.loop.actuators import actuators_of
from thermal.case.building import Device
from thermal.components.air_handler import AirHandler
from thermal.components.boiler_loop import BoilerLoop
from thermal.components.component import Component
from thermal.components.pump import Pump
from thermal.components.radiators import Radiators
from thermal.components.registry import COMPONENTS, register_component
from thermal.errors import ModelError
from thermal.pilot.building import pilot_building
from thermal.system.connections import Connection
from thermal.system.plant import HvacPlant
from thermal.system.points import HvacPoints
from thermal.system.sizing import size_system
from thermal.system.smooth import SmoothHvac
from thermal.system.symbolic import hvac_function

PAGE = Path(__file__).parents[3] / "docs" / "add_a_component.md"


@pytest.fixture(scope="module")
def page() -> Iterator[dict[str, Any]]:
    """Names that the page's blocks leave behind, run one after the other as a module."""
    module = ModuleType("page_of_a_component")
    sys.modules[module.__name__] = module  # annotations are looked up in it
    known = dict(COMPONENTS)
    for block in re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL):
        exec(compile(block, str(PAGE), "exec"), module.__dict__)
    yield module.__dict__
    COMPONENTS.clear()
    COMPONENTS.update(known)
    del sys.modules[module.__name__]


def test_the_page_runs_and_its_component_is_registered(page: dict[str, Any]) -> None:
    assert COMPONENTS["electric_baseboard"] is page["Baseboards"]
    with pytest.raises(ModelError, match=r"Baseboards.capacity\[0\]: expected 1 to 100000 W"):
        page["Baseboards"](np.array([0.0]), np.array([0]))


def test_devices_of_its_type_join_a_sized_system(page: dict[str, Any]) -> None:
    office = pilot_building(1, floor_area=600.0, zones=12, name="office")
    device = Device(name="BASE", type="electric_baseboard", zone=office.zone_names[5])
    group = size_system(replace(office, devices=(*office.devices, device))).components["ELECTRIC_BASEBOARD"]
    assert isinstance(group, page["Baseboards"]) and group.zone.tolist() == [5]


def test_a_type_of_two_classes_is_refused(page: dict[str, Any]) -> None:
    class Other(Component):
        device = "electric_baseboard"

    with pytest.raises(ModelError, match="component Other: device: expected a type of device beside .*boiler"):
        register_component(Other)
    with pytest.raises(ModelError, match="found ''"):
        register_component(Component)


def test_a_heat_pump_supplies_the_water_of_plant_predictor_and_points(page: dict[str, Any]) -> None:
    system, conditions, step = page["warm"], page["conditions"], page["warmed"]
    assert system.water_suppliers == ("CARNOT_HEAT_PUMP",) and list(system.states) == ["CARNOT_HEAT_PUMP/supply_water_temperature"]
    known = system.defaults | page["setpoints"]
    found = hvac_function(system, 0.0)(
        CARNOT_HEAT_PUMP_supply_water_temperature=318.0, seconds=300.0, **conditions._asdict(),
        **{point: [known[key] for key in keys] for point, keys in system.by_point.items()},
    )  # fmt: skip
    assert np.allclose(np.array(found["heat"]).ravel(), page["pump_plant"].heat(step))
    assert float(found["CARNOT_HEAT_PUMP_supply_water_temperature_end"]) == pytest.approx(page["after"].values[0])
    points = HvacPoints(system)
    read = dict(zip(points.columns, points.read(conditions, page["setpoints"], step), strict=True))
    assert read["CARNOT_HEAT_PUMP/electrical_power_sensor"] == pytest.approx(step.results["CARNOT_HEAT_PUMP"].electric_power)


def test_derivatives_of_a_heat_pump_are_those_of_finite_differences(page: dict[str, Any]) -> None:
    smooth = SmoothHvac(page["warm"], 0.02, setpoints=True)
    n, zone = smooth.n_zone, np.array([[293.5, 292.0]])
    values = {"supply_water_temperature_setpoint": 320.0, "supply_air_temperature_setpoint": 288.0}
    values |= {"zone_air_heating_temperature_setpoint": 294.0, "zone_air_cooling_temperature_setpoint": 298.0}
    inputs = np.empty((1, smooth.n_input))
    for name, at in smooth.inputs.items():
        inputs[:, at] = values.get(name, 318.0)
    given = {"seconds": np.array([300.0]), "outdoor_temperature": np.array([270.0])}
    given |= {"outdoor_humidity": np.array([0.004])}
    given |= {name: np.full((1, n), value) for name, value in values.items() if name.startswith("zone")}
    exogenous, stepper = smooth.surroundings(given), smooth.stepper()

    def outputs(inputs: np.ndarray) -> np.ndarray:
        stepper.zone[:], stepper.inputs[:], stepper.exogenous[:] = zone[0], inputs, exogenous[0]
        return stepper.step().copy()

    sums = outputs(inputs[0])[None, n + 3 : n + 3 + smooth.n_sum]
    jacobian, step = smooth.jacobian(zone, inputs, exogenous, sums), 1e-4
    for k in range(smooth.n_input):
        change = np.zeros(smooth.n_input)
        change[k] = step
        slope = (outputs(inputs[0] + change) - outputs(inputs[0] - change))[: n + 3] / (2.0 * step)
        exact = np.concatenate([jacobian.heat_by_inputs[0, :, k], jacobian.totals_by_inputs[0, :, k]])
        assert np.allclose(exact, slope, rtol=1e-5, atol=1e-4)


def test_two_of_a_kind_keep_their_own_states_and_a_port_has_one_supplier(page: dict[str, Any]) -> None:
    radiators, second = Radiators.sized([800.0], np.array([1])), page["CarnotHeatPump"](1e4, tank=1e6)
    warm = page["warm"]
    with pytest.raises(ModelError, match="SECOND: port 'hot_water'.*expected a connection for its water, found none"):
        warm.with_component("SECOND", second)
    with pytest.raises(ModelError, match="RAD: port 'hot_water'.*expected one connection for its water, found none"):
        warm.with_component("RAD", radiators)
    with pytest.raises(ModelError, match="having: expected a component.*'CARNOT_HEAT_PUMP'"):
        warm.having(CARNOT_HEAT_PUMPS=second)
    joined = warm.with_component("RAD", radiators, hot_water="CARNOT_HEAT_PUMP")
    both = joined.with_component("SECOND", second, feeds=("RAD",))
    with pytest.raises(ModelError, match="RAD: port 'hot_water'.*expected one connection for its water, found 2"):
        links = [c for c in both.connections if c.consumer != "RAD"]
        replace(both, connections=(*links, Connection("RAD", "hot_water", ("CARNOT_HEAT_PUMP", "SECOND"))))
    plant = HvacPlant(both)
    start = plant.start(**{"CARNOT_HEAT_PUMP/supply_water_temperature": 318.0, "SECOND/supply_water_temperature": 308.0})
    assert start.values == (318.0, 308.0)
    assert plant.start(**{"SECOND/supply_water_temperature": 308.0}).values == (313.15, 308.0)
    told = {"SECOND/supply_water_temperature_setpoint": 310.0, "CARNOT_HEAT_PUMP/supply_water_temperature_setpoint": 320.0}
    actions = both.actions(supply_air_temperature_setpoint=288.0, **told)
    after, _ = plant.step(start, page["conditions"], actions, 300.0)
    assert after.values[0] > 316.0 and after.values[1] < 312.0


def test_a_component_that_cannot_be_sized_and_a_missing_input_are_named(page: dict[str, Any]) -> None:
    with pytest.raises(ModelError, match="component AirHandler: expected a class with a classmethod `sized`"):
        AirHandler.sized(1.0)
    smooth = SmoothHvac(page["warm"])
    with pytest.raises(ModelError, match="exogenous inputs: expected values of 'outdoor_temperature', found none"):
        smooth.surroundings({"seconds": np.array([300.0])} | dict.fromkeys(
            ("zone_air_heating_temperature_setpoint", "zone_air_cooling_temperature_setpoint"), np.full((1, 2), 294.0)
        ))  # fmt: skip


def test_ranges_of_setpoints_are_their_components(page: dict[str, Any]) -> None:
    radiators = Radiators.sized([800.0], np.array([1]))
    loop = BoilerLoop(2e4, Pump(1.0))
    joined = page["warm"].with_component("RAD", radiators, hot_water="CARNOT_HEAT_PUMP")
    both = joined.with_component("BOILER", loop, feeds=("RAD",))
    found = {a.name: (a.lowest, a.highest) for a in actuators_of(both, ["west", "east"])}
    assert found["CARNOT_HEAT_PUMP/supply_water_temperature_setpoint"] == (300.0, 330.0)
    assert found["BOILER/supply_water_temperature_setpoint"] == (310.0, 355.0)
