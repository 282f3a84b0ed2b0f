"""Estimates with their intervals against the physical ranges of the parameters."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from calibration.fit.result import ParameterEstimate
from mpc.reports.figures.style import INK, MEASURED, MUTED, WARNING, Picture, picture, styled
from mpc.reports.identifiability import in_words
from thermal.effects.catalogue import CATALOGUE
from thermal.parameters import PARAMETERS, Parameter

#: More rows than this are not drawn; the table has them all.
MOST_ROWS = 40

#: Values that the paper found for parameters that ours correspond to [parameter units]: Goldfeder and Sipple (2023),
#: Table 1. Of walls it has the density beside the heat capacity, of which only the product counts, so ours is theirs at
#: our nominal density. A plan's walls are as thick as drawn in both; those of a table of zones are 1 m thick and
#: have no such density, so that nothing corresponds.
PAPER = {"exterior_convection_coefficient": 800.0, "shuffle_probability": 1.0}
PAPER_WALLS = {  # conductivity [W/m/K], density [kg/m^3], heat capacity [J/kg/K]
    "exterior_wall": (0.01, 2748.0, 2500.0),
    "interior_wall": (780.0, 0.5, 500.0),
}



def paper_values(parameters: Sequence[ParameterEstimate]) -> dict[str, float]:
    """Find what the paper's calibration of its own building gave for each parameter that it has.

    Parameters
    ----------
    parameters : sequence of ParameterEstimate
        With the nominal densities of the walls.

    Returns
    -------
    dict of str to float
        By name [parameter units].
    """
    known = dict(PAPER)
    density = {p.name: p.value for p in parameters if p.name.endswith("_density")}
    for wall, (conductivity, dense, heat) in PAPER_WALLS.items():
        if f"{wall}_density" in density:
            known[f"{wall}_conductivity"] = conductivity
            known[f"{wall}_heat_capacity"] = dense * heat / density[f"{wall}_density"]
    return {p.name: known[base] for p in parameters if (base := p.name.partition("@")[0]) in known}


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
    paper = paper_values(parameters)
    for row, p in enumerate(shown):
        _row(axes, row, p, paper.get(p.name))
    axes.set_yticks(range(len(shown)), [in_words(p.name) for p in shown], fontsize=8)
    middle = "middle (log scale" + ("; of effects, linear)" if any(_scale(p).scale == "linear" for p in shown) else ")")
    axes.set_xticks([0, 0.25, 0.5, 0.75, 1.0], ["lower bound", "", middle, "", "upper bound"])
    axes.set(xlim=(-0.05, 1.05), ylim=(len(shown) - 0.4, -0.6))
    axes.grid(axis="y", visible=False)
    axes.spines["left"].set_visible(False)
    axes.tick_params(axis="y", length=0)
    marks = [
        Line2D([], [], color=colour, marker="o", linewidth=1.6, markersize=5, label=label)
        for colour, label in ((MEASURED, "determined by the data"), (MUTED, "not determined"), (WARNING, "on a bound"))
    ]
    marks.append(Line2D([], [], color=INK, marker="|", linewidth=0, markersize=8, label="start"))
    if any(p.name in paper for p in shown):
        label = "the paper's value (arrow: beyond the range)"
        marks.append(Line2D([], [], color=INK, marker="D", markerfacecolor="white", linewidth=0, markersize=5,
                            label=label))  # fmt: skip
    figure.legend(handles=marks, loc="outside lower center", ncols=3, fontsize=8)
    return [
        picture(figure, "Estimates with 90 % intervals within the physical ranges; the table below has the numbers")
    ]


def _row(axes: Axes, row: int, p: ParameterEstimate, paper: float | None) -> None:
    scale = _scale(p)
    low, high = scale.transform(scale.lower), scale.transform(scale.upper)

    def place(value: float) -> float:
        return (scale.transform(value) - low) / (high - low)

    centre = place(p.value)
    ends = [place(end) for end in p.interval90 or ()]
    colour = WARNING if p.at_bound else MEASURED if p.identifiable else MUTED
    axes.plot([0, 1], [row, row], color="#DDE1E6", linewidth=7, solid_capstyle="butt", zorder=1)
    axes.plot(ends, [row] * len(ends), color=colour, linewidth=2.2, solid_capstyle="butt", zorder=3)
    axes.plot([place(p.start)], [row], color=INK, marker="|", markersize=9, markeredgewidth=1.2, zorder=2)
    axes.plot([centre], [row], color=colour, marker="o", markersize=6, zorder=4)
    if paper is not None:
        _paper_mark(axes, row, 1.0 if scale.scale == "logit" and paper >= 1.0 else place(paper), paper >= scale.upper)


def _paper_mark(axes: Axes, row: int, at: float, above: bool) -> None:
    """Mark the paper's value, with an arrow at the end that it lies beyond."""
    beyond = above or at < 0.0
    marker = ">" if above else "<" if beyond else "D"
    x = 1.025 if above else -0.025 if beyond else at
    axes.plot([x], [row], color=INK, marker=marker, markerfacecolor="white", markersize=5.5, zorder=5, clip_on=False)


def _scale(p: ParameterEstimate) -> Parameter:
    """Range and scale of estimation of an estimate; a parameter of one zone has those of its kind."""
    kinds = PARAMETERS | {own.name: own for effect in CATALOGUE.values() for own in effect.parameters}
    kind = kinds.get(p.name.partition("@")[0])
    if kind is None or p.lower is None or p.upper is None:
        return Parameter(p.name, p.unit, p.start, p.lower or p.value / 2, p.upper or p.value * 2, p.source)
    return replace(kind, start=p.start, lower=p.lower, upper=p.upper)
