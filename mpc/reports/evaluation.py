"""What an evaluation leaves behind, and the figures that it shares with a calibration."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from calibration.evaluation.carried import Carried
from calibration.evaluation.intervals import Interval
from calibration.evaluation.n_step import Evaluation, spatial_metrics
from calibration.evaluation.yardsticks import YARDSTICKS, Yardsticks
from calibration.fit.result import Rung
from mpc.reports.figures.errors import Band, drift_boxes, error_growth, median_run, series_of_runs, zone_panels
from mpc.reports.figures.field import Field
from mpc.reports.figures.plan import floor_maps, tile_map
from mpc.reports.figures.style import CELSIUS, Picture
from mpc.reports.means import prediction_means
from mpc.reports.page import clock, counted, duration, estimated_sentences, kelvin, listed, write_report
from thermal._types import FloatArray
from thermal.case.building import FloorPlans
from thermal.case.case import Case


def write_evaluation(
    evaluation: Evaluation, case: Case, out: str | Path, *, parameters: str = "uncalibrated", force: bool = False
) -> Path:
    """Write ``evaluation.json``, ``predictions.parquet`` and ``report.html``.

    Parameters
    ----------
    evaluation : Evaluation
        From `evaluate_model`, with its trajectories.
    case : Case
        The case it was made on.
    out : str or Path
        Folder, made if need be.
    parameters : str
        Where the parameters come from, for the page.
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
    drawn = evaluation_figures(evaluation, case) | {"growth": error_growth({"all runs": {"model": evaluation}})}
    content = {
        "case": case.building.name,
        "subtitle": subtitle(case, evaluation),
        "verdict": evaluation_verdict(evaluation),
        "means": prediction_means(evaluation, unchanged_error(evaluation)),
        "evaluation": evaluation,
        "unchanged": unchanged_error(evaluation),
        "horizons": horizon_rows(evaluation),
        "intervals": interval_records(evaluation),
        "figures": drawn,
        "zones": by_error(evaluation.by_zone()),
        "parameters": parameters,
    }
    files = {"evaluation.json": evaluation.to_dict(), "predictions.parquet": predictions_table(evaluation)}
    return write_report(out, "evaluation", content, files, force)


def evaluation_verdict(evaluation: Evaluation) -> str:
    """Say in plain words how far a model is off.

    Parameters
    ----------
    evaluation : Evaluation
        From `evaluate_model`.
    """
    metrics, rest = evaluation.metrics, unchanged_error(evaluation)
    ahead = duration(evaluation.steps * evaluation.step_seconds).capitalize()
    lean = "too warm" if metrics.bias > 0 else "too cold"
    text = f"{ahead} ahead, the model misses the measured zone temperatures by {kelvin(metrics.mae)} K on average"
    text += f" and is {lean} by {kelvin(abs(metrics.bias))} K."
    text = " ".join([text, *estimated_sentences(evaluation.estimated)])
    text += carried_sentence(evaluation.carried)
    if evaluation.yardsticks is not None:
        return f"{text} {beside_sentence(metrics.mae, evaluation.yardsticks)}"
    compared = "less" if rest < metrics.mae else "more"
    return f"{text} Assuming that nothing changes misses by {kelvin(rest)} K, {compared} than the model."


def horizon_rows(evaluation: Evaluation) -> list[tuple[str, float, float | None]]:
    """Errors at every horizon, without and with unmeasured heat carried on [K].

    Parameters
    ----------
    evaluation : Evaluation
        From `evaluate_model`.
    """
    carried = {} if evaluation.carried is None else evaluation.carried.by_horizon
    return [(name, mae, carried.get(name)) for name, mae in evaluation.by_horizon.items()]


def carried_sentence(carried: Carried | None) -> str:
    """Say how a model does that carries on what a filter knows, and how sure it is; nothing where that was not tried.

    Parameters
    ----------
    carried : Carried or None
        Of an evaluation.

    Examples
    --------
    >>> carried_sentence(Carried(0.2, 0.0, 0.0, coverage=0.91, half_width=0.5))[:72]
    ' Begun from the filtered state, with its unmeasured heat carried on, it '
    """
    if carried is None:
        return ""
    text = " Begun from the filtered state, with its unmeasured heat carried on,"
    text += f" it misses them by {kelvin(carried.mae)} K"
    if carried.coverage is None or carried.half_width is None:
        return f"{text}."
    held, wide = f"{100 * carried.coverage:.0f} %", kelvin(carried.half_width)
    return f"{text}; its 90 % bands, at the end ± {wide} K, held {held} of what was measured."


#: Structures in words.
_STRUCTURES = {
    "radiator": "as drawn, with heat that radiates in part",
    "floor": "as drawn, with heat that floors give",
    "natural convection": "as drawn, with inside films that follow the heat of their zone",
    "light contents": "as drawn, with light things whose heat capacity adds to the air's",
    "wind": "as drawn, with outside films that follow the wind",
    "zoned": "as drawn, with values of each zone's own",
    "people": "as drawn with people who have hours of their own in each zone",
    "people beside": "as drawn with what was found and people who have hours of their own in each zone",
    "lumped": "lumped into air and mass a zone",
    "recurring": "lumped into air and mass a zone, with a gain that recurs from day to day",
    "corrected": "with heat of unknown cause",
    "found": "lumped with what was found in the place of what it has itself",
    "lumped floor": "lumped into air, one mass and a heated floor a zone",
    "shifted": "lumped into air and mass a zone, with heat and weather moved in time",
}


def structure_words(rungs: Sequence[Rung]) -> str:
    """Say how a building is taken.

    Parameters
    ----------
    rungs : sequence of Rung
        One of them chosen.

    Examples
    --------
    >>> structure_words([Rung("drawn", 0.2, 13, True)])
    'as drawn'
    """
    kept = next(rung.name for rung in rungs if rung.chosen)
    return _STRUCTURES.get(kept, f"as {kept}")


#: What makes a model useful that is not yet.
_WOULD_HELP = "more days to tune on with heat that varies, and irradiance where none is measured"


def beside_sentence(mae: float, yardsticks: Yardsticks, helps: str = "") -> str:
    """Say how a model does beside what anyone fits in an hour.

    Parameters
    ----------
    mae : float
        Of the model [K].
    yardsticks : Yardsticks
        On the same runs.
    helps : str
        What to try first where they do better; what helps any model follows.

    Examples
    --------
    >>> beside_sentence(0.3, Yardsticks(1.0, 0.5, 0.4)).partition(":")[0]
    'What anyone fits in an hour misses the same runs by'
    """
    errors = listed([f"{kelvin(error)} K ({YARDSTICKS[name]})" for name, error in yardsticks.made.items()])
    text = f"What anyone fits in an hour misses the same runs by: {errors}."
    better = [YARDSTICKS[name] for name, error in yardsticks.made.items() if error <= mae]
    if better:
        text += f" The model does not beat {listed(better)}, so it is not yet useful."
        return f"{text} What helps: {helps}{_WOULD_HELP}."
    return f"{text} The model beats {'them all' if len(yardsticks.made) > 1 else 'it'}."


def unchanged_error(evaluation: Evaluation) -> float:
    """Error of assuming that every zone keeps the temperature of its start [K], averaged as the model's is.

    Parameters
    ----------
    evaluation : Evaluation
        Whose runs are compared.
    """
    return spatial_metrics(np.concatenate([p.initial - p.measured[:, -1] for p in evaluation.predictions])).mae


def predictions_table(evaluation: Evaluation) -> pd.DataFrame:
    """Predictions in tidy form: one row a run, step and measured zone.

    Parameters
    ----------
    evaluation : Evaluation
        From `evaluate_model`.

    Returns
    -------
    DataFrame
        Index ``timestamp``; columns ``run_start``, ``zone``, ``simulated`` and ``measured`` [degC].
    """
    parts = []
    for p in evaluation.predictions:
        lags = pd.to_timedelta(p.steps * evaluation.step_seconds, unit="s")
        stamps = pd.DatetimeIndex(np.repeat(p.start, len(lags)) + np.tile(lags, len(p.start)))
        shape = (len(stamps), len(evaluation.zones))
        values = {"simulated": p.simulated.reshape(shape) - CELSIUS, "measured": p.measured.reshape(shape) - CELSIUS}
        frame = tidy(stamps, evaluation.zones, values)
        frame.insert(0, "run_start", np.repeat(p.start, len(lags) * shape[1]))
        parts.append(frame[frame["measured"].notna()])
    table = pd.concat(parts)
    table.attrs["units"] = {"simulated": "degC", "measured": "degC"}
    return table


def tidy(stamps: pd.DatetimeIndex, zones: tuple[str, ...], values: dict[str, FloatArray]) -> pd.DataFrame:
    """Tabulate values by time and zone with one row a stamp and zone.

    Parameters
    ----------
    stamps : DatetimeIndex, length n_time
        May repeat.
    zones : tuple of str
        Zone names.
    values : dict of str to ndarray, shape (n_time, n_zone)
        By column [units of the columns].

    Returns
    -------
    DataFrame
        Index ``timestamp``; ``zone`` and the columns.
    """
    names = pd.Categorical(np.tile(np.array(zones, dtype=object), len(stamps)), categories=list(zones))
    columns = {"zone": names, **{name: value.ravel() for name, value in values.items()}}
    return pd.DataFrame(columns, index=pd.DatetimeIndex(np.repeat(stamps, len(zones)), name="timestamp"))


def evaluation_figures(
    evaluation: Evaluation,
    case: Case,
    before: Evaluation | None = None,
    field: Field | None = None,
    band: Band | None = None,
) -> dict[str, Any]:
    """Figures of the runs of an evaluation: drift, maps and zones.

    Parameters
    ----------
    evaluation : Evaluation
        With its trajectories.
    case : Case
        For the plans.
    before : Evaluation, optional
        The same runs before calibration.
    field : Field, optional
        Last state of the median run on the grid.
    band : Band, optional
        About the predictions, from other runs.
    """
    which, run = median_run(evaluation)
    p = evaluation.predictions[which]
    ahead = duration(evaluation.steps * evaluation.step_seconds)
    shown = [("after calibration" if before else "the model", p, run)]
    if before is not None:
        shown.insert(0, ("before calibration", before.predictions[which], run))
    runs = sum(len(x.start) for x in evaluation.predictions)
    errors = evaluation.by_zone()
    mean = np.array([errors[z]["bias"] if z in errors else np.nan for z in evaluation.zones])
    series = series_of_runs(evaluation, band)
    inside = band.coverage(evaluation) if band is not None else np.nan
    return {
        "drift": drift_boxes(shown, evaluation.step_seconds),
        "run_start": clock(p.start[run]),
        "runs": runs,
        "maps": [
            *error_maps(case, evaluation.zones, p.error[run], f"{ahead} after {clock(p.start[run])}", field),
            *error_maps(case, evaluation.zones, mean, f"mean over {runs} runs"),
        ],
        "plan": isinstance(case.building.geometry, FloorPlans),
        "cells": field is not None,
        "zones": zone_panels(series, evaluation.zones, {z: e["mae"] for z, e in errors.items()}),
        "inside": f"{100 * inside:.0f} %" if np.isfinite(inside) else "",
        "zone_count": len(errors),
        "ahead": ahead,
    }


def error_maps(
    case: Case, zones: tuple[str, ...], error: FloatArray, title: str, field: Field | None = None
) -> list[Picture]:
    """Map the error of the zones on the plans, or on tiles where there is no plan."""
    geometry = case.building.geometry
    if isinstance(geometry, FloorPlans):
        return floor_maps(geometry, case.building.orientation, zones, error, title, field)
    areas = np.array([zone.floor_area for zone in geometry.zones])
    return tile_map(zones, areas, error, title)


def interval_records(evaluation: Evaluation) -> list[dict[str, Any]]:
    """Pair the predictions of each interval with their errors, for the table of intervals.

    Parameters
    ----------
    evaluation : Evaluation
        From `evaluate_model`.
    """
    return [vars(p) | vars(spatial_metrics(p.error)) for p in evaluation.predictions]


def by_error(errors: Mapping[str, Mapping[str, float]]) -> list[dict[str, Any]]:
    """List the errors of the zones as records, the largest first."""
    return [{"zone": z, **e} for z, e in sorted(errors.items(), key=lambda item: -item[1]["mae"])]


def command(name: str, parts: Sequence[Sequence[Interval]], horizon: str, dx: float | None, further: str = "") -> str:
    """Spell the command that gives a result again.

    Parameters
    ----------
    name : str
        Of the command.
    parts : sequence of sequence of Interval
        Those tuned on and those held out.
    horizon : str
        Prediction horizon, such as ``6h``.
    dx : float or None
        Distance between control volumes of a plan [m].
    further : str
        Other options.
    """
    words = [f"buildingmpc {name} CASE --out RESULTS"]
    for option, intervals in zip(("--tune", "--hold-out"), parts, strict=True):
        words += [f"{option} {'/'.join(i.to_dict().values())}" for i in intervals]
    return " ".join([*words, f"--horizon {horizon}{further}", *([] if dx is None else [f"--dx {dx:g}"])])


def subtitle(case: Case, evaluation: Evaluation) -> str:
    """Line under a page's title."""
    zones, measured = len(evaluation.zones), len(evaluation.by_zone())
    seen = counted(zones, "zone") + ("" if measured == zones else f", {measured} of them measured")
    return f"{seen}; times are local ({case.building.location.timezone})"
