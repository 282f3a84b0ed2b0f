"""Optimal control beside learned policies and rules, on a plant that has effects which the model lacks.

The case is that of `_learning_case.py`: an office of 12 zones with sun and leakage, three weeks (winter, spring,
summer) whose weather nobody has seen. All act each quarter of an hour in the same ranges, see the same noisy
measurements and the same forecasts of twelve hours with errors. Lines:

- least action, schedule, outdoor reset, ASHRAE Guideline 36;
- MPC with the model before diagnosis (the calibrated baseline) and after, untuned, at three prices of discomfort;
- do-mpc with the model after diagnosis, and ours on the problem that do-mpc solves, on a day of each week;
- MPC that knows state, model, weather and people, with exact sensors: a bound but for the valleys of its problem;
- PPO and SAC of `train_rl.py`, every policy of `benchmarks/policies`: trained in the model before diagnosis and moved
  to the plant, and trained on the plant. Their reward is minus the stage cost; the best policy on validation weeks of
  their own world is kept.

Indicators have BOPTEST's names. A run is a file in ``OUT/runs``, and the same command goes on where it was interrupted.

Run: ``python benchmarks/mpc_vs_rl.py --out results/mpc_vs_rl --processes 2 [--publish]``. Writes ``mpc_vs_rl.json``,
``.md``, ``mpc_vs_rl_front.svg`` and ``mpc_vs_rl_learning.svg``; ``--smoke`` is a day on four zones.
"""

from __future__ import annotations

import argparse
import json
import os
import time
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from _comparison import PRICES, Entry, entries, run
from _comparison_tables import draw_front, draw_learning, short, table
from _learning_case import FULL, POLICIES, SMOKE, TEST_WEEKS, Size
from _table import publish, write
from simulator_speed import use_one_thread

Job = tuple[Entry, str]


def perform(job: Job, size: Size, policies: Path, file: Path) -> None:
    """Do a run and write it down, whole or not at all."""
    text = json.dumps(run(*job, size, policies), indent=1) + "\n"
    part = file.with_suffix(".part")
    part.write_text(text, encoding="utf-8")
    os.replace(part, file)


def gather(jobs: dict[Path, Job], size: Size, policies: Path, processes: int) -> list[dict[str, Any]]:
    """Do what has not been done, and read all of it."""
    due = {file: job for file, job in jobs.items() if not file.exists()}
    begin = time.time()
    if processes > 1 and len(due) > 1:
        with ProcessPoolExecutor(processes, get_context("spawn")) as pool:
            asked = {pool.submit(perform, job, size, policies, file): file for file, job in due.items()}
            for number, future in enumerate(as_completed(asked), 1):
                future.result()
                print(f"{number} of {len(due)}, {time.time() - begin:.0f} s: {asked[future].stem}", flush=True)
    else:
        for number, (file, job) in enumerate(due.items(), 1):
            perform(job, size, policies, file)
            print(f"{number} of {len(due)}, {time.time() - begin:.0f} s: {file.stem}", flush=True)
    return [json.loads(file.read_text(encoding="utf-8")) for file in jobs]


def parse(arguments: list[str] | None = None) -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, required=True, help="folder of the results")
    parser.add_argument("--policies", type=Path, default=POLICIES, help="folder of policies and models")
    parser.add_argument("--weeks", nargs="+", default=list(TEST_WEEKS), choices=list(TEST_WEEKS))
    parser.add_argument("--prices", nargs="+", type=float, default=list(PRICES), help="of discomfort, for the fronts")
    parser.add_argument("--controllers", nargs="+", help="only these; all by default")
    parser.add_argument("--processes", type=int, default=1)
    parser.add_argument("--publish", action="store_true", help="replace the tables between their marks")
    parser.add_argument("--smoke", action="store_true", help="a day on four zones")
    return parser.parse_args(arguments)


def main(arguments: list[str] | None = None) -> list[dict[str, Any]]:
    """Run, and write tables and pictures."""
    use_one_thread()
    options = parse(arguments)
    size = SMOKE if options.smoke else FULL
    folder = options.out / "runs"
    folder.mkdir(parents=True, exist_ok=True)
    chosen = entries(tuple(options.prices), options.policies)
    if options.controllers:
        chosen = [entry for entry in chosen if entry.controller in options.controllers]
    jobs = {
        folder / f"{week}_{entry.name}_{size.days}d_{size.zones}z.json": (entry, week)
        for entry in chosen for week in options.weeks
    }  # fmt: skip
    if not jobs:
        raise SystemExit(f"no controller of {options.controllers}; policies are looked for in {options.policies}")
    runs = gather(jobs, size, options.policies, options.processes)
    text = table(runs)
    write(options.out, "mpc_vs_rl", text, {"runs": runs}, options.publish)
    if options.publish:
        publish("mpc_vs_rl_short", short(runs))
    draw_front(runs, options.out / "mpc_vs_rl_front.svg")
    draw_learning(runs, options.out / "mpc_vs_rl_learning.svg")
    print(text)
    return runs


if __name__ == "__main__":
    main()
