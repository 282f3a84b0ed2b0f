"""Plants sized from loads: they carry the design day, and their parts fit each other."""

from __future__ import annotations

import numpy as np
import pytest

from thermal import Building, Simulator, load_bundled_case
from thermal.components.component import Conditions
from thermal.errors import ModelError
from thermal.pilot.building import pilot_building
from thermal.system.plant import HvacPlant
from thermal.system.sizing import DesignConditions, size_system
from thermal.units import AIR_HEAT_CAPACITY


@pytest.fixture(scope="module")
def office() -> Building:
    return pilot_building(1, floor_area=600.0, zones=12, name="office")


def test_the_design_day_is_held(office: Building) -> None:
    """Full calls in the design winter bring the steady heat loss, oversized; the boiler carries them all."""
    at, system = DesignConditions(), size_system(office)
    n = system.zone_count
    zones = np.full(n, at.heating)
    plant = HvacPlant(system)
    conditions = Conditions(zones, zones + 5.0, zones + 8.0, at.winter_outdoor)
    state = plant.start(supply_water_temperature=at.supply_water)
    actions = system.actions(
        supply_air_temperature_setpoint=at.supply_air, supply_water_temperature_setpoint=at.supply_water
    )
    for _ in range(12):
        state, step = plant.step(state, conditions, actions, 300.0)
    simulator = Simulator(office, dx=1.0, step_seconds=3600.0)
    simulator.reset(zones, np.array([at.winter_outdoor]))
    after = simulator.step(plant.heat(step), np.array([at.winter_outdoor]))
    assert (after >= zones - 0.02).all()
    assert step.results["BOILER"].supply_water_temperature == pytest.approx(at.supply_water, abs=0.5)


def test_cooling_carries_gains_and_sun(office: Building) -> None:
    at, system = DesignConditions(), size_system(office)
    areas = 600.0
    most = AIR_HEAT_CAPACITY * system.terminals.design_flow.sum() * (at.cooling - at.supply_air)
    assert most > at.gains * areas
    for handler in system.air_handlers:
        assert handler.cooling is not None
        assert handler.cooling.capacity > AIR_HEAT_CAPACITY * handler.supply_fan.design_flow * 11.0


def test_each_floor_has_its_air_handler(office: Building) -> None:
    floors = [name[:2] for name in office.zone_names]
    assert (np.where(size_system(office).terminals.air_handler == 0, "F1", "F2") == floors).all()


def test_a_zone_table_gets_one_too() -> None:
    system = size_system(load_bundled_case().building)
    assert len(system.terminals) == 5 and len(system.air_handlers) == 1


def test_a_colder_winter_needs_more(office: Building) -> None:
    mild, cold = size_system(office), size_system(office, DesignConditions(winter_outdoor=253.15))
    assert cold.loop.capacity > 1.1 * mild.loop.capacity


@pytest.mark.parametrize("wrong", [{"winter_outdoor": 290.0}, {"oversizing": 0.5}, {"gains": -1.0}])
def test_conditions_that_mean_nothing_are_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(ModelError, match="design conditions"):
        DesignConditions(**wrong)
