"""The paper's figure of temperature drift: measured and simulated zones as box plots over the steps of one run."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from calibration.evaluation.n_step import Evaluation, Predictions
from mpc.reports.figures.style import CELSIUS, MEASURED, SIMULATED, Picture, picture, styled
from thermal._types import FloatArray

#: Time between two pairs of boxes [s].
SPACING = 1800.0

_KEYS = [Patch(color=MEASURED, label="measured"), Patch(color=SIMULATED, label="simulated")]

#: Up to this many zones each zone is a dot on its box.
MOST_DOTS = 16


def median_run(evaluation: Evaluation) -> tuple[int, int]:
    """Find the run whose mean absolute error is the median over all runs.

    Parameters
    ----------
    evaluation : Evaluation
        With at least one run.

    Returns
    -------
    tuple of (int, int)
        Position of the interval and of the run in it.
    """
    places = [(i, k) for i, p in enumerate(evaluation.predictions) for k in range(len(p.start))]
    errors = np.concatenate([np.nanmean(np.abs(p.error), axis=1) for p in evaluation.predictions])
    return places[int(np.argsort(errors, kind="stable")[(errors.size - 1) // 2])]


@styled
def drift_boxes(runs: Sequence[tuple[str, Predictions, int]], step: float) -> list[Picture]:
    """Draw the box plots of one run, once a model; the pictures share their axis of temperature.

    Parameters
    ----------
    runs : sequence of (str, Predictions, int)
        Title, predictions with their trajectories, and position of the run.
    step : float
        Time step [s].
    """
    tables = [_run_table(p, k) for _, p, k in runs]
    values = np.concatenate([np.ravel(part) for table in tables for part in table[1:]])
    low, high = np.nanmin(values), np.nanmax(values)
    margin = max(0.1, 0.06 * (high - low))
    pictures = []
    for (title, p, k), (steps, measured, simulated) in zip(runs, tables, strict=True):
        figure = Figure(figsize=(5.6, 3.1))
        axes = figure.subplots()
        shown = _shown_steps(steps, step)
        _boxes(axes, measured[shown], -0.2, MEASURED)
        _boxes(axes, simulated[shown], 0.2, SIMULATED)
        clock = [(p.start[k] + np.timedelta64(round(steps[i] * step), "s")).strftime("%H:%M") for i in shown]
        every = 2 if len(shown) > 9 else 1
        axes.set_xticks(range(0, len(shown), every), clock[::every])
        axes.set_ylim(low - margin, high + margin)
        axes.grid(axis="x", visible=False)
        axes.set(title=title, xlabel=f"local time, run of {p.start[k]:%Y-%m-%d}", ylabel="zone temperature [°C]")
        axes.legend(handles=_KEYS, loc="best", ncols=2, fontsize=8)
        alt = f"Box plots over the zones, measured and simulated, {title}; run from {p.start[k]:%Y-%m-%d %H:%M}"
        pictures.append(picture(figure, alt))
    return pictures


def _run_table(p: Predictions, k: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Tabulate steps from 0, measured and simulated temperatures [degC] of one run, shape (n_kept + 1, n_zone)."""
    steps = np.concatenate([[0], p.steps]).astype(float)
    measured = np.vstack([p.initial[k], p.measured[k]]) - CELSIUS
    simulated = np.vstack([p.initial[k], p.simulated[k]]) - CELSIUS
    return steps, measured, np.where(np.isfinite(p.initial[k]), simulated, np.nan)


def _shown_steps(steps: FloatArray, step: float) -> list[int]:
    """Rows on multiples of the spacing; of long runs at most 13."""
    stride = max(1, round(SPACING / step))
    while (steps[-1] // stride) + 1 > 13:
        stride *= 2
    return [int(i) for i in np.flatnonzero(steps % stride == 0)]


def _boxes(axes: Axes, values: FloatArray, offset: float, colour: str) -> None:
    data = [row[np.isfinite(row)] for row in values]
    keep = [i for i, row in enumerate(data) if row.size]
    boxes = axes.boxplot(
        [data[i] for i in keep], positions=[i + offset for i in keep], widths=0.32, whis=(0, 100), patch_artist=True,
        manage_ticks=False, medianprops={"color": "white", "linewidth": 1.4}, whiskerprops={"color": colour},
        capprops={"color": colour}, boxprops={"facecolor": colour, "edgecolor": colour},
    )  # fmt: skip
    for box in boxes["boxes"]:
        box.set_alpha(0.85)
    if max((row.size for row in data), default=0) <= MOST_DOTS:
        x = np.concatenate([np.full(data[i].size, i + offset) for i in keep])
        y = np.concatenate([data[i] for i in keep])
        axes.add_line(Line2D(x, y, linestyle="none", marker="o", markersize=2.8, color="white", markeredgecolor=colour,
                             markeredgewidth=0.6, zorder=4))  # fmt: skip
