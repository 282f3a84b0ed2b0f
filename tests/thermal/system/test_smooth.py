"""The smooth system and its Jacobian: against the same system as one CasADi function, and against finite differences."""

from __future__ import annotations

import numpy as np
import pytest

from thermal.system.smooth import SmoothHvac
from thermal.system.symbolic import hvac_function
from thermal.system.system import HvacSystem


@pytest.fixture(scope="module")
def smooth(plant_system: HvacSystem) -> SmoothHvac:
    return SmoothHvac(plant_system, pressures=True)


def points(smooth: SmoothHvac, count: int = 12) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(1)
    zone, n, n_air = rng.uniform(291.0, 299.0, (count, smooth.n_zone)), smooth.n_zone, smooth.n_air_handler
    inputs, at = np.zeros((count, smooth.n_input)), smooth.inputs
    inputs[:, at["BOILER/supply_water_temperature"]] = rng.uniform(310.0, 350.0, (count, 1))
    inputs[:, at["supply_air_temperature_setpoint"]] = rng.uniform(285.0, 297.0, (count, n_air))
    inputs[:, at["supply_water_temperature_setpoint"]] = rng.uniform(310.0, 350.0, (count, 1))
    inputs[:, at["supply_air_static_pressure_setpoint"]] = rng.uniform(60.0, 110.0, (count, n_air))
    inputs[:, at["differential_pressure_setpoint"]] = rng.uniform(6e4, 9e4, (count, 1))
    exogenous = smooth.surroundings({
        "zone_air_heating_temperature_setpoint": np.full((count, n), 294.0),
        "zone_air_cooling_temperature_setpoint": np.full((count, n), 297.0),
        "outdoor_temperature": rng.uniform(265.0, 305.0, count), "outdoor_humidity": np.full(count, 0.005),
        "seconds": np.full(count, 300.0),
    })  # fmt: skip
    return zone, inputs, exogenous


def run(smooth: SmoothHvac, zone: np.ndarray, inputs: np.ndarray, exogenous: np.ndarray) -> np.ndarray:
    stepper, rows = smooth.stepper(), []
    for row in zip(zone, inputs, exogenous, strict=True):
        stepper.zone[:], stepper.inputs[:], stepper.exogenous[:] = row
        rows.append(stepper.step().copy())
    return np.array(rows)


def test_a_step_is_that_of_the_plants_function(smooth: SmoothHvac) -> None:
    zone, inputs, exogenous = points(smooth)
    done, n, n_air, function = run(smooth, zone, inputs, exogenous), smooth.n_zone, smooth.n_air_handler, None
    function = hvac_function(smooth.system)
    for k in range(len(zone)):
        found = function(
            BOILER_supply_water_temperature=inputs[k, 0], zone_temperature=zone[k],
            zone_air_heating_temperature_setpoint=294.0, zone_air_cooling_temperature_setpoint=297.0,
            outdoor_temperature=exogenous[k, 2 * n], outdoor_humidity=0.005, return_humidity=0.006,
            room_temperature=293.15,
            supply_air_temperature_setpoint=inputs[k, smooth.inputs["supply_air_temperature_setpoint"]],
            supply_water_temperature_setpoint=inputs[k, smooth.inputs["supply_water_temperature_setpoint"]],
            supply_air_static_pressure_setpoint=inputs[k, smooth.inputs["supply_air_static_pressure_setpoint"]],
            differential_pressure_setpoint=inputs[k, smooth.inputs["differential_pressure_setpoint"]],
            fan_running=np.ones(n_air), boiler_running=1.0, ventilation=np.ones(n_air), seconds=300.0,
        )  # fmt: skip
        names = ("heat", "electric_power", "fuel_power", "BOILER_supply_water_temperature_end")
        wanted = np.concatenate([np.array(found[name]).ravel() for name in names])
        np.testing.assert_allclose(done[k, : n + 3], wanted, rtol=1e-10)


def test_one_air_handler_may_serve_many_terminals(gas_system: HvacSystem) -> None:
    smooth = SmoothHvac(gas_system, pressures=True)
    zone, inputs, exogenous = points(smooth)
    assert np.isfinite(run(smooth, zone, inputs, exogenous)).all()
    assert hvac_function(gas_system).size_out("heat") == (5, 1)


def test_derivatives_are_those_of_finite_differences(smooth: SmoothHvac) -> None:
    zone, inputs, exogenous = points(smooth)
    n, m = smooth.n_zone, smooth.n_sum
    base = run(smooth, zone, inputs, exogenous)
    jacobian = smooth.jacobian(zone, inputs, exogenous, base[:, n + 3 : n + 3 + m])
    full = jacobian.heat_by_sums @ jacobian.sums_by_zone
    full[:, np.arange(n), np.arange(n)] += jacobian.local
    np.testing.assert_allclose(base[:, -n:], jacobian.local)
    for j in range(n + inputs.shape[1]):
        size = 1e-5 if j < n + 4 else 1e-3
        moved = [[zone.copy(), inputs.copy()] for _ in range(2)]
        for side, sign in enumerate((1.0, -1.0)):
            moved[side][int(j >= n)][:, j if j < n else j - n] += sign * size
        difference = (run(smooth, *moved[0], exogenous) - run(smooth, *moved[1], exogenous)) / (2.0 * size)
        heat = full[:, :, j] if j < n else jacobian.heat_by_inputs[:, :, j - n]
        totals = jacobian.totals_by_zone[:, :, j] if j < n else jacobian.totals_by_inputs[:, :, j - n]
        np.testing.assert_allclose(difference[:, :n], heat, rtol=2e-4, atol=2e-2)
        np.testing.assert_allclose(difference[:, n : n + 3], totals, rtol=2e-4, atol=2e-2)
