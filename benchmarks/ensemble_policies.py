"""Policies trained in one model, or in an ensemble of diagnosed ones, and moved to the plant without further learning.

The buildings and their three test weeks are those of `mpc_vs_rl`: the office of ours, and EnergyPlus' Medium Office.
Worlds that PPO is trained in, with the same recipe and steps, on as many plants at once as there are members:

- ``before``: the calibrated baseline, which lacks sun and leakage, or sun and the heat of people;
- ``after``: the model of the diagnosis, at its most likely parameters; of EnergyPlus the one of the nearest season;
- ``ensemble``: in the office models that the diagnosis leaves possible, sets of effects by their probability and
  parameters by their covariance, with the heat that the likeliest leaves unexplained; of EnergyPlus the diagnoses of
  three telemetries, which differ by more than their standard errors, and in what they found. Each training week has one
  of them;
- ``plant``: the office itself, which nobody has to learn from. On EnergyPlus, which has no equations to trace, are the
  policies of `train_rl`, which learned there one step after the other.

No policy is chosen by what it does: the last one counts. The judge is the stage cost of a week of the plant.

Run: ``python benchmarks/ensemble_policies.py --out results/ensemble [--site medium_office] [--seeds 0 1 2 3 4]
[--publish]`` (extra ``[jax]``, and ``[energyplus]``), a quarter to half an hour of CPU a policy, ten seconds on a GPU.
A policy or a run that is there is not made again. Writes ``ensemble_policies.json`` and ``.md``, or those of the site.
"""

from __future__ import annotations

import argparse
import json
import time
from dataclasses import replace
from functools import cache
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from _comparison import Entry, run
from _medium_office_site import SEASONS, MediumOfficeSite
from _office_site import STEP, WARM_UP_DAYS, office, posterior_file
from _site import Site
from _sites import SITES
from _table import markdown, write
from _threads import use_one_thread

from calibration.diagnosis.posterior import read_posterior
from calibration.estimation.disturbance import DisturbanceModel
from mpc.environment.policy import ActorNetwork
from mpc.loop.noise import SensorNoise
from mpc.loop.reduced import ReducedBuilding
from mpc.loop.simulated import SimulatedPlant
from mpc.model import control_model

WORLDS = ("before", "after", "ensemble", "plant")
MODELS, BEGINNINGS, ROUNDS, WEEKS_LEARNED = 8, 32, 610, 26
#: What stands beside policies of EnergyPlus: learned on it, and optimal control.
BESIDE = {"ppo_plant": "EnergyPlus, PPO of `train_rl`", "sac_plant": "EnergyPlus, SAC of `train_rl`",
          "mpc_after": "optimal control, model after diagnosis"}  # fmt: skip


@cache
def drawn_models(count: int = MODELS) -> list[tuple[ReducedBuilding, DisturbanceModel | None]]:
    """Draw models that the diagnosis leaves possible, with the heat that they leave unexplained."""
    drawn = read_posterior(posterior_file()).draw(office(), count)
    return [(ReducedBuilding(control_model(office(), one), step_seconds=STEP), one.disturbance) for one in drawn]


def plants_of(site: Site, world: str) -> list[Any]:
    """Make the training weeks of a world."""
    weeks = list(site.training_weeks.values())
    chosen = weeks[:: max(1, len(weeks) // WEEKS_LEARNED)]
    if world != "ensemble":
        return [site.plant(week, world) for week in chosen]  # type: ignore[arg-type]
    if isinstance(site, MediumOfficeSite):
        return [site.modelled(week, season) for week in chosen for season in SEASONS]
    made = []
    for k, week in enumerate(chosen):
        plant: Any = site.plant(week, "after")
        model, unmeasured = drawn_models()[k % MODELS]
        made.append(SimulatedPlant(
            replace(plant.given, unmeasured=unmeasured), plant.system, model, control_steps=plant.control_steps,
            noise=SensorNoise(), forecaster=plant.forecaster, warm_up_days=WARM_UP_DAYS, seed=week[1],
        ))  # fmt: skip
    return made


@cache
def learner(site: Site, world: str, rounds: int) -> Any:
    """Compile learning in a world; call it with a seed."""
    import jax

    from mpc.environment.functional import FunctionalEnvironment
    from mpc.environment.ppo import Ppo, PpoSettings
    from mpc.environment.vector import VectorEnvironment

    settings, plants = PpoSettings(reward_scale=site.reward_scale), plants_of(site, world)
    members = max(BEGINNINGS, 2 * len(plants))
    ppo = Ppo(FunctionalEnvironment(VectorEnvironment(site.world_of(*plants), members), seed=1), settings)

    def learn(seed: Any, tables: Any) -> Any:
        return Ppo(ppo.world.with_tables(tables), settings).learn(jax.random.key(seed), rounds)

    compiled = jax.jit(learn).lower(np.int32(0), ppo.world.tables).compile()
    return ppo, lambda seed: jax.block_until_ready(compiled(np.int32(seed), ppo.world.tables))


def train(site: Site, world: str, seed: int, rounds: int, path: Path) -> None:
    """Train a policy and keep it."""
    import jax

    ppo, learn = learner(site, world, rounds)
    begin = time.perf_counter()
    weights, _ = learn(seed)
    told = {"world": world, "seed": seed, "steps": rounds * ppo.settings.samples,
            "device": jax.devices()[0].device_kind, "seconds": time.perf_counter() - begin}  # fmt: skip
    ppo.policy(weights, told).save(path)


def judged(site: Site, name: str, policies: Path, folder: Path) -> list[list[float]]:
    """Let a controller run the test weeks; give the stage costs of their days."""
    found = []
    for week in site.test_weeks:
        file = folder / f"{week}_{name}.json"
        if not file.exists():
            file.write_text(json.dumps(run(Entry(name), week, site, policies)) + "\n", encoding="utf-8")
        found.append(json.loads(file.read_text(encoding="utf-8"))["days"])
    return found


def rows(site: Site, folder: Path) -> list[list[Any]]:
    """Lay out the table of all policies that are there, and of what stands beside them."""
    named = {path.stem: (path.stem.split("_")[0], folder) for path in sorted(folder.glob("*.npz"))}
    if "plant" not in (world for world, _ in named.values()):
        learned = {path.stem for path in site.policies.glob("*_plant_*.npz")}
        named |= {stem: (stem.rpartition("_")[0], site.policies) for stem in sorted(learned)}
        named["mpc_after"] = "mpc_after", site.policies
    costs: dict[str, list[list[float]]] = {}
    for name, (world, policies) in named.items():
        costs.setdefault(world, []).append([sum(days) for days in judged(site, name, policies, folder)])
    best = min(np.mean(costs[world]) for world in costs if world.endswith("plant"))
    made = []
    for world in (w for w in (*WORLDS, *BESIDE) if w in costs):
        each = np.array(costs[world])
        mean = each.mean(axis=1)
        beyond = f"{100.0 * (mean.mean() / best - 1.0):+.0f} %"
        weeks = " ".join(f"{v:.1f}" for v in each.mean(axis=0))
        ends = f"{mean.min():.1f} to {mean.max():.1f}" if len(mean) > 1 else ""
        made.append([BESIDE.get(world, world), len(mean), f"{mean.mean():.1f}", ends, weeks, beyond])
    return made


def main() -> None:
    """Train, move, judge, and write the table."""
    use_one_thread()
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, required=True, help="folder of policies and results")
    parser.add_argument("--site", choices=list(SITES), default="office")
    parser.add_argument("--seeds", nargs="+", type=int, default=list(range(5)))
    parser.add_argument("--worlds", nargs="+", choices=list(WORLDS), help="all that can be had by default")
    parser.add_argument("--rounds", type=int, default=ROUNDS, help="of a training; 610 are 20 million control steps")
    parser.add_argument("--publish", action="store_true", help="replace the table between its marks")
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    site = SITES[options.site]
    traced = WORLDS if site.key == "office" else WORLDS[:-1]
    for seed, world in product(options.seeds, options.worlds or traced):
        path = options.out / f"{world}_{seed}.npz"
        if not path.exists():
            train(site, world, seed, options.rounds, path)
            print(f"{path.stem}: {ActorNetwork.load(path).about}", flush=True)
        judged(site, path.stem, options.out, options.out)
    columns = ("trained in", "seeds", "stage cost of a week [USD]", "lowest and highest seed",
               " ".join(site.test_weeks), "over trained on the plant")  # fmt: skip
    found = rows(site, options.out)
    told = [dict(ActorNetwork.load(path).about) for path in sorted(options.out.glob("*.npz"))]
    seconds = float(np.mean([one["seconds"] for one in told]))
    many = f"{MODELS} models in the ensemble, out of those that the diagnosis leaves possible"
    if site.key != "office":
        many = f"{len(SEASONS)} models in the ensemble, of telemetry of {', '.join(SEASONS)}"
    note = (
        f"PPO, {told[0]['steps']:,} control steps of {60.0 * site.hours_a_step:.0f} minutes and {seconds:.0f} s a "
        f"policy ({told[0]['device']}); {many}.\n"
    )
    name, table = "ensemble_policies" + ("" if site.key == "office" else f"_{site.key}"), markdown(columns, found)
    write(options.out, name, f"{table}\n{note}", {"rows": found, "policies": told}, options.publish)
    print(table, note, sep="\n")


if __name__ == "__main__":
    main()
