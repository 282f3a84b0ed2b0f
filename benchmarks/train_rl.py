"""Train the policies that optimal control is compared with: PPO and SAC of Stable-Baselines3, from scratch.

A run is a site, an algorithm, a world and a seed. Sites: ``office``, an office of ours, and ``medium_office``, one of
EnergyPlus (extra ``[energyplus]``). Worlds: ``plant``, the building itself, and ``before``, the calibrated baseline,
from which the policy then moves to the plant; ``after``, the model of the diagnosis, is there too. Runs are taken seed
by seed; each has a folder with a checkpoint at every evaluation, and the same command goes on where it was
interrupted. Of each run the policy that did best on validation weeks, in its own world, is kept as arrays of NumPy;
``--ship`` copies them to ``benchmarks/policies``.

Run: ``python benchmarks/train_rl.py --out results/rl``; times in `docs/learning.md`. ``--worlds plant`` and such take
part of the runs, ``--minutes`` ends after a while, ``--models`` first makes the models anew from telemetry (minutes),
``--smoke`` is a matter of seconds.
"""

from __future__ import annotations

import argparse
import shutil
import time
from dataclasses import replace
from itertools import product
from pathlib import Path

from _office_site import SMOKE, OfficeSite
from _sites import SITES
from _threads import use_one_thread
from _training import RECIPES, Training, train

WORLDS = ("before", "plant")
SEEDS = range(5)


def smoke(folder: Path) -> list[Path]:
    """Train both algorithms for a moment on a small office and a day."""
    site, done = OfficeSite(SMOKE), []
    weeks, validation = (dict(list(w.items())[:n]) for w, n in ((site.training_weeks, 2), (site.validation_weeks, 1)))
    for algorithm, recipe in RECIPES.items():
        few = {"n_steps": 48, "batch_size": 48} if algorithm == "ppo" else {"learning_starts": 50, "buffer_size": 500}
        short = replace(recipe, evaluate_every=96, options=recipe.options | few)
        run = Training(site, algorithm, "plant", 0)
        train(run, folder / run.name, short, 96, weeks=weeks, validation=validation, say=lambda _: None)
        done.append(folder / run.name / "policy.npz")
    return done


def main() -> None:
    """Train what is asked for."""
    use_one_thread()
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, required=True, help="folder of the runs")
    parser.add_argument("--sites", nargs="+", default=list(SITES), choices=list(SITES))
    parser.add_argument("--algorithms", nargs="+", default=list(RECIPES), choices=list(RECIPES))
    parser.add_argument("--worlds", nargs="+", default=list(WORLDS), choices=["before", "after", "plant"])
    parser.add_argument("--seeds", nargs="+", type=int, default=list(SEEDS))
    parser.add_argument("--steps", type=int, help="control steps of a run; those of the site by default")
    parser.add_argument("--minutes", type=float, default=float("inf"), help="end after this time, to be resumed")
    parser.add_argument("--models", action="store_true", help="first make the models of the buildings anew")
    parser.add_argument("--ship", action="store_true", help="copy finished policies to benchmarks/policies")
    parser.add_argument("--smoke", action="store_true", help="a moment of training on a small office")
    options = parser.parse_args()
    if options.smoke:
        print("\n".join(str(path) for path in smoke(options.out)))
        return
    until = time.time() + 60.0 * options.minutes
    for key in options.sites if options.models else ():
        SITES[key].make_models(options.out / "models")
    for seed, key, world, algorithm in product(options.seeds, options.sites, options.worlds, options.algorithms):
        run = Training(SITES[key], algorithm, world, seed)
        folder, steps = options.out / key / run.name, options.steps or run.site.budget[algorithm]
        if time.time() < until and train(run, folder, RECIPES[algorithm], steps, until=until) and options.ship:
            run.site.policies.mkdir(exist_ok=True)
            shutil.copyfile(folder / "policy.npz", run.site.policies / f"{run.name}.npz")


if __name__ == "__main__":
    main()
