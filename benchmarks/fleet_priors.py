"""What a fleet teaches about the next building: three days of telemetry with its priors beside 14 days without.

Buildings of one population (`_fleet`: generated offices of 80 m2 and 2 zones, half-hourly, winter, our own model as
plant; true parameters are drawn about a centre that is not the drawing's). The training fleet is calibrated on 14 days
and held out on 7, by a Kalman filter's innovations, which draw most from few days, and its population learned from its
data set (`calibration.fleet.priors`). The test fleet has other seeds; each of its buildings is calibrated on 14 days,
on the last 3 of them, and on these 3 with the fleet's priors, and judged on the same 7 days that follow. A case of 3
days holds no telemetry from before them. All but the first two are done twice, with errors 6 h ahead as the objective,
the default, and with innovations.

The centre of the population lies 0.8 of the priors' deviations off the drawing, and its spread is 0.25 (``--spread``):
the gain is that of such a fleet, and is smaller where buildings are less alike; the line of the true population as
prior (what an endless fleet would teach) bounds it. How far true parameters are from the estimate of 3 days with that
prior, in deviations of its posterior, says whether that posterior is right. Buildings come from the model that is
fitted: nothing here is said of missing physics.

Run: ``python benchmarks/fleet_priors.py --out results/priors [--train 1000 --test 100] [--workers 2] [--publish]``,
and with ``--spread 0.1 --table fleet_priors_alike`` for buildings that are more alike. Writes ``TABLE.json`` and
``.md``; the training fleet stays in ``train_SPREAD``, and a rerun does what is missing of it.
"""

from __future__ import annotations

import argparse
import os
import tempfile
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import replace
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from _fleet import SPREAD, make_office, population_centre
from _table import markdown, write

from calibration import Interval, calibrate, calibrate_many
from calibration.evaluation.population import Population
from calibration.fit.told import Told
from calibration.fleet.data_set import LocalFolder
from calibration.fleet.priors import population_of
from thermal.case.case import Case
from thermal.case.load import load_case
from thermal.network.build import build_network

LONG, SHORT, HELD_OUT = 14.0, 3.0, 7.0  # days
FIRST_TEST = 10_000  # seed
SETTINGS: dict[str, Any] = {"starts": 1}
OBJECTIVES = {"multi_step": "errors 6 h ahead", "innovations": "innovations"}
COLUMNS = ("calibrated on", "by", "priors", "median [K]", "quartiles [K]", "mean [K]", "better than 14 days without in")


def intervals(case: Case) -> dict[str, Interval]:
    """Days that tune, and days that judge."""
    start = case.stamps[0]
    cuts = {days: start + pd.Timedelta(days=days) for days in (LONG - SHORT, LONG, LONG + HELD_OUT)}
    step = case.stamps[1] - start
    return {
        "long": Interval(start, cuts[LONG]),
        "short": Interval(cuts[LONG - SHORT], cuts[LONG]),
        "held_out": Interval(cuts[LONG] + step, min(cuts[LONG + HELD_OUT], case.stamps[-1])),
    }


def shortened(case: Case, since: pd.Timestamp) -> Case:
    """Leave out what was measured before a time."""
    return replace(case, telemetry=replace(case.telemetry, frame=case.telemetry.frame.loc[since:]))


def train(folder: Path, count: int, workers: int, spread: float) -> tuple[Population, int]:
    """Calibrate the training fleet and learn its population; also how many did not make it."""
    offices = [folder / "cases" / f"office_{seed:05d}" for seed in range(count)]
    for seed, office in enumerate(offices):
        if not office.exists():
            make_office(office, seed, LONG + HELD_OUT, spread=spread)
    results = folder / "results"
    found = calibrate_many(offices, results, SETTINGS | {"objective": "innovations"}, workers=workers)
    return population_of(LocalFolder(results)), sum(o.status != "calibrated" for o in found)


def true_population(learned: Population, prior: dict[str, float], spread: float) -> Population:
    """Make the population that an endless fleet would teach."""
    deviation = np.array([prior[name] for name in learned.names])
    centre = population_centre(list(learned.names))
    mean = np.array([centre[name] for name in learned.names]) * deviation
    return replace(learned, mean=mean, covariance=np.diag((spread * deviation) ** 2))


def squared_distance(told: Told, prior: Population, case: Case, truth: dict[str, float]) -> float:
    """Squared distance of the true parameters from an estimate, by its posterior's covariance, a parameter [-]."""
    parameters = {p.name: p for p in build_network(case.building).parameters}
    estimated = [parameters[name] for name in told.names]
    off = told.point - np.array([p.transform(truth[p.name]) - p.transform(p.start) for p in estimated])
    _, _, covariance = prior.prior(estimated, told.own_deviation)
    return float(off @ (told.information + np.linalg.inv(covariance)) @ off / len(off))


def judge(folder: Path, seed: int, learned: Population, spread: float) -> dict[str, Any]:
    """Held-out errors of a building of the test fleet by days, objective and priors [K]; ``distance`` [-]."""
    truth = make_office(folder, seed, LONG + HELD_OUT, spread=spread)
    case = load_case(folder)
    cut = intervals(case)
    three = shortened(case, cut["short"].start)
    errors: dict[str, Any] = {"seed": seed}
    for objective in OBJECTIVES:
        settings = SETTINGS | {"objective": objective}
        first = calibrate(case, [cut["long"]], [cut["held_out"]], settings=settings)
        deviations = {p.base: p.prior_deviation for p in first.information.estimated}
        errors["drawn"] = first.uncalibrated["held_out"].metrics.mae
        true = true_population(learned, deviations, spread)
        found = {f"14 days, {objective}, none": first}
        for days, on, tuned in (("3 days", three, cut["short"]), ("14 days", case, cut["long"])):
            priors = {"none": None, "fleet": learned, "truth": true}
            for name, given in priors.items():
                key = f"{days}, {objective}, {name}"
                if key not in found and not (days == "14 days" and name == "truth"):
                    more = settings | {"population": given}
                    found[key] = calibrate(on, [tuned], [cut["held_out"]], settings=more)
        errors |= {key: result.calibrated["held_out"].metrics.mae for key, result in found.items()}
    last = found["3 days, innovations, truth"]  # of which the likelihood, and so the posterior, is the plant's own
    return errors | {"distance": squared_distance(last.told, true, case, truth)}


def rows(judged: list[dict[str, Any]]) -> list[list[Any]]:
    """Lay out the table."""
    priors = {"none": "physical ranges", "fleet": "of the fleet", "truth": "true population"}
    which = [("drawn", "nothing", "–", "–")]
    for objective, by in OBJECTIVES.items():
        for days, name in (("14 days", "none"), ("3 days", "none"), ("3 days", "fleet"), ("3 days", "truth"),
                           ("14 days", "fleet")):  # fmt: skip
            which.append((f"{days}, {objective}, {name}", days, by, priors[name]))
    usual, made = "14 days, multi_step, none", []
    for key, days, by, told in which:
        errors = np.array([j[key] for j in judged])
        low, middle, high = np.quantile(errors, (0.25, 0.5, 0.75))
        better = sum(j[key] < j[usual] for j in judged)
        share = "–" if key == usual else f"{better} of {len(judged)}"
        made.append([days, by, told, f"{middle:.4f}", f"{low:.4f} to {high:.4f}", f"{errors.mean():.4f}", share])
    return made


def ratio_of_medians(judged: list[dict[str, Any]], key: str, other: str) -> str:
    """Median error over that of the other, with 90 % by bootstrap over buildings."""
    errors = np.array([[one[key], one[other]] for one in judged])
    drawn = np.random.default_rng(0).integers(0, len(errors), (5000, len(errors)))
    ratios = np.divide(*np.median(errors[drawn], axis=1).T)
    low, high = np.quantile(ratios, (0.05, 0.95))
    return f"{np.divide(*np.median(errors, axis=0)):.2f} ({low:.2f} to {high:.2f})"


def main() -> None:
    """Train, test, and write the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, required=True, help="folder of the results")
    parser.add_argument("--train", type=int, default=1000, help="buildings to learn from")
    parser.add_argument("--test", type=int, default=100, help="buildings to judge on")
    parser.add_argument("--workers", type=int, default=1, help="processes")
    parser.add_argument("--spread", type=float, default=SPREAD, help="of buildings, in deviations of the priors")
    parser.add_argument("--publish", action="store_true", help="replace the table between its marks")
    parser.add_argument("--table", default="fleet_priors", help="whose marks, and name of the files")
    options = parser.parse_args()
    load, judged = os.getloadavg()[0], list[dict[str, Any]]()
    with tempfile.TemporaryDirectory() as folder:
        training = options.out / f"train_{options.spread:g}"
        learned, failed = train(training, options.train, options.workers, options.spread)
        began = sum(os.times()[:4])  # with processes that have ended
        with ProcessPoolExecutor(options.workers, get_context("spawn")) as pool:
            seeds = range(FIRST_TEST, FIRST_TEST + options.test)
            asked = [
                pool.submit(judge, Path(folder) / f"office_{seed}", seed, learned, options.spread) for seed in seeds
            ]
            for one in as_completed(asked):
                judged.append(one.result())
                print(f"{len(judged)} of {options.test}", flush=True)
                print(markdown(COLUMNS, rows(judged)), flush=True)
        judged.sort(key=lambda errors: errors["seed"])
        seconds = sum(os.times()[:4]) - began
    table = markdown(COLUMNS, rows(judged))
    usual = "14 days, multi_step, none"
    of_fleet, of_truth = (ratio_of_medians(judged, f"3 days, innovations, {p}", usual) for p in ("fleet", "truth"))
    note = (
        f"{len(learned.members)} buildings to learn from ({failed} calibrations without convergence), {options.test} "
        f"others to judge on, spread {options.spread:g}; MAE 6 h ahead on the same 7 days. {seconds:.0f} s of CPU for "
        "the tests. Medians of 3 days by innovations over that of 14 days by errors without priors (90 % by bootstrap "
        f"over buildings): {of_fleet} with the fleet's priors, {of_truth} with the true population; from this last "
        f"estimate the true parameters are a squared distance of {np.mean([j['distance'] for j in judged]):.2f} away "
        "(1 where the posterior is right).\n"
    )
    data = {"judged": judged, "population": learned.to_dict(), "failed": failed, "load": load}
    write(options.out, options.table, f"{table}\n{note}", data, options.publish)
    print(table, note, sep="\n")


if __name__ == "__main__":
    main()
