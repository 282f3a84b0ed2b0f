"""Ten ways to cut a floor into zones."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ideal_air_trials.plan import Rectangle

#: Layouts by the number of zones on a floor.
KINDS = {
    6: ("strips23", "strips32", "ends", "corridor", "grid", "pinwheel"),
    5: ("perimeter", "strips22"),
    4: ("quad", "ends4"),
}
LEAST_WIDTH = 6  # cells of a zone in a row of zones
LEAST_DEPTH = 7  # cells of a row of zones on the north side
_WIDTHS = (36, 66)  # cells of a floor from west to east, the end left out

Span = tuple[int, int]  # first cell and the end
Cut = tuple[int, int, tuple[Rectangle, ...]]  # columns, rows, zones
Generator = np.random.Generator


def draw_cut(rng: Generator, zones: int) -> tuple[str, Cut]:
    """Draw the zones of a floor.

    Parameters
    ----------
    rng : Generator
        Random numbers.
    zones : int
        How many, one of `KINDS`.

    Returns
    -------
    tuple
        Its kind; columns and rows of cells inside of the exterior walls, and the zones.
    """
    columns = int(rng.integers(*_WIDTHS))
    kind = str(rng.choice(KINDS[zones]))
    return kind, _CUTS[kind](rng, columns)


def _cells(rng: Generator, low: int, high: int) -> int:
    """Draw a number of cells, both ends included."""
    return int(rng.integers(low, high + 1))


def _row(rng: Generator, columns: int, parts: int) -> list[Span]:
    """Cut a row into parts of unlike width with a wall of one cell between them."""
    weights = rng.uniform(0.8, 1.25, parts)
    room = columns - (parts - 1)
    widths = np.maximum(np.round(weights / weights.sum() * room).astype(int), LEAST_WIDTH)
    widths[-1] += room - widths.sum()
    ends = np.cumsum(widths + 1) - 1
    return [(int(end - width), int(end)) for end, width in zip(ends, widths, strict=True)]


def _zone(name: str, columns: Span, rows: Span) -> Rectangle:
    return Rectangle(name, *columns, *rows)


def _strips(north: int, south: int, middle: Span) -> Callable[[Generator, int], Cut]:
    """Rows of zones on both long sides of a middle one, which is as deep as drawn between two numbers of cells."""

    def cut(rng: Generator, columns: int) -> Cut:
        core = _cells(rng, *middle)
        rows = _cells(rng, 8, 12) + _cells(rng, 8, 12) + core + 2
        depth = min(_cells(rng, 8, 12), rows - core - 2 - LEAST_DEPTH)
        zones = [_zone("C", (0, columns), (depth + 1, depth + 1 + core))]
        for name, parts, span in (("N", north, (depth + 2 + core, rows)), ("S", south, (0, depth))):
            zones += [_zone(f"{name}{k}", c, span) for k, c in enumerate(_row(rng, columns, parts), 1)]
        return columns, rows, tuple(zones)

    return cut


def _ends(rng: Generator, columns: int) -> Cut:
    """Two zones over the whole depth at the ends, and between them one in the south, a core, and two in the north."""
    columns = max(columns, 50)
    rows = _cells(rng, 26, 36)
    west, east = _cells(rng, 9, 13), columns - _cells(rng, 9, 13)
    south, north = _cells(rng, 8, 11), rows - _cells(rng, 8, 11)
    first, last = west + 1, east - 1
    middle = (first + last) // 2 + _cells(rng, -3, 3)
    return columns, rows, (
        _zone("W", (0, west), (0, rows)), _zone("E", (east, columns), (0, rows)),
        _zone("S", (first, last), (0, south)), _zone("C", (first, last), (south + 1, north - 1)),
        _zone("N1", (first, middle), (north, rows)), _zone("N2", (middle + 1, last), (north, rows)),
    )  # fmt: skip


def _grid(rng: Generator, columns: int) -> Cut:
    """Three zones in the south, and as wide ones in the north."""
    rows = _cells(rng, 18, 26)
    middle = rows // 2 + _cells(rng, -2, 2)
    zones: list[Rectangle] = []
    for k, span in enumerate(_row(rng, columns, 3), 1):
        zones += [_zone(f"S{k}", span, (0, middle)), _zone(f"N{k}", span, (middle + 1, rows))]
    return columns, rows, tuple(zones)


def _ring(parts: int) -> Callable[[Generator, int], Cut]:
    """Return a core within a ring of zones, each of which begins at a corner; the northern one in one part or two."""

    def cut(rng: Generator, columns: int) -> Cut:
        rows, depth = _cells(rng, 26, 34), _cells(rng, 8, 10)
        right, top = columns - depth, rows - depth
        zones = [
            _zone("S", (0, right - 1), (0, depth)), _zone("E", (right, columns), (0, top - 1)),
            _zone("W", (0, depth), (depth + 1, rows)),
        ]  # fmt: skip
        if parts == 2:
            middle = (depth + 1 + columns) // 2 + _cells(rng, -3, 3)
            zones += [_zone("N1", (depth + 1, middle), (top, rows)), _zone("N2", (middle + 1, columns), (top, rows))]
        else:
            zones += [_zone("N", (depth + 1, columns), (top, rows))]
        return columns, rows, (*zones, _zone("C", (depth + 1, right - 1), (depth + 1, top - 1)))

    return cut


def _quad(rng: Generator, columns: int) -> Cut:
    """Four corners."""
    rows = _cells(rng, 18, 26)
    north, east = rows // 2 + _cells(rng, -2, 2), columns // 2 + _cells(rng, -4, 4)
    return columns, rows, (
        _zone("SW", (0, east), (0, north)), _zone("SE", (east + 1, columns), (0, north)),
        _zone("NW", (0, east), (north + 1, rows)), _zone("NE", (east + 1, columns), (north + 1, rows)),
    )  # fmt: skip


def _ends_of_four(rng: Generator, columns: int) -> Cut:
    """Two zones over the whole depth at the ends, and two between them."""
    rows = _cells(rng, 16, 22)
    west, east = _cells(rng, 9, 13), columns - _cells(rng, 9, 13)
    middle, between = rows // 2, (west + 1, east - 1)
    return columns, rows, (
        _zone("W", (0, west), (0, rows)), _zone("E", (east, columns), (0, rows)),
        _zone("S", between, (0, middle)), _zone("N", between, (middle + 1, rows)),
    )  # fmt: skip


_CUTS: dict[str, Callable[[Generator, int], Cut]] = {
    "strips23": _strips(2, 3, (7, 10)), "strips32": _strips(3, 2, (7, 10)), "strips22": _strips(2, 2, (7, 10)),
    "corridor": _strips(3, 2, (4, 5)), "ends": _ends, "grid": _grid, "pinwheel": _ring(2), "perimeter": _ring(1),
    "quad": _quad, "ends4": _ends_of_four,
}  # fmt: skip
