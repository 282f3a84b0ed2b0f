"""A policy in NumPy acts as that of Stable-Baselines3, in the environment and as a controller."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from mpc.environment.environment import ControlEnvironment
from mpc.environment.policy import ActorNetwork, PolicyController
from mpc.errors import MpcError
from mpc.loop.run import run_closed_loop

Make = Callable[..., ControlEnvironment]


def random_network(inputs: int, squashed: bool = True) -> ActorNetwork:
    rng = np.random.default_rng(0)
    shapes = [(8, inputs), (8, 8), (2, 8)]
    weights = tuple(0.3 * rng.standard_normal(shape) for shape in shapes)
    biases = tuple(0.1 * rng.standard_normal(shape[0]) for shape in shapes)
    return ActorNetwork(weights, biases, "relu", squashed, {"seed": 0})


@pytest.mark.parametrize("kind", ["PPO", "SAC"])
def test_the_actor_is_that_of_stable_baselines(make_environment: Make, kind: str) -> None:
    library = pytest.importorskip("stable_baselines3", reason="needs the extra [rl]")
    world = make_environment()
    model = getattr(library, kind)("MlpPolicy", world, seed=1, device="cpu", policy_kwargs={"net_arch": [16, 8]})
    network = ActorNetwork.of_stable_baselines(model)
    rng = np.random.default_rng(1)
    for _ in range(20):
        seen = rng.uniform(-4.0, 4.0, network.inputs).astype(np.float32)
        np.testing.assert_allclose(network.act(seen), model.predict(seen, deterministic=True)[0], atol=2e-6)


def test_another_algorithm_is_refused() -> None:
    class DQN:
        class policy:  # noqa: N801
            state_dict = staticmethod(dict)

    with pytest.raises(MpcError, match="PPO or SAC"):
        ActorNetwork.of_stable_baselines(DQN())


def test_a_policy_is_saved_and_read(tmp_path: Path) -> None:
    network = random_network(5)
    network.save(tmp_path / "policy.npz")
    again = ActorNetwork.load(tmp_path / "policy.npz")
    assert again.about == {"seed": 0} and again.squashed and again.activation == "relu"
    assert np.array_equal(network.act(np.ones(5)), again.act(np.ones(5)))


def test_what_is_no_policy_is_refused(tmp_path: Path) -> None:
    (tmp_path / "text.npz").write_text("no policy")
    np.savez(tmp_path / "other.npz", weights0=np.zeros((2, 2)))
    objects = {"about": np.array([{}], dtype=object)}
    np.savez(tmp_path / "objects.npz", **objects)  # type: ignore[arg-type]
    for name in ("text.npz", "other.npz", "objects.npz", "none.npz"):
        with pytest.raises(MpcError, match="a file that ActorNetwork.save wrote"):
            ActorNetwork.load(tmp_path / name)
    with pytest.raises(MpcError, match="finite layers that fit"):
        ActorNetwork((np.zeros((2, 3)), np.zeros((2, 3))), (np.zeros(2), np.zeros(2)), "tanh", True)
    with pytest.raises(MpcError, match="nearest valid one is 'tanh'"):
        ActorNetwork((np.zeros((2, 3)),), (np.zeros(2),), "tan", True)  # type: ignore[arg-type]


def test_a_controller_does_what_the_policy_does_in_the_environment(make_environment: Make) -> None:
    world = make_environment({"control_steps": 3})
    network = random_network(len(world.layout))
    seen, info = world.reset(seed=7)
    rewards, actions = [], []
    for _ in range(30):
        actions.append(network.act(seen))
        seen, reward, *_ = world.step(actions[-1])
        rewards.append(reward)
    again = make_environment({"control_steps": 3})
    controller = PolicyController(network, again.layout, again.actions)
    run = run_closed_loop(again.plant, controller, steps=30, seed=info["plant_seed"], forecasts=True)
    kinds = [world.actions.setpoints(action) for action in actions]
    for name in run.actions:
        np.testing.assert_allclose(run.actions[name], [k[name] for k in kinds], atol=2e-4)  # K, of single precision
    np.testing.assert_allclose(run.record.zone_temperature, world.plant.record().zone_temperature, atol=1e-4)


def test_a_controller_goes_on_without_a_forecast(make_environment: Make) -> None:
    world = make_environment()
    controller = PolicyController(random_network(len(world.layout)), world.layout, world.actions)
    seen = world.plant.reset(0)
    assert controller.step(seen, None).keys() == controller.step(seen, world.plant.forecast()).keys()
    assert controller.observe(seen, None).tolist() == controller.observe(seen, world.plant.forecast()).tolist()


def test_a_policy_of_another_environment_is_refused(make_environment: Make) -> None:
    world = make_environment()
    with pytest.raises(MpcError, match="5 and 2"):
        PolicyController(random_network(5), world.layout, world.actions)
