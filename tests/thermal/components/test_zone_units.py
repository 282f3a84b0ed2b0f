"""Units in zones: electric heaters, fan coils, unitary heat pumps, ventilators, by hand and against closed forms."""

from __future__ import annotations

from typing import Any

import numpy as np
import psychrolib
import pytest
from hypothesis import given
from hypothesis import strategies as st

from thermal.components.component import Calls, Conditions, Given, Group
from thermal.components.electric_heaters import ElectricHeaters
from thermal.components.fan_coils import FanCoils
from thermal.components.operations import NumpyOperations, StepOperations
from thermal.components.radiators import HeatedFloors
from thermal.components.streams import HotWater, SupplyWater
from thermal.components.unitary_units import DX_COOLING, UnitaryUnits
from thermal.components.ventilators import Ventilators
from thermal.errors import ModelError

OPS, TWO = StepOperations(), np.array([0, 1])
COILS = FanCoils(np.array([4000.0, 2000.0]), np.array([3500.0, 2000.0]), TWO, np.array([0.3, 0.2]), np.full(2, 50.0))
WATER = {"hot_water": 318.15, "chilled_water": 280.15}


def at(zone: float, outdoor: float, inside: float = 0.006) -> Conditions:
    return Conditions(np.full(2, zone), None, None, outdoor, 0.003, inside)


def ran(group: Group, conditions: Conditions, warm: float, cold: float, water: dict[str, float] | None = None) -> Any:
    """Run a group of two, with water of constant temperatures [K] by port."""
    calls = Calls(np.full(2, warm), np.full(2, cold))
    done = group.run(OPS, Given(conditions, calls, {}, {}, 300.0, lambda port, message: None))
    if water is None:
        return done
    told: Any = None
    try:
        while True:
            port = done.send(told)
            told = SupplyWater(water[port]) if isinstance(told, HotWater) else HotWater(1.0, water[port])
    except StopIteration as end:
        return end.value


def test_an_electric_heater_is_on_for_the_call() -> None:
    done = ran(ElectricHeaters(np.array([1000.0, 500.0]), TWO), at(293.0, 270.0), 0.3, 0.0)
    assert done.heat.tolist() == [300.0, 150.0] == done.electric_power.tolist()
    assert done.radiant_heat == pytest.approx([90.0, 45.0])


def test_a_heated_floor_brings_its_nominal_heat() -> None:
    floor = HeatedFloors.sized([2000.0, 1000.0], TWO)
    assert floor.emitted(floor.water_flow, 15.0) == pytest.approx([2000.0, 1000.0], rel=1e-9)
    assert floor.radiant_share == 0.0


def test_fan_coils_bring_what_they_are_rated_for() -> None:
    """EN 1397: heat at 45 degC of water and 20 degC; total cooling at 7 degC, 27 degC and a wet bulb of 19 degC."""
    warm = ran(COILS, at(293.15, 270.0), 1.0, 0.0, WATER)
    assert warm.heat == pytest.approx([4050.0, 2050.0]) and not warm.cooling.any()
    cold = ran(COILS, at(300.15, 305.0, 0.0105), 0.0, 1.0, WATER)
    assert cold.cooling + cold.moisture == pytest.approx([3500.0, 2000.0], rel=1e-3)
    assert (0.6 < cold.cooling / (cold.cooling + cold.moisture)).all()
    assert ran(COILS, at(293.15, 270.0), 0.4, 0.0, WATER).heat == pytest.approx(0.4 * warm.heat)


@given(zone=st.floats(293.0, 303.0), inside=st.floats(0.003, 0.018), water=st.floats(278.0, 288.0))
def test_the_wet_surface_balances_air_and_water(zone: float, inside: float, water: float) -> None:
    ops, at_zone = NumpyOperations(), np.full(2, zone)
    surface = COILS.surface(ops, water, at_zone, inside)
    touched = COILS.air_flow * (1.0 - COILS.bypass)
    given_off = touched * (1006.0 * (at_zone - surface) + 2.454e6 * COILS._condensed(ops, surface, inside))
    assert given_off == pytest.approx((surface - water) / COILS.resistance, rel=1e-3, abs=1.0)


@pytest.mark.parametrize(("temperature", "inside", "total"), [(300.0, 0.010, 4000.0), (297.0, 0.012, 5000.0)])
def test_the_apparatus_dew_point_is_on_the_line_of_the_process(
    temperature: float, inside: float, total: float
) -> None:
    """Beside psychrolib: a coil of 0.3 kg/s with a bypass of 0.1 leaves air on the line to its dew point."""
    unit = UnitaryUnits(np.array([4e3]), np.array([4e3]), np.zeros(1, int), np.array([0.3]), np.array([50.0]))
    share = unit.sensible_share(OPS, np.array([total]), np.array([temperature]), inside)[0]
    psychrolib.SetUnitSystem(psychrolib.SI)
    entering = psychrolib.GetMoistAirEnthalpy(temperature - 273.15, inside)
    surface = entering - total / 0.3 / 0.9
    low, high = -10.0, 30.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if psychrolib.GetSatAirEnthalpy(middle, 101_325.0) < surface else (low, middle)
    dew = psychrolib.GetSatHumRatio(low, 101_325.0)
    sensible = psychrolib.GetMoistAirEnthalpy(temperature - 273.15, dew) - surface
    assert share == pytest.approx(sensible / (entering - surface), abs=0.01) and 0.5 < share < 0.95


def test_a_unit_heats_by_its_compressor_first() -> None:
    units = UnitaryUnits.sized([4000.0, 2000.0], TWO)
    cold, zone = at(293.15, 258.15), at(293.15, 258.15).zone_temperature
    machine = units.heating_map
    frost = machine.frosted(OPS, 258.15, 0.003)
    able = machine.available(OPS, units.heating, zone, 258.15, frost)
    little, all_of_it = ran(units, cold, 0.2, 0.0), ran(units, cold, 1.0, 0.0)
    assert all_of_it.heating == pytest.approx(able + units.supplement)
    assert little.heating == pytest.approx(0.2 * all_of_it.heating) and (little.heating < able).all()
    assert (little.electric_power - little.fan_power < 0.9 * little.heating).all()  # less than by resistance
    full = ran(units, at(299.15, 308.15, 0.010), 0.0, 1.0)
    assert (full.heat < 0.0).all() and full.fan_power == pytest.approx(units.fan_power)
    power = (full.electric_power - full.fan_power) / (full.cooling + full.moisture)
    assert power == pytest.approx(1.0 / DX_COOLING.cop, rel=0.25)


def test_a_ventilator_recovers_and_does_not_freeze_and_lets_cool_air_in() -> None:
    units = Ventilators(np.array([0.05, 0.02]), TWO, np.array([40.0, 20.0]), 0.8)
    mild, frost, free = (ran(units, at(294.15, t), 0.0, c) for t, c in ((280.15, 0.0), (258.15, 0.0), (285.15, 1.0)))
    assert mild.recovered == pytest.approx(1006.0 * units.air_flow * 0.8 * 14.0)
    assert mild.heat == pytest.approx(-1006.0 * units.air_flow * 0.2 * 14.0 + 0.5 * units.fan_power)
    assert frost.exhaust_temperature == pytest.approx([274.85, 274.85])
    assert free.recovered.tolist() == [0.0, 0.0]


def test_a_coil_that_air_cannot_feed_is_refused() -> None:
    small = FanCoils(np.array([1e3]), np.array([9e3]), np.zeros(1, int), np.array([0.1]), np.array([10.0]))
    with pytest.raises(ModelError, match=r"FanCoils: cooling of unit 0: expected less than the air can bring"):
        _ = small.resistance
