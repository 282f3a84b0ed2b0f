"""Figures of the runs of an evaluation: drift over one run, growth of the error, and the zones over time."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from calibration.evaluation.n_step import Evaluation, Predictions
from mpc.reports.figures import style
from mpc.reports.figures.style import Picture, keys_below, lines_over_time, panel, picture, styled
from thermal._types import FloatArray

#: Time between two pairs of boxes [s].
SPACING = 1800.0

#: Up to this many zones each zone is a dot on its box.
MOST_DOTS = 16

#: Panels of a figure: the zones with the largest error.
MOST_PANELS = 12

#: Ends of the band of a prediction [-], and fewest errors that they are taken from.
TAILS = (0.05, 0.95)
FEWEST = 20

#: Colour, line and name of each model.
LINES = {
    "before": (style.MUTED, "--", "before calibration"),
    "after": (style.SIMULATED, "-", "after calibration"),
    "model": (style.SIMULATED, "-", "model"),
}

_KEYS = [Patch(color=style.MEASURED, label="measured"), Patch(color=style.SIMULATED, label="simulated")]


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
    """Draw the paper's box plots of one run, once a model; the pictures share their axis of temperature.

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
        start, shown = p.start[k], _shown_steps(steps, step)
        figure, axes = panel(
            5.6, 3.1, title=title, xlabel=f"local time, run of {start:%Y-%m-%d}", ylabel="zone temperature [°C]"
        )
        _boxes(axes, measured[shown], -0.2, style.MEASURED)
        _boxes(axes, simulated[shown], 0.2, style.SIMULATED)
        clock = [(start + np.timedelta64(round(steps[i] * step), "s")).strftime("%H:%M") for i in shown]
        every = 2 if len(shown) > 9 else 1
        axes.set_xticks(range(0, len(shown), every), clock[::every])
        axes.set_ylim(low - margin, high + margin)
        axes.grid(axis="x", visible=False)
        axes.legend(handles=_KEYS, loc="best", ncols=2, fontsize=8)
        alt = f"Box plots over the zones, measured and simulated, {title}; run from {start:%Y-%m-%d %H:%M}"
        pictures.append(picture(figure, alt))
    return pictures


def _run_table(p: Predictions, k: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Tabulate steps from 0, measured and simulated temperatures [degC] of one run, shape (n_kept + 1, n_zone)."""
    steps = np.concatenate([[0], p.steps]).astype(float)
    measured, simulated = (np.vstack([p.initial[k], values[k]]) - style.CELSIUS for values in (p.measured, p.simulated))
    return steps, measured, np.where(np.isfinite(p.initial[k]), simulated, np.nan)


def _shown_steps(steps: FloatArray, step: float) -> list[int]:
    """Rows on multiples of the spacing; of long runs at most 13."""
    stride = max(1, round(SPACING / step))
    while (steps[-1] // stride) + 1 > 13:
        stride *= 2
    return [int(i) for i in np.flatnonzero(steps % stride == 0)]


def _boxes(axes: Axes, values: FloatArray, offset: float, colour: str) -> None:
    data = {i + offset: known for i, row in enumerate(values) if (known := row[np.isfinite(row)]).size}
    boxes = axes.boxplot(
        list(data.values()), positions=list(data), widths=0.32, whis=(0, 100), patch_artist=True, manage_ticks=False,
        medianprops={"color": "white", "linewidth": 1.4}, whiskerprops={"color": colour},
        capprops={"color": colour}, boxprops={"facecolor": colour, "edgecolor": colour},
    )  # fmt: skip
    for box in boxes["boxes"]:
        box.set_alpha(0.85)
    if max((row.size for row in data.values()), default=0) <= MOST_DOTS:
        x = np.concatenate([np.full(row.size, at) for at, row in data.items()])
        axes.add_line(Line2D(x, np.concatenate(list(data.values())), linestyle="none", marker="o", markersize=2.8,
                             color="white", markeredgecolor=colour, markeredgewidth=0.6, zorder=4))  # fmt: skip


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
    curves = {title: {name: _spread(e) for name, e in models.items()} for title, models in groups.items()}
    rest = {title: _spread(next(iter(models.values())), unchanged=True)[:2] for title, models in groups.items()}
    top = max(float(np.max(c[3])) for models in curves.values() for c in models.values())
    top = 1.08 * max([top, *(float(np.max(r[1])) for r in rest.values() if np.max(r[1]) < 1.6 * top)])
    pictures = []
    for title, models in curves.items():
        figure, axes = panel(
            5.6, 3.3, title=title, xlabel="time since the start of the run [h]", ylabel="mean absolute error [K]"
        )
        axes.plot(*rest[title], color=style.INK, linestyle=":", linewidth=1.2, label="nothing changes")
        for name, (hours, mean, low, high) in models.items():
            colour, dashes, label = LINES[name]
            axes.fill_between(hours, low, high, color=colour, alpha=0.18, linewidth=0)
            axes.plot(hours, mean, color=colour, linestyle=dashes, linewidth=1.8, label=label)
        axes.set(xlim=(0, max(c[0][-1] for c in models.values())), ylim=(0, top))
        keys_below(figure, 3)
        ends = "; ".join(f"{name} {curve[1][-1]:.2f} K" for name, curve in models.items())
        pictures.append(picture(figure, f"Mean absolute error over the horizon, {title}: at its end {ends}"))
    return pictures


def _spread(evaluation: Evaluation, unchanged: bool = False) -> list[FloatArray]:
    """Hours, mean, lower and upper quartile over runs of the spatial error, shape (n_kept + 1,).

    Of the model, or of zones that keep the temperature of their start.
    """
    errors = (np.abs((p.initial[:, None] if unchanged else p.simulated) - p.measured) for p in evaluation.predictions)
    by_run = np.nanmean(np.concatenate(list(errors)), axis=2)
    hours = evaluation.predictions[0].steps * evaluation.step_seconds / 3600.0
    rows = (hours, np.nanmean(by_run, axis=0), *np.nanquantile(by_run, [0.25, 0.75], axis=0))
    return [np.concatenate([[0.0], row]) for row in rows]


@dataclass(frozen=True)
class Band:
    """Where measurements lie about a prediction, 90 % of them on the runs it was made from.

    Parameters
    ----------
    low, high : ndarray, shape (n_kept, n_zone)
        Ends, measured minus simulated, by step of the run and zone [K]; NaN where too little was measured.
    """

    low: FloatArray
    high: FloatArray

    def coverage(self, evaluation: Evaluation) -> float:
        """Share of the measurements of other runs inside the band [-]; NaN where none can be.

        Parameters
        ----------
        evaluation : Evaluation
            Runs of the same length, with their trajectories.
        """
        errors = np.concatenate([p.measured - p.simulated for p in evaluation.predictions])
        known = np.isfinite(errors) & np.isfinite(self.low)
        inside = (errors >= self.low) & (errors <= self.high)
        return float(inside[known].mean()) if known.any() else float("nan")


@styled
def error_band(evaluation: Evaluation) -> Band:
    """Take the band of a prediction from the errors of earlier runs, zone by zone and step by step.

    Parameters
    ----------
    evaluation : Evaluation
        Of the tuning runs, with their trajectories.
    """
    errors = np.concatenate([p.measured - p.simulated for p in evaluation.predictions])
    enough = np.isfinite(errors).sum(axis=0) >= FEWEST
    return Band(*(np.where(enough, end, np.nan) for end in np.nanquantile(errors, TAILS, axis=0)))


@dataclass(frozen=True)
class Series:
    """Zone temperatures over time, with a row of NaN where a line breaks.

    Parameters
    ----------
    stamps : DatetimeIndex, length n_time
        Local stamps.
    measured, simulated : ndarray, shape (n_time, n_zone)
        Temperatures [K].
    low, high : ndarray, shape (n_time, n_zone), or None
        Ends of the band of the prediction [K].
    """

    stamps: pd.DatetimeIndex
    measured: FloatArray
    simulated: FloatArray
    low: FloatArray | None = None
    high: FloatArray | None = None


def series_of_runs(evaluation: Evaluation, band: Band | None = None) -> Series:
    """Concatenate runs that follow each other without overlap; each starts at the measured temperatures again.

    Parameters
    ----------
    evaluation : Evaluation
        With its trajectories.
    band : Band, optional
        About the predictions, of the same steps.
    """
    stamps, parts = [], []
    length = pd.Timedelta(seconds=evaluation.steps * evaluation.step_seconds)
    blank = np.full((1, len(evaluation.zones)), np.nan)
    for p in evaluation.predictions:
        after = None
        lags = pd.to_timedelta(np.concatenate([[0], p.steps]) * evaluation.step_seconds, unit="s")
        for start, initial, measured, simulated in zip(p.start, p.initial, p.measured, p.simulated, strict=True):
            if after is not None and start < after:
                continue
            after = start + length
            stamps.append((start + lags).append(pd.DatetimeIndex([after])))
            ends = [] if band is None else [simulated + band.low, simulated + band.high]
            parts.append([np.vstack([initial, course, blank]) for course in (measured, simulated, *ends)])
    joined = pd.DatetimeIndex(stamps[0].append(stamps[1:]))
    return Series(joined, *(np.concatenate(courses) for courses in zip(*parts, strict=True)))


@styled
def zone_panels(series: Series, zones: Sequence[str], errors: Mapping[str, float]) -> list[Picture]:
    """Draw measured and simulated temperatures, one picture a zone, those with the largest error first.

    Parameters
    ----------
    series : Series
        What to draw.
    zones : sequence of str
        Zone names.
    errors : mapping of str to float
        Mean absolute error of each measured zone [K].
    """
    chosen = sorted(errors, key=lambda z: -errors[z])[:MOST_PANELS]
    columns = [list(zones).index(zone) for zone in chosen]
    courses = [v for v in (series.measured, series.simulated, series.low, series.high) if v is not None]
    drawn = np.stack(courses)[:, :, columns] - style.CELSIUS
    highest, lowest = np.nanmax(drawn, axis=(0, 1)), np.nanmin(drawn, axis=(0, 1))
    span, middle = float(np.nanmax(highest - lowest)), 0.5 * (highest + lowest)
    pictures = []
    for i, zone in enumerate(chosen):
        figure, axes = panel(4.1, 2.0)
        x = lines_over_time(axes, series.stamps, ticks=6)
        measured, simulated, *ends = drawn[:, :, i]
        if ends:
            axes.fill_between(x, *ends, color=style.SIMULATED, alpha=0.2, linewidth=0)
        axes.plot(x, measured, color=style.MEASURED, linewidth=1.1)
        axes.plot(x, simulated, color=style.SIMULATED, linewidth=1.1)
        axes.set_ylim(middle[i] - 0.55 * span, middle[i] + 0.55 * span)
        axes.set_title(f"{zone}: {errors[zone]:.2f} K", fontsize=9)
        axes.set_ylabel("[°C]", fontsize=8)
        axes.tick_params(labelsize=7)
        alt = f"Measured and simulated temperature of zone {zone}, mean absolute error {errors[zone]:.2f} K"
        pictures.append(picture(figure, alt, zoom=True))
    return pictures
