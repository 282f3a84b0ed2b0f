"""Time line of a monitoring: changes, evidence, errors."""

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from calibration.monitoring.monitor import Monitoring
from mpc.reports.diagnosis_words import called
from mpc.reports.figures import style
from mpc.reports.figures.style import MEASURED, MUTED, SIMULATED, WARNING, Picture, keys_below, picture, styled
from thermal._types import FloatArray


@styled
def time_line(found: Monitoring) -> list[Picture]:
    """Draw changes with their beginnings and ends, the evidence by day with its threshold, and the errors by week.

    Parameters
    ----------
    found : Monitoring
        From `monitor`.
    """
    events, daily, weekly = found.events, found.daily(), found.weekly()
    figure = Figure(figsize=(10.0, 3.8 + (0.8 + 0.3 * len(events) if events else 0.0)), layout="constrained")
    heights = [*([0.5 + 0.3 * len(events)] if events else []), 1.5, 1.5]
    *bars, evidence, error = figure.subplots(len(heights), 1, sharex=True, gridspec_kw={"height_ratios": heights})
    x = style.lines_over_time(error, found.days.dates, ticks=13)
    for axes in bars:
        _changes(axes, found, x)
    first, beside = (bars[0], -0.5) if bars else (evidence, 2.6 * found.course.threshold)
    first.axvspan(x[0], x[min(found.settings.reference_days, len(x) - 1)], color=MUTED, alpha=0.2)
    first.text(x[0], beside, " reference days", va="center", fontsize=8)
    evidence.plot(x, np.maximum(daily["log_evidence"].to_numpy(), -5.0), color=MEASURED, linewidth=0.9)
    evidence.axhline(found.course.threshold, color=WARNING, linestyle="--", linewidth=0.9)
    evidence.set(title="Evidence that something has changed, dashed: alarm", ylabel="log evidence [-]")
    evidence.set_ylim(-6.0, 3.0 * found.course.threshold)
    weekly = pd.concat([weekly, weekly.iloc[-1:]])  # the last week goes on until the telemetry ends
    weeks = np.append(style.day_numbers(weekly.index[:-1]), x[-1])  # type: ignore[arg-type]
    error.step(weeks, weekly["mae"], where="post", color=MUTED, label="model of the reference days")
    error.step(weeks, weekly["mae_carried"], where="post", color=MEASURED, label="carried on, a day ahead")
    error.set(title="Mean absolute error by week", ylabel="[K]")
    error.set_ylim(bottom=0.0)
    keys_below(figure, 2)
    return [picture(figure, "Changes, evidence by day and errors by week, over time", zoom=True)]


def _changes(bars: Axes, found: Monitoring, x: FloatArray) -> None:
    """Draw changes as bars from their beginning to their end."""
    for row, e in enumerate(found.events):
        begin, end = x[min(e.since, len(x) - 1)], x[-1] if e.end is None else x[min(e.end, len(x) - 1)]
        bars.barh(row, end - begin, left=begin, height=0.6, color=WARNING if e.end is None else SIMULATED)
        bars.plot(x[min(e.alarm, len(x) - 1)], row, "k|", markersize=10)
        words = f"{called(e.effect, e.zones)} "
        late = begin > x[0] + 0.5 * (x[-1] - x[0])
        bars.text(begin if late else end, row, words if late else f" {words}", va="center", fontsize=8,
                  ha="right" if late else "left", clip_on=not late and e.end is not None)  # fmt: skip
        if not late and e.end is None:  # a bar to the end has no room behind it
            bars.texts[-1].set(x=begin, ha="right", text=words)
    bars.set(title="What has changed; a stroke is the day on which it was noticed", yticks=[])
    bars.set_ylim(len(found.events) - 0.4, -1.0)
