"""What a diagnosis hands on for prediction: its final model, or the same building in another structure."""

from dataclasses import replace

import numpy as np

from calibration.diagnosis.refit.comparison import Fit, ModelComparison
from calibration.estimation.bands import Forecaster
from calibration.estimation.disturbance import DisturbanceModel
from calibration.evaluation.n_step import Evaluation, EvaluationSettings, Progress
from calibration.evaluation.simple_models import with_yardsticks
from calibration.fit.estimate import tune
from calibration.fit.fitted_case import FittedCase, is_large
from calibration.fit.ladder import climb_from
from calibration.fit.left_out import Known, LeftOut
from calibration.fit.result import CalibrationResult, Rung


def other_structures(
    models: ModelComparison, final: Fit, progress: Progress | None, advance: float
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

    Returns
    -------
    tuple
        As `calibration.fit.ladder.climb_from` gives it.
    """
    if is_large(final.built.network.zones):
        return (), None, None
    name = "named" if final.effects else "drawn"
    # the fit has found its deviation beside its parameters
    problem = replace(final.problem, deviation=float(np.sqrt(final.found.mean_square)))
    return climb_from(name, Known(problem, final.model, final.point), models, progress, advance)


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
