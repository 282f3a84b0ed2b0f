"""Both buildings of a plant step alike, and their heat adds up."""

from __future__ import annotations

import numpy as np
import pytest

from mpc.errors import PlantError
from mpc.loop.building import BuildingModel, GridBuilding, zone_response
from mpc.loop.reduced import ReducedBuilding, reduced_building
from thermal import Building, Simulator
from thermal.effects.catalogue import chosen
from thermal.model.simulator import Shuffle

NONE = np.zeros(0)
START, COLD = np.full(12, 294.15), np.array([278.15])
HEAT = np.linspace(-800.0, 1500.0, 12)


def run(model: BuildingModel, steps: int = 12) -> np.ndarray:
    """Zone temperatures under changing heat, shape (steps, n_zone) [K]."""
    model.reset(START, COLD, NONE)
    path = []
    for k in range(steps):
        model.begin(0.3 * HEAT[::-1], COLD + 0.1 * k, NONE)
        path.append(model.finish(HEAT * np.cos(0.5 * k), NONE).reading)
    return np.array(path)


@pytest.fixture(scope="module")
def grid(building: Building) -> GridBuilding:
    return GridBuilding(Simulator(building, dx=1.0))


@pytest.fixture(scope="module")
def modes(building: Building) -> ReducedBuilding:
    return reduced_building(building, dx=1.0)


def test_the_reduced_building_follows_the_grid(grid: GridBuilding, modes: ReducedBuilding) -> None:
    assert modes.order < 100 < grid.network.n_node
    np.testing.assert_allclose(run(modes), run(grid), atol=5e-3)


def test_a_reset_is_the_steady_state(grid: GridBuilding, modes: ReducedBuilding) -> None:
    for model in (grid, modes):
        np.testing.assert_allclose(model.reset(START, COLD, NONE), START, atol=1e-6)


def test_the_grid_steps_as_its_simulator_does(building: Building, grid: GridBuilding) -> None:
    plain = Simulator(building, dx=1.0)
    plain.reset(START, COLD)
    grid.reset(START, COLD, NONE)
    grid.begin(np.zeros(12), COLD, NONE)
    seen = grid.finish(HEAT, NONE)
    np.testing.assert_array_equal(seen.mean, plain.step(HEAT, COLD))
    np.testing.assert_array_equal(seen.reading, plain.zone_temperatures)


@pytest.mark.parametrize("kind", ["grid", "random", "reduced"])
def test_heat_in_is_heat_out_and_kept(building: Building, kind: str) -> None:
    """Envelope and storage are added up from states, each by itself."""
    model: BuildingModel = (
        reduced_building(building, dx=1.0)
        if kind == "reduced"
        else GridBuilding(
            Simulator(building, dx=1.0, shuffle=Shuffle("random" if kind == "random" else "mean", seed=1))
        )
    )
    run(model)
    flows = model.flows()
    given = 0.3 * HEAT.sum() + HEAT.sum() * np.cos(0.5 * 11)
    assert abs(given + flows.effects - flows.envelope - flows.storage) < 1e-6 * abs(flows.storage)
    assert flows.effects == 0.0


def test_effects_bring_their_heat(building: Building) -> None:
    """A leak of 10 W/m2 in one zone, while its signal is 1 in the second half of the step's knowledge."""
    leak = chosen({"valve_leak": ("F1_W01",)})
    model = reduced_building(building, {"valve_leak@F1_W01": 10.0}, dx=1.0, effects=leak)
    model.reset(START, COLD, np.zeros(1))
    free = model.begin(np.zeros(12), COLD, np.zeros(1))
    seen = model.finish(np.zeros(12), np.ones(1))
    zone = building.zone_names.index("F1_W01")
    moved = seen.reading - free
    assert moved[zone] > 0.05 and np.delete(moved, zone).max() < 0.2 * moved[zone]
    flows = model.flows()
    assert flows.effects > 100.0
    assert abs(flows.effects - flows.envelope - flows.storage) < 1e-9 * abs(flows.envelope)


def test_a_saved_state_returns(modes: ReducedBuilding) -> None:
    run(modes)
    saved = modes.save_state()
    modes.begin(HEAT, COLD, NONE)
    first = modes.finish(HEAT, NONE)
    modes.restore_state(saved)
    modes.begin(HEAT, COLD, NONE)
    again = modes.finish(HEAT, NONE)
    np.testing.assert_array_equal(first.reading, again.reading)
    np.testing.assert_array_equal(first.mean, again.mean)
    with pytest.raises(PlantError, match="order"):
        modes.restore_state((np.zeros(3), np.zeros(12)))


def test_the_response_is_that_of_a_step(grid: GridBuilding, modes: ReducedBuilding) -> None:
    heat = np.full(12, 1000.0)
    np.testing.assert_allclose(zone_response(modes, heat), zone_response(grid, heat), rtol=0.02)
    assert (zone_response(modes, heat) > 0.0).all()
