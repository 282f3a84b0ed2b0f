"""Measured and simulated temperatures of each zone over time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from calibration.evaluation.n_step import Evaluation
from mpc.reports.figures.style import CELSIUS, MEASURED, SIMULATED, Picture, day_numbers, picture, styled, time_axis
from thermal._types import FloatArray

#: Panels of a figure: the zones with the largest error.
MOST_PANELS = 12

#: Ends of the band of a prediction [-], and fewest errors that they are taken from.
TAILS = (0.05, 0.95)
FEWEST = 20


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
    low, high = np.nanquantile(errors, TAILS, axis=0)
    enough = np.isfinite(errors).sum(axis=0) >= FEWEST
    return Band(np.where(enough, low, np.nan), np.where(enough, high, np.nan))


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
    stamps, measured, simulated, low, high = [], [], [], [], []
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
            if band is not None:
                low.append(np.vstack([p.initial[k], p.simulated[k] + band.low, blank]))
                high.append(np.vstack([p.initial[k], p.simulated[k] + band.high, blank]))
    joined = pd.DatetimeIndex(stamps[0].append(stamps[1:]))
    ends = (np.concatenate(low), np.concatenate(high)) if band is not None else (None, None)
    return Series(joined, np.concatenate(measured), np.concatenate(simulated), *ends)


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
    drawn = both
    if series.low is not None and series.high is not None:
        drawn = np.concatenate([both, np.stack([series.low[:, columns], series.high[:, columns]]) - CELSIUS])
    highest, lowest = np.nanmax(drawn, axis=(0, 1)), np.nanmin(drawn, axis=(0, 1))
    span = float(np.nanmax(highest - lowest))
    pictures = []
    for i, zone in enumerate(chosen):
        measured, simulated = both[:, :, i]
        figure = Figure(figsize=(4.1, 2.0))
        axes = figure.subplots()
        if len(drawn) > len(both):
            axes.fill_between(x, drawn[2, :, i], drawn[3, :, i], color=SIMULATED, alpha=0.2, linewidth=0)
        axes.plot(x, measured, color=MEASURED, linewidth=1.1)
        axes.plot(x, simulated, color=SIMULATED, linewidth=1.1)
        middle = 0.5 * (highest[i] + lowest[i])
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
