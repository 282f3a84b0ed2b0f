"""Growth of the error of free runs on logarithmic axes, with the slopes that tell its cause."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter

from mpc.reports.figures.style import INK, MUTED, SIMULATED, Picture, picture, styled
from thermal._types import FloatArray

#: Slopes that are drawn beside the curves [-], with what they are called.
SLOPES = ((0.5, "slope ½"), (1.0, "slope 1"))

#: Marks of the axis of time [s].
_TIMES = {
    300.0: "5 min",
    900.0: "15 min",
    3600.0: "1 h",
    10800.0: "3 h",
    21600.0: "6 h",
    43200.0: "12 h",
    86400.0: "24 h",
}


@styled
def drift_lines(curves: Mapping[str, tuple[FloatArray, FloatArray]]) -> list[Picture]:
    """Draw the root mean square error of free runs over the time since their start.

    Parameters
    ----------
    curves : mapping of str to (ndarray, ndarray)
        Times [s] and errors [K] of each model by what it is called, the calibrated one first.
    """
    figure = Figure(figsize=(5.6, 3.3))
    axes = figure.subplots()
    for (name, (time, error)), colour in zip(curves.items(), (MUTED, SIMULATED), strict=False):
        axes.plot(time, error, color=colour, marker="o", markersize=2.6, linewidth=1.6, label=name)
    time, error = next(iter(curves.values()))
    low = min(float(np.min(e)) for _, e in curves.values())
    high = max(float(np.max(e)) for _, e in curves.values())
    for (slope, name), dashes in zip(SLOPES, ("--", ":"), strict=True):
        axes.plot(
            time, 0.8 * error[0] * (time / time[0]) ** slope, color=INK, linestyle=dashes, linewidth=1.0, label=name
        )
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xlim(0.9 * time[0], 1.1 * time[-1])
    axes.set_ylim(0.7 * low, 1.4 * high)
    shown = {t: name for t, name in _TIMES.items() if time[0] <= t <= time[-1]}
    axes.set_xticks(list(shown), list(shown.values()), minor=False)
    axes.xaxis.set_minor_formatter(NullFormatter())
    ticks = [
        t
        for t in (0.01, 0.02, 0.03, 0.05, 0.1, 0.2, 0.3, 0.5, 1.0, 2.0, 3.0, 5.0, 10.0)
        if 0.7 * low <= t <= 1.4 * high
    ]
    axes.set_yticks(ticks, [f"{t:g}" for t in ticks], minor=False)
    axes.yaxis.set_minor_formatter(NullFormatter())
    axes.set(xlabel="time since the start of the run", ylabel="root mean square error [K]")
    figure.legend(fontsize=8, loc="outside lower center", ncols=4)
    ends = "; ".join(
        f"{name} {e[0]:.2f} K after the first step, {e[-1]:.2f} K at the end" for name, (_, e) in curves.items()
    )
    return [picture(figure, f"Growth of the error of free runs on logarithmic axes: {ends}")]
