"""Blind trials of the diagnosis: buildings with effects switched on one by one, in pairs, or not at all.

There are several worlds of buildings, made by packages that share no code for the building: `office`, offices drawn
from a seed in EnergyPlus (`energyplus_trials`), `house`, houses with people in them (`house_trials`), `reference`,
EnergyPlus' reference buildings (`reference_trials`), and `ideal_air`, offices of another maker (`ideal_air_trials`).
`make` draws trials from seeds and makes them. What the diagnosis may see goes to `DIR/cases/NAME`, what a trial truly
holds to `DIR/sealed/NAME.json`; names tell nothing. Seeds of development and of confirmation are streams of their own,
so that no trial of one is ever in the other; trials of one seed share building, weather, use and noise, so that the
null of a seed is the twin of its other trials.

Run from the repository's root, in an environment with Python 3.11 or newer::

    pip install -e .[energyplus]
    python benchmarks/blind_trials.py make --out results/blind --kind single --seeds 0-9
    python benchmarks/blind_trials.py make --out results/blind --kind null --seeds 0-9      # their twins
    python benchmarks/blind_trials.py make --out results/blind --kind pair --seeds 0-9
    python benchmarks/blind_trials.py make --out results/blind --kind without --seeds 0-9   # pairs less one effect
    python benchmarks/blind_trials.py gaps --out results/blind
    python benchmarks/blind_trials.py diagnose --out results/blind
    python benchmarks/blind_trials.py score --out results/blind
    python benchmarks/blind_trials.py make --world reference --out results/reference --kind all --seeds 0-9
    python benchmarks/blind_trials.py make --world ideal_air --out results/ideal_air --kind all --seeds 0-9
    python benchmarks/blind_trials.py worlds --out results/blind results/reference results/spoilt   # by world

`diagnose` answers each trial in a process of its own, which gets the case folder and nothing else; `score` opens the
seals of what is answered. Pairs less one effect are needed for their gap only, which `gaps` measures in a tenth of the
time; few pairs have two effects that show, and ``diagnose --showing`` answers only those. ``score --publish`` of a
folder with one kind of trials goes to a table of its own. An interrupted run goes on where it was: trials and answers
that are there are left alone.
"""

from __future__ import annotations

import argparse
import os
import time
from collections.abc import Sequence
from concurrent.futures import Future, ThreadPoolExecutor, as_completed
from pathlib import Path

from _sealed import EnergyPlusMissingError, TrialError
from _seeds import seed_range
from _trial_answers import CASES, SEALED, answer_all, measure_gaps, report
from _trial_worlds import report_worlds
from _worlds import PACKAGES, Drawn, World, world


def make(maker: World, specs: Sequence[Drawn], out: Path, workers: int) -> list[str]:
    """Make trials that are not there yet and return the names of those that failed.

    Simulators run in processes of their own; the threads only wait for them.

    Parameters
    ----------
    maker : World
        Makes them.
    specs : sequence of Drawn
        What to make.
    out : Path
        Folder of cases and sealed labels.
    workers : int
        Runs at a time.
    """
    failed = []
    with ThreadPoolExecutor(workers) as pool:
        tasks: dict[Future[bool], Drawn] = {
            pool.submit(maker.make, spec, out / CASES, out / SEALED): spec for spec in specs
        }
        began = time.perf_counter()
        try:
            for number, task in enumerate(as_completed(tasks), 1):
                spec, outcome = tasks[task], "there already"
                try:
                    outcome = "made" if task.result() else outcome
                except EnergyPlusMissingError as error:
                    raise SystemExit(str(error)) from error
                except TrialError as error:  # the others are worth having
                    failed.append(spec.name)
                    outcome = f"FAILED: {error}"
                seconds = time.perf_counter() - began
                print(f"{number} of {len(specs)} ({seconds:.0f} s): {spec.name}: {outcome}", flush=True)
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise
    return failed


def _make(options: argparse.Namespace) -> int:
    maker = world(options.world)
    kinds = tuple(k for k in maker.kinds if k != "without") if options.kind == "all" else (options.kind,)
    if not set(kinds) <= set(maker.kinds):
        raise SystemExit(f"--kind: expected one of {', '.join(maker.kinds)} of the world {options.world!r}, "
                         f"found {options.kind!r}")  # fmt: skip
    if options.uneven and options.world != "office":
        raise SystemExit(f"--uneven: expected the world 'office', found {options.world!r}; leave it out")
    more = {"uneven": True} if options.uneven else {}
    specs = [
        spec
        for seed in options.seeds
        for kind in kinds
        for spec in maker.draw(seed, kind, confirmation=options.confirmation, days=options.days, **more)
    ]
    return 1 if make(maker, specs, options.out, options.workers) else 0


def main() -> int:
    """Run the command."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(required=True)
    command = commands.add_parser("make", help="make trials and seal their labels")
    command.add_argument("--out", type=Path, required=True, help="folder of cases and sealed labels")
    command.add_argument("--world", choices=sorted(PACKAGES), default="office", help="which buildings")
    kinds = ("null", "single", "pair", "outside", "without", "all")
    command.add_argument("--kind", choices=kinds, required=True, help="which effects the trials hold")
    command.add_argument("--seeds", type=seed_range, required=True, help="first and last, such as 0-19")
    command.add_argument("--confirmation", action="store_true", help="the stream of seeds that nothing is tuned on")
    command.add_argument("--uneven", action="store_true", help="offices: films with the wind, uneven furniture")
    command.add_argument("--days", type=int, help="length of the telemetry, the world's own where left out")
    command.add_argument("--workers", type=int, default=min(2, os.cpu_count() or 1), help="runs at a time")
    command.set_defaults(run=_make)
    command = commands.add_parser("diagnose", help="diagnose trials that have no answer yet, one process each")
    command.add_argument("--out", type=Path, required=True, help="folder of the trials")
    command.add_argument("--workers", type=int, default=min(2, os.cpu_count() or 1), help="processes at a time")
    command.add_argument("--most", type=int, help="most trials to answer now")
    command.add_argument("--showing", action="store_true", help="only those of several effects of which two show")
    command.set_defaults(run=lambda o: 1 if answer_all(o.out, o.workers, o.most, showing=o.showing) else 0)
    command = commands.add_parser("gaps", help="measure the gap of trials without an answer, as twins need no more")
    command.add_argument("--out", type=Path, required=True, help="folder of the trials")
    command.add_argument("--workers", type=int, default=min(2, os.cpu_count() or 1), help="processes at a time")
    command.set_defaults(run=lambda o: 1 if measure_gaps(o.out, o.workers) else 0)
    command = commands.add_parser("score", help="open the seals of answered trials and score the answers")
    command.add_argument("--out", type=Path, required=True, help="folder of the trials")
    command.add_argument("--publish", action="store_true", help="replace the table between its marks")
    command.add_argument("--table", default="blind_trials", help="whose marks, such as blind_trials_fresh")
    command.set_defaults(run=_score)
    command = commands.add_parser("worlds", help="score answered trials of several folders by world")
    command.add_argument("--out", type=Path, required=True, nargs="+", help="folders of the trials")
    command.add_argument("--publish", action="store_true", help="replace the table between its marks")
    command.set_defaults(run=_worlds)
    options = parser.parse_args()
    return int(options.run(options))


def _score(options: argparse.Namespace) -> int:
    print(report(options.out, options.publish, options.table))
    return 0


def _worlds(options: argparse.Namespace) -> int:
    print(report_worlds(options.out, options.publish))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
