"""A regression that knows nothing of buildings predicts held-out days better: then something regular is missing.

It has the same telemetry as the model. What it predicts and the model does not, such as a room that an unmetered heater
holds at its setpoint, is no chance and no noise, whatever the model's own errors look like.
"""

from contextlib import suppress

import numpy as np
import pandas as pd
from scipy.stats import t as student

from calibration.diagnosis.refit.comparison import Fit, ModelComparison
from calibration.diagnosis.refit.refit import HeldOut, by_day, growth
from calibration.diagnosis.screen.gains import MATTERS
from calibration.errors import NotEnoughDataError
from calibration.evaluation.n_step import EvaluationSettings, evaluate_model
from calibration.evaluation.simple_models import regression_errors
from calibration.fit.fitted_case import is_large
from calibration.fit.left_out import Fitted

#: Share by which it must be better [-]. In 44 nulls of four makers it is worse than the model by 5 to 907 %, in five
#: measured buildings by 3 to 45 %; in two Twin Houses without a heater's power, or a boundary, better by 59 and 41 %.
_BETTER = 0.25

#: Horizon from which that was looked at: what comes next within minutes a regression knows best, with nothing missing.
_HORIZON = pd.Timedelta("6h")

#: Fewest days whose scatter says what chance does, and the rate at which chance alone may be beyond it [-].
_LEAST_DAYS, _CHANCE = 3, 0.05


def regression_held_out(models: ModelComparison, fit: Fit) -> HeldOut | None:
    """Held-out errors of a ridge regression on the runs of a model; None where days are few, zones many or runs short.

    Parameters
    ----------
    models : ModelComparison
        The case.
    fit : Fit
        Any model of it.
    """
    inputs, spin_up = fit.built.inputs, models.settings.spin_up_seconds
    if pd.Timedelta(models.horizon) >= _HORIZON and not is_large(models.case.building.zone_names):
        with suppress(NotEnoughDataError):
            judged = fit.evaluate(models.judged, models.horizon)
            errors = regression_errors(judged, models.case, inputs, models.anatomy, models.tuned, spin_up)
            return by_day(judged.predictions, errors, inputs.step)
    return None


def held_out_of(models: ModelComparison, kept: Fitted) -> HeldOut:
    """Held-out errors of another structure.

    Parameters
    ----------
    models : ModelComparison
        The case.
    kept : Fitted
        The structure, fitted.
    """
    runs = EvaluationSettings(
        models.horizon, scheme=models.settings.stepping, spin_up_seconds=models.settings.spin_up_seconds
    )
    problem = kept.problem
    found = evaluate_model(kept.model, problem.theta(kept.point), problem.inputs, models.judged, runs)
    return by_day(found.predictions, [p.error for p in found.predictions], problem.inputs.step)


def is_outdone(model: HeldOut, regression: HeldOut | None) -> bool:
    """Whether a regression is better by a share, by enough to matter, and beyond chance over days.

    Parameters
    ----------
    model, regression : HeldOut
        Errors of both on the same days.
    """
    if regression is None or regression.mae > min((1.0 - _BETTER) * model.mae, model.mae - MATTERS):
        return False
    days = np.intersect1d(model.days, regression.days).size
    grown, error = growth(model, regression)
    return days >= _LEAST_DAYS and grown + float(student.ppf(1.0 - _CHANCE, days - 1)) * error < 0.0
