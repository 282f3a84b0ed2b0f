"""Choice between baseline structures: each is calibrated, then judged by tuning data and days held out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import replace
from typing import Any

import numpy as np

from calibration.errors import CalibrationError
from calibration.evaluation.intervals import Interval
from calibration.evaluation.n_step import Progress
from calibration.fit.calibrate import calibrate
from calibration.fit.cross_validation import in_order, run_errors
from calibration.fit.least_squares import INTERRUPTED
from calibration.fit.precision import precision
from calibration.fit.selection_verdict import Candidate, Selection, compare_candidates
from calibration.fleet.record import INTERVALS, check_settings
from calibration.identifiability.information_search import InformationSearch
from calibration.identifiability.power import tuning_problem
from thermal.case.case import Case
from thermal.model.reduce import reduced_model
from thermal.network.structure import Structure


def select_structure(
    case: Case,
    structures: Mapping[str, Structure | Mapping[str, Any]],
    tune: Sequence[Interval] = (),
    hold_out: Sequence[Interval] = (),
    settings: Mapping[str, Any] | None = None,
    *,
    seed: int = 0,
    executor: Executor | None = None,
    progress: Progress | None = None,
) -> Selection:
    """Calibrate each structure and say which one the data prefer, or that they cannot tell.

    Held-out errors decide where their paired difference is told from zero, by a circular block bootstrap over days
    (Politis and Romano 1992). Where it is not, the tuning data may: nested structures by the likelihood ratio
    ``n log(σ_small² / σ_large²)``, chi-square with the difference of parameters (Wilks 1938), others by the evidence
    ``-n log σ - n/2 - (z - c)'Λ(z - c)/2 - log|I + Λ^-1 J'J|/2`` (Laplace; MacKay 1992). σ is the root mean square of
    each one's residuals; n is the number of independent observations that these are worth, the least of all candidates'
    (`Problem.effective_size`, with the disturbance that the calibration found).

    Parameters
    ----------
    case : Case
        Building and telemetry.
    structures : mapping of str to Structure or mapping
        By name: a structure, or keywords of `calibrate` that make the difference, such as scopes.
    tune, hold_out : sequence of Interval
        As `calibrate` takes them.
    settings : mapping of str to Any, optional
        Keywords of `calibrate` that all have in common.
    seed : int
        Seed of the bootstrap.
    executor : Executor, optional
        Where to calibrate, any of `concurrent.futures`; it is left open. One after the other by default.
    progress : callable, optional
        Called with stage, done, total after each structure.

    Raises
    ------
    CalibrationError
        When there are fewer than two structures, a keyword is unknown, or they are not judged on the same data.

    Examples
    --------
    >>> from thermal.data import load_bundled_case
    >>> structures = {"the paper's": Structure.paper(), "with interior mass": Structure()}
    >>> select_structure(load_bundled_case(), structures).verdict  # doctest: +SKIP
    """
    if len(structures) < 2:
        raise CalibrationError(f"structures: expected at least two to choose from, came {list(structures)}")
    tasks = [
        (case, name, tuple(tune), tuple(hold_out), _keywords(settings or {}, structure))
        for name, structure in structures.items()
    ]
    candidates: list[Candidate] = []
    for candidate in in_order(_candidate, tasks, executor):
        candidates.append(candidate)
        if progress is not None:
            progress("select", len(candidates), len(tasks))
    _check_comparable(candidates)
    return compare_candidates(candidates, seed)


def _keywords(common: Mapping[str, Any], structure: Structure | Mapping[str, Any]) -> dict[str, Any]:
    """Keywords of `calibrate` for one structure, checked."""
    own = {"structure": structure} if isinstance(structure, Structure) else structure
    for name in (*common, *own):
        if name in INTERVALS:
            raise CalibrationError(f"structures: {name!r} is the same for all; give it beside the structures")
    keywords = {**common, **own}
    check_settings(keywords)
    return keywords


def _candidate(
    case: Case, name: str, tune: Sequence[Interval], hold_out: Sequence[Interval], settings: Mapping[str, Any]
) -> Candidate:
    """Calibrate one structure, in whatever process."""
    result = calibrate(case, tune, hold_out, **settings)
    if result.solver.status == INTERRUPTED:  # the best so far is no candidate
        raise KeyboardInterrupt
    problem = tuning_problem(case, result.tuning, result.settings, fixed=settings.get("fixed"), horizon=result.horizon)
    model, z = reduced_model(problem.grid, [result.theta]), problem.point(result.theta)
    error = problem.residuals_only(model, result.theta)
    deviation, size = float(np.sqrt(np.mean(error**2))), problem.effective_size()
    if result.disturbance is not None:
        known = precision(problem, model, result.theta, result.disturbance)
        size = min(size, known.effective(deviation) / result.excess)
    residual, jacobian = replace(problem, deviation=deviation, effective=1.0).weighted(model, z)
    data, prior = jacobian[: error.size], jacobian[error.size :]  # priors follow the data
    return Candidate(
        name,
        result.settings,
        len(problem.free),
        deviation,
        InformationSearch(data.T @ data, prior.T @ prior).values,
        float(np.sum(residual[error.size :] ** 2)),
        result.calibrated["held_out"].metrics.mae,
        result.solver.success,
        size,
        error.size,
        run_errors(result.calibrated["held_out"]),
    )


def _check_comparable(candidates: Sequence[Candidate]) -> None:
    first = candidates[0]
    for other in candidates[1:]:
        same = first.errors.index.equals(other.errors.index) and first.residuals == other.residuals
        if not same:
            raise CalibrationError(
                f"structures: {first.name!r} and {other.name!r} are not judged on the same runs; "
                "expected the same horizon and spin-up for all"
            )
