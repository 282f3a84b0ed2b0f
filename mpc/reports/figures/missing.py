"""Missing heat of a zone over time with its band, one line a model."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from mpc.reports.figures.style import INK, MUTED, SIMULATED, Picture, day_numbers, picture, styled, time_axis
from mpc.reports.page import watts
from thermal._types import FloatArray

#: Colour and dashes of each model in turn: the parameters at their starts, calibrated, with effects.
LINES = (("#7B3F98", (0, (4, 2))), (MUTED, "-"), (SIMULATED, "-"))

#: Longest stretch that is drawn [days]: beyond it the lines close up.
LONGEST_WEEK = 7


class Course(NamedTuple):
    """Missing heat of one zone over time.

    Parameters
    ----------
    mean, low, high : ndarray, shape (n_time,)
        Estimate and ends of its band [W]; NaN where it is not known.
    """

    mean: FloatArray
    low: FloatArray
    high: FloatArray


@styled
def missing_lines(zones: Mapping[str, Mapping[str, Course]], stamps: pd.DatetimeIndex) -> list[Picture]:
    """Draw the missing heat of zones over time, one picture a zone.

    Parameters
    ----------
    zones : mapping of str to mapping of str to Course
        By zone, the course of each model by what it is called: parameters at their starts first.
    stamps : DatetimeIndex, length n_time
        Beginnings of the averages.
    """
    rows = _worst_week(zones, stamps)
    x = day_numbers(stamps[rows])
    broken = np.flatnonzero(np.diff(x) > 1.5 * np.min(np.diff(x), initial=np.inf)) + 1
    pictures = []
    for zone, models in zones.items():
        figure = Figure(figsize=(5.6, 2.9))
        axes = figure.subplots()
        axes.axhline(0.0, color=INK, linewidth=0.8)
        for (name, course), (colour, dashes) in zip(models.items(), LINES, strict=False):
            mean, low, high = (np.insert(v[rows], broken, np.nan) for v in course)
            along = np.insert(x, broken, x[broken])
            axes.fill_between(along, low, high, color=colour, alpha=0.22, linewidth=0)
            axes.plot(along, mean, color=colour, linestyle=dashes, linewidth=1.3, label=name)
        axes.set_xlim(x[0], x[-1])
        axes.set(title=zone, ylabel="missing heat [W]")
        time_axis(axes, stamps.tz)
        figure.legend(fontsize=8, loc="outside lower center", ncols=3)
        sizes = "; ".join(f"{name} {watts(float(np.sqrt(np.nanmean(c.mean**2))))}" for name, c in models.items())
        pictures.append(picture(figure, f"Missing heat of zone {zone} over time, root mean square: {sizes}"))
    return pictures


def _worst_week(zones: Mapping[str, Mapping[str, Course]], stamps: pd.DatetimeIndex) -> slice:
    """Rows of the days with the most missing heat of the second model, or all there are."""
    days = stamps.normalize()
    courses = [list(models.values())[min(1, len(models) - 1)].mean for models in zones.values()]
    daily = pd.Series(np.nanmean(np.square(courses), axis=0), stamps).groupby(days).mean()
    if len(daily) <= LONGEST_WEEK + 1:
        return slice(0, len(stamps))
    last = int(np.nanargmax(daily.rolling(LONGEST_WEEK).mean().to_numpy()))
    first = daily.index[last - LONGEST_WEEK + 1]
    return slice(int(days.searchsorted(first)), int(days.searchsorted(daily.index[last], side="right")))
