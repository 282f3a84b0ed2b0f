"""Figures of a case: plans, or tiles as large as zones, with errors or missing heat; quality of its telemetry."""

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colorbar import Colorbar
from matplotlib.colors import Colormap, Normalize, to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import Patch, Rectangle
from matplotlib.text import OffsetFrom
from scipy.ndimage import distance_transform_edt

from mpc.reports.figures import style
from mpc.reports.figures.field import Field
from mpc.reports.figures.style import INK, Picture, panel, picture, styled
from mpc.reports.page import watts
from thermal._types import BoolArray, FloatArray
from thermal.case.building import FloorPlan, FloorPlans
from thermal.case.quality import QualityReport

#: Red is a simulation that is too warm, blue one that is too cold, white none, as in the paper; and white no missing
#: heat, dark red most, which reads in grey too.
ERROR_COLOURS, HEAT_COLOURS = colormaps["RdBu_r"], colormaps["OrRd"]

#: Labels below this size are left out [pt].
SMALLEST_LABEL = 4.6

#: Colours of what is drawn in a plan beside its zones, and of what is not measured.
WALLS = {"#": to_rgb("#3A3F45"), "+": to_rgb("#8E949B"), ".": to_rgb("white")}
UNMEASURED = to_rgb("#E3E5E8")
_ZONES = [to_rgb(c) for c in ("#D7E8F5", "#FBE3D0", "#DDEFDC", "#F3E6F3", "#FFF3C9", "#DDEFEF", "#F0E4DA", "#E5E6F4")]

#: Most columns of telemetry that are drawn, those with the most flaws, and the colour of each kind of finding; what is
#: constant is only reported, not left out.
_MOST_COLUMNS = 40
_FINDINGS = {"gap": style.MUTED, "impossible": style.WARNING, "flat": style.SIMULATED, "spike": "#7B3FA0",
             "constant": "#7FB2D6"}  # fmt: skip

Box = tuple[float, float, float, float]
Colour = tuple[float, float, float]


def _error_scale(values: FloatArray) -> float:
    """Choose the ends of a symmetric colour scale [K]: what 98 % of the values stay within, rounded up."""
    finite = np.abs(values[np.isfinite(values)])
    top = float(np.quantile(finite, 0.98)) if finite.size else 0.0
    step = next((step for limit, step in ((0.2, 0.1), (1.0, 0.2), (4.0, 0.4)) if top <= limit), 1.0)
    return float(max(1.0, np.ceil(round(top / step, 6))) * step)


def _error_bar(figure: Figure, axes: Axes, scale: float) -> None:
    """Add a bar of the error's colours below the axes."""
    label = "simulated minus measured [K]: red too warm, blue too cold"
    bar = _colour_bar(figure, axes, ScalarMappable(Normalize(-scale, scale), ERROR_COLOURS), label, extend="both")
    bar.set_ticks([-scale, -0.5 * scale, 0.0, 0.5 * scale, scale])


def _colour_bar(figure: Figure, axes: Axes, colours: ScalarMappable, label: str, extend: str = "neither") -> Colorbar:
    bar = figure.colorbar(colours, ax=axes, orientation="horizontal", aspect=40, shrink=0.8, pad=0.02, extend=extend)
    bar.set_label(label, fontsize=8)
    bar.ax.tick_params(labelsize=8)
    return bar


def _colour(colours: Colormap, place: float) -> Colour:
    """Colour of a place on a scale [-]; grey where nothing is measured."""
    if not np.isfinite(place):
        return UNMEASURED
    red, green, blue, _ = colours(place)
    return red, green, blue


def _error_colour(error: float, scale: float) -> Colour:
    return _colour(ERROR_COLOURS, 0.5 + 0.5 * error / scale)


def _ink_on(colour: Colour) -> str:
    """Dark or white text, whichever reads better on a colour."""
    return "white" if 0.299 * colour[0] + 0.587 * colour[1] + 0.114 * colour[2] < 0.5 else style.INK_ON_COLOUR


@styled
def plan_drawings(plans: FloorPlans, orientation: float) -> list[Picture]:
    """Draw each floor with its zones and walls.

    Parameters
    ----------
    plans : FloorPlans
        The floors.
    orientation : float
        Clockwise from true north to the plan's up [deg].
    """
    drawn = []
    for floor in plans.floors:
        colours = {zone: _ZONES[i % len(_ZONES)] for i, zone in enumerate(floor.zone_names)}
        labels = {zone: (zone, colours[zone]) for zone in floor.zone_names}
        figure, _ = _canvas(floor, plans.cell_size, orientation, _filled(floor, colours), f"floor {floor.name}", labels)
        drawn.append(picture(figure, f"Plan of floor {floor.name} with {len(labels)} zones", phone=False))
    return drawn


@styled
def floor_maps(
    plans: FloorPlans,
    orientation: float,
    zones: Sequence[str],
    error: FloatArray,
    title: str,
    field: Field | None = None,
) -> list[Picture]:
    """Draw the error of each zone on the plan of each floor, or of each cell where the field of the grid is given.

    Parameters
    ----------
    plans : FloorPlans
        The floors.
    orientation : float
        Clockwise from true north to the plan's up [deg].
    zones : tuple of str
        Zone names.
    error : ndarray, shape (n_zone,)
        Simulated minus measured [K], NaN where not measured; the numbers on the map.
    title : str
        Follows the floor's name.
    field : Field, optional
        Temperatures of the grid's control volumes.
    """
    values = [
        _cell_errors(floor, number, plans.cell_size, zones, error, field) for number, floor in enumerate(plans.floors)
    ]
    scale = _error_scale(np.concatenate([v.ravel() for v in values]))
    by_zone = dict(zip(zones, error, strict=True))
    drawn = []
    for floor, cells in zip(plans.floors, values, strict=True):
        image = ERROR_COLOURS(0.5 + 0.5 * cells / scale)[..., :3]
        image[~np.isfinite(cells)] = UNMEASURED
        split = cells.shape[0] // floor.tokens.shape[0]
        tokens = np.repeat(np.repeat(floor.tokens, split, axis=0), split, axis=1)
        for token, colour in WALLS.items():
            image[tokens == token] = colour
        labels = {
            z: (f"{z}\n{_signed_kelvin(by_zone[z])}", _error_colour(float(np.median(cells[tokens == z])), scale))
            for z in floor.zone_names
        }
        figure, axes = _canvas(floor, plans.cell_size, orientation, image, f"floor {floor.name}, {title}", labels)
        _error_bar(figure, axes, scale)
        worst = max(floor.zone_names, key=lambda z: np.nan_to_num(abs(by_zone[z]), nan=-1.0))
        alt = f"Error on floor {floor.name}, {title}; largest in zone {worst}: {_signed_kelvin(by_zone[worst])}"
        drawn.append(picture(figure, alt, phone=False))
    return drawn


@styled
def heat_maps(
    plans: FloorPlans, orientation: float, zones: Sequence[str], heat: FloatArray, title: str, top: float
) -> list[Picture]:
    """Draw the size of each zone's missing heat on the plan of each floor.

    Parameters
    ----------
    plans : FloorPlans
        The floors.
    orientation : float
        Clockwise from true north to the plan's up [deg].
    zones : sequence of str
        Zone names.
    heat : ndarray, shape (n_zone,)
        Root mean square of the missing heat [W]; NaN where not known.
    title : str
        Follows the floor's name.
    top : float
        Upper end of the colour scale [W].
    """
    by_zone = dict(zip(zones, heat.tolist(), strict=True))
    colour = {zone: _colour(HEAT_COLOURS, size / top) for zone, size in by_zone.items()}
    drawn = []
    for floor in plans.floors:
        image, name = _filled(floor, colour), f"floor {floor.name}, {title}"
        labels = {z: (f"{z}\n{watts(by_zone[z])}", colour[z]) for z in floor.zone_names}
        figure, axes = _canvas(floor, plans.cell_size, orientation, image, name, labels)
        shades = ScalarMappable(Normalize(0.0, top), HEAT_COLOURS)
        _colour_bar(figure, axes, shades, "missing heat, root mean square [W]")
        listed = "; ".join(f"{z} {watts(by_zone[z])}" for z in floor.zone_names)
        drawn.append(picture(figure, f"Missing heat on floor {floor.name}, {title}: {listed}", phone=False))
    return drawn


def _filled(floor: FloorPlan, colours: Mapping[str, Colour]) -> FloatArray:
    """Image of a floor with one colour a zone, shape (n_row, n_column, 3)."""
    return np.array([[WALLS.get(str(t)) or colours[str(t)] for t in row] for row in floor.tokens])


def _signed_kelvin(value: float) -> str:
    """Spell an error of a zone."""
    if not np.isfinite(value):
        return "not measured"
    return f"{value:+.2f} K".replace("-", "−") if abs(value) >= 0.005 else "0.00 K"


def _cell_errors(
    floor: FloorPlan, number: int, cell: float, zones: Sequence[str], error: FloatArray, field: Field | None
) -> FloatArray:
    """Error of each pixel of a floor [K]; NaN in walls, outside, and where nothing is measured."""
    code = np.full(floor.tokens.shape, -1)
    for name in floor.zone_names:
        code[floor.tokens == name] = zones.index(name)
    if field is None:
        return np.where(code >= 0, error[code], np.nan)
    spacing = cell if field.dx is None else field.dx
    split, merge = max(1, round(cell / spacing)), max(1.0, spacing / cell)
    code = np.repeat(np.repeat(code, split, axis=0), split, axis=1)
    mine = np.flatnonzero((field.network.kind == "air") & (field.network.place[:, 0] == number))
    places = zip(*field.network.place[mine, 1:].T, field.network.zone[mine], strict=True)
    temperature = {(int(r), int(c), int(z)): t for (r, c, z), t in zip(places, field.temperatures[mine], strict=True)}
    out = np.full(code.shape, np.nan)
    for row, column in np.argwhere(code >= 0):
        zone = int(code[row, column])
        out[row, column] = (
            temperature[int((row + 0.5) / merge), int((column + 0.5) / merge), zone] - field.measured[zone]
        )
    return out


def _canvas(
    floor: FloorPlan,
    cell: float,
    orientation: float,
    image: FloatArray,
    title: str,
    labels: Mapping[str, tuple[str, Colour]],
) -> tuple[Figure, Axes]:
    """Axes in metres with the image of a floor, labels where they fit, and an arrow to the north."""
    rows, columns = floor.tokens.shape
    shown = 6.4 - 0.8
    figure, axes = panel(6.4, min(7.5, shown * rows / columns + 1.35), title=title)
    axes.imshow(image, extent=(0, columns * cell, rows * cell, 0), interpolation="nearest")
    axes.grid(visible=False)
    axes.spines[["left", "bottom"]].set_visible(False)
    axes.tick_params(labelsize=8)
    axes.set_xlabel("[m]", fontsize=8)
    scale = 72.0 * min(shown / columns, 6.0 / rows)  # points a cell
    for zone, (text, colour) in labels.items():
        _label(axes, floor.tokens == zone, cell, scale, text, _ink_on(colour), 8.0 if len(labels) < 30 else 6.5)
    _north(axes, orientation)
    return figure, axes


def _north(axes: Axes, orientation: float) -> None:
    """Draw an arrow to true north, above the right corner."""
    x, y = -np.sin(np.deg2rad(orientation)), np.cos(np.deg2rad(orientation))
    corner = OffsetFrom(axes, (1.0, 1.0), "points")

    def along(points: float) -> tuple[float, float]:
        return float(-14.0 + points * x), float(14.0 + points * y)

    arrow = {"arrowstyle": "-|>", "color": INK, "shrinkA": 0, "shrinkB": 0, "linewidth": 1.0}
    tip, foot = along(9.0), along(-9.0)
    axes.annotate("", tip, foot, xycoords=corner, textcoords=corner, annotation_clip=False, arrowprops=arrow)
    axes.annotate("N", along(16.0), xycoords=corner, fontsize=7, ha="center", va="center", annotation_clip=False)


def _label(axes: Axes, mine: BoolArray, cell: float, scale: float, text: str, ink: str, largest: float) -> None:
    """Write into the roomiest place of a zone; the number alone, or nothing, where more does not fit."""
    depth = distance_transform_edt(np.pad(mine, 1))[1:-1, 1:-1]
    deepest = depth.max()
    centre = np.argwhere(mine).mean(axis=0)
    best = (-np.inf, 0.0, 0.0, 0, "")
    for row in np.flatnonzero(depth.max(axis=1) >= 0.6 * deepest):
        for first, last in _runs(mine[row] & (depth[row] >= 0.5 * deepest)):
            column = 0.5 * (first + last)
            far = abs(row - centre[0]) + abs(column - centre[1])
            height = 2.0 * float(depth[row, first : last + 1].max()) * scale
            for lines in (text, text.rpartition("\n")[2]):
                width = 0.66 * max(map(len, lines.split("\n")))
                size = min(largest, (last - first + 1.3) * scale / width, height / (1.3 * (lines.count("\n") + 1)))
                better = size - 0.05 * far + (1.0 if lines == text else 0.0)
                if size >= SMALLEST_LABEL and better > best[0]:
                    best = (better, size, column, int(row), lines)
    _, size, column, at, lines = best
    if lines:
        above, below = next(r for r in _runs(depth[:, int(column)] >= depth[at, int(column)]) if r[0] <= at <= r[1])
        x, y = (column + 0.5) * cell, 0.5 * (above + below + 1) * cell
        axes.text(x, y, lines, fontsize=size, color=ink, ha="center", va="center", linespacing=1.15)


def _runs(mask: BoolArray) -> list[tuple[int, int]]:
    """First and last position of each interval of True."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], mask.astype(np.int8), [0]])))
    return [(int(a), int(b) - 1) for a, b in zip(edges[::2], edges[1::2], strict=True)]


@styled
def tile_map(zones: tuple[str, ...], areas: FloatArray, error: FloatArray, title: str) -> list[Picture]:
    """Draw the error of each zone as a tile; the tiles' places mean nothing.

    Parameters
    ----------
    zones : tuple of str
        Zone names.
    areas : ndarray, shape (n_zone,)
        Floor areas [m2].
    error : ndarray, shape (n_zone,)
        Simulated minus measured [K], NaN where not measured.
    title : str
        Of the figure.
    """
    width, height = 6.0, 3.4
    scale = _error_scale(error)
    order = np.argsort(-areas, kind="stable")
    boxes = _squarify(areas[order] / areas.sum() * width * height, (0.0, 0.0, width, height))
    figure, axes = panel(6.4, 4.3)
    for i, (x, y, w, h) in zip(order, boxes, strict=True):
        colour = _error_colour(float(error[i]), scale)
        axes.add_patch(Rectangle((x, y), w, h, facecolor=colour, edgecolor="#3A3F45", linewidth=1.2))
        number = _signed_kelvin(float(error[i]))
        for text in (f"{zones[i]}\n{number}\n{areas[i]:.0f} m²", f"{zones[i]}\n{number}", number):
            lines = text.split("\n")
            size = min(9.0, 72 * w / (0.66 * max(map(len, lines))), 72 * h / (1.5 * len(lines)))
            if size >= 6.0 or text == number:
                axes.text(x + w / 2, y + h / 2, text, fontsize=size, color=_ink_on(colour), ha="center", va="center")
                break
    axes.set(xlim=(0, width), ylim=(0, height), title=title)
    axes.set_axis_off()
    _error_bar(figure, axes, scale)
    listed = "; ".join(f"{z} {_signed_kelvin(e)}" for z, e in zip(zones, error, strict=True) if np.isfinite(e))
    return [picture(figure, f"Error of each zone, {title}: {listed}", phone=False)]


def _squarify(sizes: FloatArray, box: Box) -> list[Box]:
    """Cut a rectangle into tiles of given areas that are as square as can be.

    Bruls, Huizing & van Wijk (2000), doi:10.1007/978-3-7091-6783-0_4.

    Parameters
    ----------
    sizes : ndarray, shape (n,)
        Areas, largest first, that sum to the rectangle's [-].
    box : tuple of float
        Left, lower, width, height [-].
    """
    tiles: list[Box] = []
    rest = list(map(float, sizes))
    x, y, w, h = box
    while rest:
        side = min(w, h)
        count = 1
        while count < len(rest) and _worst(rest[: count + 1], side) <= _worst(rest[:count], side):
            count += 1
        row, rest = rest[:count], rest[count:]
        depth = sum(row) / side
        at = 0.0
        for size in row:
            along = size / depth
            tiles.append((x, y + at, depth, along) if w >= h else (x + at, y, along, depth))
            at += along
        x, y, w, h = (x + depth, y, w - depth, h) if w >= h else (x, y + depth, w, h - depth)
    return tiles


def _worst(row: list[float], side: float) -> float:
    """Largest ratio of sides in a row of tiles along a side."""
    depth = sum(row) / side
    return max(max(depth * depth / size, size / (depth * depth)) for size in row)


@styled
def quality_timeline(report: QualityReport) -> list[Picture]:
    """Draw the findings of each column that has any, over the time of the telemetry.

    Parameters
    ----------
    report : QualityReport
        Of a case.
    """
    flawed = sorted((c for c in report.columns if c.findings), key=lambda c: -c.unusable_share)[:_MOST_COLUMNS]
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
            axes.barh(row, right - left, left=left, height=0.6, color=_FINDINGS[finding.kind], zorder=2)
    axes.set_yticks(range(len(flawed)), [c.column for c in flawed], fontsize=7)
    style.lines_over_time(axes, pd.DatetimeIndex([report.start, report.end]))
    axes.set_ylim(len(flawed) - 0.4, -0.6)
    axes.grid(axis="y", visible=False)
    keys = [Patch(color=colour, label=kind) for kind, colour in _FINDINGS.items() if kind in kinds]
    style.keys_below(figure, 5, handles=keys)
    return [picture(figure, "Time line of what is missing or not usable, one row a telemetry column")]
