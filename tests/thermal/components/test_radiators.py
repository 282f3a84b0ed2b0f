"""Radiators: EN 442's characteristic, closed forms, balances, and derivatives against finite differences."""

from __future__ import annotations

import casadi
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from thermal.components.air_handler import AirHandler
from thermal.components.boiler_loop import BoilerLoop
from thermal.components.component import Conditions
from thermal.components.cooling_coil import CoolingCoil
from thermal.components.fan import Fan
from thermal.components.pump import Pump
from thermal.components.radiators import Radiators
from thermal.components.terminals import Terminals
from thermal.errors import ModelError
from thermal.system.plant import HvacPlant
from thermal.system.points import HvacPoints, energy_balance
from thermal.system.smooth import SmoothHvac
from thermal.system.symbolic import hvac_function
from thermal.system.system import HvacSystem, vav_system

RADIATORS = Radiators(np.array([1000.0, 2000.0, 500.0]), np.array([0, 2, 2]), np.array([1.3, 1.2, 1.45]))


@pytest.fixture(scope="module")
def system() -> HvacSystem:
    """Three zones with terminals; radiators in the first and, two of them, in the last."""
    terminals = Terminals.sized([0.3, 0.4, 0.5], [3000.0, 4000.0, 5000.0])
    base = vav_system(
        [AirHandler(Fan(1.2), cooling=CoolingCoil(15e3))], BoilerLoop(3e4, Pump(1.0), water_volume=0.2), terminals
    )
    return base.with_component("RADIATORS", RADIATORS, hot_water="BOILER")


def cold(zone: tuple[float, ...] = (293.3, 292.0, 290.0), outdoor: float = 268.0) -> Conditions:
    return Conditions(np.array(zone), np.full(3, 294.0), np.full(3, 298.0), outdoor)


def actions(system: HvacSystem, water: float = 348.15) -> dict[str, float]:
    return system.actions(supply_air_temperature_setpoint=289.0, supply_water_temperature_setpoint=water)


def test_nominal_heat_at_nominal_temperatures() -> None:
    assert RADIATORS.emitted(RADIATORS.water_flow, 55.0) == pytest.approx(RADIATORS.nominal_heat, rel=1e-9)


@given(over=st.floats(8.0, 70.0), scale=st.floats(0.3, 2.0))
def test_heat_goes_with_the_overtemperature_to_the_exponent(over: float, scale: float) -> None:
    """At the same ratio of return to supply overtemperature, which flows of scale^(n - 1) keep: the closed form."""
    first = RADIATORS.emitted(RADIATORS.water_flow, over)
    flow = RADIATORS.water_flow * scale ** (RADIATORS.exponent - 1.0)
    assert RADIATORS.emitted(flow, scale * over) == pytest.approx(scale**RADIATORS.exponent * first, rel=1e-7)


@given(over=st.floats(15.0, 70.0), share=st.floats(0.3, 1.5))
def test_near_en_442_with_the_logarithmic_mean(over: float, share: float) -> None:
    flow = share * RADIATORS.water_flow
    heat = RADIATORS.emitted(flow, over)
    back = over - heat / (4186.0 * flow)
    assert (back > 0.0).all()  # no water leaves colder than the zone
    mean, nominal = (over - back) / np.log(over / back), 10.0 / np.log(55.0 / 45.0)
    assert heat == pytest.approx(RADIATORS.nominal_heat * (mean / nominal) ** RADIATORS.exponent, rel=0.02)


def test_a_steady_step_brings_the_characteristic_and_closes_to_round_off(system: HvacSystem) -> None:
    plant, conditions = HvacPlant(system), cold()
    state, step = plant.step(plant.start(supply_water_temperature=348.15), conditions, actions(system), 300.0)
    done = step.results["RADIATORS"]
    assert state.values[0] == pytest.approx(348.15, abs=1e-9)
    call = np.clip(294.0 - conditions.zone_temperature[RADIATORS.zone], 0.0, 1.0)
    expected = RADIATORS.emitted(call * RADIATORS.water_flow, 348.15 - conditions.zone_temperature[RADIATORS.zone])
    assert done.heat == pytest.approx(expected, rel=1e-6)
    assert done.radiant_heat == pytest.approx(0.3 * done.heat)
    zones = step.terminals.heat + np.bincount(RADIATORS.zone, done.heat, 3)
    assert plant.heat(step) == pytest.approx(zones)
    assert system.at_zones(plant._ops, step.results, "radiant_heat") == pytest.approx(
        np.bincount(RADIATORS.zone, 0.3 * done.heat, 3)
    )


@given(
    water=st.floats(300.0, 360.0), zone=st.floats(284.0, 300.0), outdoor=st.floats(255.0, 300.0),
    seconds=st.floats(30.0, 3600.0),
)  # fmt: skip
def test_energy_closes(system: HvacSystem, water: float, zone: float, outdoor: float, seconds: float) -> None:
    plant, conditions = HvacPlant(system), cold((zone, zone + 1.0, zone - 2.0), outdoor)
    _, step = plant.step(plant.start(supply_water_temperature=320.0), conditions, actions(system, water), seconds)
    balance = energy_balance(system, conditions, step)
    assert abs(balance.residual) <= 1e-9 * balance.turnover
    assert balance.zones == pytest.approx(plant.heat(step).sum(), rel=1e-12, abs=1e-9)


def test_casadi_and_numpy_are_the_same_and_derivatives_are_finite_differences(system: HvacSystem) -> None:
    plant, conditions = HvacPlant(system), cold()
    state, step = plant.step(plant.start(supply_water_temperature=340.0), conditions, actions(system), 300.0)
    function, chosen = hvac_function(system, 0.0), system.defaults | actions(system)
    given = {"BOILER_supply_water_temperature": 340.0, "seconds": 300.0, **conditions._asdict()}
    given |= {point: [chosen[key] for key in keys] for point, keys in system.by_point.items()}
    found = function(**given)
    assert np.array(found["heat"]).ravel() == pytest.approx(plant.heat(step), rel=1e-12)
    assert float(found["BOILER_supply_water_temperature_end"]) == pytest.approx(state.values[0], rel=1e-12)
    smooth = hvac_function(system, 0.02)
    symbols = {name: casadi.SX.sym(name, smooth.size1_in(name)) for name in smooth.name_in()}
    heat = smooth(**symbols)["heat"]
    for name in ("zone_temperature", "supply_water_temperature_setpoint"):
        slope = casadi.Function("d", list(symbols.values()), [casadi.jacobian(heat, symbols[name])])
        exact, point = np.array(slope(*(given[n] for n in symbols))), np.atleast_1d(given[name]).astype(float)
        for k in range(len(point)):
            ends = [np.array(smooth(**given | {name: point + s * 1e-4 * (np.arange(len(point)) == k)})["heat"]).ravel()
                    for s in (1.0, -1.0)]  # fmt: skip
            assert exact[:, k] == pytest.approx((ends[0] - ends[1]) / 2e-4, rel=1e-4, abs=1e-2)


def test_the_jacobian_is_still_a_diagonal_and_a_product_of_low_rank(system: HvacSystem) -> None:
    smooth = SmoothHvac(system)
    assert smooth.n_sum == 4 + 3  # conductance, source and water of the radiators
    zone, exogenous = np.array([[293.0, 292.0, 290.0]]), smooth.surroundings({
        "zone_air_heating_temperature_setpoint": np.full((1, 3), 294.0),
        "zone_air_cooling_temperature_setpoint": np.full((1, 3), 298.0), "outdoor_temperature": np.array([268.0]),
        "outdoor_humidity": np.array([0.002]), "seconds": np.array([300.0]),
    })  # fmt: skip
    inputs, stepper = np.array([[340.0, 289.0, 348.15]]), smooth.stepper()

    def run(zones: np.ndarray) -> np.ndarray:
        stepper.zone[:], stepper.inputs[:], stepper.exogenous[:] = zones, inputs[0], exogenous[0]
        return stepper.step().copy()

    found = smooth.jacobian(zone, inputs, exogenous, run(zone[0])[3 + 3 : 3 + 3 + smooth.n_sum][None])
    full = np.diag(found.local[0]) + found.heat_by_sums[0] @ found.sums_by_zone[0]
    for k in range(3):
        ends = [run(zone[0] + s * 1e-4 * np.eye(3)[k])[:3] for s in (1.0, -1.0)]
        assert full[:, k] == pytest.approx((ends[0] - ends[1]) / 2e-4, rel=2e-4, abs=2e-2)


def test_points_and_parameters(system: HvacSystem) -> None:
    plant, points = HvacPlant(system), HvacPoints(system)
    chosen = actions(system)
    _, step = plant.step(plant.start(supply_water_temperature=348.15), cold(), chosen, 300.0)
    values = dict(zip(points.columns, points.read(cold(), chosen, step), strict=True))
    assert values["RADIATORS_1/heating_power_sensor"] == step.results["RADIATORS"].heat[1]
    with pytest.raises(ModelError, match=r"Radiators.exponent\[0\]: expected 1.05 to 1.6 -"):
        Radiators(np.array([1000.0]), np.array([0]), np.array([2.0]))
    with pytest.raises(ModelError, match="expected room < return < supply"):
        Radiators(np.array([1000.0]), np.array([0]), return_temperature=350.0)
