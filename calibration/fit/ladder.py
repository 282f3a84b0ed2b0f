"""Ladder of structures: as drawn, and lumped with factors of its own for every zone and pair; days left out choose."""

import itertools
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import Protocol

import numpy as np
import pandas as pd

from calibration.errors import NotEnoughDataError
from calibration.evaluation.intervals import Interval, Runs, select_runs
from calibration.evaluation.n_step import Progress, spatial_metrics
from calibration.evaluation.settings import CalibrationSettings
from calibration.fit.fitted_case import FittedCase, fit_case
from calibration.fit.least_squares import solve_least_squares
from calibration.fit.problem import Problem
from calibration.fit.result import CalibrationResult, Rung
from thermal._types import FloatArray
from thermal.case.case import Case
from thermal.inputs.provider import telemetry_inputs
from thermal.model.reduce import ReducedModel
from thermal.network.structure import BASELINE, Structure

#: Parts that tuning days are cut into, each left out once, and the least length of one [days].
_FOLDS, _LEAST_DAYS = 4, 1.0

#: Share by which a lumped model must predict left-out days better than a building as drawn [-]: it has ten times the
#: parameters, and on a simulated office whose drawing is true a fitting advance of 7 % did not last on later days.
ADVANCE = 0.1

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
    if asked or is_large(drawn.model.grid.network.zones) or chosen.objective != "multi_step":
        return drawn.result(began, progress)
    best = drawn.best
    rungs, lumped = beside_lumped("drawn", best.problem, best.model, best.point, drawn, progress)
    if lumped is None:
        return replace(drawn.result(began, progress), rungs=rungs)
    # before is what the drawing says
    return replace(lumped.result(began, progress), rungs=rungs, uncalibrated=drawn.uncalibrated(progress))


def is_large(zones: Sequence[str]) -> bool:
    """Whether a building has too many zones to be fitted lumped.

    Parameters
    ----------
    zones : sequence of str
        Their names.
    """
    return len(zones) > _MOST_ZONES


class Tuned(Protocol):
    """A case with the days that tune, those that judge, and the settings of a fit."""

    @property
    def case(self) -> Case:
        """Building and telemetry."""

    @property
    def tuned(self) -> Sequence[Interval]:
        """Where it is fitted."""

    @property
    def judged(self) -> Sequence[Interval]:
        """Where it will be judged."""

    @property
    def calibration(self) -> CalibrationSettings:
        """Of the fit as drawn."""


def beside_lumped(
    name: str,
    problem: Problem,
    model: ReducedModel,
    point: FloatArray,
    given: Tuned,
    progress: Progress | None = None,
    advance: float = ADVANCE,
) -> tuple[tuple[Rung, ...], FittedCase | None]:
    """Fit the lumped structure beside a fitted model; it is returned where it predicts left-out days better.

    The sun is a part of it where irradiance is measured.

    Parameters
    ----------
    name : str
        Of the fitted model.
    problem : Problem
        That it solves.
    model : ReducedModel
        Accurate at its estimate.
    point : ndarray, shape (n_free,)
        Its estimate on the estimation scale [-].
    given : Tuned
        The case and its days.
    progress : callable, optional
        Called with stage, done, total.
    advance : float
        Share by which the lumped model's error must be less [-].

    Returns
    -------
    tuple
        Both rungs, and the lumped model or None.
    """
    settings = given.calibration
    structure = Structure(lumped=True, sun=telemetry_inputs(given.case).gives("sun"))
    # its priors hold it so well that further starts find the same
    settings = replace(settings, structure=structure, starts=1)
    lumped = fit_case(given.case, given.tuned, given.judged, settings, progress)
    own = lumped.best
    models = ((problem, model, point), (own.problem, own.model, own.point))
    errors = [left_out(*fitted, given.tuned, settings.spin_up_seconds) for fitted in models]
    better = errors[1] < (1.0 - advance) * errors[0]
    rungs = (
        Rung(name, errors[0], len(problem.free), not better),
        Rung("lumped", errors[1], len(own.problem.free), better),
    )
    return rungs, lumped if better else None


def left_out(
    problem: Problem, model: ReducedModel, point: FloatArray, tuned: Sequence[Interval], spin_up_seconds: float
) -> float:
    """Mean absolute error on tuning days that are left out in turn, fitted anew from the others [K].

    Weights and the reduced model stay those of the fit of all days.

    Parameters
    ----------
    problem : Problem
        Fitted on all tuning days.
    model : ReducedModel
        Accurate at the estimate.
    point : ndarray, shape (n_free,)
        The estimate on the estimation scale [-].
    tuned : sequence of Interval
        The tuning days.
    spin_up_seconds : float
        Length of the spin-up before an interval [s].
    """
    errors = []
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
        weighted = partial(fold.weighted, model)
        found = solve_least_squares(weighted, point, *problem.bounds, tolerance=1e-2)
        error, _ = fold.errors(model, fold.theta(found.x), left, slopes=False)
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
