"""Proximal policy optimisation as a function learns, and gives a policy that others can use."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("jax", reason="needs the extra [jax]")
pytest.importorskip("optax", reason="needs the extra [jax]")

import jax

from mpc.environment.functional import FunctionalEnvironment
from mpc.environment.office import Office, office_environment
from mpc.environment.ppo import Ppo, PpoSettings
from mpc.environment.vector import VectorEnvironment
from mpc.errors import MpcError


@pytest.mark.long
def test_it_learns() -> None:
    """After 138,000 steps half a day costs a fifth less, at least, than with actions in the middle of their ranges."""
    single = office_environment(office=Office(zones=4, floor_area=200.0), days=1, episode_steps=144)
    learner = Ppo(FunctionalEnvironment(VectorEnvironment(single, 4)), PpoSettings(members=64, n_steps=36, units=(32,)))
    weights, rewards = jax.jit(learner.learn, static_argnums=1)(jax.random.key(0), 60)
    assert rewards.shape == (60,) and np.isfinite(rewards).all()
    earned = []
    for act in (lambda seen: np.zeros(2, dtype=np.float32), learner.policy(weights, rounds=60).act):
        seen, _ = single.reset(seed=5)
        total, ended = 0.0, False
        while not ended:
            seen, reward, _, ended, _ = single.step(act(seen))
            total += reward
        earned.append(total)
    assert earned[1] > 0.8 * earned[0]


def test_samples_are_shared_out_evenly() -> None:
    with pytest.raises(MpcError, match="1000 samples shared out evenly, found 3 batches"):
        PpoSettings(members=10, n_steps=100, n_batches=3)
