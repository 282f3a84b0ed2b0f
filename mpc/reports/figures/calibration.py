"""Figures of a calibration: parameters in their ranges, innovations beside white ones, needed beside metered heat."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from scipy.stats import kstwo

from calibration.fit.result import ParameterEstimate
from mpc.reports.figures import style
from mpc.reports.figures.style import Picture, keys_below, lines_over_time, panel, picture, styled
from mpc.reports.page import in_words
from thermal._types import FloatArray
from thermal.effects.catalogue import CATALOGUE
from thermal.effects.unknown import UNKNOWN
from thermal.parameters import PARAMETERS, Parameter

#: More rows than this are not drawn; the table has them all.
MOST_ROWS = 40

#: Probability of white innovations beyond the dashed bounds [-], and the longest lag that is drawn [s].
LEVEL, LONGEST = 0.05, 6 * 3600.0

#: Values that the paper found for parameters that ours correspond to [parameter units]: Goldfeder and Sipple (2023),
#: Table 1. Of walls it has the density beside the heat capacity, of which only the product counts, so ours is theirs at
#: our nominal density. A plan's walls are as thick as drawn in both; those of a table of zones are 1 m thick and
#: have no such density, so that nothing corresponds.
PAPER = {"exterior_convection_coefficient": 800.0, "shuffle_probability": 1.0}
PAPER_WALLS = {  # conductivity [W/m/K], density [kg/m^3], heat capacity [J/kg/K]
    "exterior_wall": (0.01, 2748.0, 2500.0),
    "interior_wall": (780.0, 0.5, 500.0),
}


def paper_values(parameters: Sequence[ParameterEstimate]) -> dict[str, float]:
    """Find what the paper's calibration of its own building gave for each parameter that it has.

    Parameters
    ----------
    parameters : sequence of ParameterEstimate
        With the nominal densities of the walls.

    Returns
    -------
    dict of str to float
        By name [parameter units].
    """
    known = dict(PAPER)
    density = {p.name: p.value for p in parameters if p.name.endswith("_density")}
    for wall, (conductivity, dense, heat) in PAPER_WALLS.items():
        if f"{wall}_density" in density:
            known[f"{wall}_conductivity"] = conductivity
            known[f"{wall}_heat_capacity"] = dense * heat / density[f"{wall}_density"]
    return {p.name: known[base] for p in parameters if (base := p.name.partition("@")[0]) in known}


@styled
def parameter_ranges(parameters: Sequence[ParameterEstimate]) -> list[Picture]:
    """Draw estimated parameters within their ranges, on the scale they are estimated on (logarithmic, or logit).

    Of more than 40, those that the data determine are drawn first.

    Parameters
    ----------
    parameters : sequence of ParameterEstimate
        Those without a standard error are left out.
    """
    shown = [p for p in parameters if p.standard_error is not None]
    if len(shown) > MOST_ROWS:
        shown = sorted(shown, key=lambda p: not p.identifiable)[:MOST_ROWS]
    if not shown:
        return []
    figure, axes = panel(7.4, 1.6 + 0.3 * len(shown))
    paper = paper_values(parameters)
    for row, p in enumerate(shown):
        _row(axes, row, p, paper.get(p.name))
    axes.set_yticks(range(len(shown)), [in_words(p.name) for p in shown], fontsize=8)
    middle = "middle (log scale" + ("; of effects, linear)" if any(_scale(p).scale == "linear" for p in shown) else ")")
    axes.set_xticks([0, 0.25, 0.5, 0.75, 1.0], ["lower bound", "", middle, "", "upper bound"])
    axes.set(xlim=(-0.05, 1.05), ylim=(len(shown) - 0.4, -0.6))
    axes.grid(axis="y", visible=False)
    axes.spines["left"].set_visible(False)
    axes.tick_params(axis="y", length=0)
    kinds = ((style.MEASURED, "determined by the data"), (style.MUTED, "not determined"), (style.WARNING, "on a bound"))
    dot: dict[str, Any] = {"marker": "o", "linewidth": 1.6, "markersize": 5}
    ink: dict[str, Any] = {"color": style.INK, "markerfacecolor": "white", "linewidth": 0}
    marks = [Line2D([], [], color=colour, label=label, **dot) for colour, label in kinds]
    marks.append(Line2D([], [], marker="|", markersize=8, label="start", **ink))
    if any(p.name in paper for p in shown):
        label = "the paper's value (arrow: beyond the range)"
        marks.append(Line2D([], [], marker="D", markersize=5, label=label, **ink))
    keys_below(figure, 3, handles=marks)
    alt = "Estimates with 90 % intervals within the physical ranges; the table below has the numbers"
    return [picture(figure, alt)]


def _row(axes: Axes, row: int, p: ParameterEstimate, paper: float | None) -> None:
    scale = _scale(p)
    low, high = scale.transform(scale.lower), scale.transform(scale.upper)

    def place(value: float) -> float:
        return (scale.transform(value) - low) / (high - low)

    centre = place(p.value)
    ends = [place(end) for end in p.interval90 or ()]
    colour = style.WARNING if p.at_bound else style.MEASURED if p.identifiable else style.MUTED
    axes.plot([0, 1], [row, row], color="#DDE1E6", linewidth=7, solid_capstyle="butt", zorder=1)
    axes.plot(ends, [row] * len(ends), color=colour, linewidth=2.2, solid_capstyle="butt", zorder=3)
    axes.plot([place(p.start)], [row], color=style.INK, marker="|", markersize=9, markeredgewidth=1.2, zorder=2)
    axes.plot([centre], [row], color=colour, marker="o", markersize=6, zorder=4)
    if paper is not None:
        _paper_mark(axes, row, 1.0 if scale.scale == "logit" and paper >= 1.0 else place(paper), paper >= scale.upper)


def _paper_mark(axes: Axes, row: int, at: float, above: bool) -> None:
    """Mark the paper's value, with an arrow at the end that it lies beyond."""
    beyond = above or at < 0.0
    marker = ">" if above else "<" if beyond else "D"
    x = 1.025 if above else -0.025 if beyond else at
    axes.plot(
        [x], [row], color=style.INK, marker=marker, markerfacecolor="white", markersize=5.5, zorder=5, clip_on=False
    )


def _scale(p: ParameterEstimate) -> Parameter:
    """Range and scale of estimation of an estimate; a parameter of one zone has those of its kind."""
    kinds = PARAMETERS | {q.name: q for e in (CATALOGUE | UNKNOWN).values() for q in e.parameters}
    kind = kinds.get(p.name.partition("@")[0])
    if kind is None or p.lower is None or p.upper is None:
        return Parameter(p.name, p.unit, p.start, p.lower or p.value / 2, p.upper or p.value * 2, p.source)
    return replace(kind, start=p.start, lower=p.lower, upper=p.upper)


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
        figure, axes = panel(5.6, 3.3, title=title, xlabel=what)
        for (name, values), colour in zip(series.items(), (style.SIMULATED, style.MEASURED), strict=False):
            draw(axes, values, step, name, colour)
        keys_below(figure, 2)
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
    axes.axhspan(-bound, bound, color=style.MUTED, alpha=0.15, linewidth=0)
    axes.axhline(0.0, color=style.INK, linewidth=0.8)
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
    axes.fill_between(
        [0.0, top], [-bound, 1.0 - bound], [bound, 1.0 + bound], color=style.MUTED, alpha=0.15, linewidth=0
    )
    axes.plot([0.0, top], [0.0, 1.0], color=style.INK, linewidth=0.8)
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


@styled
def heat_lines(stamps: pd.DatetimeIndex, metered: FloatArray, needed: FloatArray) -> list[Picture]:
    """Draw metered and needed heat of a building over time.

    Parameters
    ----------
    stamps : DatetimeIndex, length n_time
        Beginnings of the averages.
    metered, needed : ndarray, shape (n_time,)
        Heat [W]; lines break where it is NaN, and where stamps do.
    """
    known = np.isfinite(metered) & np.isfinite(needed)
    if not known.any():
        return []
    figure, axes = panel(7.4, 2.6, ylabel="heat [kW]")
    lines = [np.where(known, heat / 1000.0, np.nan) for heat in (metered, needed)]
    x, *lines = style.broken(lines_over_time(axes, stamps), *lines)
    axes.plot(x, lines[0], color=style.MEASURED, linewidth=1.2, label="metered")
    axes.plot(x, lines[1], color=style.SIMULATED, linewidth=1.2, label="needed by the model")
    keys_below(figure, 2)
    means = [float(np.nanmean(line)) for line in lines]
    alt = f"Heat of the building by the hour: metered {means[0]:.2f} kW on average, needed {means[1]:.2f} kW"
    return [picture(figure, alt, zoom=True)]
