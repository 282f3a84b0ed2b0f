"""How every figure looks, and how it becomes a picture of a page."""

from __future__ import annotations

import base64
import io
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import tzinfo
from functools import wraps
from typing import Any, ParamSpec, TypeVar

import matplotlib as mpl
import numpy as np
import pandas as pd
from matplotlib import dates
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from thermal._types import FloatArray

P = ParamSpec("P")
T = TypeVar("T")

#: Measured is blue and simulated orange, as in the paper, from a palette that the colour-blind can tell apart.
MEASURED, SIMULATED, WARNING, MUTED, INK = "#0072B2", "#D55E00", "#C00028", "#8A8F98", "#22262B"

#: Zero of the Celsius scale [K].
CELSIUS = 273.15

_STYLE: dict[Any, Any] = {  # Matplotlib types its keys one by one
    "axes.edgecolor": "#9AA0A8",
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.labelcolor": INK,
    "axes.spines.right": False,
    "axes.spines.top": False,
    "axes.titlelocation": "left",
    "axes.titlesize": 10,
    "figure.constrained_layout.use": True,
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans", "Verdana", "Arial", "sans-serif"],
    "font.size": 9,
    "grid.color": "#E4E7EB",
    "legend.frameon": False,
    "svg.fonttype": "none",
    "svg.hashsalt": "buildingmpc",
    "text.color": INK,
    "text.parse_math": False,
    "xtick.color": INK,
    "ytick.color": INK,
}


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
    """

    source: str
    alt: str
    width: int


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
            warnings.filterwarnings(
                "ignore", message="Glyph .* missing from"
            )  # names in any script: the page's font shows them
            warnings.filterwarnings(
                "ignore", message="Mean of empty slice|All-NaN slice"
            )  # a sensor that is silent: a gap in a line
            warnings.filterwarnings("ignore", message="AutoDateLocator")  # chooses its ticks all the same
            return function(*args, **kwargs)

    return drawn


def picture(figure: Figure, alt: str) -> Picture:
    """Turn a figure into an SVG that a page holds itself.

    Parameters
    ----------
    figure : Figure
        Of Matplotlib.
    alt : str
        What it shows, for those who cannot see it.
    """
    buffer = io.BytesIO()
    figure.savefig(buffer, format="svg", metadata={"Date": None, "Creator": None})
    drawn = buffer.getvalue()
    encoded = base64.b64encode(drawn[drawn.index(b"<svg") :]).decode("ascii")  # without the address of a DTD
    return Picture(f"data:image/svg+xml;base64,{encoded}", alt, round(figure.get_size_inches()[0] * 96))


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
    time_axis(axes, stamps.tz, ticks)
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


def time_axis(axes: Axes, zone: tzinfo | None, ticks: int = 7) -> None:
    """Local time along x.

    Parameters
    ----------
    axes : Axes
        Of Matplotlib.
    zone : tzinfo or None
        Whose clock.
    ticks : int
        Most of them.
    """
    locator = dates.AutoDateLocator(tz=zone, minticks=3, maxticks=ticks)  # type: ignore[no-untyped-call]
    axes.xaxis.set_major_locator(locator)
    formatter = dates.ConciseDateFormatter(locator, tz=zone)  # type: ignore[no-untyped-call]
    axes.xaxis.set_major_formatter(formatter)
    axes.xaxis.get_offset_text().set_fontsize(8)
    axes.tick_params(axis="x", labelsize=8)
