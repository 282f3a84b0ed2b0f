from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from thermal.components.component import Conditions
from thermal.components.operations import StepOperations
from thermal.components.terminals import Terminals
from thermal.errors import ModelError
from thermal.system.exchange import advance
from thermal.system.plant import HvacPlant
from thermal.system.points import energy_balance
from thermal.system.system import vav_system

SITUATIONS = {
    "zones": st.lists(st.floats(283.0, 306.0), min_size=5, max_size=5), "heating": st.floats(287.0, 296.0),
    "band": st.floats(0.5, 8.0), "outdoor": st.floats(250.0, 318.0), "damp": st.floats(0.0005, 0.02),
    "indoor_damp": st.floats(0.002, 0.014), "air": st.floats(281.0, 305.0), "water": st.floats(285.0, 365.0),
    "before": st.floats(285.0, 365.0), "static": st.floats(30.0, 800.0), "pressure": st.floats(5e3, 1.5e5),
    "running": st.sampled_from([(1.0, 1.0), (1.0, 0.0), (0.0, 0.0)]), "boiler": st.sampled_from([1.0, 0.0]),
    "seconds": st.floats(10.0, 3600.0), "ventilation": st.floats(0.0, 1.0),
}  # fmt: skip


def told(system, air, water, static, pressure, running, boiler, ventilation):
    return system.actions(
        supply_air_temperature_setpoint=air, supply_water_temperature_setpoint=water,
        supply_air_static_pressure_setpoint=static, differential_pressure_setpoint=pressure, fan_running=running,
        boiler_running=boiler, ventilation=ventilation,
    )  # fmt: skip


def situation(system, s):
    conditions = Conditions(
        np.array(s["zones"]), np.full(5, s["heating"]), np.full(5, s["heating"] + s["band"]), s["outdoor"], s["damp"],
        s["indoor_damp"],
    )  # fmt: skip
    actions = told(
        system,
        s["air"],
        s["water"],
        s["static"],
        s["pressure"],
        s["running"],
        s["boiler"],
        (s["ventilation"], 1.0)[: len(system.air_handlers)],
    )
    return conditions, actions


plant_of = cache(HvacPlant)


def taken(system, s):
    conditions, actions = situation(system, s)
    plant = plant_of(system)
    state, step = plant.step(plant.start(supply_water_temperature=s["before"]), conditions, actions, s["seconds"])
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
    conditions, actions = situation(gas_system, s)
    plant = plant_of(gas_system)
    _, step = plant.step(plant.start(supply_water_temperature=s["before"]), conditions, actions, s["seconds"])
    balance = energy_balance(gas_system, conditions, step)
    assert abs(balance.residual) <= 1e-9 * balance.turnover + 1e-6


@settings(max_examples=200, deadline=None)
@given(s=st.fixed_dictionaries(SITUATIONS))
def test_no_air_is_hotter_than_its_water_nor_beyond_its_limit(plant_system, s):
    _, step, state, _ = taken(plant_system, s)
    ceiling = np.maximum(step.terminals.entering, state.values[0])
    assert np.all(step.terminals.discharge <= ceiling + 1e-9)
    limit = plant_system.terminals.discharge_limit
    assert np.all(step.terminals.discharge <= np.maximum(limit, step.terminals.entering) + 1e-6)
    floor = np.minimum(step.terminals.entering, state.values[0])
    assert np.all(step.terminals.discharge >= floor - 1e-9)
    assert state.values[0] <= max(s["before"], s["water"], max(s["zones"]), s["outdoor"], 305.0) + 1e-6
    # water comes back no colder than the coldest of what it meets: air, plant room, the water before
    coldest = min(
        [293.15, s["before"], *(a.mixed.cooled_temperature for a in step.air_handlers), *step.terminals.entering]
    )
    assert coldest - 1e-6 <= step.results["BOILER"].return_water_temperature
    assert np.all((step.terminals.valve_flow >= 0.0) & (step.terminals.valve_flow <= 1.0 + 1e-12))


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
    ops, (conditions, actions) = StepOperations(), situation(plant_system, s)
    conditions = conditions._replace(return_humidity=(0.006, 0.006))
    calls = plant_system.thermostat.calls(ops, *conditions[:3])

    # a loop so large that its water is what it is told to be
    def reheat(water):
        loop = plant_system.loop
        system = plant_system.having(BOILER=type(loop)(1e8, loop.pump, water_volume=1e4))
        chosen = actions | {"BOILER/supply_water_temperature_setpoint": water}
        return advance(ops, system, (water,), calls, conditions, chosen, 10.0)

    low = reheat(s["water"])
    high = reheat(s["water"] + more)
    assert np.all(high.terminals.heat >= low.terminals.heat - 1e-3 * (1.0 + np.abs(low.terminals.heat)))


def test_air_handlers_that_are_off_bring_nothing(plant_system, command):
    conditions = Conditions(np.full(5, 285.0), np.full(5, 293.0), np.full(5, 297.0), 270.0)
    plant = HvacPlant(plant_system)
    _, step = plant.step(
        plant.start(supply_water_temperature=330.0), conditions, command(plant_system, 290.0, 330.0, running=0.0), 300.0
    )
    assert np.abs(plant.heat(step)).max() < 1e-6
    assert step.electric_power == pytest.approx(step.results["BOILER"].pump_power, abs=1e-6)


def test_several_terminals_of_a_zone_add_up(plant_system, command):
    terminals = Terminals.sized([0.3, 0.5, 0.2], 2000.0, zone=np.array([0, 1, 0]), air_handler=np.array([0, 1, 0]))
    system = vav_system(plant_system.air_handlers, plant_system.loop, terminals)
    plant = HvacPlant(system)
    conditions = Conditions(np.array([290.0, 299.0]), np.full(2, 293.0), np.full(2, 297.0), 280.0)
    _, step = plant.step(
        plant.start(supply_water_temperature=330.0), conditions, command(plant.system, 287.0, 330.0), 300.0
    )
    heat = plant.heat(step)
    assert heat.shape == (2,)
    assert heat[0] == pytest.approx(step.terminals.heat[0] + step.terminals.heat[2])
    assert heat[0] > 0.0 > heat[1]


def test_the_heat_is_the_metered_heat(plant_system, command):
    conditions = Conditions(np.linspace(290.0, 299.0, 5), np.full(5, 293.0), np.full(5, 297.0), 280.0)
    plant = HvacPlant(plant_system)
    _, step = plant.step(
        plant.start(supply_water_temperature=330.0), conditions, command(plant.system, 287.0, 330.0), 300.0
    )
    metered = step.terminals.airflow * 1006.0 * (step.terminals.discharge - conditions.zone_temperature)
    assert np.allclose(plant.heat(step), metered, rtol=1e-12)


def test_systems_that_do_not_fit_are_refused(plant_system):
    with pytest.raises(ModelError, match="each with a terminal of its own"):
        vav_system(plant_system.air_handlers[:1], plant_system.loop, plant_system.terminals)
    terminals = Terminals.sized([0.3, 0.5], 2000.0, zone=np.array([0, 2]), air_handler=np.array([0, 1]))
    with pytest.raises(ModelError, match=r"a terminal in each zone, found none in zones \[1\]"):
        vav_system(plant_system.air_handlers, plant_system.loop, terminals)
