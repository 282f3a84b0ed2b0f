"""The contract of Gymnasium, repeatability, rewards that are the indicators, vectors of environments."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from mpc.environment.environment import ControlEnvironment
from mpc.environment.office import Office, office_environment
from mpc.environment.reward import EconomicReward, PaperStepReward
from mpc.errors import MpcError, PlantActionError
from mpc.kpi.record import PlantRecord
from mpc.kpi.rewards import PaperReward, StageCost
from mpc.loop.noise import SensorNoise
from mpc.loop.simulated import SimulatedPlant
from mpc.scenario.scenario import Scenario

Make = Callable[..., ControlEnvironment]

SMALL: dict[str, Any] = {"office": Office(zones=4, floor_area=200.0), "days": 1}


def episode(world: Any, seed: int, steps: int = 40) -> Iterator[tuple[np.ndarray, float]]:
    """Observations and rewards under random actions of a seed."""
    rng = np.random.default_rng(seed)
    seen, _ = world.reset(seed=seed)
    yield seen, 0.0
    for _ in range(steps):
        seen, reward, _, _, _ = world.step(rng.uniform(-1.0, 1.0, 2).astype(np.float32))
        yield seen, reward


def test_the_checker_of_gymnasium_is_silent() -> None:
    check_env(gymnasium.make("buildingmpc/Office-v0", **SMALL).unwrapped)  # warnings are errors


def test_the_checker_of_stable_baselines_is_silent(make_environment: Make) -> None:
    checker = pytest.importorskip("stable_baselines3.common.env_checker", reason="needs the extra [rl]")
    checker.check_env(make_environment(histograms=True))


def test_the_registered_environment_is_made_by_its_id() -> None:
    world = gymnasium.make("mpc.environment:buildingmpc/Office-v0", **SMALL, episode_steps=3)
    world.reset(seed=1)
    ends = [world.step(np.zeros(2, dtype=np.float32))[3] for _ in range(3)]
    assert ends == [False, False, True]
    assert isinstance(world.unwrapped, ControlEnvironment)


def test_a_seed_repeats_bit_for_bit(make_environment: Make) -> None:
    one, other = make_environment(), make_environment()
    first = list(episode(one, 3))
    for again in (list(episode(other, 3)), list(episode(one, 3))):
        assert all(np.array_equal(a, b) and r == s for (a, r), (b, s) in zip(first, again, strict=True))
    assert not all(np.array_equal(a, b) for (a, _), (b, _) in zip(first, episode(other, 4), strict=True))


def test_plants_of_an_environment_may_share_a_building_model(make_plant: Callable[..., SimulatedPlant]) -> None:
    shared = make_plant().model
    days = ("2023-01-09", "2023-07-10")
    one = ControlEnvironment([make_plant(day, model=shared) for day in days])
    other = ControlEnvironment([make_plant(day) for day in days])
    for k in (0, 1, 0):
        seen = [world.reset(seed=5, options={"plant": k, "plant_seed": 2})[0] for world in (one, other)]
        for _ in range(10):
            assert np.array_equal(*seen)
            seen = [world.step(np.full(2, 0.3, dtype=np.float32))[0] for world in (one, other)]


@pytest.mark.parametrize("control_steps", [1, 3])
def test_the_economic_reward_is_minus_the_indicators(make_environment: Make, control_steps: int) -> None:
    price, carbon = 0.7, 0.05
    world = make_environment({"control_steps": control_steps}, reward=EconomicReward(StageCost(price, carbon)))
    world.reset(seed=2)
    total, ended, info = 0.0, False, {}
    while not ended:
        _, reward, terminated, ended, info = world.step(np.full(2, -1.0, dtype=np.float32))  # cold air, cool water
        total += reward
        assert not terminated
    kpis, n_zone = info["kpis"], 4
    area = kpis["floor_area"]
    expected = area * kpis["cost_tot"] + carbon * area * kpis["emis_tot"] + price * n_zone * kpis["tdis_tot"]
    assert total == pytest.approx(-expected, rel=1e-12)
    assert kpis["hours"] == 10.0  # of 16, six are left for the last forecast
    assert kpis["tdis_tot"] > 0.0


def test_the_paper_reward_is_that_of_its_steps(make_environment: Make) -> None:
    terms = PaperReward(highest_electricity=5e3, highest_gas=1e4)
    world = make_environment({"control_steps": 3}, reward=PaperStepReward(terms))
    world.reset(seed=2)
    rewards = [world.step(np.zeros(2, dtype=np.float32))[1] for _ in range(30)]
    record, scenario = world.plant.record(), world.plant.scenario
    each = [
        float(terms.of_step(scenario, k, record.zone_temperature[k + 1], record.electricity[k], record.gas[k]).reward)
        for k in range(90)
    ]
    np.testing.assert_allclose(rewards, np.reshape(each, (30, 3)).mean(axis=1), rtol=1e-13)
    assert -1.0 < min(rewards) < max(rewards) <= 0.0


@pytest.mark.parametrize("each", [1, 3])
def test_traced_steps_are_those_of_the_plants(make_environment: Make, each: int) -> None:
    class Stepped(EconomicReward):
        """The same reward said once more, so that it is taken of the plant itself."""

        def of_steps(self, done: Any, scenario: Scenario, first_step: int) -> float:
            return super().of_steps(done, scenario, first_step)

    options = {"control_steps": each, "noise": SensorNoise()}
    fast, slow = make_environment(options), make_environment(options, reward=Stepped())
    assert fast._traced is not None and slow._traced is None
    rng = np.random.default_rng(0)
    for seed in (3, 4):
        seen = [world.reset(seed=seed)[0] for world in (fast, slow)]
        np.testing.assert_array_equal(*seen)
        ended = False
        while not ended:
            action = rng.uniform(-1.0, 1.0, 2).astype(np.float32)
            one, other = fast.step(action), slow.step(action)
            np.testing.assert_allclose(one[0], other[0], rtol=0.0, atol=2e-6)
            assert one[1] == pytest.approx(other[1], rel=1e-9, abs=1e-9)
            ended = one[3]
            assert ended == other[3]
        for name in ("cost_tot", "tdis_tot", "ener_tot", "pele_tot", "zones"):
            found, exact = one[4]["kpis"][name], other[4]["kpis"][name]
            pairs = [(found[z], exact[z]) for z in exact] if name == "zones" else [(found, exact)]
            assert all(a == pytest.approx(b, rel=1e-9, abs=1e-12) for a, b in pairs)
        records = [world.plant.record().zone_temperature for world in (fast, slow)]  # the plant makes up for its steps
        np.testing.assert_array_equal(*records)
        np.testing.assert_allclose(fast._record().zone_temperature, records[1], rtol=0.0, atol=1e-9)


def test_a_plant_of_others_is_rewarded_by_its_whole_record(make_plant: Callable[..., SimulatedPlant]) -> None:
    class Other:
        """The same plant behind the bare protocol: neither forecaster nor `recent` can be seen."""

        def __init__(self, inner: SimulatedPlant) -> None:
            self.inner, self.scenario = inner, inner.scenario

        def __getattr__(self, name: str) -> Any:
            if name in ("forecaster", "recent", "now"):
                raise AttributeError(name)
            return getattr(self.inner, name)

        def reset(self, seed: int | None = None) -> Any:
            seen = self.inner.reset(seed)
            self.scenario = self.inner.scenario
            return seen

        def record(self) -> PlantRecord:
            return self.inner.record()

        finished = property(lambda self: self.inner.finished)
        control_step = zone_names = columns = actuators = property(lambda self: None)

    for name in ("control_step", "zone_names", "columns", "actuators"):
        setattr(Other, name, property(lambda self, name=name: getattr(self.inner, name)))
    ours = ControlEnvironment(make_plant(control_steps=2))
    theirs = ControlEnvironment(Other(make_plant(control_steps=2)))  # type: ignore[arg-type]
    for (a, r), (b, s) in zip(episode(ours, 1, 12), episode(theirs, 1, 12), strict=True):
        np.testing.assert_allclose(a, b, atol=1e-6)
        assert r == pytest.approx(s, rel=1e-12)


def test_vectors_of_gymnasium(make_environment: Make) -> None:
    alone = make_environment()
    with_two = gymnasium.vector.SyncVectorEnv([make_environment] * 2)
    seen, _ = with_two.reset(seed=[4, 5])
    assert np.array_equal(seen[0], alone.reset(seed=4)[0])
    action = np.full((2, 2), 0.1, dtype=np.float32)
    seen, rewards, _, _, _ = with_two.step(action)
    own, reward, _, _, _ = alone.step(action[0])
    assert np.array_equal(seen[0], own) and rewards[0] == reward


@pytest.mark.long
def test_vectors_in_processes_of_their_own() -> None:
    def make() -> ControlEnvironment:
        return office_environment(**SMALL)

    apart = gymnasium.vector.AsyncVectorEnv([make], context="spawn")
    try:
        first, _ = apart.reset(seed=[4])
        assert np.array_equal(first[0], make().reset(seed=4)[0])
    finally:
        apart.close()


def test_vectors_of_stable_baselines(make_environment: Make) -> None:
    vectors = pytest.importorskip("stable_baselines3.common.vec_env", reason="needs the extra [rl]")
    both = vectors.DummyVecEnv([lambda: make_environment(episode_steps=2)] * 2)
    both.seed(3)
    both.reset()
    both.step(np.zeros((2, 2), dtype=np.float32))
    _, _, ended, infos = both.step(np.zeros((2, 2), dtype=np.float32))
    assert ended.all() and infos[0]["TimeLimit.truncated"] and infos[1]["kpis"]["hours"] > 0.0


@pytest.mark.parametrize("action", [[0.0, 1.1], [np.nan, 0.0], [0.0], [0.0, 0.0, 0.0]])
def test_an_action_out_of_range_is_refused(make_environment: Make, action: list[float]) -> None:
    world = make_environment()
    world.reset(seed=0)
    with pytest.raises(PlantActionError, match="2 numbers from -1 to 1"):
        world.step(np.array(action, dtype=np.float32))


def test_what_does_not_fit_is_refused_by_name(make_plant: Callable[..., SimulatedPlant]) -> None:
    plant = make_plant()
    for options, words in (
        ({"reward": "economical"}, "nearest valid one is 'economic'"),
        ({"actions": ["supply_air_temperature_setpoint"]}, "every setpoint that is required"),
        ({"actions": ["supply_air_temperature"]}, "a setpoint of the plant"),
        ({"episode_steps": 0}, "episode_steps"),
        ({"block_ends": (1.0, 0.5)}, "ends that rise"),
        ({"ranges": {"gas_power": (0.0, 1.0)}}, "a point that is observed"),
        ({"ranges": {"gas_power_sensor": (1.0, 0.0)}}, "a lower and a higher number"),
    ):
        with pytest.raises(MpcError, match=words):
            ControlEnvironment(plant, **options)
    with pytest.raises(MpcError, match="a plant or more"):
        ControlEnvironment([])
    with pytest.raises(MpcError, match="plant 1: expected the same control step"):
        ControlEnvironment([plant, make_plant(control_steps=3)])
    world = ControlEnvironment(plant)
    for options, words in (({"plants": 1}, "nearest valid one is 'plant'"), ({"plant": 1}, "a plant from 0 to 0")):
        with pytest.raises(MpcError, match=words):
            world.reset(options=options)
