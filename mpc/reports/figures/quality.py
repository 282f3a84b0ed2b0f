"""When telemetry is missing or not usable, on a line of time."""

from __future__ import annotations

import pandas as pd
from matplotlib.patches import Patch

from mpc.reports.figures import style
from mpc.reports.figures.style import Picture, keys_below, lines_over_time, panel, picture, styled
from thermal.case.quality import QualityReport

#: Colour of each kind of finding; what is constant is only reported, not left out.
COLOURS = {
    "gap": style.MUTED,
    "impossible": style.WARNING,
    "flat": style.SIMULATED,
    "spike": "#7B3FA0",
    "constant": "#7FB2D6",
}

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
    figure, axes = panel(7.4, 1.1 + 0.24 * len(flawed))
    kinds = set()
    least = (report.end - report.start) / 400
    for row, column in enumerate(flawed):
        axes.axhline(row, color="#E4E7EB", linewidth=6, zorder=1)
        for finding in column.findings:
            kinds.add(finding.kind)
            ends = [finding.start, max(finding.end, finding.start + least)]
            left, right = style.day_numbers(pd.DatetimeIndex(ends))
            axes.barh(row, right - left, left=left, height=0.6, color=COLOURS[finding.kind], zorder=2)
    axes.set_yticks(range(len(flawed)), [c.column for c in flawed], fontsize=7)
    lines_over_time(axes, pd.DatetimeIndex([report.start, report.end]))
    axes.set_ylim(len(flawed) - 0.4, -0.6)
    axes.grid(axis="y", visible=False)
    keys = [Patch(color=colour, label=kind) for kind, colour in COLOURS.items() if kind in kinds]
    keys_below(figure, 5, handles=keys)
    return [picture(figure, "Time line of what is missing or not usable, one row a telemetry column")]
