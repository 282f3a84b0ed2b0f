"""One case under every method of calibration: errors on three six-hour intervals as the paper has them, and held out.

The intervals are the paper's: (a) 1:40 to 7:40 of a weekday, (b) the same hours of the next day, (c) 11:40 to 17:40 of
that day; (a) is the first that has three days of spin-up before it and a weekday after it. Each is one run of N steps,
judged by the paper's metric, the mean over zones of ``|T_real - T_sim|`` at the last step. Held out is the last third
of the telemetry, with a run every hour.

The paper's methods minimise that metric of (a). All methods share model code, inputs and spin-up (the paper starts
walls at a state that it does not describe), and every error is one of the grid, no reduced model's: a search that jumps
over all of its ranges would leave any basis behind.

Ours fits on (a) from the first whole hour on, for `calibration.calibrate` starts its runs on the hour.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from _code import code
from _paper_search import EVALUATIONS, RANGES, Search, bayesian_search, sobol_search, theta, values
from numpy.typing import NDArray

from calibration import CalibrationResult, CalibrationSettings, Interval, ModelSettings, calibrate, evaluate_model
from calibration.evaluation.intervals import default_intervals, horizon_steps
from calibration.evaluation.n_step import EvaluationSettings, spatial_metrics
from thermal import Case, Inputs, Structure, SymbolicModel, free_runs, load_case, replay_inputs, spin_up
from thermal.model.case_replay import SPIN_UP
from thermal.model.matrices import Matrices
from thermal.network.structure import BASELINE

FloatArray = NDArray[np.float64]

#: How runs are judged, whatever a method fitted: as `calibrate` does by default.
HORIZON, SCHEME = "6h", ModelSettings().stepping

#: Structures that the paper's searches are given, and the searches, by the names of their rows.
STRUCTURES = {"its structure": Structure.paper(), "our structure": BASELINE}
SEARCHES: dict[str, Callable[..., Search]] = {"paper": sobol_search, "paper, Bayesian": bayesian_search}


@dataclass(frozen=True)
class Study:
    """What a case's numbers depend on beside the case."""

    hours: tuple[str, str] = ("01:40", "11:40")  # clock at the starts of (a) and (b), and of (c)
    day: str | None = None  # of (a), as 2023-07-06; None for the first that will do
    evaluations: int = EVALUATIONS
    seed: int = 0

    def to_dict(self) -> dict[str, Any]:
        """Values by name, as JSON gives them back."""
        return {**asdict(self), "hours": list(self.hours)}


@dataclass(frozen=True)
class Intervals:
    """Where methods are tuned and judged."""

    starts: dict[str, int]  # stamps of the runs a, b and c
    tune: Interval  # of (a)
    tuning: list[Interval]  # the first two thirds
    held_out: list[Interval]  # the last third

    def inside(self, inputs: Inputs, parts: Sequence[Interval]) -> list[str]:
        """Name the runs whose start lies in intervals that a method was tuned on."""
        at = {name: inputs.stamps[start] for name, start in self.starts.items()}
        return [name for name, stamp in at.items() if any(p.start <= stamp <= p.end for p in parts)]


def measure(path: Path, study: Study) -> dict[str, Any]:
    """Calibrate a case by every method and collect a row each."""
    began = Clock()
    case = load_case(path)
    bench = Bench(case, study)
    rows = [bench.uncalibrated()]
    for search in SEARCHES:
        rows += [bench.searched(search, structure) for structure in STRUCTURES]
    rows += [bench.ours("ours, on (a)", [bench.intervals.tune]), bench.ours("ours", bench.intervals.tuning)]
    stamps = {name: bench.inputs.stamps[start].isoformat() for name, start in bench.intervals.starts.items()}
    return {
        "case": case.building.name,
        "study": study.to_dict(),
        "code": code(),
        "starts": stamps,
        "held_out": [i.to_dict() for i in bench.intervals.held_out],
        "rows": rows,
        **began.seconds(),
    }


class Clock:
    """Wall and CPU time since it was made; CPU time of processes that were waited for as well."""

    def __init__(self) -> None:
        self.wall, self.cpu = time.perf_counter(), sum(os.times()[:4])

    def seconds(self) -> dict[str, float]:
        """Take the times [s] by name."""
        return {"wall_seconds": time.perf_counter() - self.wall, "cpu_seconds": sum(os.times()[:4]) - self.cpu}


class Bench:
    """A case with its intervals, on which methods are measured."""

    def __init__(self, case: Case, study: Study) -> None:
        self.case, self.study = case, study
        self.grids = {s: SymbolicModel(ModelSettings(structure=s).network(case.building)) for s in STRUCTURES.values()}
        self.inputs = replay_inputs(case, self.grids[BASELINE].network)
        self.intervals = choose_intervals(case, self.inputs, study)

    def uncalibrated(self) -> dict[str, Any]:
        """Judge the start values of our structure."""
        grid = self.grids[BASELINE]
        cost = {"evaluations": 0, **dict.fromkeys(Clock().seconds(), 0.0)}
        return self.row("uncalibrated", grid, grid.network.start(), (), **cost, on_bound=[], of=0)

    def searched(self, search: str, structure: str) -> dict[str, Any]:
        """Tune on (a) by a search over the paper's ranges."""
        grid = self.grids[STRUCTURES[structure]]
        objective = partial(metric, grid, self.inputs, self.intervals.starts["a"])
        began = Clock()
        found = SEARCHES[search](objective, self.study.evaluations, self.study.seed)
        cost = {"evaluations": len(found.errors), **began.seconds()}
        best = values(found.best)
        return self.row(
            f"{search}, {structure}", grid, theta(grid.network, best), ("a",),
            **cost, on_bound=found.on_bound, of=len(RANGES), values=best, errors_of_search=found.errors.tolist(),
        )  # fmt: skip

    def ours(self, name: str, tuning: Sequence[Interval]) -> dict[str, Any]:
        """Tune by `calibration.calibrate`."""
        own = {} if tuning == self.intervals.tuning else {"horizon": whole_hours(tuning[0])}
        with counted() as seen:
            began = Clock()
            settings = CalibrationSettings(seed=self.study.seed, **own)
            result = calibrate(self.case, tuning, self.intervals.held_out, settings=settings)
            cost = {"evaluations": len(seen), **began.seconds()}
        estimated = [p for p in result.parameters if p.standard_error is not None]
        return self.row(
            name, self.grid_of(result), result.theta, self.intervals.inside(self.inputs, tuning),
            **cost, on_bound=[p.name for p in estimated if p.at_bound], of=len(estimated),
            solver=result.solver.to_dict(), tuning=[i.to_dict() for i in tuning],
        )  # fmt: skip

    def grid_of(self, result: CalibrationResult) -> SymbolicModel:
        """Find the grid model that a result's θ belongs to."""
        structure = result.settings.structure
        known = ModelSettings(structure=structure) == result.settings and structure in self.grids
        return self.grids[structure] if known else SymbolicModel(result.settings.network(self.case.building))

    def row(self, name: str, grid: SymbolicModel, at: FloatArray, tuned: Sequence[str], **more: Any) -> dict[str, Any]:
        """Judge θ on all intervals."""
        matrices = grid.matrices(at)
        errors = {
            key: spatial_metrics(run_error(grid, matrices, self.inputs, start)).to_dict()
            for key, start in self.intervals.starts.items()
        }
        runs = EvaluationSettings(HORIZON, scheme=SCHEME)
        judged = evaluate_model(grid, at, self.inputs, self.intervals.held_out, runs)
        names = [p.name for p in grid.network.parameters]
        return {
            "method": name,
            "errors": {**errors, "held out": judged.metrics.to_dict()},
            "tuned_on": list(tuned),
            "theta": dict(zip(names, at.tolist(), strict=True)),
            **more,
        }


def choose_intervals(case: Case, inputs: Inputs, study: Study) -> Intervals:
    """Find the day of (a): the one asked for, or the first weekday before a weekday with all that the runs need."""
    steps = horizon_steps(HORIZON, inputs.step)
    tuning, held_out = default_intervals(case)
    days = pd.date_range(inputs.stamps[0].date(), inputs.stamps[-1].date(), freq="D")
    for day in days if study.day is None else [pd.Timestamp(study.day)]:
        if study.day is None and day.weekday() >= 4:
            continue
        morning, noon = study.hours
        clocks = {
            "a": (day, morning),
            "b": (day + pd.Timedelta(days=1), morning),
            "c": (day + pd.Timedelta(days=1), noon),
        }
        starts = {name: _stamp(inputs, d, clock) for name, (d, clock) in clocks.items()}
        if all(_usable(inputs, start, steps) for start in starts.values()):
            tune = Interval(inputs.stamps[starts["a"]], inputs.stamps[starts["a"] + steps])
            if tune.end < held_out[0].start:
                return Intervals(starts, tune, tuning, held_out)
    wanted = study.day or "a weekday before a weekday"
    raise ValueError(
        f"{case.building.name}: expected {wanted} with {SPIN_UP / 86400:g} days of spin-up before "
        f"{study.hours[0]}, whole telemetry in (a), (b) and (c), and (a) before the last third; found none"
    )


def _stamp(inputs: Inputs, day: pd.Timestamp, clock: str) -> int:
    """Position of a clock time of a day in the telemetry; -1 where it has none."""
    stamp = pd.Timestamp(f"{day.date()} {clock}", tz=inputs.stamps.tz)
    at = int(inputs.stamps.searchsorted(stamp))
    return at if at < len(inputs) and inputs.stamps[at] == stamp else -1


def _usable(inputs: Inputs, start: int, steps: int) -> bool:
    """Whether a run has its spin-up, its inputs, and temperatures at start and target."""
    if start < round(SPIN_UP / inputs.step) or start + steps >= len(inputs):
        return False
    seen = np.isfinite(inputs.bridged[start]) & np.isfinite(inputs.zone[start + steps])
    return bool(inputs.complete[start + 1 : start + steps + 1].all() and seen.any())


def whole_hours(interval: Interval) -> str:
    """Horizon of the longest run in an interval that starts on the hour and takes whole hours."""
    return f"{int((interval.end - interval.start.ceil('h')) / pd.Timedelta(hours=1))}h"


def run_error(grid: SymbolicModel, matrices: Matrices, inputs: Inputs, start: int) -> FloatArray:
    """Errors of the zones at the end of one run, shape (1, n_zone) [K]; NaN where not measured."""
    steps, at = horizon_steps(HORIZON, inputs.step), np.array([start])
    states, _ = spin_up(matrices, inputs, start - round(SPIN_UP / inputs.step), at)
    means, _ = free_runs(matrices, inputs, at, np.array([steps]), states, scheme=SCHEME)
    return np.where(np.isfinite(inputs.bridged[at]), means[:, 0] - inputs.zone[at + steps], np.nan)


def metric(grid: SymbolicModel, inputs: Inputs, start: int, point: FloatArray) -> float:
    """Evaluate what the paper minimises, the MAE at the last step of one run [K], at a point of the unit cube."""
    matrices = grid.matrices(theta(grid.network, values(point)))
    return spatial_metrics(run_error(grid, matrices, inputs, start)).mae


@contextmanager
def counted() -> Iterator[set[bytes]]:
    """Collect the θ at which models are assembled meanwhile: what a solve evaluates begins with that."""
    seen: set[bytes] = set()
    original = SymbolicModel.matrices

    def matrices(self: SymbolicModel, theta: FloatArray, slopes: bool = False) -> Matrices:
        seen.add(np.asarray(theta, dtype=float).tobytes())
        return original(self, theta, slopes)

    SymbolicModel.matrices = matrices  # type: ignore[method-assign]
    try:
        yield seen
    finally:
        SymbolicModel.matrices = original  # type: ignore[method-assign]
