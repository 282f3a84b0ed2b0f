"""Ladder of structures: as drawn, and lumped with factors of its own for every zone and pair; days left out choose."""

import itertools
from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np
import pandas as pd

from calibration.errors import NotEnoughDataError
from calibration.evaluation.intervals import Interval, Runs, select_runs
from calibration.evaluation.n_step import Progress, spatial_metrics
from calibration.evaluation.settings import CalibrationSettings
from calibration.fit.estimate import Estimate
from calibration.fit.fitted_case import FittedCase, fit_case
from calibration.fit.least_squares import solve_least_squares
from calibration.fit.result import CalibrationResult, Rung
from thermal.case.case import Case
from thermal.inputs.provider import telemetry_inputs
from thermal.network.structure import BASELINE, Structure

#: Parts that tuning days are cut into, each left out once, and the least length of one [days].
_FOLDS, _LEAST_DAYS = 4, 1.0

#: Zones beyond which no lumped structure is fitted: it has some ten parameters a zone.
_MOST_ZONES = 40


def climb(drawn: FittedCase, began: float, progress: Progress | None = None) -> CalibrationResult:
    """Fit a building lumped too, and keep what predicts tuning days better that a fit has not seen.

    Effects or values a facade that somebody asked for are kept; so is the drawing in a building of more than 40 zones.
    Held-out intervals have no part in the choice.

    Parameters
    ----------
    drawn : FittedCase
        The building as drawn.
    began : float
        When the calibration began, by `time.perf_counter` [s].
    progress : callable, optional
        Called with stage, done, total.

    Returns
    -------
    CalibrationResult
        With ``rungs``, the drawing's first; empty where there was no choice.
    """
    chosen = drawn.settings
    asked = chosen.effects or chosen.scopes or chosen.fixed or chosen.structure != BASELINE
    many = len(drawn.model.grid.network.zones) > _MOST_ZONES
    if asked or many or chosen.objective != "multi_step":
        return drawn.result(began, progress)
    fitted = [drawn, fit_lumped(drawn.model.case, drawn.tuned, drawn.judged, chosen, progress)]
    errors = [left_out(f.best, drawn.tuned, chosen.spin_up_seconds) for f in fitted]
    best = int(errors[1] < errors[0])
    rungs = tuple(
        Rung(name, error, len(f.best.problem.free), number == best)
        for number, (name, error, f) in enumerate(zip(("drawn", "lumped"), errors, fitted, strict=True))
    )
    result = replace(fitted[best].result(began, progress), rungs=rungs)
    # before is what the drawing says
    return replace(result, uncalibrated=drawn.uncalibrated(progress)) if best else result


def fit_lumped(
    case: Case,
    tuned: Sequence[Interval],
    judged: Sequence[Interval],
    settings: CalibrationSettings,
    progress: Progress | None = None,
) -> FittedCase:
    """Fit the lumped structure, from the drawing alone; with the sun where irradiance is measured.

    Parameters
    ----------
    case : Case
        Building and telemetry.
    tuned, judged : sequence of Interval
        Where it is fitted, and where it will be judged.
    settings : CalibrationSettings
        Of the fit as drawn.
    progress : callable, optional
        Called with stage, done, total.
    """
    structure = Structure(lumped=True, sun=telemetry_inputs(case).gives("sun"))
    # its priors hold it so well that further starts find the same
    return fit_case(case, tuned, judged, replace(settings, structure=structure, starts=1), progress)


def left_out(best: Estimate, tuned: Sequence[Interval], spin_up_seconds: float) -> float:
    """Mean absolute error on tuning days that are left out in turn, fitted anew from the others [K].

    Weights and the reduced model stay those of the fit of all days.

    Parameters
    ----------
    best : Estimate
        Fitted on all tuning days.
    tuned : sequence of Interval
        These.
    spin_up_seconds : float
        Length of the spin-up before an interval [s].
    """
    problem, errors = best.problem, []
    for part in _parts(tuned):
        kept = [_outside(problem.inputs.stamps, runs, problem.steps, part) for runs in problem.runs]
        try:
            left = select_runs(problem.inputs, part, problem.steps, spin_up=spin_up_seconds)
        except NotEnoughDataError:
            continue
        rest = tuple(runs for runs in kept if runs.starts.size)
        if not rest or not left.starts.size:
            continue
        share = sum(r.starts.size for r in rest) / sum(r.starts.size for r in problem.runs)
        fold = replace(problem, runs=rest, effective=share * problem.effective_size())
        weighted = partial(fold.weighted, best.model)
        found = solve_least_squares(weighted, best.point, *problem.bounds, tolerance=1e-2)
        error, _ = fold.errors(best.model, fold.theta(found.x), left, slopes=False)
        errors.append(error[:, -1])
    return spatial_metrics(np.concatenate(errors)).mae if len(errors) > 1 else float("nan")


def _parts(tuned: Sequence[Interval]) -> list[Interval]:
    """Cut the tuning intervals into parts of equal length, each left out once."""
    length = sum((i.end - i.start for i in tuned), pd.Timedelta(0))
    count = min(_FOLDS, int(length / pd.Timedelta(days=_LEAST_DAYS)))
    if len(tuned) >= count > 0:  # whole intervals
        return list(tuned)
    parts = []
    for interval in tuned:
        own = max(1, round(count * ((interval.end - interval.start) / length)))
        cuts = pd.date_range(interval.start, interval.end, periods=own + 1)
        parts += [Interval(a, b) for a, b in itertools.pairwise(cuts)]
    return parts


def _outside(stamps: pd.DatetimeIndex, runs: Runs, steps: int, part: Interval) -> Runs:
    """Keep the runs that share no step with an interval."""
    clear = (stamps[runs.starts + steps] < part.start) | (stamps[runs.starts] > part.end)
    return replace(runs, starts=runs.starts[np.asarray(clear)])
