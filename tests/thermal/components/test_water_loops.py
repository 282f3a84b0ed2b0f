"""What makes hot and chilled water: heat pump, district connection, chiller and tower, by hand and in balance."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import brentq

from thermal.components.chiller_loop import ChillerLoop
from thermal.components.component import Conditions
from thermal.components.cooling_tower import CoolingTower
from thermal.components.curves import (
    CHILLER_PART_LOAD,
    WATER_COOLED_CAPACITY,
    WATER_COOLED_INPUT,
)
from thermal.components.district_loop import DistrictLoop
from thermal.components.heat_pump_loop import AIR_TO_WATER, HeatPumpLoop
from thermal.components.machine_map import MachineMap
from thermal.components.moist_air import (
    WATER_HEAT_CAPACITY,
    enthalpy,
    saturated_temperature,
    saturation_humidity,
    wet_bulb,
)
from thermal.components.operations import FloatOperations, NumpyOperations
from thermal.components.pump import Pump

OPS = FloatOperations()
COLD = Conditions(None, None, None, 268.15, 0.002)
WARM = Conditions(None, None, None, 303.15, 0.012)
MACHINE = MachineMap(4.5, WATER_COOLED_CAPACITY, WATER_COOLED_INPUT, CHILLER_PART_LOAD, minimum=0.25)


def test_a_heat_pump_brings_what_it_can_and_the_resistance_the_rest() -> None:
    loop = HeatPumpLoop(10e3, Pump(0.5), backup=4e3)
    most = loop.can(OPS, COLD, 318.15)
    alone = 10e3 * (0.758746 - 5 * 0.027626 + 25 * 0.000148716 - 125 * 3.4992e-6)
    assert most == pytest.approx(alone + 4e3)
    part, all_of_it = (loop.takes(OPS, COLD, heat, 318.15, 313.15) for heat in (0.5 * alone, most))
    cop = 6.81 - 0.121 * 50.0 + 0.00063 * 2500.0
    standing = 0.005 * 10e3 / AIR_TO_WATER.cop
    assert part.electric_power == pytest.approx(0.5 * alone / cop + standing)
    assert all_of_it.electric_power == pytest.approx(alone / cop + 4e3 + standing)


def test_a_brine_heat_pump_does_not_see_the_weather() -> None:
    loop = HeatPumpLoop(10e3, Pump(0.5), source_temperature=279.15)
    assert loop.can(OPS, COLD, 308.15) == loop.can(OPS, WARM, 308.15)


def test_a_district_connection_falls_with_the_difference_to_the_network() -> None:
    loop = DistrictLoop(20e3, Pump(0.5), network_temperature=363.15, rated_water=343.15)
    assert loop.can(OPS, COLD, 343.15) == 20e3 and loop.can(OPS, COLD, 353.15) == 10e3
    assert loop.can(OPS, COLD, 363.15) == 0.0
    took = loop.takes(OPS, COLD, 7e3, 343.15, 333.15)
    assert (took.fuel_power, took.electric_power) == (7e3, 0.0)


def test_air_is_as_warm_saturated_as_it_was() -> None:
    for temperature in np.linspace(263.15, 318.15, 12):
        saturated = enthalpy(temperature, saturation_humidity(OPS, temperature, 101_325.0))
        assert saturated_temperature(OPS, saturated, 101_325.0) == pytest.approx(temperature, abs=1e-6)


def test_a_tower_is_merkels_integral() -> None:
    """UA / c_p is the number of transfer units of Merkel: the integral of c_w dT / (h_s(T) - h), counter flow.

    The equivalent gas takes the saturation line as straight between the air's ends: within 0.6 K of water.
    """
    tower, ops = CoolingTower.sized(1e5), NumpyOperations()
    water = WATER_HEAT_CAPACITY * tower.water_flow

    def units(leaving: float, rejected: float, wet_bulb: float) -> float:
        along = np.linspace(leaving, leaving + rejected / water, 200)
        start = enthalpy(wet_bulb, saturation_humidity(OPS, wet_bulb, 101_325.0))
        air = start + water / tower.air_flow * (along - leaving)
        driving = enthalpy(along, saturation_humidity(ops, along, 101_325.0)) - air
        return float(np.trapezoid(water / np.maximum(driving, 1.0), along))

    for rejected, wet in ((1e5, 298.75), (6e4, 293.15), (1.2e5, 283.15)):
        found = tower._leaving(OPS, rejected, wet, 1.0)
        ends = found - 3.0, found + 5.0
        exact = brentq(lambda t, q=rejected, w=wet: units(t, q, w) - tower.conductance / 1006.0, *ends)
        assert found == pytest.approx(exact, abs=0.6)


def test_a_tower_is_sized_for_its_conditions_and_holds_its_setpoint() -> None:
    tower = CoolingTower.sized(1e5)
    assert tower._leaving(OPS, 1e5, 298.75, 1.0) == pytest.approx(302.55, abs=1e-6)
    mild, hot, idle = (tower.cool(OPS, q, w) for q, w in ((4e4, 283.15), (1e5, 298.75), (0.0, 298.75)))
    assert mild.water_temperature == tower.setpoint and 0.0 < mild.duty < 1.0
    assert hot.duty == pytest.approx(1.0, abs=1e-3) and hot.water_temperature == pytest.approx(302.55, abs=1e-6)
    assert idle.power == 0.0


@given(load=st.floats(0.0, 70e3), outdoor=st.floats(283.0, 308.0), humid=st.floats(0.004, 0.014))
def test_chiller_and_tower_solve_their_circle(load: float, outdoor: float, humid: float) -> None:
    """The condenser's water is what the tower makes of the chiller's heat, to 0.1 K."""
    loop = ChillerLoop(60e3, Pump(2.0), machine=MACHINE, tower=CoolingTower.sized(78e3))
    done, cooled = loop.chilled(OPS, load, 279.82, Conditions(None, None, None, outdoor, humid))
    wet = Conditions(None, None, None, outdoor, humid)
    again, water = loop.chilled(OPS, done.output, 279.82, wet)
    assert again.output == pytest.approx(done.output) and water.water_temperature == cooled.water_temperature
    once_more = loop.tower.cool(OPS, done.output + done.power, wet_bulb(OPS, outdoor, humid, 101_325.0))
    assert once_more.water_temperature == pytest.approx(cooled.water_temperature, abs=0.1)


def test_an_air_cooled_chiller_by_hand() -> None:
    """30 degC outdoors, 6.67 degC of water: the curves of EnergyPlus' template by its own polynomial."""
    loop = ChillerLoop(50e3, Pump(2.0))
    took = loop.takes(OPS, WARM, 20e3, 279.82, 285.0)
    x, y = 6.67, 30.0
    capacity = 0.507883 + 0.145228 * x - 0.00625644 * x**2 - 0.0011178 * y - 0.0001296 * y**2 - 0.00028188 * x * y
    ratio = 1.03076 - 0.103536 * x + 0.00710208 * x**2 + 0.0093186 * y + 0.00031752 * y**2 - 0.00104328 * x * y
    part = 20e3 / (50e3 * capacity)
    power = 50e3 * capacity * ratio / 3.0 * (0.088065 + 1.137742 * part - 0.225806 * part**2) + 0.105 * 50e3 / 3.0
    assert took.electric_power == pytest.approx(power, rel=1e-6)
