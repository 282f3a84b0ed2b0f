"""What a calibration leaves behind: its numbers as JSON, its predictions as a table, and a page to read."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from calibration.evaluation.case_model import CHECK_TOLERANCE
from calibration.fit.result import CalibrationResult, ParameterEstimate
from calibration.results import Content, check_results_folder
from mpc.reports import evaluation
from mpc.reports.display import write_results
from mpc.reports.figures.calibration import MOST_ROWS, paper_values, parameter_ranges
from mpc.reports.figures.errors import error_band, error_growth, median_run
from mpc.reports.figures.field import spatial_field
from mpc.reports.identifiability import information_content, information_sentences
from mpc.reports.means import calibration_means, determined_words
from mpc.reports.page import (
    counted,
    duration,
    estimated_sentences,
    in_words,
    kelvin,
    percent,
    render,
)
from mpc.reports.residuals import diagnostics_content
from mpc.reports.warnings import case_warnings, windows_first
from thermal.case.case import Case
from thermal.model.case_replay import Inputs, replay_inputs
from thermal.model.matrices import SymbolicModel

#: The heat map shows every cell of the grid up to this many control volumes; beyond, one colour a zone.
MOST_VOLUMES = 40_000


def write_calibration(result: CalibrationResult, case: Case, out: str | Path, *, force: bool = False) -> Path:
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
    return write_results(out, calibration_files(result, case), force) / "report.html"


def calibration_files(result: CalibrationResult, case: Case) -> dict[str, Content]:
    """Files of a calibration by name, see `write_calibration`.

    Parameters
    ----------
    result : CalibrationResult
        From `calibrate`.
    case : Case
        The case it was calibrated on.
    """
    grid = SymbolicModel(result.settings.network(case.building))
    inputs = replay_inputs(case, grid.network)
    held_out = result.calibrated["held_out"]
    return {
        "calibration.json": calibration_content(result),
        "evaluation.json": held_out.to_dict(),
        "predictions.parquet": evaluation.predictions_table(held_out),
        "report.html": render("calibration", _content(result, case, grid, inputs)),
    }


def calibration_content(result: CalibrationResult) -> dict[str, Any]:
    """Contents of ``calibration.json``: the numbers of a calibration, with what the data determine in words.

    Parameters
    ----------
    result : CalibrationResult
        From `calibrate`.
    """
    return result.to_dict() | {"information": information_content(result.information)}


def calibration_verdict(result: CalibrationResult) -> str:
    """Say in plain words what a calibration achieved.

    Parameters
    ----------
    result : CalibrationResult
        From `calibrate`.
    """
    held_out = result.calibrated["held_out"]
    before, after = result.uncalibrated["held_out"].metrics.mae, held_out.metrics.mae
    rest = evaluation.unchanged_error(held_out)
    ahead = duration(held_out.steps * held_out.step_seconds).capitalize()
    sentences = [
        f"{ahead} ahead, on data it was not fitted to, the calibrated model misses the measured zone temperatures by",
        f"{kelvin(after)} K on average. Before calibration it was {kelvin(before)} K" + _change(before, after),
        f"Assuming that nothing changes misses by {kelvin(rest)} K"
        + ("." if rest > after else ", less than the model.")
        if held_out.yardsticks is None
        else evaluation.beside_sentence(after, held_out.yardsticks, "a diagnosis, which seeks what the model lacks; "),
        evaluation.carried_sentence(held_out.carried).strip(),
        *_structure_sentences(result),
        *estimated_sentences(held_out.estimated),
        _parameter_sentence(result.parameters),
    ]
    if not result.solver.success:
        status = result.solver.status
        sentences.insert(0, f"The solver stopped before it converged ({status}): do not rely on these numbers.")
    return " ".join(filter(None, sentences))


#: Conductances and capacities that a verdict says to be far from the drawing's; the data have them all.
_MOST_FAR = 3


def _structure_sentences(result: CalibrationResult) -> list[str]:
    """Which structure was kept and why, and what it says of the drawing."""
    if not result.rungs:
        return []
    kept = next(rung for rung in result.rungs if rung.chosen)
    if np.isnan(kept.left_out_mae):
        return ["The tuning intervals are too short to leave any of them out, so the building is taken as drawn."]
    errors = ", ".join(f"{rung.name} {kelvin(rung.left_out_mae)} K" for rung in result.rungs)
    taken = evaluation.structure_words(result.rungs)
    how = "the simplest that predicts left-out tuning days within a tenth of the best"
    sentences = [f"The building is taken {taken}, {how} ({errors}).", *_emitter_sentences(result)]
    far = result.against_drawing()
    named = [f"{in_words(f['what'])} ({f['factor']:.2g})" for f in far[:_MOST_FAR]]
    if named:
        rest = f" and {len(far) - len(named)} more" if len(far) > len(named) else ""
        sentences.append(f"Farthest from the drawing, as factors on it: {', '.join(named)}{rest}.")
    return sentences


def _emitter_sentences(result: CalibrationResult) -> list[str]:
    """Say what heaters give their heat by, where the case does not say it and the data do."""
    if result.settings.structure.emitter == "air":
        return []
    values = {p.name: p.value for p in result.parameters}
    floors = [name.partition("@")[2] for name, v in values.items() if name.startswith("floor_heat_share@") and v > 0.5]
    share = values.get("radiator_radiant_share")
    radiant = "" if share is None else f"{percent(share)} of it radiates"
    if not floors:
        return [f"Metered heat behaves as if radiators gave it: {radiant}."] if radiant else []
    rest = len(floors) < sum(name.startswith("floor_heat_share@") for name in values)
    other = f"; in the others as if radiators gave it ({radiant})" if rest and radiant else ""
    return [f"Metered heat behaves as if the floor were heated in {', '.join(floors)}{other}."]


def _change(before: float, after: float) -> str:
    if after < before:
        return f", so the error fell by {100 * (1 - after / before):.0f} %."
    return ": on these data calibration did not help."


def _parameter_sentence(parameters: Sequence[ParameterEstimate]) -> str:
    estimated = [p for p in parameters if p.standard_error is not None]
    told = sum(p.identifiable for p in estimated)
    absent, whole = _absent(estimated), [p for p in estimated if p.at_bound and p.base == "floor_heat_share"]
    bound = [in_words(p.name) for p in _leaving(estimated)]
    free = len(estimated) - told - len(bound) - len(absent) - len(whole)
    begin = f"Of {counted(len(estimated), 'estimated parameter')} the data determine {told or 'none'} by "
    parts = [begin + ("itself" if told == 1 else "themselves")]
    if free:
        open_ = f"{free} stay{'s' if free == 1 else ''} open within the physical range"
        parts.append(f"{open_}, as other values predict equally well: do not quote them")
    if absent:
        parts.append(f"{counted(len(absent), 'solar aperture')} of no size: no sun is seen to enter there")
    if whole:
        parts.append(f"{counted(len(whole), 'share')} of heat at an end: a floor gives all of it, or none")
    if not bound:
        return "; ".join([*parts, "none lies on a bound."])
    names = f" ({', '.join(bound)})" if len(bound) < 4 else ""
    lie = "lies" if len(bound) == 1 else "lie"
    return "; ".join([*parts, f"{len(bound)} {lie} on a bound{names}, which hints at physics that the model lacks."])


def _absent(parameters: Sequence[ParameterEstimate]) -> list[ParameterEstimate]:
    """Solar apertures of no size, which are no wrong ones."""
    return [p for p in parameters if p.at_bound and p.base == "solar_aperture" and p.value < p.start]


def _leaving(parameters: Sequence[ParameterEstimate]) -> list[ParameterEstimate]:
    """Estimates on a bound that hint at physics which the model lacks."""
    absent = {p.name for p in _absent(parameters)}
    return [p for p in parameters if p.at_bound and p.name not in absent and p.base != "floor_heat_share"]


def _kinds(rows: Sequence[Mapping[str, Any]]) -> dict[str, list[Mapping[str, Any]]]:
    """Rows of the table of parameters by kind, where there are too many for one table."""
    kinds: dict[str, list[Mapping[str, Any]]] = {}
    for row in rows:
        kinds.setdefault(row["base"] if len(rows) > MOST_ROWS else "parameters", []).append(row)
    return kinds


def _content(result: CalibrationResult, case: Case, grid: SymbolicModel, inputs: Inputs) -> dict[str, Any]:
    """Lay out the page."""
    before, after = result.uncalibrated["held_out"], result.calibrated["held_out"]
    field, chosen = None, result.settings
    if grid.network.n_node <= MOST_VOLUMES and (grid.network.place >= 0).any():
        which, run = median_run(after)
        start = after.predictions[which].start[run]
        field = spatial_field(grid, result.theta, inputs, start, after.steps, chosen.dx, chosen.stepping)
    drawn = evaluation.evaluation_figures(after, case, before, field, error_band(result.calibrated["tuning"]))
    parts = {name.replace("_", " "): name for name in ("held_out", "tuning")}
    pairs = {title: {"before": result.uncalibrated[k], "after": result.calibrated[k]} for title, k in parts.items()}
    drawn["growth"] = error_growth(pairs)
    paper, objective = paper_values(result.parameters), result.objective
    rows = [
        vars(p) | {"title": in_words(p.name), "base": p.base, "paper": paper.get(p.name)} for p in result.parameters
    ]
    flags = f" --scheme {chosen.scheme}" + (f" --objective {objective}" if objective != "multi_step" else "")
    flags += f" --starts {result.solver.starts} --seed {result.seed}"
    return {
        "result": result,
        "after": after,
        "subtitle": evaluation.subtitle(case, after),
        "verdict": calibration_verdict(result),
        "means": windows_first(calibration_means(result, evaluation.unchanged_error(after)), case),
        "determined": determined_words([p for p in result.parameters if p.standard_error is not None]),
        "warnings": case_warnings(case),
        "fine": result.solver.success and after.metrics.mae < before.metrics.mae,
        "parts": [(title, result.uncalibrated[k].metrics, result.calibrated[k].metrics,
                   evaluation.unchanged_error(result.calibrated[k])) for title, k in parts.items()],
        "figures": drawn,
        "estimated": [p for p in result.parameters if p.standard_error is not None],
        "kinds": list(_kinds(rows).items()),
        "drawn": MOST_ROWS,
        "parameter_figure": parameter_ranges(result.parameters),
        "told": information_sentences(result.information)[1:],  # how many, says `determined`
        "leaving": len(_leaving(result.parameters)),
        "zones": evaluation.by_error(after.by_zone()),
        "intervals": [record | {"part": title} for title, k in reversed(parts.items())
                      for record in evaluation.interval_records(result.calibrated[k])],
        **diagnostics_content(result, grid, inputs),
        "trusted": result.grid_check.max_difference <= CHECK_TOLERANCE,
        "span": (case.stamps[0], case.stamps[-1], case.step),
        "pandas": pd.__version__,
        "command": evaluation.command("calibrate", (result.tuning, result.held_out), result.horizon, chosen.dx, flags),
    }  # fmt: skip
