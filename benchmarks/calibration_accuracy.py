"""Calibration beside the paper's own method: errors on its three intervals and held out, evaluations, seconds, bounds.

Every case of ``--cases`` that has floor plans is calibrated seven ways: not at all; by the paper's 100 evaluations of
its metric over its eight ranges, in its structure of the model (air and walls) and in ours (slabs, furniture and a
radiant node beside them), each by a plain search and by a Bayesian one; by `calibration.calibrate` on the same six
hours; and by it on the first two thirds of the telemetry. The plain search is the paper's row: it says "100 iterations"
and nothing of how. `_paper_search.py` has searches, ranges and how its parameters map to ours, `_calibration_study.py`
the intervals and what is shared, so that methods differ in nothing but method.

Run: ``python benchmarks/calibration_accuracy.py --out results/calibration [--cases CASES] [--publish]``; some three
minutes a case on a core. Each case is one file of ``cases/`` in ``--out`` as soon as it is done: run the same command
again after an interruption and it goes on where it was.

Errors of the first version, beside these, are read from ``first_accuracy.json``: the table of ``baseline_accuracy.py``
in the README of the commit that it names, written by ``--first-version COMMIT``.
"""

from __future__ import annotations

import argparse
import json
import os
import time
import traceback
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from _calibration_study import Study, measure
from _calibration_tables import first_version, report
from _paper_search import EVALUATIONS
from _table import ROOT, publish, write

from thermal import load_case
from thermal.case.building import FloorPlans

NAME = "calibration"
SHARED = ROOT.parent / "shared" / "cases"


def cases_with_plans(places: Sequence[Path]) -> dict[str, Path]:
    """Find the cases among given folders, and one level inside of them, that have floor plans, by name."""
    folders = [
        p.parent for place in places for pattern in ("building.yaml", "*/building.yaml") for p in place.glob(pattern)
    ]
    buildings = {path: load_case(path).building for path in sorted(folders)}
    return {b.name: path for path, b in buildings.items() if isinstance(b.geometry, FloorPlans)}


def attempt(path: Path, study: Study) -> dict[str, Any]:
    """Measure a case; an error is an outcome as well."""
    try:
        return measure(path, study)
    except Exception as error:  # one case that fails should not cost the others
        return {"failure": f"{type(error).__name__}: {error}", "traceback": traceback.format_exc()}


def read_lines(folder: Path, study: Study) -> dict[str, dict[str, Any]]:
    """Read the cases that were measured before."""
    lines = {}
    for path in sorted(folder.glob("*.json")):
        line = json.loads(path.read_text(encoding="utf-8"))
        if line["study"] != study.to_dict():
            raise SystemExit(
                f"{path}: expected a study of {study.to_dict()}, found {line['study']}; choose another --out"
            )
        lines[line["case"]] = line
    return lines


def run(cases: dict[str, Path], study: Study, workers: int, folder: Path) -> dict[str, str]:
    """Measure cases in processes of their own, write a file each, and return what failed."""
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ[name] = "1"  # spawned workers load NumPy after this
    folder.mkdir(parents=True, exist_ok=True)
    failed: dict[str, str] = {}
    began = time.perf_counter()
    with ProcessPoolExecutor(workers, get_context("spawn")) as pool:
        tasks = {pool.submit(attempt, path, study): name for name, path in cases.items()}
        for number, task in enumerate(as_completed(tasks), 1):
            name = tasks[task]
            try:
                line = task.result()
            except (BrokenProcessPool, KeyboardInterrupt) as error:
                pool.shutdown(wait=False, cancel_futures=True)
                raise SystemExit(f"stopped by {type(error).__name__}; run again to go on with the rest") from error
            if "failure" in line:
                failed[name] = line["failure"]
                print(line["traceback"], flush=True)
            else:
                part = folder / f"{name}.part"
                part.write_text(json.dumps(line, indent=1) + "\n", encoding="utf-8")
                part.replace(folder / f"{name}.json")
            left = (time.perf_counter() - began) / number * (len(tasks) - number)
            outcome = line.get("failure") or f"{line['wall_seconds']:.0f} s"
            print(f"{number} of {len(tasks)}: {name}: {outcome}; about {left / 60:.0f} min left", flush=True)
    return failed


def main() -> None:
    """Measure the cases that are not there yet, and write the tables of all."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", type=Path, nargs="+", default=[SHARED], help="case folders, or folders of them")
    parser.add_argument("--out", type=Path, default=Path("results"), help="folder of the results")
    parser.add_argument("--hours", nargs=2, default=Study.hours, metavar="CLOCK", help="starts of (a), and of (c)")
    parser.add_argument("--day", help="day of (a), such as 2023-07-06; the first weekday that will do by default")
    parser.add_argument("--evaluations", type=int, default=EVALUATIONS, help="of the paper's search")
    parser.add_argument("--seed", type=int, default=0, help="of the searches")
    parser.add_argument("--workers", type=int, default=1, help="processes, one thread each")
    parser.add_argument("--publish", action="store_true", help="replace the table between its marks")
    parser.add_argument("--first-version", metavar="COMMIT", help="write first_accuracy.json from this commit and stop")
    options = parser.parse_args()
    if options.first_version:
        print(f"first_accuracy.json: {len(first_version(options.first_version)['cases'])} cases")
        return
    first = first_version()
    study, folder = Study(tuple(options.hours), options.day, options.evaluations, options.seed), options.out / "cases"
    cases = cases_with_plans(options.cases)
    lines = read_lines(folder, study)
    missing = {name: path for name, path in cases.items() if name not in lines}
    failed = run(missing, study, options.workers, folder) if missing else {}
    lines = read_lines(folder, study)
    measured = [lines[name] for name in cases if name in lines]
    short, by_case, page = report(measured, failed, first)
    write(options.out, NAME, page, {"first_version": first, "cases": measured, "failed": failed}, published=False)
    if options.publish:
        publish(NAME, short)
        publish(f"{NAME}_cases", by_case)
    print(page)


if __name__ == "__main__":
    main()
