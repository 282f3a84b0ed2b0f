"""The vector environment does what a vector of single ones does; adapters, wrappers and pictures."""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode, SyncVectorEnv

from mpc.environment.environment import ControlEnvironment
from mpc.environment.office import Office, office_environment, office_vector_environment
from mpc.environment.reward import EconomicReward
from mpc.environment.vector import VectorEnvironment
from mpc.environment.wrappers import DiscreteActions, DiscreteVectorActions, NormalizedObservations
from mpc.errors import MpcError, PlantActionError
from mpc.loop.make import PlantSettings
from mpc.loop.noise import SensorNoise

SMALL: dict[str, Any] = {"office": Office(zones=4, floor_area=200.0), "days": 1}
COARSE = PlantSettings(dx=1.0, order=30, noise=SensorNoise(), control_steps=3)


@pytest.mark.parametrize(
    "options",
    [
        {"episode_steps": 9},
        {"starts": ("2023-01-09", "2023-07-10"), "histograms": True, "episode_steps": 6},
        {"plant": COARSE, "reward": "paper", "episode_steps": 5},
    ],
)
def test_it_is_a_vector_of_single_ones(options: dict[str, Any]) -> None:
    together = gymnasium.make_vec(
        "mpc.environment:buildingmpc/Office-v0", num_envs=3, vectorization_mode="vector_entry_point",
        dtype=np.float64, **SMALL, **options,
    )  # fmt: skip
    apart = SyncVectorEnv([lambda: office_environment(**SMALL, **options)] * 3)
    assert together.observation_space == apart.observation_space and together.action_space == apart.action_space
    assert together.metadata["autoreset_mode"] is AutoresetMode.NEXT_STEP
    rng, ends = np.random.default_rng(0), 0
    (seen, infos), (own, theirs) = together.reset(seed=5), apart.reset(seed=5)
    for _ in range(24):
        assert np.isfinite(own).all()
        np.testing.assert_allclose(seen, own, atol=2e-6)
        assert set(infos) == set(theirs)
        for name in ("plant", "plant_seed", "_plant"):
            assert name not in theirs or np.array_equal(infos[name], theirs[name])
        if "kpis" in theirs:
            ends += 1
            np.testing.assert_allclose([k["cost_tot"] for k in infos["kpis"]], theirs["kpis"]["cost_tot"], rtol=1e-9)
        actions = rng.uniform(-1.0, 1.0, (3, 2)).astype(np.float32)
        seen, rewards, over, cut, infos = together.step(actions)
        own, earned, finished, short, theirs = apart.step(actions)
        np.testing.assert_allclose(rewards, earned, rtol=1e-9, atol=1e-12)
        assert np.array_equal(over, finished) and np.array_equal(cut, short)
    assert ends >= 2


def test_an_episode_may_end_in_the_step_that_begins_the_next() -> None:
    world = office_vector_environment(2, **SMALL, episode_steps=3, autoreset_mode=AutoresetMode.SAME_STEP)
    alone = office_environment(**SMALL, episode_steps=3)
    world.reset(seed=[4, 9])
    alone.reset(seed=9)
    action = np.full((2, 2), 0.3, dtype=np.float32)
    for k in range(6):
        seen, _, _, cut, infos = world.step(action)
        own, _, _, short, told = alone.step(action[1])
        assert bool(cut[1]) == short == (k in (2, 5))
        if short:
            np.testing.assert_allclose(infos["final_obs"][1], own, atol=3e-3)  # single precision, and its resolution
            assert infos["final_info"]["kpis"][1]["ener_tot"] == pytest.approx(told["kpis"]["ener_tot"], rel=1e-4)
            own, drawn = alone.reset()
            assert infos["plant_seed"][1] == drawn["plant_seed"]
        np.testing.assert_allclose(seen[1], own, atol=3e-3)


def test_a_single_precision_day_is_near() -> None:
    world, alone = office_vector_environment(2, **SMALL), office_environment(**SMALL)
    world.reset(seed=3)
    alone.reset(seed=4)
    rng, total, earned = np.random.default_rng(1), 0.0, 0.0
    for _ in range(200):
        actions = rng.uniform(-1.0, 1.0, (2, 2)).astype(np.float32)
        _, rewards, *_ = world.step(actions)
        _, reward, *_ = alone.step(actions[1])
        total, earned = total + rewards[1], earned + reward
    assert earned < 0.0 and total == pytest.approx(earned, rel=1e-4)
    np.testing.assert_allclose(world.batch.zone_temperature[:, 1], alone.plant.record().zone_temperature[-1], atol=1e-4)


def test_stable_baselines_learns_with_it() -> None:
    library = pytest.importorskip("stable_baselines3", reason="needs the extra [rl]")
    from mpc.environment.stable_baselines import StableBaselinesVector

    world = office_vector_environment(4, **SMALL, episode_steps=5, autoreset_mode=AutoresetMode.SAME_STEP)
    vector = StableBaselinesVector(world)
    vector.seed(3)
    vector.reset()
    for _ in range(5):
        seen, rewards, ended, infos = vector.step(np.zeros((4, 2), dtype=np.float32))
    assert ended.all() and infos[0]["TimeLimit.truncated"] and infos[3]["kpis"]["hours"] > 0.0
    assert infos[1]["terminal_observation"].shape == seen[1].shape and (rewards <= 0.0).all()
    model = library.PPO("MlpPolicy", vector, n_steps=10, batch_size=20, n_epochs=1, seed=0, device="cpu")
    before = model.policy.action_net.weight.detach().numpy().copy()
    model.learn(80)
    assert model.num_timesteps == 80 and not np.array_equal(before, model.policy.action_net.weight.detach().numpy())
    with pytest.raises(MpcError, match="SAME_STEP"):
        StableBaselinesVector(office_vector_environment(2, **SMALL))


def test_names_pictures_and_tables() -> None:
    world = office_environment(**SMALL, render_mode="rgb_array")
    assert len(world.observation_names) == world.observation_space.shape[0]
    assert world.action_names == ("supply_water_temperature_setpoint", "supply_air_temperature_setpoint")
    world.reset(seed=0)
    blank = world.render()
    for _ in range(100):
        world.step(np.zeros(2, dtype=np.float32))
    picture = world.render()
    assert picture.dtype == np.uint8 and picture.shape == blank.shape and not np.array_equal(picture, blank)
    text = office_vector_environment(2, **SMALL, render_mode="ansi")
    text.reset(seed=0)
    assert "before the first step" in text.render()[0]
    text.step(np.zeros((2, 2), dtype=np.float32))
    row = text.render()[1].splitlines()[2].split()
    assert row[0] == text.batch.plants[0].zone_names[0]
    assert float(row[1]) == pytest.approx(text.batch.zone_temperature[0, 1] - 273.15, abs=0.006)
    with pytest.raises(MpcError, match="render_mode"):
        office_environment(**SMALL, render_mode="human")


def test_actions_out_of_levels(make_environment: Any) -> None:
    inner: ControlEnvironment = make_environment()
    world = DiscreteActions(inner, (3, 5))
    world.reset(seed=0)
    assert world.action([2, 1]).tolist() == [1.0, -0.5]
    assert world.action_space.nvec.tolist() == [3, 5]
    world.step(np.array([1, 2]))
    many = DiscreteVectorActions(VectorEnvironment(inner, 2), 3)
    many.reset(seed=0)
    assert many.actions(np.array([[0, 2], [1, 1]])).tolist() == [[-1.0, 1.0], [0.0, 0.0]]
    many.step(np.array([[0, 2], [1, 1]]))
    for levels in (1, (2, 2, 2)):
        with pytest.raises(MpcError, match="levels"):
            DiscreteActions(inner, levels)


def test_observations_are_scaled_by_a_sample(make_environment: Any) -> None:
    world = NormalizedObservations.measured(make_environment(), steps=60)
    first, _ = world.reset(seed=0)
    rows = [first, *(world.step(np.zeros(2, dtype=np.float32))[0] for _ in range(60))]
    assert np.abs(np.mean(rows, axis=0)).max() < 4.0 and np.isfinite(rows).all()
    with pytest.raises(MpcError, match="normalization"):
        NormalizedObservations(make_environment(), np.zeros(3), np.ones(3))


def test_what_does_not_fit_is_refused(make_environment: Any) -> None:
    single = make_environment()

    class Mine:
        def of_steps(self, done: Any, scenario: Any, first_step: int) -> float:
            return 0.0

    class Anew(EconomicReward):  # what it says of many is not what it says of one
        of_steps = Mine.of_steps

    for options, words in (
        ({"num_envs": 0}, "1 or more"), ({"single": make_environment(reward=Mine())}, "many plants at once"),
        ({"single": make_environment(reward=Anew())}, "both of_values"),
        ({"autoreset_mode": AutoresetMode.DISABLED}, "NEXT_STEP or SAME_STEP"),
    ):  # fmt: skip
        with pytest.raises(MpcError, match=words):
            VectorEnvironment(**{"single": single, **options})
    world = VectorEnvironment(single, 2)
    for bad in ({"seed": [1]}, {"options": {"plants": 1}}, {"options": {"plant": 4}}):
        with pytest.raises(MpcError):
            world.reset(**bad)
    world.reset(seed=0)
    for actions in (np.zeros((2, 3)), np.full((2, 2), np.nan), np.full((2, 2), 1.5)):
        with pytest.raises(PlantActionError, match="2 numbers from -1 to 1"):
            world.step(actions)
