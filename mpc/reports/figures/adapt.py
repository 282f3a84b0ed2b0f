"""What any figure needs for its place: units that are shown, a narrow screen, a dark page."""

import re
import textwrap
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.collections import PolyCollection
from matplotlib.dates import AutoDateLocator
from matplotlib.figure import Figure
from matplotlib.gridspec import GridSpec
from matplotlib.legend import Legend
from matplotlib.lines import Line2D
from matplotlib.text import Text
from matplotlib.ticker import FixedLocator, FuncFormatter, MaxNLocator, ScalarFormatter

from mpc.reports.display import Display
from mpc.reports.units import NUMBER, converted_number
from thermal._types import FloatArray
from thermal.display_units import Line, inch_pound

#: Width of a figure on a phone [inch]: 374 px, which a screen of 390 px shows at about nine tenths.
NARROW = 3.9

#: Figures wider than this are drawn again for a phone [inch]: text of 9 pt would shrink below 7 pt there.
WIDEST = 4.6

#: Lengths of lines of text on a phone [characters]: of titles, and of labels beside rows.
_TITLE, _ROW = 44, 20

#: Height of a line of such a label [inch].
_LINE = 0.15

#: Entries of a legend beside each other on a phone, as far as so many characters go.
_KEYS, _KEYS_LENGTH = 3, 46

#: What the colours of lines and text become on a dark page: the same hues, lighter. Contrast against #1b1f24 is 6 to 1
#: and more, of muted marks 4.2 (WCAG 2.2, 1.4.3 and 1.4.11 ask 4.5 of text and 3 of lines); grids stay faint.
DARK = {
    "#22262b": "#e3e6ea", "#000000": "#e3e6ea", "#9aa0a8": "#79818b", "#e4e7eb": "#343a42", "#dde1e6": "#3a4149",
    "#0072b2": "#56b4f0", "#d55e00": "#ff9d4d", "#c00028": "#ff6b81", "#8a8f98": "#a3abb5", "#7b3f98": "#c792ea",
    "#009e73": "#3ecf9e",
}  # fmt: skip

#: Decimals of coordinates beyond a hundredth of a point, which no screen shows: a third of a page.
_LONG = re.compile(r"(?<=[ LMCQ\"-])(\d+\.\d\d)\d+(?=[ \n\"LMCQ])")

#: Blanks about the corners of a path, a fifth of a long one.
_BETWEEN = re.compile(r" \n([LMCQ]) (?=[\d-])")

#: How high a figure on a phone is against one of its axes before, for each of those below each other [-].
_LOWER = 0.75

#: Columns that lines are thinned to for each inch of a figure [1/inch]: of the 96 pixels an inch has on a screen axes
#: take two thirds, and a column is at most two of these wide.
_COLUMNS = 40

_UNIT = re.compile(r"\[([^\]]+)\]")


class _InUnits(MaxNLocator):
    """Round ticks in the units that are shown, on an axis whose data are in others."""

    def __init__(self, line: Any) -> None:
        super().__init__(nbins="auto", steps=[1, 2, 2.5, 5, 10])
        self._line = line

    def tick_values(self, vmin: float, vmax: float) -> Any:
        shown = super().tick_values(*(self._line(end) for end in (vmin, vmax)))
        return (np.asarray(shown) - self._line.offset) / self._line.scale


def axis_line(axis: Axis) -> Line | None:
    """Conversion of the values of an axis to the units that are shown, by the unit in its label; None where it stays.

    Parameters
    ----------
    axis : Axis
        Of Matplotlib, with its label in SI units.
    """
    found = _UNIT.search(axis.label.get_text())
    return inch_pound(found[1]) if found else None


def in_units(figure: Figure, shown: Display) -> None:
    """Show a figure in other units: ticks, and all text.

    Parameters
    ----------
    figure : Figure
        In SI units.
    shown : Display
        With the units.
    """
    for axes in figure.axes:
        for axis in (axes.xaxis, axes.yaxis):
            line = axis_line(axis)
            if line is None:
                continue
            fixed = isinstance(axis.get_major_locator(), FixedLocator)  # on a logarithmic axis the same ticks stay
            if not fixed:
                axis.set_major_locator(_InUnits(line))
            digits = 2 if fixed else 6
            axis.set_major_formatter(
                FuncFormatter(lambda x, _, line=line, n=digits: f"{line(x):.{n}g}".replace("-", "−"))
            )
        lines = [line for line in map(axis_line, (axes.yaxis, axes.xaxis)) if line is not None]
        for text in axes.texts if lines else ():  # labels of bars and points: numbers of the axis
            if re.fullmatch(NUMBER, text.get_text()):
                text.set_text(converted_number(text.get_text(), lines[0]))
    ticks = {id(mark) for axes in figure.axes for mark in (*axes.get_xticklabels(), *axes.get_yticklabels())}
    for words in figure.findobj(Text):
        if isinstance(words, Text) and id(words) not in ticks:
            words.set_text(shown.text(words.get_text()))


def for_phone(figure: Figure) -> None:
    """Lay a figure out for a narrow screen: fewer ticks, text in more lines, legends above the axes.

    Parameters
    ----------
    figure : Figure
        That is not needed wide any more.
    """
    height = float(figure.get_size_inches()[1]) * _stack(figure)
    figure.set_size_inches(NARROW, max(min(height, 2.6), 0.9 * height))
    for axes in figure.axes:
        for axis in (axes.xaxis, axes.yaxis) if axes.get_label() != "<colorbar>" else ():
            locator = axis.get_major_locator()
            if isinstance(locator, AutoDateLocator):
                locator.minticks = 2
                locator.maxticks = dict.fromkeys(locator.maxticks, 4)
            elif axis is axes.xaxis and isinstance(axis.get_major_formatter(), ScalarFormatter):
                axis.set_major_locator(MaxNLocator(nbins=5, steps=[1, 2, 3, 5, 6, 10]))
            axis.label.set_text(textwrap.fill(axis.label.get_text(), _TITLE if axis is axes.xaxis else _TITLE // 2))
        for axis, length in ((axes.yaxis, _ROW), (axes.xaxis, _ROW // 2)):
            if isinstance(axis.get_major_locator(), FixedLocator):
                marks = [mark.get_text() for mark in axis.get_majorticklabels()]
                if max(map(len, marks), default=0) > length:
                    filled = [textwrap.fill(mark, length) for mark in marks]
                    axis.set_ticks(axis.get_majorticklocs(), filled)
                    if axis is axes.yaxis:  # a row of two lines needs the height of two
                        most = max(text.count("\n") + 1 for text in filled)
                        figure.set_figheight(max(figure.get_figheight(), 1.6 + _LINE * most * len(filled)))
        title = textwrap.fill(axes.get_title(loc="left"), _TITLE)
        legend, pad = axes.get_legend(), 6.0
        if legend is not None and _is_beside(legend, axes):
            names = [text.get_text() for text in legend.get_texts()]
            columns = _columns(names)
            handles = [handle for handle in legend.legend_handles if handle is not None]
            axes.legend(handles, names, loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=columns, fontsize=8,
                        borderpad=0.2, columnspacing=1.0, handlelength=1.4)  # fmt: skip
            pad += 13.0 * -(-len(names) // columns)
        if title:
            axes.set_title(title, loc="left", pad=pad)
    for legend in list(figure.legends):
        names = [text.get_text() for text in legend.get_texts()]
        legend.remove()
        handles = [handle for handle in legend.legend_handles if handle is not None]
        figure.legend(handles, names, loc="outside lower center", ncols=_columns(names), fontsize=8,
                      columnspacing=1.0, handlelength=1.4)  # fmt: skip


def _stack(figure: Figure) -> float:
    """Put axes that stand beside each other in one row below each other; gives how much higher the figure becomes."""
    row = [axes for axes in figure.axes if (place := axes.get_subplotspec()) and place.get_gridspec().nrows == 1]
    if len(row) < 2:
        return 1.0
    below = GridSpec(len(row), 1, figure=figure)
    for k, axes in enumerate(row):
        axes.set_subplotspec(below[k])
        axes.tick_params(labelleft=True)
    return _LOWER * len(row)


def _is_beside(legend: Legend, axes: Axes) -> bool:
    """Whether a legend stands right of its axes."""
    place = legend.get_bbox_to_anchor().transformed(axes.transAxes.inverted())
    return bool(place.x0 > 1.0)


def _columns(names: list[str]) -> int:
    """Entries of a legend that fit beside each other."""
    longest = max(map(len, names), default=1) + 5
    return max(1, min(_KEYS, _KEYS_LENGTH // longest))


def for_dark(svg: str) -> str:
    """Let an SVG follow the scheme of colours of the page it is in.

    Parameters
    ----------
    svg : str
        As Matplotlib writes it, its ground left out.
    """
    rules = []
    for light, dark in DARK.items():
        for what in ("fill", "stroke"):
            if f"{what}: {light}" in svg:
                rules.append(f'[style*="{what}: {light}"]{{{what}:{dark}!important}}')
    svg = _BETWEEN.sub(r"\1", _LONG.sub(r"\1", svg))
    at = svg.index(">") + 1
    return f"{svg[:at]}<style>@media (prefers-color-scheme: dark){{{''.join(rules)}}}</style>{svg[at:]}"


def thin(figure: Figure, sharpness: float = 1.0) -> None:
    """Leave out of long lines and bands over time what no screen shows: lowest and highest of each column stay.

    An average would hide peaks; these stay where and as high as they are.

    Parameters
    ----------
    figure : Figure
        Changed; what is short in it stays as it is.
    sharpness : float
        Columns against those of a figure that stands still: above 1 for one that zooms [-].
    """
    columns = round(sharpness * _COLUMNS * float(figure.get_size_inches()[0]))
    over_time = [axes for axes in figure.axes if isinstance(axes.xaxis.get_major_locator(), AutoDateLocator)]
    for axes in over_time:
        for artist in axes.get_children():
            if isinstance(artist, Line2D) and artist.get_linestyle() != "None":
                x, y = (np.asarray(values, dtype=float) for values in artist.get_data(orig=False))
                if len(kept := kept_points(x, y, columns)) < len(x):
                    artist.set_data(x[kept], y[kept])
            elif isinstance(artist, PolyCollection):
                corners = [np.asarray(path.vertices)[:-1] for path in artist.get_paths() if np.size(path.vertices)]
                whole = float(np.ptp(np.concatenate([each[:, 0] for each in corners]))) if corners else 0.0
                shares = [float(np.ptp(each[:, 0])) / max(whole, 1e-12) for each in corners]  # of parts between gaps
                thinned = [_thinned_band(e, max(1, round(columns * s))) for e, s in zip(corners, shares, strict=True)]
                if sum(map(len, thinned)) < sum(map(len, corners)):
                    artist.set_verts(thinned)


def _thinned_band(corners: FloatArray, columns: int) -> FloatArray:
    """Corners of a band, there along one of its ends and back along the other, shape (n_kept, 2)."""
    turn = int(np.argmax(corners[:, 0])) + 1
    there, back = corners[:turn], corners[turn:][::-1]
    ends = [part[kept_points(part[:, 0], part[:, 1], columns)] for part in (there, back)]
    return np.concatenate([ends[0], ends[1][::-1]])


def kept_points(x: FloatArray, y: FloatArray, columns: int) -> np.ndarray[Any, np.dtype[np.intp]]:
    """Points of a line that show on so many columns of pixels: lowest and highest of each, its ends, and its gaps.

    Parameters
    ----------
    x : ndarray, shape (n_points,)
        Along the line; where it runs back anywhere, all points are kept [any].
    y : ndarray, shape (n_points,)
        Values, NaN in gaps [any].
    columns : int
        How many.

    Returns
    -------
    ndarray, shape (n_kept,)
        Indices, rising.
    """
    everything = np.arange(len(x))
    if len(x) <= 2 * columns or not np.isfinite(x).all() or np.any(np.diff(x) < 0.0) or x[-1] <= x[0]:
        return everything
    column = np.minimum((x - x[0]) / (x[-1] - x[0]) * columns, columns - 1).astype(int)
    gap = np.isnan(y)
    order = np.lexsort((y, column, gap))  # those with a value first; by column, and within it from low to high
    key = 2 * column[order] + gap[order]
    change = np.flatnonzero(np.diff(key, prepend=-1, append=-1))
    first, last = change[:-1], change[1:] - 1
    return np.unique(np.concatenate([[0, len(x) - 1], order[first], order[last]]))
