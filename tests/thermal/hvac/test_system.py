from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from thermal.errors import ModelError
from thermal.hvac._advance import advance
from thermal.hvac._balance import energy_balance
from thermal.hvac._operations import StepOperations
from thermal.hvac._plant import HvacPlant
from thermal.hvac._settings import settings_of
from thermal.hvac._step import Actions, Calls, Conditions
from thermal.hvac._system import HvacSystem
from thermal.hvac._terminals import Terminals

SITUATIONS = {
    "zones": st.lists(st.floats(283.0, 306.0), min_size=5, max_size=5), "heating": st.floats(287.0, 296.0),
    "band": st.floats(0.5, 8.0), "outdoor": st.floats(250.0, 318.0), "damp": st.floats(0.0005, 0.02),
    "indoor_damp": st.floats(0.002, 0.014), "air": st.floats(281.0, 305.0), "water": st.floats(285.0, 365.0),
    "before": st.floats(285.0, 365.0), "static": st.floats(30.0, 800.0), "pressure": st.floats(5e3, 1.5e5),
    "running": st.sampled_from([(1.0, 1.0), (1.0, 0.0), (0.0, 0.0)]), "boiler": st.sampled_from([1.0, 0.0]),
    "seconds": st.floats(10.0, 3600.0), "ventilation": st.floats(0.0, 1.0),
}  # fmt: skip


def situation(s):
    conditions = Conditions(
        np.array(s["zones"]), np.full(5, s["heating"]), np.full(5, s["heating"] + s["band"]), s["outdoor"], s["damp"],
        s["indoor_damp"],
    )  # fmt: skip
    actions = Actions(
        s["air"], s["water"], s["static"], s["pressure"], s["running"], s["boiler"], (s["ventilation"], 1.0)
    )
    return conditions, actions


plant_of = cache(HvacPlant)


def taken(system, s):
    conditions, actions = situation(s)
    plant = plant_of(system)
    state, step = plant.step(plant.start(s["before"]), conditions, actions, s["seconds"])
    return conditions, step, state, plant.heat(step)


@settings(max_examples=200, deadline=None)
@given(s=st.fixed_dictionaries(SITUATIONS))
def test_energy_closes(plant_system, s):
    conditions, step, _, heat = taken(plant_system, s)
    balance = energy_balance(plant_system, conditions, step)
    assert abs(balance.residual) <= 1e-9 * balance.turnover + 1e-6
    assert balance.zones == pytest.approx(heat.sum(), rel=1e-12, abs=1e-9)
    assert balance.electricity == pytest.approx(step.electric_power, rel=1e-12, abs=1e-9)
    assert min(balance.electricity, balance.fuel, balance.condenser, balance.flue) >= -1e-9


@settings(max_examples=100, deadline=None)
@given(s=st.fixed_dictionaries(SITUATIONS | {"running": st.just(1.0), "ventilation": st.just(1.0)}))
def test_energy_closes_with_gas_coils(gas_system, s):
    s = s | {"ventilation": 1.0}
    conditions, actions = situation(s)
    plant = plant_of(gas_system)
    _, step = plant.step(plant.start(s["before"]), conditions, actions._replace(ventilation=1.0), s["seconds"])
    balance = energy_balance(gas_system, conditions, step)
    assert abs(balance.residual) <= 1e-9 * balance.turnover + 1e-6


@settings(max_examples=200, deadline=None)
@given(s=st.fixed_dictionaries(SITUATIONS))
def test_no_air_is_hotter_than_its_water_nor_beyond_its_limit(plant_system, s):
    _, step, state, _ = taken(plant_system, s)
    ceiling = np.maximum(step.entering, state.water)
    assert np.all(step.discharge <= ceiling + 1e-9)
    limit = plant_system.terminals.discharge_limit
    assert np.all(step.discharge <= np.maximum(limit, step.entering) + 1e-6)
    floor = np.minimum(step.entering, state.water)
    assert np.all(step.discharge >= floor - 1e-9)
    assert state.water <= max(s["before"], s["water"], max(s["zones"]), s["outdoor"], 305.0) + 1e-6
    # water comes back no colder than the coldest of what it meets: air, plant room, the water before
    coldest = min([293.15, s["before"], *(m.cooled_temperature for m in step.mixed), *step.entering])
    assert coldest - 1e-6 <= step.return_water
    assert np.all((step.valve_flow >= 0.0) & (step.valve_flow <= 1.0 + 1e-12))


@settings(max_examples=150, deadline=None)
@given(s=st.fixed_dictionaries(SITUATIONS))
def test_warmer_supply_air_never_cools_a_zone(plant_system, s):
    s = s | {"boiler": 0.0}  # heat that has no capacity to run out of
    heat = taken(plant_system, s)[3]
    warmer = taken(plant_system, s | {"air": s["air"] + 1.0})[3]
    assert np.all(warmer >= heat - 1e-6 * (1.0 + np.abs(heat)))


@settings(max_examples=150, deadline=None)
@given(s=st.fixed_dictionaries(SITUATIONS), more=st.floats(0.1, 20.0))
def test_hotter_water_is_never_less_heat(plant_system, s, more):
    ops, (conditions, actions) = StepOperations(), situation(s)
    conditions = conditions._replace(return_humidity=(0.006, 0.006))
    heat, cool = plant_system.thermostat.calls(
        ops, conditions.zone_temperature, conditions.heating_setpoint, conditions.cooling_setpoint
    )

    # a loop so large that its water is what it is told to be
    def reheat(water):
        loop = plant_system.loop
        steady = type(loop)(1e8, loop.pump, water_volume=1e4)
        system = HvacSystem(plant_system.air_handlers, steady, plant_system.terminals)
        settings = settings_of(ops, system, actions._replace(supply_water_temperature=water))
        return advance(ops, system, water, Calls(heat, cool), conditions, settings, 10.0)

    low = reheat(s["water"])
    high = reheat(s["water"] + more)
    assert np.all(high.terminal_heat >= low.terminal_heat - 1e-3 * (1.0 + np.abs(low.terminal_heat)))


def test_air_handlers_that_are_off_bring_nothing(plant_system):
    conditions = Conditions(np.full(5, 285.0), np.full(5, 293.0), np.full(5, 297.0), 270.0)
    plant = HvacPlant(plant_system)
    _, step = plant.step(plant.start(330.0), conditions, Actions(290.0, 330.0, running=0.0), 300.0)
    assert np.abs(plant.heat(step)).max() < 1e-6
    assert step.electric_power == pytest.approx(step.pump_power, abs=1e-6)


def test_several_terminals_of_a_zone_add_up(plant_system):
    terminals = Terminals.sized([0.3, 0.5, 0.2], 2000.0, zone=np.array([0, 1, 0]), air_handler=np.array([0, 1, 0]))
    system = HvacSystem(plant_system.air_handlers, plant_system.loop, terminals)
    plant = HvacPlant(system)
    conditions = Conditions(np.array([290.0, 299.0]), np.full(2, 293.0), np.full(2, 297.0), 280.0)
    _, step = plant.step(plant.start(330.0), conditions, Actions(287.0, 330.0), 300.0)
    heat = plant.heat(step)
    assert heat.shape == (2,)
    assert heat[0] == pytest.approx(step.terminal_heat[0] + step.terminal_heat[2])
    assert heat[0] > 0.0 > heat[1]


def test_the_heat_is_the_metered_heat(plant_system):
    conditions = Conditions(np.linspace(290.0, 299.0, 5), np.full(5, 293.0), np.full(5, 297.0), 280.0)
    plant = HvacPlant(plant_system)
    _, step = plant.step(plant.start(330.0), conditions, Actions(287.0, 330.0), 300.0)
    metered = step.airflow * 1006.0 * (step.discharge - conditions.zone_temperature)
    assert np.allclose(plant.heat(step), metered, rtol=1e-12)


def test_systems_that_do_not_fit_are_refused(plant_system):
    with pytest.raises(ModelError, match="each with a terminal of its own"):
        HvacSystem(plant_system.air_handlers[:1], plant_system.loop, plant_system.terminals)
    terminals = Terminals.sized([0.3, 0.5], 2000.0, zone=np.array([0, 2]), air_handler=np.array([0, 1]))
    with pytest.raises(ModelError, match=r"a terminal in each zone, found none in zones \[1\]"):
        HvacSystem(plant_system.air_handlers, plant_system.loop, terminals)
