"""When telemetry is missing or not usable, on a line of time."""

from __future__ import annotations

import pandas as pd
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from mpc.reports.figures.style import MUTED, SIMULATED, WARNING, Picture, day_numbers, picture, styled, time_axis
from thermal.case.quality import QualityReport

#: Colour of each kind of finding; what is constant is only reported, not left out.
COLOURS = {"gap": MUTED, "impossible": WARNING, "flat": SIMULATED, "spike": "#7B3FA0", "constant": "#7FB2D6"}

#: More columns than this are not drawn; those with the most flaws are.
MOST_ROWS = 40


@styled
def quality_timeline(report: QualityReport) -> list[Picture]:
    """Draw the findings of each column that has any, over the time of the telemetry.

    Parameters
    ----------
    report : QualityReport
        Of a case.
    """
    flawed = sorted((c for c in report.columns if c.findings), key=lambda c: -c.unusable_share)[:MOST_ROWS]
    if not flawed:
        return []
    figure = Figure(figsize=(7.4, 1.1 + 0.24 * len(flawed)))
    axes = figure.subplots()
    kinds = set()
    least = (report.end - report.start) / 400
    for row, column in enumerate(flawed):
        axes.axhline(row, color="#E4E7EB", linewidth=6, zorder=1)
        for finding in column.findings:
            kinds.add(finding.kind)
            ends = [finding.start, max(finding.end, finding.start + least)]
            left, right = day_numbers(pd.DatetimeIndex(ends))
            axes.barh(row, right - left, left=left, height=0.6, color=COLOURS[finding.kind], zorder=2)
    axes.set_yticks(range(len(flawed)), [c.column for c in flawed], fontsize=7)
    left, right = day_numbers(pd.DatetimeIndex([report.start, report.end]))
    axes.set(xlim=(left, right), ylim=(len(flawed) - 0.4, -0.6))
    axes.grid(axis="y", visible=False)
    time_axis(axes, report.start.tzinfo)
    keys = [Patch(color=colour, label=kind) for kind, colour in COLOURS.items() if kind in kinds]
    figure.legend(handles=keys, loc="outside lower center", ncols=5, fontsize=8)
    return [picture(figure, "Time line of what is missing or not usable, one row a telemetry column")]
