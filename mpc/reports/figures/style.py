"""How every figure looks, and how it becomes a picture of a page."""

import base64
import io
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import wraps
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

import matplotlib as mpl
import numpy as np
import pandas as pd
from matplotlib import dates
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure

from mpc.reports.display import Display, display
from mpc.reports.figures.adapt import WIDEST, for_dark, for_phone, in_units, thin
from mpc.reports.figures.zoom import zoomable
from thermal._types import FloatArray

P = ParamSpec("P")
T = TypeVar("T")

#: Measured is blue and simulated orange, as in the paper, from a palette that the colour-blind can tell apart.
MEASURED, SIMULATED, WARNING, MUTED, INK = "#0072B2", "#D55E00", "#C00028", "#8A8F98", "#22262B"

#: Text on a light colour, which stays dark on a dark page too.
INK_ON_COLOUR = "#22262C"

#: Areas with more corners than this are painted as pixels, which keeps pages of long runs small.
_MOST_CORNERS = 3000

#: Points that figures which zoom hold, against those that a screen shows at once [-]: with it a comparison of four
#: controllers over 90 days holds 0.9 MB of them, packed.
_SHARPNESS = 2.0

#: Zero of the Celsius scale [K].
CELSIUS = 273.15

_STYLE = mpl.rc_params_from_file(
    Path(__file__).parents[1] / "templates" / "figures.mplstyle", use_default_template=False
)

#: Warnings: names in any script, which the page's font shows; a silent sensor, a gap in a line; ticks, chosen anyway.
_EXPECTED = ("Glyph .* missing from", "Mean of empty slice|All-NaN slice", "AutoDateLocator")


@dataclass(frozen=True)
class Picture:
    """A figure as a page shows it.

    Parameters
    ----------
    source : str
        Data URI of an SVG.
    alt : str
        What it shows, for those who cannot see it.
    width : int
        Natural width [px].
    narrow : str
        Data URI of an SVG laid out for a phone; empty where the other one is narrow enough, or cannot be.
    zoom : mapping of str to Any, optional
        The same for plotly, where a reader would zoom.
    is_map : bool
        Whether it keeps its size on a phone, and is moved about.
    """

    source: str
    alt: str
    width: int
    narrow: str = ""
    zoom: Mapping[str, Any] | None = None
    is_map: bool = False


def styled(function: Callable[P, T]) -> Callable[P, T]:
    """Draw in the house's style, whatever the user's own settings.

    Parameters
    ----------
    function : callable
        That draws.
    """

    @wraps(function)
    def drawn(*args: P.args, **kwargs: P.kwargs) -> T:
        with mpl.rc_context(), warnings.catch_warnings():
            mpl.rcdefaults()
            mpl.rcParams.update(_STYLE)
            for message in _EXPECTED:
                warnings.filterwarnings("ignore", message=message)
            return function(*args, **kwargs)

    return drawn


def picture(figure: Figure, alt: str, *, zoom: bool = False, phone: bool = True) -> Picture:
    """Turn a figure into SVGs that a page holds itself, in the units that are shown.

    Parameters
    ----------
    figure : Figure
        Of Matplotlib, in SI units; it is laid out anew.
    alt : str
        What it shows, for those who cannot see it.
    zoom : bool
        Whether readers would zoom: lines and bands over time.
    phone : bool
        Whether it may be laid out anew for a phone; a map, whose text fits its rooms, may not.
    """
    shown = display()
    interactive = None
    if zoom:
        if (layout := figure.get_layout_engine()) is not None:
            layout.execute(figure)  # for the places of axes
        thin(figure, _SHARPNESS)
        interactive = zoomable(figure, shown)
    thin(figure)
    for area in figure.findobj(PolyCollection):
        if isinstance(area, PolyCollection):
            corners = sum(np.size(path.vertices) // 2 for path in area.get_paths())
            area.set_rasterized(corners > _MOST_CORNERS)
    if shown.converts:
        in_units(figure, shown)
    if shown.figures != "page":
        shown.drawn.append((_short(alt), _file(figure, shown)))
    width, source, narrow = float(figure.get_size_inches()[0]), _uri(figure), ""
    if phone and width > WIDEST:
        for_phone(figure)
        thin(figure)
        narrow = _uri(figure)
    return Picture(source, alt, round(width * 96), narrow, interactive, not phone)


def _file(figure: Figure, shown: Display) -> bytes:
    """Drawing for a file of its own, on white."""
    stream = io.BytesIO()
    metadata = {"Date": None, "Creator": None} if shown.figures == "svg" else None
    figure.savefig(stream, format=shown.figures, dpi=200, facecolor="white", metadata=metadata)
    return stream.getvalue()


def _short(alt: str) -> str:
    """First words of a description, for the name of a file."""
    return alt.partition(";")[0].partition(",")[0].partition(":")[0]


def _uri(figure: Figure) -> str:
    stream = io.StringIO()
    canvas = FigureCanvasSVG(figure)  # not `savefig`, which draws everything once more to lay it out
    canvas.print_svg(stream, metadata={"Date": None, "Creator": None})  # type: ignore[no-untyped-call]
    drawn = stream.getvalue()
    encoded = base64.b64encode(for_dark(drawn[drawn.index("<svg") :]).encode()).decode("ascii")  # no address of a DTD
    return f"data:image/svg+xml;base64,{encoded}"


def panel(width: float, height: float, *, title: str = "", xlabel: str = "", ylabel: str = "") -> tuple[Figure, Axes]:
    """Begin a figure of one pair of axes.

    Parameters
    ----------
    width, height : float
        Size [inch].
    title, xlabel, ylabel : str
        Above and beside the axes.
    """
    figure = Figure(figsize=(width, height))
    axes = figure.subplots()
    axes.set(title=title, xlabel=xlabel, ylabel=ylabel)
    return figure, axes


def keys_below(figure: Figure, columns: int, handles: Sequence[Artist] | None = None) -> None:
    """Put the legend below the axes.

    Parameters
    ----------
    figure : Figure
        With labelled lines.
    columns : int
        Number of columns.
    handles : sequence of Artist, optional
        Keys in place of those of the lines.
    """
    figure.legend(handles=handles, fontsize=8, loc="outside lower center", ncols=columns)


def lines_over_time(axes: Axes, stamps: pd.DatetimeIndex, ticks: int = 7) -> FloatArray:
    """Prepare axes for lines over local time, from the first stamp to the last.

    Parameters
    ----------
    axes : Axes
        Of Matplotlib.
    stamps : DatetimeIndex, length n_time
        With a time zone.
    ticks : int
        Most of them.

    Returns
    -------
    ndarray, shape (n_time,)
        Where the stamps are along x [d].
    """
    x = day_numbers(stamps)
    axes.set_xlim(x[0], x[-1])
    locator = dates.AutoDateLocator(tz=stamps.tz, minticks=3, maxticks=ticks)  # type: ignore[no-untyped-call]
    axes.xaxis.set_major_locator(locator)
    axes.xaxis.set_major_formatter(dates.ConciseDateFormatter(locator, tz=stamps.tz))  # type: ignore[no-untyped-call]
    axes.xaxis.get_offset_text().set_fontsize(8)
    axes.tick_params(axis="x", labelsize=8)
    return x


def broken(x: FloatArray, *courses: FloatArray) -> list[FloatArray]:
    """Break lines where times are missing: times first, then the courses with NaN there.

    Parameters
    ----------
    x : ndarray, shape (n_time,)
        Times of averages [d].
    *courses : ndarray, shape (n_time,)
        Values at these [any].
    """
    at = np.flatnonzero(np.diff(x) > 1.5 * np.min(np.diff(x), initial=np.inf)) + 1
    return [np.insert(x, at, x[at]), *(np.insert(values, at, np.nan) for values in courses)]


def day_numbers(stamps: pd.DatetimeIndex) -> FloatArray:
    """Stamps as Matplotlib's days, shape (n_time,).

    Parameters
    ----------
    stamps : DatetimeIndex
        With a time zone.
    """
    return np.asarray(stamps.tz_convert("UTC").tz_localize(None).as_unit("us").asi8 / 86400e6, dtype=float)
