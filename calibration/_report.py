"""What a calibration leaves behind: its numbers as JSON, its predictions as a table, and a page to read."""

from __future__ import annotations

import platform
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import pandas as pd

from calibration import _figures as figures
from calibration._calibrate import CHECK_TOLERANCE
from calibration._evaluate import HORIZONS, Evaluation, evaluate_model
from calibration._page import clock, duration, kelvin, render, signed, significant, unit
from calibration._report_evaluation import (
    evaluation_figures,
    interval_rows,
    predictions_table,
    subtitle,
    unchanged_error,
)
from calibration._result import CalibrationResult, ParameterEstimate
from calibration._results import check_results_folder, write_results
from thermal import Case, Inputs, SymbolicModel, build_network, reduced_model, replay_inputs
from thermal.model import SCHEMES

#: The heat map shows every cell of the grid up to this many control volumes; beyond, one colour a zone.
MOST_VOLUMES = 40_000


def write_calibration(
    result: CalibrationResult, case: Case, out: str | Path, *, scheme: str = "implicit_euler", force: bool = False
) -> Path:
    """Write ``calibration.json``, ``evaluation.json``, ``predictions.parquet`` and ``report.html``.

    The last three are of the calibrated model on the held-out intervals.

    Parameters
    ----------
    result : CalibrationResult
        From `calibrate`.
    case : Case
        The case it was calibrated on.
    out : str or Path
        Folder, made if need be.
    scheme : str
        Time stepping of the calibration.
    force : bool
        Replace earlier results.

    Returns
    -------
    Path
        The page.

    Raises
    ------
    ResultsExistError
        When the folder holds something and ``force`` is not set.
    """
    check_results_folder(out, force)
    scopes = {p.name.partition("@")[0]: "zone" for p in result.parameters if "@" in p.name}
    grid = SymbolicModel(build_network(case.building, dx=result.dx, scopes=scopes))  # type: ignore[arg-type]
    inputs = replay_inputs(case, grid.network)
    held_out = _with_horizons(result, grid, inputs, scheme)
    page = render("calibration", _content(result, case, grid, inputs, scheme))
    folder = write_results(
        out,
        {
            "calibration.json": result.to_dict(),
            "evaluation.json": held_out.to_dict(),
            "predictions.parquet": predictions_table(held_out),
            "report.html": page,
        },
        force,
    )
    return folder / "report.html"


def calibration_verdict(result: CalibrationResult) -> str:
    """Say in plain words what a calibration achieved.

    Parameters
    ----------
    result : CalibrationResult
        From `calibrate`.
    """
    before, after = (e["held_out"].metrics.mae for e in (result.uncalibrated, result.calibrated))
    rest = unchanged_error(result.calibrated["held_out"])
    ahead = duration(result.calibrated["held_out"].steps * result.calibrated["held_out"].step_seconds)
    sentences = []
    if not result.solver.success:
        sentences.append(
            f"The solver stopped before it converged ({result.solver.status}): do not rely on these numbers."
        )
    sentences.append(
        f"{ahead.capitalize()} ahead, on data it was not fitted to, the calibrated model misses the measured zone temperatures by "
        f"{kelvin(after)} K on average."
    )
    if after < before:
        sentences.append(
            f"Before calibration it was {kelvin(before)} K, so the error fell by {100 * (1 - after / before):.0f} %."
        )
    else:
        sentences.append(f"Before calibration it was {kelvin(before)} K: on these data calibration did not help.")
    compared = "better than" if rest < after else "where"
    if rest < after:
        sentences.append(f"Assuming that nothing changes misses by {kelvin(rest)} K, {compared} the model.")
    else:
        sentences.append(f"Assuming that nothing changes would miss by {kelvin(rest)} K.")
    return " ".join([*sentences, _parameter_sentence(result.parameters)])


def _parameter_sentence(parameters: Sequence[ParameterEstimate]) -> str:
    estimated = [p for p in parameters if p.standard_error is not None]
    told = sum(p.identifiable for p in estimated)
    bound = [p.name for p in estimated if p.at_bound]
    free = len(estimated) - told - len(bound)
    text = f"Of {len(estimated)} estimated parameters the data determine {told}"
    text += f", {free} stay open within their physical range" if free else ""
    if not bound:
        return f"{text}, and none lies on a bound."
    names = " and ".join(n.replace("_", " ") for n in bound) if len(bound) < 3 else str(len(bound))
    return f"{text}, and {names} lie{'s' if len(bound) == 1 else ''} on a bound of that range, which hints at physics the model lacks."


def _with_horizons(result: CalibrationResult, grid: SymbolicModel, inputs: Inputs, scheme: str) -> Evaluation:
    """The held-out evaluation of the calibrated model, with the error at every horizon."""
    evaluation = result.calibrated["held_out"]
    if evaluation.by_horizon:
        return evaluation
    model = reduced_model(grid, [result.theta]) if result.grid_check.max_difference <= CHECK_TOLERANCE else grid
    further = evaluate_model(
        model, result.theta, inputs, result.held_out, result.horizon, horizons=HORIZONS, scheme=SCHEMES[scheme]
    )
    return replace(evaluation, by_horizon=further.by_horizon)


def _content(result: CalibrationResult, case: Case, grid: SymbolicModel, inputs: Inputs, scheme: str) -> dict[str, Any]:
    before, after = result.uncalibrated["held_out"], result.calibrated["held_out"]
    field = None
    if grid.network.n_node <= MOST_VOLUMES and (grid.network.place >= 0).any():
        which, run = figures.median_run(after)
        start = after.predictions[which].start[run]
        field = figures.spatial_field(grid, result.theta, inputs, start, after.steps, result.dx, SCHEMES[scheme])
    drawn = evaluation_figures(after, case, before=before, field=field)
    drawn["growth"] = figures.error_growth(
        {
            "held out": {"before": before, "after": after},
            "tuning": {"before": result.uncalibrated["tuning"], "after": result.calibrated["tuning"]},
        }
    )
    estimated = [p for p in result.parameters if p.standard_error is not None]
    told = sum(p.identifiable for p in estimated)
    return {
        "case": result.case,
        "subtitle": subtitle(case, after),
        "verdict": calibration_verdict(result),
        "fine": result.solver.success and after.metrics.mae < before.metrics.mae,
        "cards": [
            (f"{kelvin(after.metrics.mae)} K", f"held-out error {result.horizon} ahead, calibrated"),
            (f"{kelvin(before.metrics.mae)} K", "before calibration"),
            (f"{kelvin(unchanged_error(after))} K", "assuming that nothing changes"),
            (f"{told} of {len(estimated)}", "parameters determined by the data"),
            (f"{sum(p.at_bound for p in estimated)}", "parameters on a bound"),
        ],
        "errors": _error_rows(result),
        "error_note": f"At the last of {after.steps} steps of {after.step_seconds:g} s: the mean over zones of the absolute error (MAE), "
        "their median error and mean error (bias), simulated minus measured, averaged over the runs.",
        "figures": drawn,
        "parameters": [_parameter_row(p) for p in result.parameters],
        "parameter_figure": figures.parameter_ranges(result.parameters),
        "intervals": [["tuning", *r] for r in interval_rows(result.calibrated["tuning"])]
        + [["held out", *r] for r in interval_rows(after)],
        "interval_note": "Runs start every hour; one is skipped when its inputs are missing for over 30 minutes, or its target is. "
        "A run belongs to the interval that holds its target. Errors are of the calibrated model.",
        **_solver_content(result),
        "reproduce": _reproduce(result, case, scheme),
    }


def _error_rows(result: CalibrationResult) -> list[list[str]]:
    rows = []
    for key, name in (("held_out", "held out"), ("tuning", "tuning")):
        for model, evaluations in (("before", result.uncalibrated), ("after", result.calibrated)):
            e = evaluations[key].metrics
            rows.append([f"{name}, {model} calibration", f"{e.mae:.3f}", signed(e.median), signed(e.bias)])
        rows.append([f"{name}, nothing changes", f"{unchanged_error(result.calibrated[key]):.3f}", "–", "–"])
    return rows


def _parameter_row(p: ParameterEstimate) -> dict[str, str]:
    if p.standard_error is None:
        told, kind = "not estimated", "soft"
    elif p.at_bound:
        told, kind = "on a bound", "bad"
    else:
        told, kind = ("yes", "good") if p.identifiable else ("no", "soft")
    return {
        "name": p.name.replace("_", " "),
        "value": significant(p.value),
        "unit": unit(p.unit),
        "error": significant(p.standard_error, 2),
        "range": f"{significant(p.lower)} to {significant(p.upper)}" if p.lower is not None else "–",
        "told": told,
        "kind": kind,
        "source": p.source,
    }


def _solver_content(result: CalibrationResult) -> dict[str, Any]:
    s, g = result.solver, result.grid_check
    starts = f"{s.starts} starts" if s.starts > 1 else "one start"
    end = "converged" if s.success else "did not converge"
    compared = (
        f"A reduced model of {g.order} states was fitted in place of the grid's {g.volumes:,} control volumes. Over {g.runs} held-out "
        f"runs their zone temperatures differ by {g.max_difference:.4f} K at most and {g.mean_difference:.4f} K on average"
    ).replace(",", " ", 1)
    source = "the reduced model" if g.max_difference <= CHECK_TOLERANCE else "the grid itself"
    return {
        "solver": f"{s.name.capitalize()} {end} ({s.status}) after {s.iterations} iterations from {starts}, "
        f"{s.seconds:.1f} s in all.",
        "failures": s.failures,
        "grid_check": f"{compared}; the errors on this page come from {source}.",
    }


def _reproduce(result: CalibrationResult, case: Case, scheme: str) -> list[tuple[str, str]]:
    parts = ["buildingmpc calibrate CASE --out RESULTS"]
    parts += [f"--tune {i.start.isoformat()}/{i.end.isoformat()}" for i in result.tuning]
    parts += [f"--hold-out {i.start.isoformat()}/{i.end.isoformat()}" for i in result.held_out]
    parts += [f"--horizon {result.horizon} --scheme {scheme} --starts {result.solver.starts} --seed {result.seed}"]
    parts += [f"--dx {result.dx:g}"] if result.dx is not None else []
    return [
        (
            "case",
            f"{result.case}, telemetry from {clock(case.stamps[0])} to {clock(case.stamps[-1])} every {duration(case.step)}",
        ),
        ("version", f"buildingmpc {result.version}, Python {platform.python_version()}, pandas {pd.__version__}"),
        ("seed", str(result.seed)),
        ("command", " ".join(parts)),
    ]
