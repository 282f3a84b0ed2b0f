"""Functions of JAX do what the vector environment does, with the same noise."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

pytest.importorskip("jax", reason="needs the extra [jax]")

import jax

from mpc.environment.environment import ControlEnvironment
from mpc.environment.functional import FunctionalEnvironment
from mpc.environment.office import Office, office_environment, office_plants
from mpc.environment.vector import VectorEnvironment
from mpc.loop.make import PlantSettings
from mpc.loop.noise import SensorNoise

SMALL: dict[str, Any] = {"office": Office(zones=4, floor_area=200.0), "days": 1}
COARSE = PlantSettings(dx=1.0, order=30, noise=SensorNoise(), control_steps=3)


def those_that_differ() -> ControlEnvironment:
    """Offices with other windows, and modes of other numbers."""
    each = [PlantSettings(dx=1.0, order=n, parameters={"window_u_value": u}) for u, n in ((2.0, 30), (3.0, 25))]
    plants = [p for s in each for p in office_plants(SMALL["office"], s, ("2023-01-09",), 1)]
    return ControlEnvironment(plants)


@pytest.mark.parametrize("make", [
    lambda: office_environment(**SMALL, starts=("2023-01-09", "2023-07-10"), histograms=True),
    lambda: office_environment(**SMALL, plant=COARSE, reward="paper"), those_that_differ,
])  # fmt: skip
def test_it_is_the_vector_environment(make: Callable[[], ControlEnvironment]) -> None:
    with jax.enable_x64(True):
        worlds = VectorEnvironment(make(), 4, dtype=np.float64)
        world = FunctionalEnvironment(worlds, seed=3)
        state, seen = world.begin(jax.numpy.arange(4))
        (own, infos), rng = worlds.reset(seed=3), np.random.default_rng(0)
        assert len({*infos["plant"]}) == len(worlds.single.plants)
        np.testing.assert_allclose(seen, own, atol=2e-6)
        step, each = jax.jit(world.advance), worlds.each
        for k in range(30):
            actions = rng.uniform(-1.0, 1.0, (4, 2)).astype(np.float32)
            noise = [worlds.batch.noise(np.full(4, k * each + n)) for n in range(each)]
            state, measured, reward = step(state, actions, noise)
            own, rewards, *_ = worlds.step(actions)
            np.testing.assert_allclose(reward, rewards, rtol=1e-9, atol=1e-12)
            np.testing.assert_allclose(world.observe(state, measured), own, atol=2e-6)
        np.testing.assert_allclose(state.values[0], worlds.batch.of(worlds.batch.traced.inputs.reading), atol=1e-9)


def test_episodes_end_and_begin_anew_in_the_same_step() -> None:
    worlds = VectorEnvironment(office_environment(**SMALL, episode_steps=3), 5)
    world = FunctionalEnvironment(worlds)
    state, seen = world.reset(jax.random.key(0), 64)
    assert {*np.asarray(state.beginning)} == set(range(5)) and seen.shape == (64, len(worlds.single.layout))
    step, before = jax.jit(world.step), state.beginning
    for k in range(7):
        state, seen, reward, ended, final = step(state, np.full((64, 2), 0.3), jax.random.key(k))
        assert np.asarray(ended).all() == (k in (2, 5)) and np.isfinite(reward).all()
        assert np.allclose(seen, final) != (k in (2, 5))
    assert (np.asarray(state.step) == 1).all() and (state.beginning != before).any()
    first, _ = world.begin(state.beginning)
    assert np.abs(state.values[0] - first.values[0]).max() < 1.0
