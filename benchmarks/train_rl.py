"""Train the policies that optimal control is compared with: PPO and SAC of Stable-Baselines3, from scratch.

A run is an algorithm, a world and a seed. Worlds: ``plant``, the building itself, and ``before``, the calibrated
baseline, from which the policy then moves to the plant; ``after``, the model of the diagnosis, is there too. Runs are
taken seed by seed; each has a folder with a checkpoint at every evaluation, and the same command goes on where it was
interrupted. Of each run the policy that did best on validation weeks, in its own world, is kept as arrays of NumPy;
``--ship`` copies them to ``benchmarks/policies``.

Run: ``python benchmarks/train_rl.py --out results/rl``; times in `docs/learning.md`. ``--only ppo_plant`` takes part
of the runs, ``--minutes`` ends after a while, ``--smoke`` is a matter of seconds.
"""

from __future__ import annotations

import argparse
import shutil
import time
from dataclasses import replace
from itertools import product
from pathlib import Path

from _learning_case import FULL, POLICIES, SMOKE, TRAINING_WEEKS, VALIDATION_WEEKS
from _training import RECIPES, Training, train
from simulator_speed import use_one_thread

WORLDS = ("before", "plant")
SEEDS = range(5)


def smoke(folder: Path) -> list[Path]:
    """Train both algorithms for a moment on a small office and a day."""
    weeks = dict(list(TRAINING_WEEKS.items())[:2])
    done = []
    for algorithm, recipe in RECIPES.items():
        few = {"n_steps": 48, "batch_size": 48} if algorithm == "ppo" else {"learning_starts": 50, "buffer_size": 500}
        options = recipe.options | few
        run, short = Training(algorithm, "plant", 0), replace(recipe, steps=96, evaluate_every=96, options=options)
        validation = dict(list(VALIDATION_WEEKS.items())[:1])
        train(run, folder / run.name, short, size=SMOKE, weeks=weeks, validation=validation, say=lambda _: None)
        done.append(folder / run.name / "policy.npz")
    return done


def main() -> None:
    """Train what is asked for."""
    use_one_thread()
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, required=True, help="folder of the runs")
    parser.add_argument("--algorithms", nargs="+", default=list(RECIPES), choices=list(RECIPES))
    parser.add_argument("--worlds", nargs="+", default=list(WORLDS), choices=["before", "after", "plant"])
    parser.add_argument("--seeds", nargs="+", type=int, default=list(SEEDS))
    parser.add_argument("--steps", type=int, help="control steps of a run; those of the recipe by default")
    parser.add_argument("--minutes", type=float, default=float("inf"), help="end after this time, to be resumed")
    parser.add_argument("--ship", action="store_true", help="copy finished policies to benchmarks/policies")
    parser.add_argument("--smoke", action="store_true", help="a moment of training on a small office")
    options = parser.parse_args()
    if options.smoke:
        print("\n".join(str(path) for path in smoke(options.out)))
        return
    until = time.time() + 60.0 * options.minutes
    for seed, world, algorithm in product(options.seeds, options.worlds, options.algorithms):
        run, recipe = Training(algorithm, world, seed), RECIPES[algorithm]
        recipe = replace(recipe, steps=options.steps) if options.steps else recipe
        if time.time() < until and train(run, options.out / run.name, recipe, size=FULL, until=until) and options.ship:
            POLICIES.mkdir(exist_ok=True)
            shutil.copyfile(options.out / run.name / "policy.npz", POLICIES / f"{run.name}.npz")


if __name__ == "__main__":
    main()
