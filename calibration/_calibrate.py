"""Calibration of a case: from telemetry to parameters, with errors before and after, tuned on and held out."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from importlib.metadata import version

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from calibration._case_model import CaseModel
from calibration._estimate import Estimate, Problem, estimate, random_starts, thin
from calibration._evaluate import HORIZONS, Evaluation, Progress, evaluate_model
from calibration._intervals import Interval, Runs, default_intervals, horizon_steps, select_runs
from calibration._result import CalibrationResult, GridCheck, ParameterEstimate, SolverReport
from calibration._settings import ModelSettings
from calibration.errors import CalibrationError, NotEnoughDataError
from thermal import Case, Inputs, ModelError, Parameter, SymbolicModel, replay_inputs
from thermal.model import LEAST_SPIN_UP, SPIN_UP
from thermal.parameters import Scope

FloatArray = NDArray[np.float64]

#: A bound counts as hit within this share of the range, on the estimation scale [-].
BOUND_SHARE = 0.01


def calibrate(
    case: Case,
    tune: Sequence[Interval] = (),
    hold_out: Sequence[Interval] = (),
    *,
    dx: float | None = None,
    fixed: Mapping[str, float] | None = None,
    scopes: Mapping[str, Scope] | None = None,
    horizon: str = "6h",
    scheme: str = "implicit_euler",
    reach: float | None = None,
    spin_up_seconds: float = SPIN_UP,
    starts: int = 1,
    seed: int = 0,
    progress: Progress | None = None,
) -> CalibrationResult:
    """Fit the physical parameters of a building to its telemetry by least squares.

    Residuals are the errors of N-step runs that tile the tuning intervals; each zone's errors count as one observation
    a day (they are strongly correlated in time), and every parameter has a log-normal prior whose 95 % interval is its
    physical range. Ipopt solves on a reduced model with exact derivatives; the answer is checked on the grid.

    Parameters
    ----------
    case : Case
        Building and telemetry.
    tune, hold_out : sequence of Interval
        First two thirds and last third of the telemetry when both are empty; what the other leaves when one is.
    dx : float, optional
        Distance between control volumes of a plan [m]; the plan's cell size by default.
    fixed : mapping of str to float, optional
        Parameters that keep a given value [parameter units].
    scopes : mapping of str to {"global", "zone"}, optional
        Parameters with one value a zone.
    horizon : str
        Prediction horizon, such as ``6h``.
    scheme : str
        ``implicit_euler`` or ``tr_bdf2``.
    reach : float, optional
        Reach of the shuffle [m]; None is the whole zone.
    spin_up_seconds : float
        Length of the spin-up before an interval [s].
    starts : int
        Number of starts: the given one, then draws from the prior.
    seed : int
        Seed of the draws.
    progress : callable, optional
        Called with stage, done, total.

    Returns
    -------
    CalibrationResult
        With the solver's status, which says whether it converged.

    Raises
    ------
    CalibrationError
        When an interval has no usable run, a name is unknown, or every start failed.

    Examples
    --------
    >>> from thermal import load_bundled_case
    >>> result = calibrate(load_bundled_case(), dx=1.0)
    >>> result.solver.success
    True
    """
    began = time.perf_counter()
    settings = ModelSettings(dx, reach, scheme, dict(scopes or {}), spin_up_seconds)
    for name, value, least in (("starts", starts, 1), ("seed", seed, 0)):
        if value < least:
            raise CalibrationError(f"{name}: expected at least {least}, came {value}")
    tuned, judged = default_intervals(case, tune, hold_out)
    intervals = {"tuning": tuned, "held_out": judged}
    _refuse_overlap(tuned, judged)
    network = settings.network(case.building)
    grid = SymbolicModel(network)
    inputs = replay_inputs(case, network)
    given = network.values(fixed or {})
    free = tuple(i for i, p in enumerate(network.parameters) if p.name not in (fixed or {}))
    steps = horizon_steps(horizon, inputs.step)
    runs = _tuning_runs(inputs, tuned, steps, spin_up_seconds)
    for interval in judged:
        select_runs(inputs, interval, steps, spin_up=spin_up_seconds)  # refused now rather than after the solve
    problem = Problem(grid, inputs, runs, steps, free, given, settings.stepping)
    best, failures = _solve(problem, starts, seed, progress)
    before, _ = _evaluated(CaseModel(case, settings, grid, inputs, given, "start"), intervals, horizon)
    after, check = _evaluated(CaseModel(case, settings, grid, inputs, best.theta, "estimate"), intervals, horizon)
    seconds = time.perf_counter() - began
    return CalibrationResult(
        case=case.building.name,
        zones=network.zones,
        parameters=_describe(best, network.nominal),
        theta=best.theta,
        tuning=tuple(tuned),
        held_out=tuple(judged),
        uncalibrated=before,
        calibrated=after,
        solver=SolverReport(
            "ipopt", best.solve.status, best.solve.success, best.iterations, seconds, starts, tuple(failures)
        ),
        grid_check=check,
        horizon=horizon,
        settings=settings,
        seed=seed,
        version=version("buildingmpc"),
    )


def _evaluated(
    model: CaseModel, intervals: Mapping[str, Sequence[Interval]], horizon: str
) -> tuple[dict[str, Evaluation], GridCheck]:
    """Errors on both kinds of interval, at other horizons too where held out, and the check of the reduced model."""
    settings = model.settings
    quick, check = model.certified(intervals["held_out"][0], horizon_steps(horizon, model.inputs.step))
    errors = {
        name: evaluate_model(
            quick,
            model.theta,
            model.inputs,
            part,
            horizon,
            trajectories=True,
            horizons=HORIZONS if name == "held_out" else (),
            scheme=settings.stepping,
            spin_up_seconds=settings.spin_up_seconds,
        )
        for name, part in intervals.items()
    }
    return errors, check


def _tuning_runs(inputs: Inputs, intervals: Sequence[Interval], steps: int, spin_up: float) -> tuple[Runs, ...]:
    """Choose runs that tile the tuning intervals, with a full spin-up where that leaves half of the telemetry.

    A run after 12 hours starts from walls and slabs that are still wrong, and the fit would take that for physics: on a
    twin of known parameters it cost 0.013 K of held-out error.
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
    runs = tuple(r for r in thin(chosen, steps, inputs.step) if r.starts.size)
    if not runs:
        raise NotEnoughDataError(
            "tuning: every run misses inputs or zone temperatures; `buildingmpc check` shows the gaps"
        )
    return runs


def _refuse_overlap(tuning: Sequence[Interval], held_out: Sequence[Interval]) -> None:
    for a in tuning:
        for b in held_out:
            if a.start <= b.end and b.start <= a.end:
                raise CalibrationError(
                    f"intervals: tuning {a.start}/{a.end} and held-out {b.start}/{b.end} overlap; "
                    "a held-out target may not be tuned on"
                )


def _solve(problem: Problem, starts: int, seed: int, progress: Progress | None) -> tuple[Estimate, list[str]]:
    """Best estimate over the starts; a start that fails costs that start only."""
    best: Estimate | None = None
    failures = []
    for number, z in enumerate(random_starts(problem, starts, seed)):
        try:
            found = estimate(problem, z, progress)
        except (ArithmeticError, np.linalg.LinAlgError, ModelError) as error:
            failures.append(f"start {number}: {error}")
            continue
        if best is None or _objective(found) < _objective(best):
            best = found
    if best is None:
        raise CalibrationError(f"every start failed: {'; '.join(failures)}")
    return best, failures


def _objective(found: Estimate) -> float:
    """Negative log posterior up to a constant, the deviation profiled out, so that starts compare."""
    size, deviation = found.problem.effective_size(), found.problem.deviation
    return found.solve.cost + size * float(np.log(deviation))


def _describe(found: Estimate, nominal: Mapping[str, tuple[float, str]]) -> tuple[ParameterEstimate, ...]:
    """Parameters with standard errors, bounds and what the data determine."""
    deviations = dict(zip(found.problem.free, np.sqrt(np.diag(found.covariance)), strict=True))
    described = [
        _estimated(p, float(found.theta[i]), deviations.get(i))
        for i, p in enumerate(found.problem.grid.network.parameters)
    ]
    for name, (value, unit) in nominal.items():
        source = "nominal: enters only as a product with the heat capacity"
        described.append(ParameterEstimate(name, unit, value, None, None, value, False, None, False, source))
    return tuple(described)


def _estimated(p: Parameter, value: float, deviation: float | None) -> ParameterEstimate:
    if deviation is None:
        return ParameterEstimate(
            p.name, p.unit, value, p.lower, p.upper, p.start, False, None, False, "fixed by the user"
        )
    low, high, z = p.transform(p.lower), p.transform(p.upper), p.transform(value)
    at_bound = bool(min(z - low, high - z) < BOUND_SHARE * (high - low))
    identifiable = bool(deviation < 0.5 * p.prior_deviation and not at_bound)
    error = float(deviation * p.slope(value))
    return ParameterEstimate(p.name, p.unit, value, p.lower, p.upper, p.start, at_bound, error, identifiable, p.source)
