"""Figures of a diagnosis: missing heat on the plan, error by hour, and zones before and after."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
from matplotlib import colormaps
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from mpc.reports.figures.plan import UNMEASURED, WALLS, canvas
from mpc.reports.figures.series import Series
from mpc.reports.figures.style import (
    CELSIUS,
    INK,
    MEASURED,
    MUTED,
    SIMULATED,
    Picture,
    day_numbers,
    picture,
    styled,
    time_axis,
)
from mpc.reports.page import watts
from thermal._types import FloatArray
from thermal.case.building import FloorPlans

#: White is none, dark red most; it reads in grey too.
HEAT_COLOURS = colormaps["OrRd"]

#: Zones that are drawn before and after.
MOST_CHANGED = 6

#: Longest stretch that is drawn [days]: beyond it the curves close up.
LONGEST_STRETCH = 4


@styled
def heat_maps(
    plans: FloorPlans, orientation: float, zones: Sequence[str], heat: FloatArray, title: str, top: float
) -> list[Picture]:
    """Draw the size of each zone's missing heat on the plan of each floor.

    Parameters
    ----------
    plans : FloorPlans
        The floors.
    orientation : float
        Clockwise from true north to the plan's up [deg].
    zones : sequence of str
        Zone names.
    heat : ndarray, shape (n_zone,)
        Root mean square of the missing heat [W]; NaN where not known.
    title : str
        Follows the floor's name.
    top : float
        Upper end of the colour scale [W].
    """
    by_zone = dict(zip(zones, heat.tolist(), strict=True))
    colour = {zone: _heat_colour(size, top) for zone, size in by_zone.items()}
    drawn = []
    for floor in plans.floors:
        image = np.array([[WALLS.get(str(t)) or colour[str(t)] for t in row] for row in floor.tokens])
        labels = {z: (f"{z}\n{watts(by_zone[z])}", colour[z]) for z in floor.zone_names}
        figure, axes = canvas(floor, plans.cell_size, orientation, image, f"floor {floor.name}, {title}", labels)
        shades = ScalarMappable(Normalize(0.0, top), HEAT_COLOURS)
        bar = figure.colorbar(shades, ax=axes, orientation="horizontal", aspect=40, shrink=0.8, pad=0.02)
        bar.set_label("missing heat, root mean square [W]", fontsize=8)
        bar.ax.tick_params(labelsize=8)
        listed = "; ".join(f"{z} {watts(by_zone[z])}" for z in floor.zone_names)
        drawn.append(picture(figure, f"Missing heat on floor {floor.name}, {title}: {listed}"))
    return drawn


@styled
def hour_bars(shares: FloatArray) -> list[Picture]:
    """Draw the share of the squared error by hour of the day.

    Parameters
    ----------
    shares : ndarray, shape (24,)
        By hour of the prediction's target, in local time [-].
    """
    figure = Figure(figsize=(5.6, 2.3))
    axes = figure.subplots()
    axes.bar(np.arange(24) + 0.5, 100.0 * shares, width=0.86, color=SIMULATED)
    axes.axhline(100.0 / 24.0, color=INK, linestyle=":", linewidth=1.2, label="if spread evenly")
    axes.set_xlim(0, 24)
    axes.set_xticks(range(0, 25, 3))
    axes.set(xlabel="local time [h]", ylabel="share [%]")
    axes.grid(axis="x", visible=False)
    axes.legend(fontsize=8, loc="best")
    worst = int(np.argmax(shares))
    alt = f"Share of the squared error by hour of the day; most, {shares[worst]:.0%}, from {worst} to {worst + 1} h"
    return [picture(figure, alt)]


@styled
def change_panels(
    models: Mapping[str, Series], zones: Sequence[str], errors: Sequence[Mapping[str, float]]
) -> list[Picture]:
    """Draw measured temperatures and those of one or two models, one picture a zone, the worst first.

    Parameters
    ----------
    models : mapping of str to Series
        Runs of each model by what it is called; zones are chosen by the first.
    zones : sequence of str
        Zone names.
    errors : sequence of mapping of str to float
        Mean absolute error of each measured zone, of each model [K].
    """
    chosen = sorted(errors[0], key=lambda z: -errors[0][z])[:MOST_CHANGED]
    before = next(iter(models.values()))
    first, last = _stretch(before)
    pictures = []
    for zone in chosen:
        column = list(zones).index(zone)
        figure = Figure(figsize=(5.6, 2.7))
        axes = figure.subplots()
        for (name, s), colour in zip(models.items(), (MUTED, SIMULATED), strict=False):
            rows = (s.stamps >= first) & (s.stamps <= last)
            axes.plot(day_numbers(s.stamps[rows]), s.simulated[rows, column] - CELSIUS, color=colour, label=name)
        rows = (before.stamps >= first) & (before.stamps <= last)
        x = day_numbers(before.stamps[rows])
        axes.plot(x, before.measured[rows, column] - CELSIUS, color=MEASURED, linewidth=1.1, label="measured")
        axes.set_xlim(x[0], x[-1])
        told = " → ".join(f"{e[zone]:.2f}" for e in errors if zone in e)
        axes.set(title=f"{zone}: {told} K", ylabel="temperature [°C]")
        time_axis(axes, before.stamps.tz, ticks=6)
        figure.legend(fontsize=8, loc="outside lower center", ncols=3)
        pictures.append(picture(figure, f"Zone {zone}, measured and predicted; mean absolute error {told} K"))
    return pictures


def _stretch(series: Series) -> tuple[pd.Timestamp, pd.Timestamp]:
    """Begin and end of the days with the largest error, or all there are."""
    squared = np.nanmean((series.simulated - series.measured) ** 2, axis=1)
    daily = pd.Series(squared, series.stamps).groupby(series.stamps.normalize()).mean()
    if len(daily) <= LONGEST_STRETCH:
        return series.stamps[0], series.stamps[-1]
    worst = daily.rolling(LONGEST_STRETCH).mean().to_numpy()
    end = int(np.nanargmax(worst)) if np.isfinite(worst).any() else LONGEST_STRETCH - 1
    return daily.index[end - LONGEST_STRETCH + 1], daily.index[end] + pd.DateOffset(days=1)


def _heat_colour(size: float, top: float) -> tuple[float, float, float]:
    if not np.isfinite(size):
        return UNMEASURED
    red, green, blue, _ = HEAT_COLOURS(min(1.0, size / top))
    return red, green, blue
