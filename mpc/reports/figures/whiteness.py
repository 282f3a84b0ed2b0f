"""Autocorrelation and cumulated periodogram of one-step innovations, beside what white ones would do."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.stats import kstwo

from mpc.reports.figures.style import INK, MEASURED, MUTED, SIMULATED, Picture, picture, styled
from thermal._types import FloatArray

#: Probability of white innovations beyond the dashed bounds [-].
LEVEL = 0.05

#: Longest lag that is drawn [s].
LONGEST = 6 * 3600.0

_COLOURS = (SIMULATED, MEASURED)


@styled
def whiteness_panels(series: Mapping[str, FloatArray], step: float) -> list[Picture]:
    """Draw both tests for a few zones, one picture a test.

    Parameters
    ----------
    series : mapping of str to ndarray, shape (n_time,)
        Innovations over their deviations by what a zone is called in the legend [-]; NaN where not measured.
    step : float
        Length of a step [s].
    """
    pictures = []
    for title, draw, what in (
        ("autocorrelation", _correlation, "time between two innovations [h]"),
        ("cumulated periodogram", _periodogram, "frequency [1/h]"),
    ):
        figure = Figure(figsize=(5.6, 3.3))
        axes = figure.subplots()
        for (name, values), colour in zip(series.items(), _COLOURS, strict=False):
            draw(axes, values, step, name, colour)
        axes.set(title=title, xlabel=what)
        figure.legend(fontsize=8, loc="outside lower center", ncols=2)
        pictures.append(picture(figure, f"{title.capitalize()} of the innovations of {' and '.join(series)}"))
    return pictures


def _correlation(axes: Axes, values: FloatArray, step: float, name: str, colour: str) -> None:
    """Draw autocorrelations at lags from one step on, and the bounds of white innovations."""
    there = np.isfinite(values)
    filled = np.where(there, values - np.nanmean(values), 0.0)
    lags = np.arange(1, max(2, min(round(LONGEST / step), there.size // 4)) + 1)
    pairs = np.array([np.sum(there[lag:] & there[:-lag]) for lag in lags])
    products = np.array([filled[lag:] @ filled[:-lag] for lag in lags])
    correlation = products / np.maximum(pairs, 1) / np.mean(filled[there] ** 2)
    bound = 1.96 / np.sqrt(there.sum())
    axes.axhspan(-bound, bound, color=MUTED, alpha=0.15, linewidth=0)
    axes.axhline(0.0, color=INK, linewidth=0.8)
    axes.plot(lags * step / 3600.0, correlation, color=colour, marker=".", markersize=4, linewidth=1.1, label=name)
    axes.set_xlim(0.0, lags[-1] * step / 3600.0)


def _periodogram(axes: Axes, values: FloatArray, step: float, name: str, colour: str) -> None:
    """Draw the share of the variance below each frequency, and the bounds of white innovations about the diagonal."""
    filled = np.nan_to_num(values - np.nanmean(values))
    power = np.abs(np.fft.rfft(filled)[1 : (filled.size - 1) // 2 + 1]) ** 2
    share = np.cumsum(power) / power.sum()
    place = np.arange(1, share.size + 1) / share.size
    top = 1800.0 / step  # the fastest that steps can show [1/h]
    bound = periodogram_bound(filled.size)
    axes.fill_between([0.0, top], [-bound, 1.0 - bound], [bound, 1.0 + bound], color=MUTED, alpha=0.15, linewidth=0)
    axes.plot([0.0, top], [0.0, 1.0], color=INK, linewidth=0.8)
    axes.plot(place * top, share, color=colour, linewidth=1.4, label=name)
    axes.set(xlim=(0.0, top), ylim=(0.0, 1.02), ylabel="share of the variance")


def periodogram_bound(count: int) -> float:
    """Distance from the diagonal that the cumulated periodogram of white innovations exceeds once in twenty [-].

    Parameters
    ----------
    count : int
        Number of steps.
    """
    return float(kstwo.isf(LEVEL, max(1, (count - 1) // 2 - 1)))
