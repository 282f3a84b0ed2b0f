"""Time line of a monitoring: changes, evidence, errors."""

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from calibration.monitoring.course import AT_ONCE
from calibration.monitoring.monitor import Monitoring
from mpc.reports.diagnosis_words import called
from mpc.reports.figures import style
from mpc.reports.figures.style import INK, MEASURED, MUTED, SIMULATED, WARNING, Picture, keys_below, picture, styled
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
    figure = Figure(figsize=(10.0, 3.8 + (0.8 + 0.45 * len(events) if events else 0.0)), layout="constrained")
    heights = [*([0.5 + 0.45 * len(events)] if events else []), 1.5, 1.5]
    *bars, evidence, error = figure.subplots(len(heights), 1, sharex=True, gridspec_kw={"height_ratios": heights})
    x = style.lines_over_time(error, found.days.dates, ticks=13)
    for axes in bars:
        _changes(axes, found, x)
    evidence.plot(x, np.maximum(daily["log_evidence"].to_numpy(), -5.0), color=MEASURED, linewidth=0.9)
    for level, line in ((found.course.threshold, "--"), (AT_ONCE * found.course.threshold, ":")):
        evidence.plot(x[[0, -1]], np.full(2, level), color=WARNING, linestyle=line, linewidth=0.9)
    evidence.set_ylim(-6.0, 3.0 * found.course.threshold)
    first, beside = (bars[0], -0.95) if bars else (evidence, 2.6 * found.course.threshold)
    sound = x[[0, min(found.settings.reference_days, len(x) - 1)]]
    first.fill_between(sound, *first.get_ylim(), color=MUTED, alpha=0.2, linewidth=0)
    first.text(x[0], beside, " reference days", va="center", fontsize=8)
    evidence.set_title("Evidence that something has changed; an alarm where it lasts (dashed) or at once (dotted)")
    evidence.set_ylabel("log evidence [-]")
    weekly = pd.concat([weekly, weekly.iloc[-1:]])  # the last week goes on until the telemetry ends
    weeks = np.append(style.day_numbers(weekly.index[:-1]), x[-1])  # type: ignore[arg-type]
    error.step(weeks, weekly["mae"], where="post", color=MUTED, label="model of the reference days")
    error.step(weeks, weekly["mae_carried"], where="post", color=MEASURED, label="carried on, a day ahead")
    error.set(title="Mean absolute error by week", ylabel="[K]")
    error.set_ylim(bottom=0.0)
    keys_below(figure, 2)
    return [picture(figure, "Changes, evidence by day and errors by week, over time", zoom=True)]


def _changes(bars: Axes, found: Monitoring, x: FloatArray) -> None:
    """Draw changes as bars from their beginning to their end, each below its name."""
    bars.set_ylim(len(found.events) - 0.3, -1.3)
    for row, e in enumerate(found.events):
        begin, end = x[min(e.since, len(x) - 1)], x[-1] if e.end is None else x[min(e.end, len(x) - 1)]
        colour = WARNING if e.end is None else SIMULATED
        bars.fill_between([begin, end], row, row + 0.4, color=colour, linewidth=0)
        bars.plot(np.full(2, x[min(e.alarm, len(x) - 1)]), [row - 0.08, row + 0.48], color=INK)
        late = begin > 0.5 * (x[0] + x[-1])  # the name goes where there is room for it
        bars.text(end if late else begin, row - 0.3, called(e.effect, e.zones), va="center", fontsize=8,
                  ha="right" if late else "left")  # fmt: skip
    bars.set(title="What has changed; a stroke is the day on which it was noticed", yticks=[])
