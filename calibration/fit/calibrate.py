"""Calibration of a case: from telemetry to parameters, with errors before and after, tuned on and held out."""

import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from calibration.evaluation.intervals import Interval
from calibration.evaluation.settings import ModelSettings, calibration_settings
from calibration.evaluation.simple_models import with_yardsticks
from calibration.fit.fitted_case import FittedCase, fit_case
from calibration.fit.ladder import climb
from calibration.fit.result import CalibrationResult
from calibration.progress import Forward, Progress
from thermal.case.case import Case
from thermal.case.plausibility.examine import check_calibratable


def calibrate(
    case: Case,
    tune: Sequence[Interval] = (),
    hold_out: Sequence[Interval] = (),
    *,
    settings: ModelSettings | Mapping[str, Any] | None = None,
    progress: Progress | None = None,
) -> CalibrationResult:
    """Fit the physical parameters of a building to its telemetry by least squares.

    Residuals are the errors of N-step runs that tile the tuning intervals, and every parameter has a log-normal prior
    whose 95 % interval is its physical range. The errors are strongly correlated: an autocorrelated heat disturbance in
    each zone and the sensors' noise, tuned by the likelihood of a Kalman filter's innovations, give their effective
    sample size and the standard errors. Ipopt solves on a reduced model with exact derivatives; the answer is checked
    on the grid.

    Parameters
    ----------
    case : Case
        Building and telemetry.
    tune, hold_out : sequence of Interval
        First two thirds and last third of the telemetry when both are empty; what the other leaves when one is.
    settings : CalibrationSettings, or mapping of str to Any, optional
        Model, what is fixed, horizon, objective and starts; or these by name.
    progress : callable, optional
        Called with stage, done, total.

    Returns
    -------
    CalibrationResult
        With the solver's status, which says whether it converged; after Ctrl-C during the solves, of the best so far.

    Raises
    ------
    CaseError
        When the case holds what cannot be true, as `buildingmpc check` says.
    CalibrationError
        When an interval has no usable run, a name is unknown, or every start failed.

    Examples
    --------
    >>> from thermal.data import load_bundled_case
    >>> result = calibrate(load_bundled_case(), settings={"dx": 1.0})
    >>> result.solver.success
    True
    """
    began, chosen = time.perf_counter(), calibration_settings(settings)
    check_calibratable(case)
    whole = Forward(progress)
    fitted = fit_case(case, tune, hold_out, chosen, whole.part(0.5))
    rest = whole.part(0.95)
    result = climb(fitted, began, rest) if chosen.climb else fitted.result(began, rest)
    whole.say("simple models beside it" if chosen.yardsticks else "done")
    return _beside_simple_models(result, fitted) if chosen.yardsticks else result


def _beside_simple_models(result: CalibrationResult, fitted: FittedCase) -> CalibrationResult:
    """Put the held-out errors of simple models beside those before and after."""
    model, spin_up = fitted.model, fitted.settings.spin_up_seconds
    judged = with_yardsticks(
        result.calibrated["held_out"], model.case, model.inputs, model.grid.network.anatomy, fitted.tuned, spin_up
    )
    before = replace(result.uncalibrated["held_out"], yardsticks=judged.yardsticks)
    return replace(
        result,
        uncalibrated={**result.uncalibrated, "held_out": before},
        calibrated={**result.calibrated, "held_out": judged},
    )
