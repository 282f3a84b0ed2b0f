"""The solve of a calibration: runs that tile the tuning intervals, and the best estimate over several starts."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd

from calibration.errors import CalibrationError, NotEnoughDataError
from calibration.estimation.tuner import tune
from calibration.evaluation.intervals import Interval, Runs, select_runs
from calibration.evaluation.n_step import Progress
from calibration.fit.estimate import Estimate, Tuner, compensated_start, draw_starts, estimate
from calibration.fit.problem import Problem, thin
from thermal.errors import ModelError
from thermal.model.reduce import ReducedModel
from thermal.model.replay import LEAST_SPIN_UP, Inputs


def tuning_runs(inputs: Inputs, intervals: Sequence[Interval], steps: int, spin_up: float) -> tuple[Runs, ...]:
    """Choose runs that tile the tuning intervals, with a full spin-up where that leaves half of the telemetry.

    A run after 12 hours starts from walls and slabs that are still wrong, and the fit would take that for physics: on a
    twin of known parameters it cost 0.013 K of held-out error.

    Parameters
    ----------
    inputs : Inputs
        The telemetry.
    intervals : sequence of Interval
        Tuning intervals.
    steps : int
        N.
    spin_up : float
        Length of the spin-up [s].

    Raises
    ------
    NotEnoughDataError
        When every run misses telemetry.
    """
    chosen = []
    for interval in intervals:
        begin = max(inputs.stamps[0], interval.start - pd.Timedelta(seconds=spin_up))
        half = 0.5 * (interval.end - begin).total_seconds()
        try:
            found = select_runs(inputs, interval, steps, spin_up=spin_up, least=max(LEAST_SPIN_UP, min(spin_up, half)))
        except NotEnoughDataError:
            found = select_runs(inputs, interval, steps, spin_up=spin_up)
        inside = found.starts >= inputs.stamps.searchsorted(interval.start)  # every residual lies in the interval
        chosen.append(Runs(found.begin, found.starts[inside], found.skipped))
    runs = tuple(r for r in thin(chosen, steps) if r.starts.size)
    if not runs:
        raise NotEnoughDataError(
            "tuning: every run misses inputs or zone temperatures; `buildingmpc check` shows the gaps"
        )
    return runs


def solve_starts(
    problem: Problem, first: ReducedModel, starts: int, seed: int, progress: Progress | None
) -> tuple[Estimate, list[str]]:
    """Best estimate over the starts; a start that fails costs that start only, Ctrl-C those that are left.

    Parameters
    ----------
    problem : Problem
        What to fit.
    first : ReducedModel
        At the problem's start.
    starts : int
        Number of starts.
    seed : int
        Seed of the draws.
    progress : callable, optional
        Called with stage, done, total.

    Returns
    -------
    tuple
        The best, and what was wrong with the starts that failed.

    Raises
    ------
    CalibrationError
        When every start failed.
    """
    best: Estimate | None = None
    failures = []
    draws = draw_starts(problem, max(1, starts - 1), seed)
    for number in range(starts):
        try:
            if number == 1:
                begun = best.problem if best is not None else problem
                z = compensated_start(begun, problem.point(problem.start), first)
            else:
                z = draws[max(0, number - 1)]
            model = first if number == 0 else None
            found = estimate(problem, z, progress, model, tune if best is None else _as(best))
        except (ArithmeticError, np.linalg.LinAlgError, CalibrationError, ModelError) as error:
            failures.append(f"start {number + 1}: {error}")
            continue
        except KeyboardInterrupt:
            if best is None:
                raise
            failures.append(f"start {number + 1}: stopped by Ctrl-C")
            break
        if best is None or found.better_than(best):
            best = found
        if found.solve.interrupted:
            failures.append(f"start {number + 1}: stopped by Ctrl-C")
            break
    if best is None:
        raise CalibrationError(f"every start failed: {'; '.join(failures)}")
    return best, failures


def _as(found: Estimate) -> Tuner | None:
    """Disturbance of an earlier start, so that starts are weighed alike."""
    disturbance = found.disturbance
    return None if disturbance is None else lambda *_: disturbance
