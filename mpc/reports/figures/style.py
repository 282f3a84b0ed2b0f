"""How every figure looks, and how it becomes a picture of a page."""

import base64
import io
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import wraps
from pathlib import Path
from typing import ParamSpec, TypeVar

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
            for message in _EXPECTED:
                warnings.filterwarnings("ignore", message=message)
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
