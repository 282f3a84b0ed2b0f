"""Figures of a verification: energy by day with what it would have been, and over the outdoor temperature."""

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from mpc.reports.figures import style
from mpc.reports.figures.style import CELSIUS, MEASURED, MUTED, SIMULATED, WARNING, Picture, picture, styled
from mpc.verification.verify import Saving, Verification

_KILO = 1000.0


@styled
def saving_pictures(saving: Saving) -> list[Picture]:
    """Draw the days of a design: over time, and over the outdoor temperature.

    Parameters
    ----------
    saving : Saving
        By one design.
    """
    days = saving.found.days
    new = days["reporting" if "reporting" in days else "acts"].to_numpy() == 1.0
    figure = Figure(figsize=(10.0, 3.4), layout="constrained")
    axes = figure.subplots()
    axes.set(title=f"Mean power by day, {saving.design}", ylabel="kW")
    stamps = pd.DatetimeIndex(days.index)
    x = style.lines_over_time(axes, stamps)
    lines = style.broken(x, days["baseline"].to_numpy() / _KILO)
    axes.plot(*lines, color=MUTED, linewidth=1.0, label="as the building's own control would have, by the model")
    power = days["power"].to_numpy() / _KILO
    axes.plot(x[~new], power[~new], "o", markersize=4, color=MEASURED, label="own control acts, metered")
    axes.plot(x[new], power[new], "o", markersize=4, color=SIMULATED, label="new control acts, metered")
    axes.set_ylim(bottom=0.0)
    style.keys_below(figure, 3)
    over_time = picture(
        figure, "Power by day with either control, and as the own control would have, over time", zoom=True
    )
    figure = Figure(figsize=(6.0, 3.6), layout="constrained")
    axes = figure.subplots()
    axes.set(title="Mean power by day over the outdoor temperature", xlabel="outdoor temperature [°C]", ylabel="kW")
    warm = days["outdoor"].to_numpy() - CELSIUS
    axes.plot(warm, days["baseline"].to_numpy() / _KILO, "_", color=MUTED, label="model of the own control")
    axes.plot(warm[~new], power[~new], "o", markersize=4, color=MEASURED, label="own control")
    axes.plot(warm[new], power[new], "o", markersize=4, color=SIMULATED, label="new control")
    axes.set_ylim(bottom=0.0)
    style.keys_below(figure, 3)
    return [over_time, picture(figure, "Power by day over the outdoor temperature, with either control")]


@styled
def share_picture(found: Verification) -> Picture:
    """Draw what was expected and what was realised, with intervals.

    Parameters
    ----------
    found : Verification
        Of a building.
    """
    level = found.settings.confidence
    rows = [(s.design, s.share, SIMULATED) for s in found.savings]
    if found.predicted is not None:
        rows.insert(0, ("expected in shadow", found.predicted, MEASURED))
    figure = Figure(figsize=(6.0, 0.9 + 0.45 * len(rows)), layout="constrained")
    axes = figure.subplots()
    for number, (_, share, colour) in enumerate(rows):
        axes.errorbar(
            100.0 * share.value, number, xerr=100.0 * share.half_width(level), fmt="o", color=colour, capsize=4
        )
    axes.axvline(0.0, color=WARNING, linestyle="--", linewidth=0.9)
    axes.set(yticks=np.arange(len(rows)), xlabel=f"share of the energy saved, {100 * level:.0f} % interval [%]")
    axes.set_yticklabels([name for name, _, _ in rows])
    axes.set_ylim(len(rows) - 0.4, -0.6)
    return picture(figure, "Share of the energy saved, expected and realised, with intervals")
