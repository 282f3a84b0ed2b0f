"""How policies are trained: recipes, the loop with its checkpoints, and what is kept of a run."""

from __future__ import annotations

import json
import os
import time
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import torch
from _site import Site, Week, World
from gymnasium.wrappers import TransformReward
from stable_baselines3 import PPO, SAC
from stable_baselines3.common.monitor import Monitor
from stable_baselines3.common.vec_env import DummyVecEnv, VecEnv

from mpc.environment.environment import ControlEnvironment
from mpc.environment.policy import ActorNetwork

ENVIRONMENTS = 4
VALIDATION_SEED = 11


@dataclass(frozen=True)
class Recipe:
    """How an algorithm is trained; what is not named is Stable-Baselines3's default.

    Parameters
    ----------
    evaluate_every : int
        Control steps between two evaluations on the validation weeks; the best policy of them is kept.
    options : dict
        Of the algorithm.
    """

    evaluate_every: int
    options: dict[str, Any] = field(default_factory=dict)


SMALL = {"net_arch": [64, 64]}
RECIPES = {
    "ppo": Recipe(
        15_120,
        {"n_steps": 336, "batch_size": 192, "gamma": 0.98, "learning_rate": 3e-4,
         "policy_kwargs": {**SMALL, "log_std_init": -0.5}},
    ),
    "sac": Recipe(
        5_000,
        {"buffer_size": 30_000, "learning_starts": 2_688, "train_freq": 1, "gradient_steps": 2, "gamma": 0.98,
         "learning_rate": 3e-4, "policy_kwargs": SMALL},
    ),
}  # fmt: skip
_KINDS = {"ppo": PPO, "sac": SAC}


@dataclass(frozen=True)
class Training:
    """A run: one algorithm in one world of a site with one seed.

    Parameters
    ----------
    site : Site
        The building, its weeks and prices.
    algorithm : str
        ``ppo`` or ``sac``.
    world : str
        Where it is trained.
    seed : int
        Of networks, exploration, and the order of weeks and people.
    """

    site: Site
    algorithm: str
    world: World
    seed: int

    @property
    def name(self) -> str:
        """Of its folder and its policy."""
        return f"{self.algorithm}_{self.world}_{self.seed}"


def cpu_time() -> float:
    """CPU time of this process and of those that it started and that have ended [s]."""
    return sum(os.times()[:4])


def training_environment(run: Training, weeks: Mapping[str, Week]) -> VecEnv:
    """Environments in one process, each with its share of the training weeks."""

    def maker(k: int) -> Callable[[], Any]:
        def make() -> Any:
            mine = dict(list(weeks.items())[k::ENVIRONMENTS])
            world, scale = run.site.environment(run.world, mine), run.site.reward_scale
            return Monitor(TransformReward(world, lambda reward: scale * reward))

        return make

    return DummyVecEnv([maker(k) for k in range(min(ENVIRONMENTS, len(weeks)))])


def stage_cost(network: ActorNetwork, world: ControlEnvironment) -> float:
    """Mean stage cost of a policy over the plants of an environment [currency]."""
    total = 0.0
    for k in range(len(world.plants)):
        seen, _ = world.reset(seed=VALIDATION_SEED, options={"plant": k, "plant_seed": VALIDATION_SEED})
        ended = False
        while not ended:
            seen, reward, _, ended, _ = world.step(network.act(seen))
            total -= reward
    return total / len(world.plants)


def train(
    run: Training,
    folder: Path,
    recipe: Recipe,
    steps: int,
    *,
    weeks: Mapping[str, Week] | None = None,
    validation: Mapping[str, Week] | None = None,
    until: float = np.inf,
    say: Callable[[str], None] = print,
) -> bool:
    """Train, or go on with, a run for some control steps in all; the policy is ``policy.npz`` when it is done.

    Weeks are those of the site where none are given. Returns whether it is done.
    """
    torch.set_num_threads(1)
    folder.mkdir(parents=True, exist_ok=True)
    state = _read(folder / "progress.json") or {"steps": 0, "cpu_seconds": 0.0, "curve": [], "best": None}
    if state["steps"] >= steps:
        return True
    judge = run.site.environment(run.world, validation or run.site.validation_weeks)
    worlds = training_environment(run, weeks or run.site.training_weeks)
    model = _model(run, folder, recipe, worlds, state["steps"])
    while state["steps"] < steps and time.time() < until:
        begin = cpu_time()
        chunk = min(recipe.evaluate_every, steps - state["steps"])
        model.learn(chunk, reset_num_timesteps=False)
        network = ActorNetwork.of_stable_baselines(model)
        cost = stage_cost(network, judge)
        state["steps"] = int(model.num_timesteps)
        state["cpu_seconds"] += cpu_time() - begin
        state["curve"].append([state["steps"], cost])
        if state["best"] is None or cost < state["best"][1]:
            state["best"] = [state["steps"], cost]
            ActorNetwork.of_stable_baselines(model, _about(run, recipe, state)).save(folder / "best.npz")
        _keep(model, folder, state)
        rate = state["steps"] / max(state["cpu_seconds"], 1e-9)
        say(f"{run.name}: {state['steps']:,} of {steps:,} steps, validation {cost:.2f} (best "
            f"{state['best'][1]:.2f} at {state['best'][0]:,}), {rate:.0f} steps/s")  # fmt: skip
    worlds.close()
    judge.close()
    if state["steps"] < steps:
        return False
    best = ActorNetwork.load(folder / "best.npz")
    whole = {**best.about, "steps": state["steps"], "cpu_seconds": round(state["cpu_seconds"], 1),
             "curve": state["curve"]}  # fmt: skip
    ActorNetwork(best.weights, best.biases, best.activation, best.squashed, whole).save(folder / "policy.npz")
    (folder / "buffer.pkl").unlink(missing_ok=True)  # a hundred times as large as all the rest
    return True


def _model(run: Training, folder: Path, recipe: Recipe, worlds: VecEnv, steps: int) -> Any:
    """Make a model, or read that of the last checkpoint; episodes begin anew there."""
    kind = _KINDS[run.algorithm]
    if steps and (folder / "model.zip").exists():
        model = kind.load(folder / "model.zip", env=worlds, device="cpu")
        model.set_random_seed(run.seed + 1000 * (1 + steps))
        if (folder / "buffer.pkl").exists():
            model.load_replay_buffer(folder / "buffer.pkl")
        return model
    return kind("MlpPolicy", worlds, seed=run.seed, device="cpu", verbose=0, **recipe.options)


def _keep(model: Any, folder: Path, state: dict[str, Any]) -> None:
    """Write a checkpoint, the old one whole until the new one is."""
    model.save(folder / "model.tmp.zip")
    if hasattr(model, "save_replay_buffer"):
        model.save_replay_buffer(folder / "buffer.tmp.pkl")
        (folder / "buffer.tmp.pkl").replace(folder / "buffer.pkl")
    (folder / "model.tmp.zip").replace(folder / "model.zip")
    text = folder / "progress.tmp.json"
    text.write_text(json.dumps(state, indent=1) + "\n", encoding="utf-8")
    text.replace(folder / "progress.json")


def _about(run: Training, recipe: Recipe, state: dict[str, Any]) -> dict[str, Any]:
    return {
        "site": run.site.key, "algorithm": run.algorithm, "world": run.world, "seed": run.seed,
        "best_step": state["steps"], "validation_cost": state["best"][1], "recipe": asdict(recipe),
        "reward": f"minus stage cost, {run.site.discomfort_price:g} a kelvin hour and zone",
        "reward_scale": run.site.reward_scale, "environments": ENVIRONMENTS, "hours_a_step": run.site.hours_a_step,
    }  # fmt: skip


def _read(path: Path) -> dict[str, Any] | None:
    return json.loads(path.read_text(encoding="utf-8")) if path.exists() else None
