"""Optimal control beside learned policies and rules, on plants that have effects which the model lacks.

Two buildings: that of `_office_site.py`, an office of 12 zones of ours with sun and leakage, and that of
`_medium_office_site.py`, EnergyPlus' Medium Office (extra ``[energyplus]``). On each there are three weeks (winter,
spring, summer) whose weather nobody has been trained on. All act in the same ranges, and see the same noisy
measurements and the same forecasts. Lines:

- least action, and the rules of the building: schedule, outdoor reset, ASHRAE Guideline 36, or EnergyPlus' own;
- MPC with the model before diagnosis (the calibrated baseline) and after, untuned, at three prices of discomfort;
- in our office MPC that samples plans on the batched plant, with the model after diagnosis;
- in our office do-mpc with the model after diagnosis, and ours on the problem that do-mpc solves, on a day of each
  week; and MPC that knows state, model, weather and people, with exact sensors: a bound but for the valleys of its
  problem. EnergyPlus' state nobody knows: there is no bound there;
- PPO and SAC of `train_rl.py`, every policy of ``benchmarks/policies``: trained in the model before diagnosis and moved
  to the plant, and trained on the plant. Their reward is minus the stage cost; the best policy on validation weeks of
  their own world is kept.

Indicators have BOPTEST's names. A run is a file in ``OUT/SITE``, and the same command goes on where it was interrupted.

Run: ``python benchmarks/mpc_vs_rl.py --out results/mpc_vs_rl --processes 2 [--publish]``. Writes ``mpc_vs_rl.json``,
``.md`` and for each building ``mpc_vs_rl_front_SITE.svg`` and ``mpc_vs_rl_learning_SITE.svg``; with ``--publish`` also
the tables and the fronts of README and docs. ``--sites office`` takes one of them; ``--smoke`` is a day on four zones,
without policies unless ``--policies`` has such.
"""

from __future__ import annotations

import argparse
import json
import time
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from _comparison import Entry, entries, run
from _comparison_tables import PRICES, draw_front, draw_learning, short, table
from _office_site import SMOKE, OfficeSite
from _site import Site
from _sites import SITES
from _table import keep, publish, write
from _threads import use_one_thread

PICTURES = Path(__file__).parents[1] / "docs" / "images"
WEEKS = ("winter", "spring", "summer")
Job = tuple[Entry, str, Site, Path]


def perform(job: Job, file: Path) -> None:
    """Do a run and write it down, whole or not at all."""
    keep(file, run(*job))


def gather(jobs: dict[Path, Job], processes: int) -> list[dict[str, Any]]:
    """Do what has not been done, and read all of it."""
    due = {file: job for file, job in jobs.items() if not file.exists()}
    begin = time.time()
    if processes > 1 and len(due) > 1:
        with ProcessPoolExecutor(processes, get_context("spawn")) as pool:
            asked = {pool.submit(perform, job, file): file for file, job in due.items()}
            for number, future in enumerate(as_completed(asked), 1):
                future.result()
                print(f"{number} of {len(due)}, {time.time() - begin:.0f} s: {asked[future].stem}", flush=True)
    else:
        for number, (file, job) in enumerate(due.items(), 1):
            perform(job, file)
            print(f"{number} of {len(due)}, {time.time() - begin:.0f} s: {file.stem}", flush=True)
    return [json.loads(file.read_text(encoding="utf-8")) for file in jobs]


def parse(arguments: list[str] | None = None) -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, required=True, help="folder of the results")
    parser.add_argument("--sites", nargs="+", default=list(SITES), choices=list(SITES), help="buildings")
    parser.add_argument("--policies", type=Path, help="folder of policies; by default that of each building")
    parser.add_argument("--weeks", nargs="+", default=list(WEEKS), choices=list(WEEKS))
    parser.add_argument("--prices", nargs="+", type=float, default=list(PRICES), help="of discomfort, for the fronts")
    parser.add_argument("--controllers", nargs="+", help="only these; all by default")
    parser.add_argument("--processes", type=int, default=1)
    parser.add_argument("--publish", action="store_true", help="replace the tables between their marks, and pictures")
    parser.add_argument("--smoke", action="store_true", help="a day on four zones")
    return parser.parse_args(arguments)


def jobs_of(site: Site, options: argparse.Namespace) -> dict[Path, Job]:
    """List the runs on a site by their files."""
    # the policies of a building were trained on all its zones, more than a smoke run has
    policies = options.policies or (options.out if options.smoke else site.policies)
    chosen = [
        entry for entry in entries(site, tuple(options.prices), policies)
        if not options.controllers or entry.controller in options.controllers
    ]  # fmt: skip
    if not chosen:
        raise SystemExit(f"{site.key}: no controller of {options.controllers}; policies are looked for in {policies}")
    folder = options.out / site.key
    return {
        folder / f"{week}_{entry.name}_{site.days}d.json": (entry, week, site, policies)
        for entry in chosen for week in options.weeks
    }  # fmt: skip


def main(arguments: list[str] | None = None) -> list[dict[str, Any]]:
    """Run, and write tables and pictures."""
    use_one_thread()
    options = parse(arguments)
    sites = [OfficeSite(SMOKE)] if options.smoke else [SITES[key] for key in options.sites]
    runs = {site.key: gather(jobs_of(site, options), options.processes) for site in sites}
    texts = {site.key: table(site, runs[site.key]) for site in sites}
    text = "\n".join(f"**{site.name}**\n\n{texts[site.key]}" for site in sites)
    write(options.out, "mpc_vs_rl", text, {"runs": runs}, published=False)
    folders = [options.out, PICTURES] if options.publish else [options.out]
    for site in sites:
        for folder in folders:
            draw_front(site, runs[site.key], folder / f"mpc_vs_rl_front_{site.key}.svg")
        draw_learning(site, runs[site.key], options.out / f"mpc_vs_rl_learning_{site.key}.svg")
    if options.publish:
        for site in sites:
            publish(f"mpc_vs_rl_{site.key}", texts[site.key])
            publish(f"mpc_vs_rl_short_{site.key}", short(site, runs[site.key]))
    print(text)
    return [row for of in runs.values() for row in of]


if __name__ == "__main__":
    main()
