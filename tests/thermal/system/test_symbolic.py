import casadi
import numpy as np
import pytest

from thermal.components.component import Conditions
from thermal.components.terminals import Terminals
from thermal.errors import ModelError
from thermal.system.plant import HvacPlant
from thermal.system.symbolic import hvac_function
from thermal.system.system import vav_system


def drawn(seed, n_zone, n_air):
    rng = np.random.default_rng(seed)
    heating = rng.uniform(289.0, 295.0, n_zone)
    conditions = Conditions(
        rng.uniform(284.0, 304.0, n_zone), heating, heating + rng.uniform(1.0, 4.0, n_zone), rng.uniform(255.0, 312.0),
        rng.uniform(0.001, 0.015), tuple(rng.uniform(0.003, 0.012, n_air)), rng.uniform(285.0, 300.0),
    )  # fmt: skip
    actions = (
        tuple(rng.uniform(283.0, 296.0, n_air)), rng.uniform(300.0, 355.0), tuple(rng.uniform(80.0, 400.0, n_air)),
        rng.uniform(2e4, 1.2e5), (1.0,) * n_air, 1.0, tuple(rng.uniform(0.0, 1.0, n_air)),
    )  # fmt: skip
    return rng.uniform(290.0, 355.0), conditions, actions


def arguments(water, conditions, actions):
    return [water, *conditions[:5], casadi.DM(conditions[5]), conditions[6], casadi.DM(actions[0]), casadi.DM(actions[2]),
            casadi.DM(actions[4]), casadi.DM(actions[6]), actions[1], actions[3], actions[5], 300.0]  # fmt: skip


def outputs(system, *given):
    """Outputs of the exact function, by name."""
    function = hvac_function(system, 0.0)
    return dict(zip(function.name_out(), function(*given), strict=True))


@pytest.mark.parametrize("seed", range(40))
def test_casadi_and_numpy_are_the_same(plant_system, command, seed):
    water, conditions, actions = drawn(seed, 5, 2)
    plant = HvacPlant(plant_system)
    state, step = plant.step(
        plant.start(supply_water_temperature=water), conditions, command(plant_system, *actions), 300.0
    )
    found = outputs(plant_system, *arguments(water, conditions, actions))
    done, loop = step.terminals, step.results["BOILER"]
    expected = {
        "BOILER_supply_water_temperature_end": state.values[0], "heat": plant.heat(step), "electric_power": step.electric_power,
        "fuel_power": step.fuel_power, "VAV_airflow": done.airflow, "VAV_entering": done.entering,
        "VAV_reheat": done.reheat, "supply_temperature": step.supply_temperature,
        "BOILER_return_water_temperature": loop.return_water_temperature, "BOILER_pump_power": loop.pump_power,
    }  # fmt: skip
    for name, other in expected.items():
        assert np.allclose(np.array(found[name]).ravel(), other, rtol=1e-12, atol=1e-9)
    discharge = found["VAV_entering"] + found["VAV_reheat"] / (1006.0 * found["VAV_airflow"])
    assert np.allclose(np.array(discharge).ravel(), done.discharge, rtol=1e-12, atol=1e-9)


def test_several_terminals_of_a_zone_add_up_symbolically(plant_system, command):
    terminals = Terminals.sized([0.3, 0.5, 0.2], 2000.0, zone=np.array([0, 1, 0]), air_handler=np.array([0, 1, 0]))
    system = vav_system(plant_system.air_handlers, plant_system.loop, terminals)
    water, conditions, actions = drawn(1, 2, 2)
    plant = HvacPlant(system)
    heat = plant.heat(
        plant.step(plant.start(supply_water_temperature=water), conditions, command(system, *actions), 300.0)[1]
    )
    assert np.allclose(np.array(hvac_function(system, 0.0)(*arguments(water, conditions, actions))[1]).ravel(), heat)


@pytest.mark.parametrize("seed", range(10))
def test_derivatives_are_those_of_finite_differences(plant_system, seed):
    function = hvac_function(plant_system, 0.05)
    names = ("BOILER_supply_water_temperature", "zone_temperature", "supply_air_temperature_setpoint",
             "supply_water_temperature_setpoint", "supply_air_static_pressure_setpoint")  # fmt: skip
    point = dict(zip(function.name_in(), arguments(*drawn(seed, 5, 2)), strict=True))
    point = {name: np.array(casadi.DM(value)).ravel().astype(float) for name, value in point.items()}
    outputs = ("BOILER_supply_water_temperature_end", "heat", "electric_power", "fuel_power")
    symbols = [casadi.SX.sym(n, function.size1_in(n)) for n in function.name_in()]
    results = function.call(dict(zip(function.name_in(), symbols, strict=True)))
    stacked = casadi.vertcat(*(results[name] for name in outputs))
    for name in names:
        position = function.name_in().index(name)
        derivative = casadi.Function("d", symbols, [casadi.jacobian(stacked, symbols[position])])
        value = casadi.Function("f", symbols, [stacked])
        exact = np.array(derivative(*point.values()))
        step = 1e-4 * (100.0 if name == "supply_air_static_pressure_setpoint" else 1.0)
        for k in range(len(point[name])):
            ends = []
            for sign in (1.0, -1.0):
                moved = dict(point, **{name: point[name] + sign * step * (np.arange(len(point[name])) == k)})
                ends.append(np.array(value(*moved.values())).ravel())
            numeric = (ends[0] - ends[1]) / (2.0 * step)
            assert np.allclose(exact[:, k], numeric, rtol=2e-4, atol=2e-3 * (1.0 + np.abs(exact[:, k]).max()))


def test_smoothing_moves_the_heat_by_little(plant_system):
    exact, smooth = hvac_function(plant_system, 0.0), hvac_function(plant_system, 0.02)
    worst = 0.0
    for seed in range(60):
        given = arguments(*drawn(seed, 5, 2))
        heats = [np.array(f(*given)[1]).ravel() for f in (exact, smooth)]
        worst = max(worst, np.abs(heats[0] - heats[1]).max() / np.abs(heats[0]).max())
    assert worst < 0.06


def test_smoothing_vanishes_with_its_width(plant_system):
    given = arguments(*drawn(3, 5, 2))
    exact = np.array(hvac_function(plant_system, 0.0)(*given)[1]).ravel()
    errors = [
        np.abs(np.array(hvac_function(plant_system, w)(*given)[1]).ravel() - exact).max() for w in (1e-1, 1e-2, 1e-3)
    ]
    assert errors[0] > errors[1] > errors[2]


@pytest.mark.parametrize(("running", "boiler"), [((0.0, 1.0), 1.0), ((1.0, 1.0), 0.0), ((0.0, 0.0), 0.0)])
def test_what_is_off_has_finite_derivatives(plant_system, running, boiler):
    function = hvac_function(plant_system, 0.02)
    water, conditions, actions = drawn(0, 5, 2)
    given = arguments(water, conditions, (*actions[:4], running, boiler, actions[6]))
    symbols = [casadi.SX.sym(n, function.size1_in(n)) for n in function.name_in()]
    everything = casadi.vertcat(*function.call(symbols))
    derivative = casadi.Function("d", symbols, [everything, casadi.jacobian(everything, casadi.vertcat(*symbols))])
    for value in derivative(*given):
        assert np.isfinite(np.array(value)).all()


@pytest.mark.parametrize("seed", range(30))
def test_the_second_law_holds_for_the_smooth_plant(plant_system, seed):
    function = hvac_function(plant_system, 0.1)
    water, conditions, actions = drawn(seed, 5, 2)
    found = dict(zip(function.name_out(), function(*arguments(water, conditions, actions)), strict=True))
    end, rate = float(found["BOILER_supply_water_temperature_end"]), 1006.0 * np.array(found["VAV_airflow"]).ravel()
    discharge = np.array(found["VAV_entering"]).ravel() + np.array(found["VAV_reheat"]).ravel() / rate
    supply = np.array(found["supply_temperature"]).ravel()[plant_system.terminals.air_handler]
    assert np.all(discharge <= np.maximum(supply, end) + 1e-9)
    assert np.all(discharge >= np.minimum(supply, end) - 1e-9)
    assert np.all(np.array(found["VAV_airflow"]) > 0.0)


def test_a_width_out_of_range_is_refused(plant_system):
    with pytest.raises(ModelError, match="smoothing width"):
        hvac_function(plant_system, -0.1)
