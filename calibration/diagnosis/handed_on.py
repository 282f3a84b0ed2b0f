"""What a diagnosis hands on for prediction: its final model, or the same building in another structure."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from calibration.diagnosis.correction import CORRECTED, Correction
from calibration.diagnosis.refit.comparison import Effects, Fit, ModelComparison
from calibration.estimation.bands import Forecaster
from calibration.estimation.disturbance import DisturbanceModel
from calibration.evaluation.intervals import Interval
from calibration.evaluation.n_step import Evaluation, EvaluationSettings
from calibration.evaluation.simple_models import with_yardsticks
from calibration.fit.estimate import tune
from calibration.fit.fitted_case import FittedCase, is_large
from calibration.fit.ladder import ADVANCE, climb_from
from calibration.fit.left_out import LeftOut, left_out
from calibration.fit.result import CalibrationResult, Rung, effect_entries
from calibration.progress import Progress


def other_structures(
    models: ModelComparison,
    final: Fit,
    progress: Progress | None,
    advance: float,
    beside: Sequence[Effects] = (),
    lumped_advance: float = ADVANCE,
) -> tuple[tuple[Rung, ...], FittedCase | None, LeftOut | None]:
    """Fit other structures beside the final model, unless the building is large.

    Parameters
    ----------
    models : ModelComparison
        The case and its days.
    final : Fit
        Of the building as drawn, with what was found.
    progress : callable, optional
        Called with stage, done, total.
    advance : float
        Share by which another's error on left-out days must be less [-].
    beside : sequence of mapping of str to sequence of str
        Effects beside which the heat of people with hours of their own is tried; it is not by default.
    lumped_advance : float
        The same for lumped structures [-].

    Returns
    -------
    tuple
        As `calibration.fit.ladder.climb_from` gives it.
    """
    if is_large(final.built.network.zones):
        return (), None, None
    name = "named" if final.effects else "drawn"
    return climb_from(name, final.known, models, progress, advance, beside, lumped_advance)


def with_correction(
    models: ModelComparison, correction: Correction | None, rungs: tuple[Rung, ...], left: LeftOut | None
) -> tuple[tuple[Rung, ...], LeftOut | None]:
    """Let a corrected model stand beside the others, and hand it on where it predicts left-out days best.

    Parameters
    ----------
    models : ModelComparison
        The case and its days.
    correction : Correction or None
        A model with heat of unknown cause.
    rungs : tuple of Rung
        The others.
    left : LeftOut or None
        Days left out by what is kept of these.

    Returns
    -------
    tuple
        All of them, and the days left out by what is kept.
    """
    if correction is None:
        return rungs, left
    made = correction.fit
    found = left_out(made.known, models.tuned, models.settings.spin_up_seconds)
    kept = found.mae < min((r.left_out_mae for r in rungs if r.chosen), default=np.inf)
    others = tuple(replace(r, chosen=r.chosen and not kept) for r in rungs)
    return (*others, Rung(CORRECTED, found.mae, len(made.problem.free), kept)), found if kept else left


def fit_content(
    fit: Fit, before: Fit, tuned: Sequence[Interval], judged: Sequence[Interval], horizon: str
) -> dict[str, Any]:
    """Contents of the ``calibration.json`` of a fit, but for what names case, settings and program.

    Parameters
    ----------
    fit : Fit
        What is handed on.
    before : Fit
        The baseline at its start.
    tuned, judged : sequence of Interval
        Where it was fitted, and where it is judged.
    horizon : str
        Prediction horizon.
    """
    parameters, intervals = fit.describe(), {"tuning": tuned, "held_out": judged}
    uncalibrated, calibrated = (
        {name: f.evaluate(part, horizon).metrics for name, part in intervals.items()} for f in (before, fit)
    )
    return {
        "parameters": parameters, "uncalibrated": uncalibrated, "calibrated": calibrated,
        "effects": effect_entries(fit.effects, parameters), "intervals": intervals, "objective": "multi_step",
        "horizon": horizon, "zones": fit.built.network.zones,
    }  # fmt: skip


def judge_handed_on(
    models: ModelComparison, final: Fit, better: CalibrationResult | None, left: LeftOut | None
) -> tuple[Evaluation, DisturbanceModel | None, dict[str, float]]:
    """Judge the model that is handed on, with unmeasured heat carried on too, beside simple models.

    Parameters
    ----------
    models : ModelComparison
        The case and its days.
    final : Fit
        Of the building as drawn, with what was found.
    better : CalibrationResult or None
        Of another structure, where it predicts left-out days better.
    left : LeftOut or None
        Days left out by what is kept.

    Returns
    -------
    tuple
        Its held-out errors; unmeasured heat of the final model, and factors of its bands by zone [-], where that is
        the one.
    """
    inputs, spin_up = final.built.inputs, models.settings.spin_up_seconds
    disturbance, factors = None, {}
    found = final.evaluate(models.judged, models.horizon) if better is None else better.calibrated["held_out"]
    if better is None and left is not None:
        disturbance = tune(final.problem, final.model, final.theta)
        settings = EvaluationSettings(models.horizon, scheme=models.settings.stepping, spin_up_seconds=spin_up)
        forecaster = Forecaster(final.model, inputs, disturbance, settings)
        factors = forecaster.factors(left.parts, left.thetas)
        found = replace(found, carried=forecaster.judge(final.theta, models.judged, factors))
    beside = with_yardsticks(found, models.case, inputs, models.anatomy, models.tuned, spin_up)
    return beside, disturbance, factors
