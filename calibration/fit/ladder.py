"""Ladder of structures: as drawn; lumped, with factors of its own for every zone and pair; and with a gain that recurs.

Tuning days that are left out choose.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Protocol

from calibration.evaluation.intervals import Interval, days_of
from calibration.evaluation.n_step import Progress
from calibration.evaluation.settings import CalibrationSettings
from calibration.fit.estimate import Estimate
from calibration.fit.fitted_case import FittedCase, fit_case, is_large
from calibration.fit.left_out import Begun, Fitted, LeftOut, left_out
from calibration.fit.problem import tuning_problem
from calibration.fit.result import CalibrationResult, Rung
from thermal.case.case import Case
from thermal.inputs.provider import telemetry_inputs
from thermal.model.reduce import reduced_model
from thermal.network.structure import BASELINE, Structure

#: Share by which a lumped model must predict left-out days better than a building as drawn [-]: it has ten times the
#: parameters, and on a simulated office whose drawing is true a fitting advance of 7 % did not last on later days.
ADVANCE = 0.1

#: Tuning days from which a gain that recurs from day to day is looked for [days]: it has to recur.
_WEEK = 7.0


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
    rungs, lumped, left = beside_lumped("drawn", drawn.best, drawn, progress)
    if lumped is None:
        return replace(replace(drawn, left=left).result(began, progress), rungs=rungs)
    # before is what the drawing says
    return replace(lumped.result(began, progress), rungs=rungs, uncalibrated=drawn.uncalibrated(progress))


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
    fitted: Fitted,
    given: Tuned,
    progress: Progress | None = None,
    advance: float = ADVANCE,
) -> tuple[tuple[Rung, ...], FittedCase | None, LeftOut]:
    """Fit the lumped structure beside a fitted model; it is returned where it predicts left-out days better.

    The sun is a part of it where irradiance is measured. With a gain that recurs from day to day it is fitted too
    where a few Newton steps from the lumped estimate promise enough.

    Parameters
    ----------
    name : str
        Of the fitted model.
    fitted : Fitted
        It.
    given : Tuned
        The case and its days.
    progress : callable, optional
        Called with stage, done, total.
    advance : float
        Share by which the lumped model's error must be less [-].

    Returns
    -------
    tuple
        The rungs, the lumped model or None, and the days left out by what was chosen.
    """
    structure = Structure(lumped=True, sun=telemetry_inputs(given.case).gives("sun"))
    # priors hold it so well that further starts find the same
    settings = replace(given.calibration, structure=structure, starts=1)
    lumped = fit_case(given.case, given.tuned, given.judged, settings, progress)
    spin_up = settings.spin_up_seconds
    left = left_out(fitted, given.tuned, spin_up)
    tried = [(name, len(fitted.problem.free), left.mae)]
    chosen, kept, beside = name, None, left_out(lumped.best, given.tuned, spin_up)
    tried.append(("lumped", len(lumped.best.problem.free), beside.mae))
    if beside.mae < (1.0 - advance) * left.mae:
        chosen, kept, left = "lumped", lumped, beside
    if days_of(given.tuned) >= _WEEK:
        settings = replace(settings, structure=replace(structure, recurring=True))
        begun = _begun(given, settings, lumped.best)
        beside = left_out(begun, given.tuned, spin_up)
        if beside.mae < (1.0 - ADVANCE) * left.mae:
            recurring = fit_case(given.case, given.tuned, given.judged, settings, progress, lumped.best.values)
            beside = left_out(recurring.best, given.tuned, spin_up)
            if beside.mae < (1.0 - ADVANCE) * left.mae:
                chosen, kept, left = "recurring", recurring, beside
        tried.append(("recurring", len(begun.problem.free), beside.mae))
    rungs = tuple(Rung(own, mae, count, own == chosen) for own, count, mae in tried)
    return rungs, None if kept is None else replace(kept, left=left), left


def _begun(given: Tuned, settings: CalibrationSettings, known: Estimate) -> Begun:
    """Take a structure with further parameters as it begins: at what is known of the others, and weighed like these."""
    problem, own = tuning_problem(given.case, given.tuned, settings), known.problem
    theta = problem.grid.network.values(known.values)
    problem = replace(
        problem, start=theta, deviation=own.deviation, effective=own.effective_size(),
        shrinkage={**problem.shrinkage, **own.shrinkage},
    )  # fmt: skip
    return Begun(problem, reduced_model(problem.grid, [theta]))
