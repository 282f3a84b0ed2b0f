"""The smooth plant and its slopes: against the same plant as one CasADi function, and against finite differences."""

from __future__ import annotations

import numpy as np
import pytest

from thermal.hvac._smooth import SmoothHvac
from thermal.hvac._symbolic import hvac_function
from thermal.hvac._system import HvacSystem


@pytest.fixture(scope="module")
def smooth(plant_system: HvacSystem) -> SmoothHvac:
    return SmoothHvac(plant_system, pressures=True)


def points(smooth: SmoothHvac, count: int = 12) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(1)
    zone, n, n_air = rng.uniform(291.0, 299.0, (count, smooth.n_zone)), smooth.n_zone, smooth.n_air_handler
    knobs = np.zeros((count, smooth.knobs.size))
    knobs[:, smooth.knobs.water] = rng.uniform(310.0, 350.0, count)
    knobs[:, smooth.knobs.supply_air] = rng.uniform(285.0, 297.0, (count, n_air))
    knobs[:, smooth.knobs.supply_water] = rng.uniform(310.0, 350.0, count)
    knobs[:, smooth.knobs.static_pressure] = rng.uniform(60.0, 110.0, (count, n_air))
    knobs[:, smooth.knobs.differential_pressure] = rng.uniform(6e4, 9e4, count)
    around = smooth.around(
        np.full((count, n), 294.0), np.full((count, n), 297.0), rng.uniform(265.0, 305.0, count),
        np.full(count, 0.005), np.ones((count, n_air)), np.ones(count), np.ones((count, n_air)), np.full(count, 300.0),
    )  # fmt: skip
    return zone, knobs, around


def run(smooth: SmoothHvac, zone: np.ndarray, knobs: np.ndarray, around: np.ndarray) -> np.ndarray:
    stepper, rows = smooth.stepper(), []
    for row in zip(zone, knobs, around, strict=True):
        stepper.zone[:], stepper.knobs[:], stepper.around[:] = row
        rows.append(stepper.step().copy())
    return np.array(rows)


def test_a_step_is_that_of_the_plants_function(smooth: SmoothHvac) -> None:
    zone, knobs, around = points(smooth)
    done, n, n_air, function = run(smooth, zone, knobs, around), smooth.n_zone, smooth.n_air_handler, None
    function = hvac_function(smooth.system)
    for k in range(len(zone)):
        found = function(
            water=knobs[k, 0], zone_temperature=zone[k], heating_setpoint=294.0, cooling_setpoint=297.0,
            outdoor_temperature=around[k, 2 * n], outdoor_humidity=0.005, return_humidity=0.006,
            room_temperature=293.15, supply_air_temperature=knobs[k, smooth.knobs.supply_air],
            supply_water_temperature=knobs[k, smooth.knobs.supply_water],
            static_pressure=knobs[k, smooth.knobs.static_pressure], differential_pressure=knobs[k, -1],
            running=np.ones(n_air), boiler=1.0, ventilation=np.ones(n_air), seconds=300.0,
        )  # fmt: skip
        names = ("heat", "electric_power", "fuel_power", "water_end")
        wanted = np.concatenate([np.array(found[name]).ravel() for name in names])
        np.testing.assert_allclose(done[k, : n + 3], wanted, rtol=1e-10)


def test_one_air_handler_may_serve_many_terminals(gas_system: HvacSystem) -> None:
    smooth = SmoothHvac(gas_system, pressures=True)
    zone, knobs, around = points(smooth)
    assert np.isfinite(run(smooth, zone, knobs, around)).all()
    assert hvac_function(gas_system).size_out("heat") == (5, 1)


def test_slopes_are_those_of_finite_differences(smooth: SmoothHvac) -> None:
    zone, knobs, around = points(smooth)
    n, m = smooth.n_zone, smooth.n_sum
    base = run(smooth, zone, knobs, around)
    slopes = smooth.slopes(zone, knobs, around, base[:, n + 3 : n + 3 + m])
    full = slopes.reach @ slopes.pull
    full[:, np.arange(n), np.arange(n)] += slopes.local
    np.testing.assert_allclose(base[:, -n:], slopes.local)
    for j in range(n + knobs.shape[1]):
        size = 1e-5 if j < n + 4 else 1e-3
        moved = [[zone.copy(), knobs.copy()] for _ in range(2)]
        for side, sign in enumerate((1.0, -1.0)):
            moved[side][int(j >= n)][:, j if j < n else j - n] += sign * size
        difference = (run(smooth, *moved[0], around) - run(smooth, *moved[1], around)) / (2.0 * size)
        heat = full[:, :, j] if j < n else slopes.heat_by_knobs[:, :, j - n]
        totals = slopes.totals_by_zone[:, :, j] if j < n else slopes.totals_by_knobs[:, :, j - n]
        np.testing.assert_allclose(difference[:, :n], heat, rtol=2e-4, atol=2e-2)
        np.testing.assert_allclose(difference[:, n : n + 3], totals, rtol=2e-4, atol=2e-2)
