"""How the error grows over the horizon, before and after calibration."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from calibration.evaluation.n_step import Evaluation
from mpc.reports.figures.style import INK, MUTED, SIMULATED, Picture, picture, styled
from thermal._types import FloatArray

#: Colour and line of each model.
LINES = {"before": (MUTED, "--"), "after": (SIMULATED, "-"), "model": (SIMULATED, "-")}


@styled
def error_growth(groups: Mapping[str, Mapping[str, Evaluation]]) -> list[Picture]:
    """Draw the mean absolute error over time since the start of a run; the pictures share their axis of error.

    The line is the mean over runs, the band the middle half of the runs; a dotted line is what one gets
    by assuming that nothing changes at all.

    Parameters
    ----------
    groups : mapping of str to mapping of str to Evaluation
        By title, evaluations with their trajectories by ``before``, ``after`` or ``model``.
    """
    curves = {title: {name: _curve(e) for name, e in models.items()} for title, models in groups.items()}
    rest = {title: _unchanged(next(iter(models.values()))) for title, models in groups.items()}
    top = max(float(np.max(c[3])) for models in curves.values() for c in models.values())
    top = 1.08 * max([top, *(float(np.max(r[1])) for r in rest.values() if np.max(r[1]) < 1.6 * top)])
    pictures = []
    for title, models in curves.items():
        figure = Figure(figsize=(5.6, 3.3))
        axes = figure.subplots()
        axes.plot(*rest[title], color=INK, linestyle=":", linewidth=1.2, label="nothing changes")
        for name, curve in models.items():
            _line(axes, name, curve)
        axes.set_xlim(0, max(c[0][-1] for c in models.values()))
        axes.set_ylim(0, top)
        axes.set(title=title, xlabel="time since the start of the run [h]", ylabel="mean absolute error [K]")
        figure.legend(fontsize=8, loc="outside lower center", ncols=3)
        ends = "; ".join(f"{name} {curve[1][-1]:.2f} K" for name, curve in models.items())
        pictures.append(picture(figure, f"Mean absolute error over the horizon, {title}: at its end {ends}"))
    return pictures


def _line(axes: Axes, name: str, curve: tuple[FloatArray, FloatArray, FloatArray, FloatArray]) -> None:
    colour, dashes = LINES[name]
    hours, mean, low, high = curve
    label = {"before": "before calibration", "after": "after calibration", "model": "model"}[name]
    axes.fill_between(hours, low, high, color=colour, alpha=0.18, linewidth=0)
    axes.plot(hours, mean, color=colour, linestyle=dashes, linewidth=1.8, label=label)


def _curve(evaluation: Evaluation) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Hours, mean, lower and upper quartile over runs of the spatial error, shape (n_kept + 1,)."""
    errors = np.concatenate([np.abs(p.simulated - p.measured) for p in evaluation.predictions])
    return _spread(evaluation, errors)


def _unchanged(evaluation: Evaluation) -> tuple[FloatArray, FloatArray]:
    """Hours and mean error of zones that keep the temperature of their start."""
    errors = np.concatenate([np.abs(p.initial[:, None, :] - p.measured) for p in evaluation.predictions])
    return _spread(evaluation, errors)[:2]


def _spread(evaluation: Evaluation, errors: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    seen = np.isfinite(errors)
    count = seen.sum(axis=2)
    total = np.where(seen, errors, 0.0).sum(axis=2)
    by_run = np.where(count > 0, total / np.maximum(count, 1), np.nan)
    hours = np.concatenate([[0.0], evaluation.predictions[0].steps * evaluation.step_seconds / 3600.0])
    rows = [np.nanmean(by_run, axis=0), *np.nanquantile(by_run, [0.25, 0.75], axis=0)]
    mean, low, high = (np.concatenate([[0.0], row]) for row in rows)
    return hours, mean, low, high
