"""Figures that zoom: the lines and bands of a Matplotlib figure as plotly draws them, unpacked on demand in a page."""

import base64
import gzip
import json
from collections.abc import Mapping, Sequence
from functools import cache
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_hex
from matplotlib.dates import AutoDateLocator, num2date
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from mpc.reports.display import Display
from mpc.reports.figures.adapt import DARK, axis_line

#: Dashes of plotly by those of Matplotlib.
_DASHES = {"-": "solid", "--": "dash", ":": "dot", "-.": "dashdot"}

#: Significant digits of values: more than any screen shows, and few enough to keep pages small.
_DIGITS = 5


def zoomable(figure: Figure, shown: Display) -> dict[str, Any]:
    """Take lines and bands of a figure over to plotly: axes below each other, those that share x zoom together.

    Parameters
    ----------
    figure : Figure
        Still in SI units.
    shown : Display
        With the units that are shown.

    Returns
    -------
    dict
        ``data`` and ``layout`` of plotly.
    """
    data: list[dict[str, Any]] = []
    layout: dict[str, Any] = {"annotations": [], "margin": {"l": 60, "r": 20, "t": 30, "b": 40}, "showlegend": True}
    twins = {id(b): a for a in figure.axes for b in figure.axes if a is not b and _is_twin(a, b)}
    own = [axes for axes in figure.axes if id(axes) not in twins]
    tops = [axes.get_position() for axes in own]
    number = 0
    for axes in figure.axes:
        number += 1
        tail = "" if number == 1 else str(number)
        first = twins.get(id(axes))
        base = own.index(first or axes)
        y = {"title": {"text": shown.text(axes.get_ylabel())}, "anchor": f"x{tail}", "zeroline": False}
        if first is None:
            y["domain"] = [round(max(0.0, tops[base].y0), 3), round(min(1.0, tops[base].y1 - 0.02), 3)]
        else:
            y |= {"overlaying": f"y{_tail(figure, first)}", "side": "right", "showgrid": False}
        x = {"anchor": f"y{tail}", "showticklabels": base == len(own) - 1 or not _shares(own), "zeroline": False}
        x |= {"title": {"text": shown.text(axes.get_xlabel())}}
        if number > 1 and _shares(own):
            x["matches"] = "x"
        is_time = isinstance(axes.xaxis.get_major_locator(), AutoDateLocator)
        layout |= {f"xaxis{tail}": x, f"yaxis{tail}": y}
        if title := axes.get_title(loc="left"):
            place = {"xref": f"x{tail} domain", "yref": f"y{tail} domain", "x": 0, "y": 1.0, "yanchor": "bottom"}
            layout["annotations"].append(
                place | {"text": f"<b>{shown.text(title)}</b>", "showarrow": False, "xanchor": "left"}
            )
        layout["annotations"] += _words(axes, shown, tail, is_time)
        data += [trace | {"xaxis": f"x{tail}", "yaxis": f"y{tail}"} for trace in _traces(axes, shown, is_time)]
    layout["height"] = round(max(420.0, 80.0 * figure.get_size_inches()[1]))
    return {"data": data, "layout": layout}


def _is_twin(first: Axes, other: Axes) -> bool:
    """Whether other axes lie on the first ones, with a scale of their own on the right."""
    sides = [str(axes.yaxis.get_label_position()) for axes in (first, other)]
    own = first.get_subplotspec()
    return sides == ["left", "right"] and own is not None and own == other.get_subplotspec()


def _tail(figure: Figure, axes: Axes) -> str:
    place = figure.axes.index(axes) + 1
    return "" if place == 1 else str(place)


def _shares(own: Sequence[Axes]) -> bool:
    return len(own) > 1 and own[0].get_shared_x_axes().joined(own[0], own[-1])


def _words(axes: Axes, shown: Display, tail: str, is_time: bool) -> list[dict[str, Any]]:
    """Text beside lines and bands, where these are."""
    line = axis_line(axes.yaxis) if shown.converts else None
    zone = getattr(axes.xaxis.get_major_locator(), "tz", None)
    found = []
    for text in axes.texts:
        if text.get_transform() == axes.transData and text.get_text().strip():
            at = np.asarray(text.get_position(), dtype=float)
            x = (_times(at[:1], zone) if is_time else course_of(at[:1]))[0]
            y = course_of([at[1] if line is None else line(float(at[1]))])[0]
            place = {"x": x, "y": y, "xref": f"x{tail}", "yref": f"y{tail}", "xanchor": text.get_horizontalalignment()}
            found.append(place | {"text": shown.text(text.get_text()), "showarrow": False})
    return found


def _times(values: Any, zone: Any) -> list[str]:
    """Spell days of Matplotlib as local times."""
    stamps = (num2date(v, tz=zone) for v in np.asarray(values, dtype=float))  # type: ignore[no-untyped-call]
    return [stamp.strftime("%Y-%m-%d %H:%M") for stamp in stamps]


def _traces(axes: Axes, shown: Display, is_time: bool) -> list[dict[str, Any]]:
    """Lines and bands of axes; lines without data, such as keys of a legend, are left out."""
    line = axis_line(axes.yaxis) if shown.converts else None
    zone = getattr(axes.xaxis.get_major_locator(), "tz", None)

    def course(values: Any) -> list[float | None]:
        numbers: Any = np.asarray(values, dtype=float)
        numbers = numbers if line is None else line(numbers)
        return [float(f"{v:.{_DIGITS}g}") if np.isfinite(v) else None for v in numbers]

    def times(values: Any) -> list[Any]:
        return _times(values, zone) if is_time else course_of(values)

    traces = []
    for artist in axes.get_children():
        if isinstance(artist, PolyCollection):
            for path in artist.get_paths():
                ends = np.asarray(path.vertices)
                colours: Any = artist.get_facecolor()
                colour = to_hex(colours[0]) if len(colours) else "#888888"
                traces.append({
                    "type": "scatter", "mode": "lines", "x": times(ends[:, 0]), "y": course(ends[:, 1]),
                    "fill": "toself", "fillcolor": colour, "line": {"width": 0}, "hoverinfo": "skip",
                    "opacity": float(artist.get_alpha() or 1.0), **_named(artist.get_label()),
                })  # fmt: skip
        elif isinstance(artist, Line2D) and np.size(artist.get_xdata()) > 1:
            x, y = artist.get_data()
            steps = {"steps-pre": "vh", "steps-post": "hv"}.get(str(artist.get_drawstyle()))
            drawn = {"color": to_hex(artist.get_color()), "width": 1.6}
            drawn |= {"dash": _DASHES.get(str(artist.get_linestyle()), "solid")} | ({"shape": steps} if steps else {})
            if artist.get_transform() == axes.transData:  # not a straight line across the axes
                traces.append({"type": "scatter", "mode": "lines", "x": times(x), "y": course(y), "line": drawn,
                               "connectgaps": False, **_named(artist.get_label())})  # fmt: skip
    return traces


def course_of(values: Any) -> list[float]:
    """Round numbers along an axis that is no time.

    Parameters
    ----------
    values : array_like
        Any [any].
    """
    return [float(f"{v:.{_DIGITS}g}") for v in np.asarray(values, dtype=float)]


def _named(label: Any) -> dict[str, Any]:
    text = str(label)
    return {"showlegend": False} if text.startswith("_") or not text else {"name": text}


@cache
def _library() -> str | None:
    """Pack plotly's own script; None where plotly is not installed."""
    try:
        from plotly.offline import get_plotlyjs
    except ImportError:
        return None
    return _packed(get_plotlyjs())


def _packed(text: str) -> str:
    return base64.b64encode(gzip.compress(text.encode(), compresslevel=9, mtime=0)).decode("ascii")


def zoom_scripts(figures: Mapping[str, Any]) -> dict[str, str] | None:
    """Give what a page holds so that its figures zoom: plotly and figures, packed, and colours of a dark page.

    None where plotly is not installed, or there is nothing to zoom.

    Parameters
    ----------
    figures : mapping of str to dict
        Of `zoomable`, by the id of the figure in the page.
    """
    library = _library()
    if not figures or library is None:
        return None
    packed = _packed(json.dumps(dict(figures), allow_nan=False))
    return {"library": library, "figures": packed, "dark": json.dumps(DARK)}
