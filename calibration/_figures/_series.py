"""Measured and simulated temperatures of each zone over time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from calibration._evaluate import Evaluation
from calibration._figures._style import (
    CELSIUS,
    MEASURED,
    SIMULATED,
    FloatArray,
    Picture,
    day_numbers,
    picture,
    styled,
    time_axis,
)

#: Panels of a figure: the zones with the largest error.
MOST_PANELS = 12


@dataclass(frozen=True)
class Series:
    """Zone temperatures over time, with a row of NaN where a line breaks.

    Parameters
    ----------
    stamps : DatetimeIndex, length n_time
        Local stamps.
    measured, simulated : ndarray, shape (n_time, n_zone)
        Temperatures [K].
    """

    stamps: pd.DatetimeIndex
    measured: FloatArray
    simulated: FloatArray


def series_of_runs(evaluation: Evaluation) -> Series:
    """Concatenate runs that follow each other without overlap; each starts at the measured temperatures again.

    Parameters
    ----------
    evaluation : Evaluation
        With its trajectories.
    """
    stamps, measured, simulated = [], [], []
    length = pd.Timedelta(seconds=evaluation.steps * evaluation.step_seconds)
    blank = np.full((1, len(evaluation.zones)), np.nan)
    for p in evaluation.predictions:
        after = None
        lags = pd.to_timedelta(np.concatenate([[0], p.steps]) * evaluation.step_seconds, unit="s")
        for k, start in enumerate(p.start):
            if after is not None and start < after:
                continue
            after = start + length
            stamps.append((start + lags).append(pd.DatetimeIndex([after])))
            measured.append(np.vstack([p.initial[k], p.measured[k], blank]))
            simulated.append(np.vstack([p.initial[k], p.simulated[k], blank]))
    joined = stamps[0].append(stamps[1:])
    return Series(pd.DatetimeIndex(joined), np.concatenate(measured), np.concatenate(simulated))


@styled
def zone_panels(series: Series, zones: Sequence[str], errors: dict[str, float]) -> list[Picture]:
    """Draw measured and simulated temperatures, one picture a zone, those with the largest error first.

    Parameters
    ----------
    series : Series
        What to draw.
    zones : sequence of str
        Zone names.
    errors : dict of str to float
        Mean absolute error of each measured zone [K].
    """
    chosen = sorted(errors, key=lambda z: -errors[z])[:MOST_PANELS]
    columns = [list(zones).index(zone) for zone in chosen]
    x = day_numbers(series.stamps)
    both = np.stack([series.measured[:, columns], series.simulated[:, columns]]) - CELSIUS
    span = float(np.nanmax(np.nanmax(both, axis=(0, 1)) - np.nanmin(both, axis=(0, 1))))
    pictures = []
    for i, zone in enumerate(chosen):
        measured, simulated = both[:, :, i]
        figure = Figure(figsize=(4.1, 2.0))
        axes = figure.subplots()
        axes.plot(x, measured, color=MEASURED, linewidth=1.1)
        axes.plot(x, simulated, color=SIMULATED, linewidth=1.1)
        middle = 0.5 * (np.nanmax(both[:, :, i]) + np.nanmin(both[:, :, i]))
        axes.set_ylim(middle - 0.55 * span, middle + 0.55 * span)
        axes.set_xlim(x[0], x[-1])
        axes.set_title(f"{zone}: {errors[zone]:.2f} K", fontsize=9)
        axes.set_ylabel("[°C]", fontsize=8)
        time_axis(axes, series.stamps.tz, ticks=6)
        axes.tick_params(labelsize=7)
        pictures.append(
            picture(
                figure, f"Measured and simulated temperature of zone {zone}, mean absolute error {errors[zone]:.2f} K"
            )
        )
    return pictures
