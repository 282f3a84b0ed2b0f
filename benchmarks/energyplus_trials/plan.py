"""Floor plans: how a trial's zones are drawn, on the plan's grid and in metres."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from energyplus_trials.specification import Layout, Zone

CELL_SIZE = 0.5  # [m]
SIDES = ("north", "east", "south", "west")
OPPOSITE = {"north": "south", "south": "north", "east": "west", "west": "east"}
SILL = 0.8  # [m], of every pane

Template = Callable[[np.random.Generator], list[tuple[int, int, int, int]]]


def draw_zones(rng: np.random.Generator) -> tuple[Zone, ...]:
    """Draw the zones of a floor, from one of six kinds of office, mirrored or not.

    Parameters
    ----------
    rng : Generator
        Random numbers.
    """
    template = (_rows, _rows, _ring, _bar, _corridor, _ell)[rng.integers(6)]
    boxes = template(rng)
    width, depth = max(b[1] for b in boxes), max(b[3] for b in boxes)
    if rng.random() < 0.5:
        boxes = [(width - e, width - w, s, n) for w, e, s, n in boxes]
    if rng.random() < 0.5:
        boxes = [(w, e, depth - n, depth - s) for w, e, s, n in boxes]
    return tuple(Zone(f"Z{number}", *box) for number, box in enumerate(boxes, 1))


def _cuts(rng: np.random.Generator, low: int, high: int, parts: int) -> list[int]:
    """Return the lines that part a stretch of cells in pieces of about one size."""
    shares = np.cumsum(rng.uniform(0.75, 1.25, parts))
    return [low, *np.round(low + (high - low) * shares[:-1] / shares[-1]).astype(int).tolist(), high]


def _row(rng: np.random.Generator, west: int, east: int, south: int, north: int, parts: int) -> list[tuple[int, ...]]:
    lines = _cuts(rng, west, east, parts)
    return [(a, b, south, north) for a, b in itertools.pairwise(lines)]


def _rows(rng: np.random.Generator) -> list[tuple[int, int, int, int]]:
    """Return rooms to both long facades with an open room between."""
    width, a, b, c = rng.integers(40, 68), rng.integers(9, 14), rng.integers(8, 14), rng.integers(9, 14)
    south = _row(rng, 0, int(width), 0, int(a), int(rng.integers(2, 4)))
    north = _row(rng, 0, int(width), int(a + b), int(a + b + c), int(rng.integers(1, 5)))
    return _boxes([*south, (0, width, a, a + b), *north])


def _corridor(rng: np.random.Generator) -> list[tuple[int, int, int, int]]:
    width, a, b, c = rng.integers(36, 64), rng.integers(9, 14), rng.integers(4, 6), rng.integers(9, 14)
    south = _row(rng, 0, int(width), 0, int(a), int(rng.integers(1, 4)))
    north = _row(rng, 0, int(width), int(a + b), int(a + b + c), int(rng.integers(2, 4)))
    return _boxes([*south, (0, width, a, a + b), *north])


def _ring(rng: np.random.Generator) -> list[tuple[int, int, int, int]]:
    """Return four facades around a core."""
    x = np.cumsum([0, rng.integers(9, 14), rng.integers(18, 34), rng.integers(9, 14)])
    y = np.cumsum([0, rng.integers(9, 13), rng.integers(9, 15), rng.integers(9, 13)])
    north = _row(rng, int(x[1]), int(x[2]), int(y[2]), int(y[3]), int(rng.integers(1, 3)))
    rest = [(x[0], x[1], 0, y[3]), (x[2], x[3], 0, y[3]), (x[1], x[2], 0, y[1]), (x[1], x[2], y[1], y[2])]
    return _boxes([*rest, *north])


def _bar(rng: np.random.Generator) -> list[tuple[int, int, int, int]]:
    return _boxes(_row(rng, 0, int(rng.integers(42, 70)), 0, int(rng.integers(14, 24)), int(rng.integers(3, 6))))


def _ell(rng: np.random.Generator) -> list[tuple[int, int, int, int]]:
    """Return two wings at a right angle."""
    x, y = rng.integers(14, 22), rng.integers(14, 22)
    width, depth = x + rng.integers(18, 40), y + rng.integers(14, 34)
    wing = _row(rng, int(x), int(width), 0, int(y), int(rng.integers(1, 4)))
    lines = _cuts(rng, int(y), int(depth), int(rng.integers(1, 3)))
    other = [(0, x, a, b) for a, b in itertools.pairwise(lines)]
    return _boxes([(0, x, 0, y), *wing, *other])


def _boxes(found: list[tuple[int, ...]]) -> list[tuple[int, int, int, int]]:
    return [(int(w), int(e), int(s), int(n)) for w, e, s, n in found]


def tokens(zones: tuple[Zone, ...], floor: int) -> NDArray[np.str_]:
    """Draw the plan of a floor, first row = the plan's up.

    Parameters
    ----------
    zones : tuple of Zone
        Of a floor.
    floor : int
        Its number, from 0.
    """
    width, depth = max(z.east for z in zones) + 1, max(z.north for z in zones) + 1
    cells = np.full((depth + 2, width + 2), ".", dtype="<U16")  # a rim of outside, cut off at the end
    for z in zones:
        cells[z.south + 1 : z.north + 2, z.west + 1 : z.east + 2] = "+"
    for z in zones:
        cells[z.south + 2 : z.north + 1, z.west + 2 : z.east + 1] = f"F{floor + 1}_{z.name}"
    outside = cells == "."
    near = np.zeros_like(outside)
    for rows in (-1, 0, 1):
        for columns in (-1, 0, 1):
            near |= np.roll(outside, (rows, columns), axis=(0, 1))
    cells[(cells == "+") & near] = "#"
    return cells[1:-1, 1:-1][::-1]


@dataclass(frozen=True)
class Rectangle:
    """A zone between the middles of its partitions and the inner faces of its exterior walls [m]."""

    west: float
    east: float
    south: float
    north: float

    @property
    def area(self) -> float:
        """Floor area [m2]."""
        return (self.east - self.west) * (self.north - self.south)


@dataclass(frozen=True)
class Segment:
    """A straight piece of a zone's outline: exterior wall (`other` is None) or partition.

    Parameters
    ----------
    zone : str
        Zone, without the floor; it lies to the left of the way from start to end.
    side : str
        Side of the zone, in the plan's axes.
    other : str or None
        Zone on the far side.
    start, end : tuple of float
        Ends (x, y) [m].
    """

    zone: str
    side: str
    other: str | None
    start: tuple[float, float]
    end: tuple[float, float]

    @property
    def length(self) -> float:
        """Length [m]."""
        return abs(self.end[0] - self.start[0]) + abs(self.end[1] - self.start[1])


def _neighbours(zone: Zone, side: str, zones: tuple[Zone, ...]) -> list[Zone]:
    """Return the zones beyond a side."""
    level = getattr(zone, side)
    low, high = ("west", "east") if side in ("north", "south") else ("south", "north")
    return [
        z
        for z in zones
        if z is not zone
        and getattr(z, OPPOSITE[side]) == level
        and max(getattr(z, low), getattr(zone, low)) < min(getattr(z, high), getattr(zone, high))
    ]


def rectangles(zones: tuple[Zone, ...]) -> dict[str, Rectangle]:
    """Return the outline of each zone.

    Parameters
    ----------
    zones : tuple of Zone
        Of a floor.
    """
    found = {}
    for z in zones:
        at = {}
        for side in SIDES:
            exterior = 1.0 if side in ("west", "south") else 0.0  # inner face of the line of wall cells
            at[side] = (getattr(z, side) + (0.5 if _neighbours(z, side, zones) else exterior)) * CELL_SIZE
        found[z.name] = Rectangle(at["west"], at["east"], at["south"], at["north"])
    return found


def segments(zones: tuple[Zone, ...]) -> list[Segment]:
    """Return every exterior wall and, once from each side, every partition.

    Parameters
    ----------
    zones : tuple of Zone
        Of a floor.
    """
    outlines, found = rectangles(zones), []
    for z in zones:
        a = outlines[z.name]
        for side in SIDES:
            along = ("west", "east") if side in ("north", "south") else ("south", "north")
            level, low, high = getattr(a, side), getattr(a, along[0]), getattr(a, along[1])
            pieces: list[tuple[str | None, float, float]] = []
            for other in _neighbours(z, side, zones):
                b = outlines[other.name]
                pieces.append((other.name, max(low, getattr(b, along[0])), min(high, getattr(b, along[1]))))
            for neighbour, start, end in pieces or [(None, low, high)]:
                ends = (start, end) if side in ("south", "east") else (end, start)
                first, last = ((s, level) if side in ("south", "north") else (level, s) for s in ends)
                found.append(Segment(z.name, side, neighbour, first, last))
    return found


def panes(layout: Layout) -> dict[tuple[str, str], float]:
    """Return the length of the pane of each exterior wall that has one, by zone and side [m].

    Parameters
    ----------
    layout : Layout
        Geometry.
    """
    found = {}
    for s in segments(layout.zones):
        share = layout.glazing[s.side] * layout.height / layout.pane_height
        if s.other is None and share > 0.0:
            found[s.zone, s.side] = round(min(share, 0.94) * s.length, 2)
    return found


def glazing(layout: Layout) -> dict[str, dict[str, float]]:
    """Return the glazed area of each zone and facade as the case states it [m2].

    Parameters
    ----------
    layout : Layout
        Geometry.
    """
    found: dict[str, dict[str, float]] = {}
    for floor in range(layout.floors):
        for (zone, side), length in panes(layout).items():
            found.setdefault(f"F{floor + 1}_{zone}", {})[side] = round(length * layout.pane_height, 3)
    return found
