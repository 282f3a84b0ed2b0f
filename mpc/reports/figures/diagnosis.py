"""Figures of a diagnosis: error by hour and its growth, missing heat over time, and zones before and after."""

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
from matplotlib.ticker import NullFormatter

from mpc.reports.figures import style
from mpc.reports.figures.errors import Series
from mpc.reports.figures.style import Picture, keys_below, lines_over_time, panel, picture, styled
from mpc.reports.page import percent, watts
from thermal._types import FloatArray

#: Zones that are drawn before and after.
MOST_CHANGED = 6

#: Longest times that are drawn of runs, and of missing heat [days]: beyond them the curves close up.
LONGEST_RUNS, LONGEST_HEAT = 4, 7

#: Colour and dashes of the missing heat of each model in turn: parameters at their starts, calibrated, with effects.
LINES = (("#7B3F98", (0, (4, 2))), (style.MUTED, "-"), (style.SIMULATED, "-"))

#: Slopes that are drawn beside the growth of the error [-], with what they are called and their dashes.
SLOPES = ((0.5, "slope ½", "--"), (1.0, "slope 1", ":"))

#: Marks of the axis of time [s], and of that of errors [K].
_TIMES = {300.0: "5 min", 900.0: "15 min", 3600.0: "1 h", 10800.0: "3 h", 21600.0: "6 h", 43200.0: "12 h",
          86400.0: "24 h"}  # fmt: skip
_ERRORS = (0.01, 0.02, 0.03, 0.05, 0.1, 0.2, 0.3, 0.5, 1.0, 2.0, 3.0, 5.0, 10.0)


@styled
def hour_bars(shares: FloatArray) -> list[Picture]:
    """Draw the share of the squared error by hour of the day.

    Parameters
    ----------
    shares : ndarray, shape (24,)
        By hour of the prediction's target, in local time [-].
    """
    figure, axes = panel(5.6, 2.3, xlabel="local time [h]", ylabel="share [%]")
    axes.bar(np.arange(24) + 0.5, 100.0 * shares, width=0.86, color=style.SIMULATED)
    axes.axhline(100.0 / 24.0, color=style.INK, linestyle=":", linewidth=1.2, label="if spread evenly")
    axes.set_xlim(0, 24)
    axes.set_xticks(range(0, 25, 3))
    axes.grid(axis="x", visible=False)
    axes.legend(fontsize=8, loc="best")
    worst = int(np.argmax(shares))
    alt = f"Share of the squared error by hour; most, {percent(shares[worst])}, from {worst} to {worst + 1} h"
    return [picture(figure, alt)]


@styled
def change_panels(
    models: Mapping[str, Series], zones: Sequence[str], errors: Sequence[Mapping[str, float]]
) -> list[Picture]:
    """Draw measured temperatures and those of one or two models, one picture a zone, the worst first.

    Parameters
    ----------
    models : mapping of str to Series
        The same runs of each model by what it is called; zones are chosen by the first.
    zones : sequence of str
        Zone names.
    errors : sequence of mapping of str to float
        Mean absolute error of each measured zone, of each model [K].
    """
    before = next(iter(models.values()))
    squared = np.nanmean((before.simulated - before.measured) ** 2, axis=1)
    rows = _worst_days(squared, before.stamps, LONGEST_RUNS)
    pictures = []
    for zone in sorted(errors[0], key=lambda z: -errors[0][z])[:MOST_CHANGED]:
        column = list(zones).index(zone)
        told = " → ".join(f"{e[zone]:.2f}" for e in errors if zone in e)
        figure, axes = panel(5.6, 2.7, title=f"{zone}: {told} K", ylabel="temperature [°C]")
        x = lines_over_time(axes, before.stamps[rows], ticks=6)
        for (name, s), colour in zip(models.items(), (style.MUTED, style.SIMULATED), strict=False):
            axes.plot(x, s.simulated[rows, column] - style.CELSIUS, color=colour, label=name)
        axes.plot(
            x, before.measured[rows, column] - style.CELSIUS, color=style.MEASURED, linewidth=1.1, label="measured"
        )
        keys_below(figure, 3)
        alt = f"Zone {zone}, measured and predicted; mean absolute error {told} K"
        pictures.append(picture(figure, alt, zoom=True))
    return pictures


@styled
def missing_lines(
    zones: Sequence[str], models: Mapping[str, tuple[pd.DataFrame, pd.DataFrame, pd.DataFrame]]
) -> list[Picture]:
    """Draw the missing heat of zones over time, one picture a zone.

    Parameters
    ----------
    zones : sequence of str
        To draw.
    models : mapping of str to tuple of DataFrame, shape (n_time, n_zone)
        Heat and the ends of its band by what each model is called, parameters at their starts first [W]; by the
        beginnings of the averages, NaN where it is not known.
    """
    (first, *_), *others = models.values()
    squared = np.nanmean((others[0][0] if others else first)[zones].to_numpy() ** 2, axis=1)
    rows = _worst_days(squared, pd.DatetimeIndex(first.index), LONGEST_HEAT)
    pictures = []
    for zone in zones:
        figure, axes = panel(5.6, 2.9, title=zone, ylabel="missing heat [W]")
        axes.axhline(0.0, color=style.INK, linewidth=0.8)
        x = lines_over_time(axes, pd.DatetimeIndex(first.index[rows]))
        for (name, tables), (colour, dashes) in zip(models.items(), LINES, strict=False):
            along, heat, low, high = style.broken(x, *(table[zone].to_numpy()[rows] for table in tables))
            axes.fill_between(along, low, high, color=colour, alpha=0.22, linewidth=0)
            axes.plot(along, heat, color=colour, linestyle=dashes, linewidth=1.3, label=name)
        keys_below(figure, 3)
        sizes = "; ".join(f"{name} {watts(float(np.sqrt((t[0][zone] ** 2).mean())))}" for name, t in models.items())
        pictures.append(picture(figure, f"Missing heat of zone {zone} over time, root mean square: {sizes}", zoom=True))
    return pictures


def _worst_days(squared: FloatArray, stamps: pd.DatetimeIndex, longest: int) -> slice:
    """Rows of so many days with the largest mean square; all there are where that leaves out one at most."""
    days = stamps.normalize()
    daily = pd.Series(squared, stamps).groupby(days).mean()
    if len(daily) <= longest + 1:
        return slice(0, len(stamps))
    worst = daily.rolling(longest).mean().to_numpy()
    last = int(np.nanargmax(worst)) if np.isfinite(worst).any() else longest - 1
    first, end = daily.index[last - longest + 1], daily.index[last]
    return slice(int(days.searchsorted(first)), int(days.searchsorted(end, side="right")))


@styled
def drift_lines(curves: Mapping[str, tuple[FloatArray, FloatArray]]) -> list[Picture]:
    """Draw the root mean square error of free runs over the time since their start, with slopes that tell its cause.

    Parameters
    ----------
    curves : mapping of str to (ndarray, ndarray)
        Times [s] and errors [K] of each model by what it is called, the calibrated one first.
    """
    figure, axes = panel(5.6, 3.3, xlabel="time since the start of the run", ylabel="root mean square error [K]")
    for (name, (time, error)), colour in zip(curves.items(), (style.MUTED, style.SIMULATED), strict=False):
        axes.plot(time, error, color=colour, marker="o", markersize=2.6, linewidth=1.6, label=name)
    time, error = next(iter(curves.values()))
    for slope, name, dashes in SLOPES:
        line = 0.8 * error[0] * (time / time[0]) ** slope
        axes.plot(time, line, color=style.INK, linestyle=dashes, linewidth=1.0, label=name)
    errors = np.concatenate([e for _, e in curves.values()])
    low, high = 0.7 * float(errors.min()), 1.4 * float(errors.max())
    axes.set(xscale="log", yscale="log", xlim=(0.9 * time[0], 1.1 * time[-1]), ylim=(low, high))
    times = [t for t in _TIMES if time[0] <= t <= time[-1]]
    axes.set_xticks(times, [_TIMES[t] for t in times], minor=False)
    ticks = [t for t in _ERRORS if low <= t <= high]
    axes.set_yticks(ticks, [f"{t:g}" for t in ticks], minor=False)
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_minor_formatter(NullFormatter())
    keys_below(figure, 4)
    ends = "; ".join(
        f"{name} {e[0]:.2f} K after the first step, {e[-1]:.2f} K at the end" for name, (_, e) in curves.items()
    )
    return [picture(figure, f"Growth of the error of free runs on logarithmic axes: {ends}")]
