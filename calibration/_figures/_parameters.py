"""Estimates with their intervals against the physical ranges of the parameters."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from calibration._figures._style import INK, MEASURED, MUTED, WARNING, Picture, picture, styled
from calibration._result import ParameterEstimate
from thermal import PARAMETERS, Parameter

#: More rows than this are not drawn; the table has them all.
MOST_ROWS = 40


@styled
def parameter_ranges(parameters: Sequence[ParameterEstimate]) -> list[Picture]:
    """Draw each estimated parameter within its range, on the scale it is estimated on (logarithmic, or logit).

    Parameters
    ----------
    parameters : sequence of ParameterEstimate
        Those without a standard error are left out.
    """
    shown = [p for p in parameters if p.standard_error is not None][:MOST_ROWS]
    if not shown:
        return []
    figure = Figure(figsize=(7.4, 0.9 + 0.3 * len(shown)))
    axes = figure.subplots()
    for row, p in enumerate(shown):
        _row(axes, row, p)
    axes.set_yticks(range(len(shown)), [p.name.replace("_", " ") for p in shown], fontsize=8)
    axes.set_xticks([0, 0.25, 0.5, 0.75, 1.0], ["lower bound", "", "middle (log scale)", "", "upper bound"])
    axes.set(xlim=(-0.03, 1.03), ylim=(len(shown) - 0.4, -0.6))
    axes.grid(axis="y", visible=False)
    axes.spines["left"].set_visible(False)
    axes.tick_params(axis="y", length=0)
    marks = [
        Line2D([], [], color=colour, marker="o", linewidth=1.6, markersize=5, label=label)
        for colour, label in ((MEASURED, "determined by the data"), (MUTED, "not determined"), (WARNING, "on a bound"))
    ]
    marks.append(Line2D([], [], color=INK, marker="|", linewidth=0, markersize=8, label="start"))
    figure.legend(handles=marks, loc="outside lower center", ncols=4, fontsize=8)
    return [
        picture(figure, "Estimates with 95 % intervals within the physical ranges; the table below has the numbers")
    ]


def _row(axes: Axes, row: int, p: ParameterEstimate) -> None:
    scale = _scale(p)
    low, high = scale.transform(scale.lower), scale.transform(scale.upper)

    def place(value: float) -> float:
        return (scale.transform(value) - low) / (high - low)

    centre = place(p.value)
    half = 1.96 * (p.standard_error or 0.0) / scale.slope(p.value) / (high - low)
    colour = WARNING if p.at_bound else MEASURED if p.identifiable else MUTED
    axes.plot([0, 1], [row, row], color="#DDE1E6", linewidth=7, solid_capstyle="butt", zorder=1)
    axes.plot([max(0.0, centre - half), min(1.0, centre + half)], [row, row], color=colour, linewidth=2.2, zorder=3)
    axes.plot([place(p.start)], [row], color=INK, marker="|", markersize=9, markeredgewidth=1.2, zorder=2)
    axes.plot([centre], [row], color=colour, marker="o", markersize=6, zorder=4)


def _scale(p: ParameterEstimate) -> Parameter:
    """Range and scale of estimation of an estimate; a parameter of one zone has those of its kind."""
    kind = PARAMETERS.get(p.name.partition("@")[0])
    if kind is None or p.lower is None or p.upper is None:
        return Parameter(p.name, p.unit, p.start, p.lower or p.value / 2, p.upper or p.value * 2, p.source)
    return replace(kind, start=p.start, lower=p.lower, upper=p.upper)
