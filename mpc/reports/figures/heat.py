"""Heat that the model needs to follow the measured temperatures, beside the metered heat."""

from __future__ import annotations

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from mpc.reports.figures.style import MEASURED, SIMULATED, Picture, day_numbers, picture, styled, time_axis
from thermal._types import FloatArray


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
    x, lines = day_numbers(stamps), np.stack([metered, needed]) / 1000.0
    lines[:, ~known] = np.nan
    broken = np.flatnonzero(np.diff(x) > 1.5 * np.min(np.diff(x), initial=np.inf)) + 1
    x, lines = np.insert(x, broken, x[broken]), np.insert(lines, broken, np.nan, axis=1)
    figure = Figure(figsize=(7.4, 2.6))
    axes = figure.subplots()
    for line, colour, label in ((lines[0], MEASURED, "metered"), (lines[1], SIMULATED, "needed by the model")):
        axes.plot(x, line, color=colour, linewidth=1.2, label=label)
    axes.set_xlim(x[0], x[-1])
    axes.set_ylabel("heat [kW]")
    time_axis(axes, stamps.tz)
    figure.legend(fontsize=8, loc="outside lower center", ncols=2)
    means = [float(np.nanmean(line)) for line in lines]
    alt = f"Heat of the building by the hour: metered {means[0]:.2f} kW on average, needed {means[1]:.2f} kW"
    return [picture(figure, alt)]
