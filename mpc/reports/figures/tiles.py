"""A building without a plan: one tile a zone, as large as its floor area."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from mpc.reports.figures.plan import colour_bar, error_colour, error_scale, ink_on, signed_kelvin
from mpc.reports.figures.style import Picture, picture, styled
from thermal._types import FloatArray

Box = tuple[float, float, float, float]


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
    scale = error_scale(error)
    order = np.argsort(-areas, kind="stable")
    boxes = _squarify(areas[order] / areas.sum() * width * height, (0.0, 0.0, width, height))
    figure = Figure(figsize=(6.4, 4.3))
    axes = figure.subplots()
    for i, (x, y, w, h) in zip(order, boxes, strict=True):
        colour = error_colour(float(error[i]), scale)
        axes.add_patch(Rectangle((x, y), w, h, facecolor=colour, edgecolor="#3A3F45", linewidth=1.2))
        number = signed_kelvin(float(error[i]))
        for text in (f"{zones[i]}\n{number}\n{areas[i]:.0f} m²", f"{zones[i]}\n{number}", number):
            lines = text.split("\n")
            size = min(9.0, 72 * w / (0.66 * max(map(len, lines))), 72 * h / (1.5 * len(lines)))
            if size >= 6.0 or text == number:
                axes.text(x + w / 2, y + h / 2, text, fontsize=size, color=ink_on(colour), ha="center", va="center")
                break
    axes.set(xlim=(0, width), ylim=(0, height), title=title)
    axes.set_axis_off()
    colour_bar(figure, axes, scale)
    listed = "; ".join(f"{z} {signed_kelvin(e)}" for z, e in zip(zones, error, strict=True) if np.isfinite(e))
    return [picture(figure, f"Error of each zone, {title}: {listed}")]


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
