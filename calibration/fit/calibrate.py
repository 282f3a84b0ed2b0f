"""Calibration of a case: from telemetry to parameters, with errors before and after, tuned on and held out."""

import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from importlib.metadata import version
from typing import Any

from calibration.errors import CalibrationError
from calibration.evaluation.case_model import CaseModel, GridCheck
from calibration.evaluation.intervals import Interval, default_intervals, horizon_steps, select_runs
from calibration.evaluation.n_step import HORIZONS, Evaluation, EvaluationSettings, Progress
from calibration.evaluation.settings import ModelSettings, calibration_settings
from calibration.evaluation.simple_models import with_yardsticks
from calibration.fit.estimate import solve_starts
from calibration.fit.likelihood import InnovationsProblem
from calibration.fit.problem import tuning_problem
from calibration.fit.result import CalibrationResult, SolverReport, describe
from calibration.identifiability.information import information_of
from thermal.case.case import Case
from thermal.inputs.normalisation import fit_normalisation
from thermal.model.reduce import ReducedModel, reduced_model


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
    tuned, judged = default_intervals(case, tune, hold_out)
    if chosen.effects:
        chosen = replace(chosen, normalisation=fit_normalisation(case, ((i.start, i.end) for i in tuned)))
    _refuse_overlap(tuned, judged)
    problem = tuning_problem(case, tuned, chosen)
    grid, inputs, given = problem.grid, problem.inputs, problem.start
    for interval in judged:  # refused now rather than after the solve
        select_runs(inputs, interval, problem.steps, spin_up=chosen.spin_up_seconds)
    first = reduced_model(grid, [given])
    if chosen.objective == "innovations":
        problem = InnovationsProblem(
            grid, inputs, problem.runs, problem.steps, problem.free, given, problem.scheme, loss=chosen.loss,
            intervals=tuple(tuned), spin_up_seconds=chosen.spin_up_seconds,
        ).at(first, given)  # fmt: skip
    best, failures = solve_starts(problem, first, chosen.starts, chosen.seed, progress)
    before = CaseModel(case, chosen.model, grid, inputs, given, "start")
    after = replace(before, theta=best.theta, source="estimate")
    intervals = {"tuning": tuned, "held_out": judged}
    uncalibrated, _ = _evaluated(before, first, intervals, chosen.horizon, progress)
    calibrated, check = _evaluated(after, best.model, intervals, chosen.horizon, progress)
    if chosen.yardsticks:
        judge = calibrated["held_out"]
        anatomy, spin_up = grid.network.anatomy, chosen.spin_up_seconds
        calibrated["held_out"] = with_yardsticks(judge, case, inputs, anatomy, tuned, spin_up)
        same = calibrated["held_out"].yardsticks
        uncalibrated["held_out"] = replace(uncalibrated["held_out"], yardsticks=same)
    seconds = time.perf_counter() - began
    information = information_of(best)
    solve = best.solve
    return CalibrationResult(
        case=case.building.name,
        zones=grid.network.zones,
        parameters=describe(best, information, grid.network.nominal),
        theta=best.theta,
        tuning=tuple(tuned),
        held_out=tuple(judged),
        uncalibrated=uncalibrated,
        calibrated=calibrated,
        solver=SolverReport(
            "ipopt", solve.status, solve.success, best.iterations, seconds, chosen.starts, tuple(failures),
            best.evaluations, best.settled,
        ),
        disturbance=best.disturbance,
        excess=best.excess,
        information=information,
        grid_check=check,
        objective=chosen.objective,
        horizon=chosen.horizon,
        settings=chosen.model,
        seed=chosen.seed,
        version=version("buildingmpc"),
    )  # fmt: skip


def _evaluated(
    model: CaseModel,
    reduced: ReducedModel,
    intervals: Mapping[str, Sequence[Interval]],
    horizon: str,
    progress: Progress | None,
) -> tuple[dict[str, Evaluation], GridCheck]:
    """Errors on both kinds of interval, at other horizons too where held out, and the check of the reduced model."""
    steps = horizon_steps(horizon, model.inputs.step)
    quick, check = model.certified(intervals["held_out"][0], steps, reduced)
    errors = {}
    for name, part in intervals.items():
        settings = EvaluationSettings(horizon, True, HORIZONS if name == "held_out" else ())
        errors[name] = model.evaluate(quick, part, settings, progress)
    return errors, check


def _refuse_overlap(tuning: Sequence[Interval], held_out: Sequence[Interval]) -> None:
    for a in tuning:
        for b in held_out:
            if a.start <= b.end and b.start <= a.end:
                raise CalibrationError(
                    f"intervals: tuning {a.start}/{a.end} and held-out {b.start}/{b.end} overlap; "
                    "a held-out target may not be tuned on"
                )
