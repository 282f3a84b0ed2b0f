"""Calibration of a case: from telemetry to parameters, with errors before and after, tuned on and held out."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from importlib.metadata import version
from typing import get_args

from calibration.errors import CalibrationError
from calibration.estimation.likelihood import InnovationsProblem
from calibration.evaluation.case_model import CaseModel
from calibration.evaluation.intervals import Interval, default_intervals, horizon_steps, select_runs
from calibration.evaluation.n_step import HORIZONS, Evaluation, Progress, evaluate_model
from calibration.evaluation.settings import ModelSettings
from calibration.fit.describe import describe
from calibration.fit.problem import Loss, Objective, Problem
from calibration.fit.result import CalibrationResult, GridCheck, SolverReport
from calibration.fit.starts import solve_starts, tuning_runs
from calibration.identifiability.information import information_of
from thermal.case.case import Case
from thermal.inputs.normalisation import fit_normalisation
from thermal.model.matrices import SymbolicModel
from thermal.model.reduce import ReducedModel, reduced_model
from thermal.model.replay import SPIN_UP, replay_inputs
from thermal.network.structure import BASELINE, Structure
from thermal.parameters import Scope

#: Starts that are tried unless told otherwise: the given one, where compensation would lead, and a draw.
STARTS = 3


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
    structure: Structure = BASELINE,
    effects: Sequence[str] | Mapping[str, Sequence[str]] = (),
    objective: Objective = "multi_step",
    loss: Loss = "linear",
    starts: int = STARTS,
    seed: int = 0,
    progress: Progress | None = None,
) -> CalibrationResult:
    """Fit the physical parameters of a building to its telemetry by least squares.

    Residuals are the errors of N-step runs that tile the tuning intervals, and every parameter has a log-normal prior
    whose 95 % interval is its physical range. The errors are strongly correlated: an autocorrelated heat disturbance in
    each zone and the sensors' noise, tuned by the likelihood of a Kalman filter's innovations, say how many independent
    observations they are worth, and what the standard errors are. Ipopt solves on a reduced model with exact
    derivatives; the answer is checked on the grid.

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
    scopes : mapping of str to {"global", "facade", "zone"}, optional
        Parameters with one value a facade or a zone, shrunk towards a common one as far as the data let them.
    horizon : str
        Prediction horizon, such as ``6h``.
    scheme : str
        ``implicit_euler`` or ``tr_bdf2``.
    reach : float, optional
        Reach of the shuffle [m]; None is the whole zone.
    spin_up_seconds : float
        Length of the spin-up before an interval [s].
    structure : Structure
        What the model is made of: furniture, slabs, nodes of a wall, radiant node.
    effects : sequence of str, or mapping of str to sequence of str
        Effects of the catalogue that are known to be there; a mapping has the zones of each, none for the whole
        building.
    objective : {"multi_step", "innovations"}
        Errors of N-step runs, or the likelihood of a Kalman filter's innovations, whose disturbance is tuned with the
        parameters in turn.
    loss : {"linear", "pseudo_huber"}
        Least squares, or a loss that outlying errors do not pull.
    starts : int
        Number of starts: the given one, where a fit would go that may compensate freely, then draws from the prior.
        The best is kept, and a start that fails costs that start only.
    seed : int
        Seed of the draws.
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
    >>> result = calibrate(load_bundled_case(), dx=1.0)
    >>> result.solver.success
    True
    """
    began = time.perf_counter()
    chosen = dict(effects) if isinstance(effects, Mapping) else {e: () for e in effects}
    settings = ModelSettings(dx, reach, scheme, dict(scopes or {}), spin_up_seconds, structure, chosen)
    for name, text, known in (("loss", loss, get_args(Loss)), ("objective", objective, get_args(Objective))):
        if text not in known:
            raise CalibrationError(f"{name}: expected one of {', '.join(known)}, came {text!r}")
    for name, value, least in (("starts", starts, 1), ("seed", seed, 0)):
        if value < least:
            raise CalibrationError(f"{name}: expected at least {least}, came {value}")
    tuned, judged = default_intervals(case, tune, hold_out)
    if chosen:
        settings = replace(settings, normalisation=fit_normalisation(case, ((i.start, i.end) for i in tuned)))
    intervals = {"tuning": tuned, "held_out": judged}
    _refuse_overlap(tuned, judged)
    network = settings.network(case.building)
    grid = SymbolicModel(network)
    inputs = replay_inputs(case, network)
    given = network.values(fixed or {})
    free = tuple(i for i, p in enumerate(network.parameters) if p.name not in (fixed or {}))
    if not free:
        raise CalibrationError(
            f"fixed: expected a parameter that is left to estimate, came all {len(given)}; evaluate instead"
        )
    steps = horizon_steps(horizon, inputs.step)
    runs = tuning_runs(inputs, tuned, steps, spin_up_seconds)
    for interval in judged:
        select_runs(inputs, interval, steps, spin_up=spin_up_seconds)  # refused now rather than after the solve
    problem = Problem(grid, inputs, runs, steps, free, given, settings.stepping, loss=loss)
    first = reduced_model(grid, [given])
    if objective == "innovations":
        problem = InnovationsProblem(
            grid, inputs, runs, steps, free, given, settings.stepping, loss=loss, intervals=tuple(tuned),
            spin_up_seconds=spin_up_seconds,
        ).at(first, given)  # fmt: skip
    best, failures = solve_starts(problem, first, starts, seed, progress)
    before, _ = _evaluated(CaseModel(case, settings, grid, inputs, given, "start"), first, intervals, horizon, progress)
    found = CaseModel(case, settings, grid, inputs, best.theta, "estimate")
    after, check = _evaluated(found, best.model, intervals, horizon, progress)
    seconds = time.perf_counter() - began
    information = information_of(best)
    return CalibrationResult(
        case=case.building.name,
        zones=network.zones,
        parameters=describe(best, information, network.nominal),
        theta=best.theta,
        tuning=tuple(tuned),
        held_out=tuple(judged),
        uncalibrated=before,
        calibrated=after,
        solver=SolverReport(
            "ipopt",
            best.solve.status,
            best.solve.success,
            best.iterations,
            seconds,
            starts,
            tuple(failures),
            best.evaluations,
            best.settled,
        ),
        disturbance=best.disturbance,
        excess=best.excess,
        information=information,
        grid_check=check,
        objective=objective,
        horizon=horizon,
        settings=settings,
        seed=seed,
        version=version("buildingmpc"),
    )


def _evaluated(
    model: CaseModel,
    reduced: ReducedModel,
    intervals: Mapping[str, Sequence[Interval]],
    horizon: str,
    progress: Progress | None,
) -> tuple[dict[str, Evaluation], GridCheck]:
    """Errors on both kinds of interval, at other horizons too where held out, and the check of the reduced model."""
    settings = model.settings
    steps = horizon_steps(horizon, model.inputs.step)
    quick, check = model.certified(intervals["held_out"][0], steps, reduced)
    errors = {}
    for name, part in intervals.items():
        errors[name] = evaluate_model(
            quick,
            model.theta,
            model.inputs,
            part,
            horizon,
            trajectories=True,
            horizons=HORIZONS if name == "held_out" else (),
            scheme=settings.stepping,
            spin_up_seconds=settings.spin_up_seconds,
            progress=progress,
        )
    return errors, check


def _refuse_overlap(tuning: Sequence[Interval], held_out: Sequence[Interval]) -> None:
    for a in tuning:
        for b in held_out:
            if a.start <= b.end and b.start <= a.end:
                raise CalibrationError(
                    f"intervals: tuning {a.start}/{a.end} and held-out {b.start}/{b.end} overlap; "
                    "a held-out target may not be tuned on"
                )
