"""Heat of unknown cause where the catalogue is taken away: how much of a gap it closes, in unseen days and seasons.

Offices in EnergyPlus with one effect each, as in the blind trials, and their twins without it; the same buildings
again four months later. The baseline is calibrated, and corrected as if no effect of the catalogue were known. The
share of the gap that is closed, ``(before - after) / (before - twin)``, is taken on held-out days, and four months
later with the parameters as they are. Beside it, on held-out days: a Gaussian process on the errors by zone
(scikit-learn; hour, weekend, and the means over the run of cold, sun and wind). Effects that add no heat which answers
to anything (mass, mixing, exchange between zones, clocks, stations) are left out. Trials whose effect leaves no gap
over 0.05 K do not count.

Run from the repository's root, in an environment with Python 3.11 or newer; an interrupted run goes on where it was::

    pip install -e .[energyplus,benchmarks]
    python benchmarks/corrections.py --seeds 0-39 --out results/corrections
"""

from __future__ import annotations

import argparse
import json
import os
import time
import warnings
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from datetime import date, timedelta
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from _sealed import TrialError
from _seeds import seed_range
from _table import markdown, publish, write
from _trial_scores import LEAST_GAP
from energyplus_trials.climate import YEAR
from energyplus_trials.drawing import draw_spec
from energyplus_trials.specification import TrialSpec
from energyplus_trials.world import WORLD

from calibration.diagnosis.correction import correct
from calibration.diagnosis.refit.comparison import Fit, ModelComparison
from calibration.diagnosis.refit.refit import HeldOut, held_out
from calibration.evaluation.intervals import Interval
from calibration.evaluation.settings import ModelSettings
from thermal import load_case
from thermal.inputs.provider import InputProvider, telemetry_inputs
from thermal.model.reduce import reduced_model

NAME = "corrections"

_COLD = ("heat_by_cold", "heat_by_hour_of_cold")

#: What the heat of an effect answers to, any of these first being right.
DRIVERS: dict[str, tuple[str, ...]] = {
    "solar_gain": ("heat_by_sun",), "blinds": ("heat_by_sun",), "solar_opaque": ("heat_by_sun",),
    "longwave_sky": ("heat_by_sky",), "wind_film": ("heat_by_wind", *_COLD),
    "infiltration": (*_COLD, "heat_by_wind"), "thermal_bridge": _COLD,
    "window_opening": (*_COLD, "heat_by_occupancy"),
    "internal_gains": ("heat_by_occupancy", "heat_by_hour", "heat_always", "heat_at_weekends"),
    "latent_load": ("heat_by_occupancy", "heat_by_hour"), "ground_exchange": ("heat_always", *_COLD),
    "roof_exchange": (*_COLD, "heat_by_sun", "heat_by_sky"), "neighbour": ("heat_always", *_COLD),
    "flow_gain": ("heat_by_meter",), "duct_loss": ("heat_by_meter",), "capacity_limit": ("heat_by_meter",),
}  # fmt: skip

#: How much later the other season is, and days at the year's beginning that a run-in takes.
_LATER, _RUN_IN = 120, 30

#: Errors of a zone that a Gaussian process learns from.
_LEARNT = 400


def later(spec: TrialSpec) -> TrialSpec:
    """Move a trial to another season of its year."""
    first = date(YEAR, 1, 1)
    day = _RUN_IN + ((date.fromisoformat(spec.climate.start) - first).days + _LATER) % (365 - spec.days - _RUN_IN)
    return replace(spec, climate=replace(spec.climate, start=(first + timedelta(days=day)).isoformat()))


def calibrated(folder: Path) -> tuple[ModelComparison, Fit, HeldOut]:
    """Calibrate the baseline, and judge it on held-out days."""
    models = ModelComparison(load_case(folder), ModelSettings())
    fit = models.fit({}, [{}])
    return models, fit, held_out(models, fit)


def elsewhere(folder: Path, models: ModelComparison, fit: Fit) -> float:
    """Held-out error of a fitted model on other telemetry of its building [K]."""
    case = load_case(folder)
    other = ModelComparison(case, ModelSettings())
    other.__dict__["drivers"] = telemetry_inputs(case, models.drivers.normalisation)  # counted as where it was fitted
    built = other.build(fit.effects)
    theta = built.theta(fit.values)
    problem, model = other.problem(built, theta), reduced_model(built.grid, [theta])
    found = replace(fit.found, point=problem.point(theta))
    return held_out(other, replace(fit, built=built, problem=problem, model=model, found=found)).mae


def learnt(models: ModelComparison, fit: Fit) -> float:
    """Held-out error beside a Gaussian process that learns the errors of the tuning days [K]."""
    from sklearn.exceptions import ConvergenceWarning
    from sklearn.gaussian_process import GaussianProcessRegressor
    from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel

    (known, errors), (new, left) = (_samples(models, fit, part) for part in (models.tuned, models.judged))
    rng, corrected = np.random.default_rng(0), np.empty_like(left)
    kernel = ConstantKernel(1.0) * RBF(np.ones(known.shape[1])) + WhiteKernel(0.1)
    mean, spread = known.mean(axis=0), known.std(axis=0) + 1e-9
    for zone in range(errors.shape[1]):
        there = np.flatnonzero(np.isfinite(errors[:, zone]))
        some = rng.permutation(there)[:_LEARNT]
        process = GaussianProcessRegressor(kernel, normalize_y=True, random_state=0)
        with warnings.catch_warnings():  # a length scale at its bound: what is asked of it does not matter
            warnings.simplefilter("ignore", ConvergenceWarning)
            process.fit((known[some] - mean) / spread, errors[some, zone])
        corrected[:, zone] = left[:, zone] - process.predict((new - mean) / spread)
    return float(np.nanmean(np.abs(corrected)))


def _samples(models: ModelComparison, fit: Fit, part: tuple[Interval, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Take what a process may know of each run's end, and the errors there (n_run, n_zone) [K]."""
    inputs: InputProvider = models.drivers
    features, errors = [], []
    for p in fit.evaluate(part, models.horizon).predictions:
        for start, error in zip(inputs.stamps.get_indexer(p.start), p.error, strict=True):
            end = int(start + p.steps[-1])
            run, hour = slice(start + 1, end + 1), 2.0 * np.pi * inputs.clock[end] / 24.0
            sun = inputs.sun.horizontal[run].mean() if inputs.gives("sun") else 0.0
            wind = inputs.wind[run].mean() if inputs.gives("wind") else 0.0
            weekend = float(inputs.stamps[end].day_of_week >= 5)
            features.append([np.sin(hour), np.cos(hour), weekend, inputs.outdoor[run].mean(), sun, wind])
            errors.append(error)
    return np.array(features), np.array(errors)


def judge(out: Path, name: str, twin: str, effect: str) -> dict[str, Any]:
    """Correct one trial, and judge the correction; nothing but its gap where that is too small."""
    models, fit, before = calibrated(out / "cases" / name)
    twins, plain, floor = calibrated(out / "cases" / twin)
    row: dict[str, Any] = {"effect": effect, "trial": name, "before": before.mae, "twin": floor.mae}
    if before.mae - floor.mae <= LEAST_GAP:
        return row
    began = time.process_time()
    found = correct(models, fit, before, floor)
    row["seconds"] = time.process_time() - began
    row["learnt"] = learnt(models, fit)
    row["later"] = {
        "before": elsewhere(out / "later" / "cases" / name, models, fit),
        "twin": elsewhere(out / "later" / "cases" / twin, twins, plain),
    }
    if found is not None:
        row |= {"after": found.after.mae, "drivers": [d.effect for d in found.drivers], "tested": found.tried}
        row["later"]["after"] = elsewhere(out / "later" / "cases" / name, models, found.fit)
    return row


def closed(row: dict[str, Any], after: str = "after") -> float:
    """Share of the gap that is closed [-]; 0 where nothing was certified."""
    gap = row["before"] - row["twin"]
    return float((row["before"] - row.get(after, row["before"])) / gap)


def table(rows: list[dict[str, Any]]) -> str:
    """Lay out the trials that count, by effect and altogether."""
    counted = pd.DataFrame([r for r in rows if "later" in r])
    if counted.empty:
        raise SystemExit("expected trials whose effect leaves a gap, found none")
    records: list[dict[str, Any]] = counted.to_dict("records")
    frame = pd.DataFrame({
        "effect": counted["effect"],
        "right": [isinstance(r.get("drivers"), list) and r["drivers"][0] in DRIVERS[r["effect"]] for r in records],
        "certified": [isinstance(r.get("drivers"), list) for r in records],
        "closed": [closed({k: v for k, v in r.items() if v == v}) for r in records],
        "learnt": [closed(r, "learnt") for r in records],
        "later": [closed(r["later"]) if r["later"]["before"] - r["later"]["twin"] > LEAST_GAP else np.nan
                  for r in records],
    })  # fmt: skip
    lines = [_line(name, part) for name, part in [*frame.groupby("effect"), ("all", frame)]]
    columns = ("effect", "trials", "certified", "right driver first", "closed, unseen days", "of the certified",
               "closed, four months later", "Gaussian process, unseen days")  # fmt: skip
    return markdown(columns, lines)


def _line(name: object, part: pd.DataFrame) -> list[Any]:
    found = part[part["certified"]]

    def middle(values: pd.Series[float]) -> str:
        known = values.dropna().to_numpy()
        if not known.size:
            return "-"
        drawn = np.median(np.random.default_rng(0).choice(known, (2000, known.size)), axis=1)
        low, high = np.quantile(drawn, (0.05, 0.95))
        return f"{np.median(known):.0%}" + (f" ({low:.0%} to {high:.0%})" if known.size > 4 else "")

    right = f"{found['right'].sum()} of {len(found)}"
    return [name, len(part), len(found), right, middle(part["closed"]), middle(found["closed"]),
            middle(found["later"]), middle(part["learnt"])]  # fmt: skip


def main() -> None:
    """Make what is not there, judge it, and tabulate."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=seed_range, required=True, help="first and last, such as 0-39")
    parser.add_argument("--confirmation", action="store_true", help="the stream of seeds that nothing is tuned on")
    parser.add_argument("--out", type=Path, required=True, help="folder of trials, answers and the table")
    parser.add_argument("--workers", type=int, default=min(2, os.cpu_count() or 1), help="processes at a time")
    parser.add_argument("--publish", action="store_true", help="replace the table between its marks")
    options = parser.parse_args()
    specs = [draw_spec(seed, "single", confirmation=options.confirmation) for seed in options.seeds]
    specs = [s for s in specs if s.effects[0].name in DRIVERS]
    answers = options.out / "answers"
    answers.mkdir(parents=True, exist_ok=True)
    with ProcessPoolExecutor(options.workers) as pool:
        tasks = {s.name: pool.submit(_answer, options.out, s, answers / f"{s.name}.json") for s in specs}
        for number, (name, task) in enumerate(tasks.items(), 1):
            print(f"{number} of {len(tasks)}: {name}: {task.result()}", flush=True)
    made = [f for s in specs if (f := answers / f"{s.name}.json").exists()]
    rows = [json.loads(f.read_text(encoding="utf-8")) for f in made]
    text = f"{len(rows)} trials, of which {sum('later' in r for r in rows)} leave a gap.\n\n{table(rows)}"
    write(options.out, NAME, text, rows, published=False)
    if options.publish:
        publish(NAME, text)
    print(text)


def _answer(out: Path, spec: TrialSpec, file: Path) -> str:
    if file.exists():
        return "there already"
    try:
        for trial in (spec, spec.twin()):
            WORLD.make(trial, out / "cases", out / "sealed")
            WORLD.make(later(trial), out / "later" / "cases", out / "later" / "sealed")
    except TrialError as error:  # the others are worth having
        return f"FAILED: {error}"
    row = judge(out, spec.name, spec.twin().name, spec.effects[0].name)
    part = file.with_suffix(".part")
    part.write_text(json.dumps(row), encoding="utf-8")
    part.replace(file)
    return (
        f"{row['effect']}: {row['before']:.3f} K, twin {row['twin']:.3f}, {row.get('after', float('nan')):.3f} with "
        + (", ".join(row.get("drivers", ["nothing"])))
    )


if __name__ == "__main__":
    main()
