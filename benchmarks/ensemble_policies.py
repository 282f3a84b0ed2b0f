"""Policies trained in one model, or in an ensemble of diagnosed ones, and moved to the office without further learning.

The office and its three test weeks are those of `mpc_vs_rl` (`_office_site.py`). Worlds that PPO is trained in, with
the same recipe, steps and weeks, on as many plants at once as there are members:

- ``before``: the calibrated baseline, which lacks sun and leakage;
- ``after``: the model of the diagnosis, at its most likely parameters;
- ``ensemble``: models drawn from the posterior of the diagnosis, parameters and strengths of effects by their standard
  errors on the estimation scale; each training week has one of them;
- ``plant``: the office itself, which nobody has to learn from.

No policy is chosen by what it does: the last one counts. The judge is the stage cost of a week of the office.

Run: ``python benchmarks/ensemble_policies.py --out results/ensemble [--seeds 0 1 2 3 4] [--publish]`` (extra
``[jax]``), a quarter to half an hour of CPU a policy, ten seconds on a GPU. A policy or a run that is there is not made
again. Writes ``ensemble_policies.json`` and ``.md``.
"""

from __future__ import annotations

import argparse
import json
import time
from functools import cache
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from _comparison import Entry, run
from _office_site import STEP, WARM_UP_DAYS, OfficeSite, model_file, office
from _table import markdown, write
from simulator_speed import use_one_thread

from calibration.evaluation.settings import ModelSettings, load_parameters, read_settings
from mpc.environment.policy import ActorNetwork
from mpc.loop.noise import SensorNoise
from mpc.loop.reduced import ReducedBuilding
from mpc.loop.simulated import SimulatedPlant
from mpc.model import reduced

WORLDS = ("before", "after", "ensemble", "plant")
MODELS, BEGINNINGS, ROUNDS, WEEKS_LEARNED = 8, 32, 610, 26
SITE = OfficeSite()


@cache
def drawn_models(count: int = MODELS) -> list[ReducedBuilding]:
    """Draw models from the posterior of the diagnosis."""
    file = model_file("after")
    settings = ModelSettings(**read_settings(file))
    network, told = settings.network(office()), json.loads(file.read_text(encoding="utf-8"))["parameters"]
    likely, rng = load_parameters(file, network), np.random.default_rng(0)
    found = []
    for _ in range(count):
        values = {}
        for p, value in zip(network.parameters, likely, strict=True):
            error = told[p.name]["standard_error"] or 0.0
            deviation = min(error / p.slope(float(value)), p.prior_deviation)
            drawn = p.inverse(p.transform(float(value)) + deviation * rng.standard_normal())
            values[p.name] = float(np.clip(drawn, p.lower, p.upper))
        found.append(ReducedBuilding(reduced(settings, office(), values), step_seconds=STEP))
    return found


def plants_of(world: str) -> list[SimulatedPlant]:
    """Make the training weeks of a world."""
    weeks = list(SITE.training_weeks.values())
    chosen = weeks[:: max(1, len(weeks) // WEEKS_LEARNED)]
    if world != "ensemble":
        return [SITE.plant(week, world) for week in chosen]  # type: ignore[arg-type]
    made = []
    for k, week in enumerate(chosen):
        plant = SITE.plant(week, "after")
        made.append(SimulatedPlant(
            plant.given, plant.system, drawn_models()[k % MODELS], control_steps=plant.control_steps,
            noise=SensorNoise(), forecaster=plant.forecaster, warm_up_days=WARM_UP_DAYS, seed=week[1],
        ))  # fmt: skip
    return made


@cache
def learner(world: str, rounds: int) -> Any:
    """Compile learning in a world; call it with a seed."""
    import jax

    from mpc.environment.functional import FunctionalEnvironment
    from mpc.environment.ppo import Ppo, PpoSettings
    from mpc.environment.vector import VectorEnvironment

    settings = PpoSettings(reward_scale=SITE.reward_scale)
    ppo = Ppo(FunctionalEnvironment(VectorEnvironment(SITE.world_of(*plants_of(world)), BEGINNINGS), seed=1), settings)

    def learn(seed: Any, tables: Any) -> Any:
        return Ppo(ppo.world.with_tables(tables), settings).learn(jax.random.key(seed), rounds)

    compiled = jax.jit(learn).lower(np.int32(0), ppo.world.tables).compile()
    return ppo, lambda seed: jax.block_until_ready(compiled(np.int32(seed), ppo.world.tables))


def train(world: str, seed: int, rounds: int, path: Path) -> None:
    """Train a policy and keep it."""
    import jax

    ppo, learn = learner(world, rounds)
    begin = time.perf_counter()
    weights, _ = learn(seed)
    told = {"world": world, "seed": seed, "steps": rounds * ppo.settings.samples,
            "device": jax.devices()[0].device_kind, "seconds": time.perf_counter() - begin}  # fmt: skip
    ppo.policy(weights, told).save(path)


def judged(name: str, folder: Path) -> list[dict[str, Any]]:
    """Let a policy run the test weeks of the office."""
    found = []
    for week in SITE.test_weeks:
        file = folder / f"{week}_{name}.json"
        if not file.exists():
            file.write_text(json.dumps(run(Entry(name), week, SITE, folder)) + "\n", encoding="utf-8")
        found.append(json.loads(file.read_text(encoding="utf-8")))
    return found


def rows(folder: Path) -> list[list[Any]]:
    """Lay out the table of all policies that are there."""
    costs: dict[str, list[list[float]]] = {}
    for path in sorted(folder.glob("*.npz")):
        world = path.stem.split("_")[0]
        costs.setdefault(world, []).append([sum(one["days"]) for one in judged(path.stem, folder)])
    best = np.mean(costs["plant"]) if "plant" in costs else np.nan
    made = []
    for world in (w for w in WORLDS if w in costs):
        each = np.array(costs[world])
        mean = each.mean(axis=1)
        beyond = f"{100.0 * (mean.mean() / best - 1.0):+.0f} %"
        weeks = " ".join(f"{v:.1f}" for v in each.mean(axis=0))
        made.append([world, len(mean), f"{mean.mean():.1f}", f"{mean.min():.1f} to {mean.max():.1f}", weeks, beyond])
    return made


def main() -> None:
    """Train, move, judge, and write the table."""
    use_one_thread()
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, required=True, help="folder of policies and results")
    parser.add_argument("--seeds", nargs="+", type=int, default=list(range(5)))
    parser.add_argument("--worlds", nargs="+", default=list(WORLDS), choices=list(WORLDS))
    parser.add_argument("--rounds", type=int, default=ROUNDS, help="of a training; 610 are 20 million control steps")
    parser.add_argument("--publish", action="store_true", help="replace the table between its marks")
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    for seed, world in product(options.seeds, options.worlds):
        path = options.out / f"{world}_{seed}.npz"
        if not path.exists():
            train(world, seed, options.rounds, path)
            print(f"{path.stem}: {ActorNetwork.load(path).about}", flush=True)
        judged(path.stem, options.out)
    columns = ("trained in", "seeds", "stage cost of a week [USD]", "lowest and highest seed",
               " ".join(SITE.test_weeks), "over trained on the plant")  # fmt: skip
    found = rows(options.out)
    told = [dict(ActorNetwork.load(path).about) for path in sorted(options.out.glob("*.npz"))]
    seconds = float(np.mean([one["seconds"] for one in told]))
    note = (
        f"PPO, {told[0]['steps']:,} control steps of a quarter of an hour and {seconds:.0f} s a policy "
        f"({told[0]['device']}); {MODELS} models in the ensemble, drawn by the standard errors of their parameters.\n"
    )
    table = markdown(columns, found)
    write(options.out, "ensemble_policies", f"{table}\n{note}", {"rows": found, "policies": told}, options.publish)
    print(table, note, sep="\n")


if __name__ == "__main__":
    main()
