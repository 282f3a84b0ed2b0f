"""The floor of the bundled case: zones, facades and panes of glass, on the plan's own grid."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

CELL_SIZE = 0.5  # [m], side of a plan cell
HEIGHT = 3.0  # [m], floor to ceiling
ORIENTATION = 15.0  # [degree], clockwise from true north to the plan's up: no facade looks exactly north
# Interior cells of the three rows (north first) and of the three columns of the middle row (west first).
# One '+' cell stands between two rows or columns and counts half to each side.
ROW_CELLS = (8, 13, 9)
COLUMN_CELLS = (9, 26, 11)
ZONES = ("F1_N", "F1_W", "F1_C", "F1_E", "F1_S")
# One pane per facade of a zone, centred: length [m]; all panes are as high and stand as high above the floor.
PANE_LENGTHS: Mapping[str, Mapping[str, float]] = MappingProxyType(
    {
        "F1_N": MappingProxyType({"north": 14.0, "east": 2.5}),
        "F1_W": MappingProxyType({"west": 5.0}),
        "F1_E": MappingProxyType({"east": 5.5}),
        "F1_S": MappingProxyType({"south": 16.0, "west": 2.5, "east": 3.0}),
    }
)
PANE_HEIGHT = 1.4  # [m]
PANE_SILL = 0.9  # [m]


@dataclass(frozen=True)
class Rectangle:
    """A zone's outline between the middles of its partitions and the inner faces of its exterior walls.

    Parameters
    ----------
    x0, y0, x1, y1 : float
        South-west and north-east corner in the plan's axes [m], origin at the plan's south-west inner corner.
    """

    x0: float
    y0: float
    x1: float
    y1: float

    @property
    def area(self) -> float:
        """Floor area [m2]."""
        return (self.x1 - self.x0) * (self.y1 - self.y0)


@dataclass(frozen=True)
class Segment:
    """A straight piece of a zone's outline: an exterior wall (`other` is None) or a partition to `other`.

    Parameters
    ----------
    zone : str
        Zone whose outline it is; it lies to the left of the way from start to end.
    side : str
        `north`, `east`, `south` or `west` of the zone, in the plan's axes.
    other : str or None
        Zone on the far side, None outdoors.
    start, end : tuple of float
        Ends (x, y) [m].
    """

    zone: str
    side: str
    other: str | None
    start: tuple[float, float]
    end: tuple[float, float]

    @property
    def name(self) -> str:
        """Name that no other segment has."""
        return f"{self.zone}_{self.side}_{self.other or 'outdoor'}"

    @property
    def length(self) -> float:
        """Length [m]."""
        return abs(self.end[0] - self.start[0]) + abs(self.end[1] - self.start[1])


def _edges(cells: tuple[int, int, int]) -> tuple[float, ...]:
    """Return the four edges [m] of three stretches of cells with one '+' cell between neighbours."""
    first = (cells[0] + 0.5) * CELL_SIZE
    second = first + (cells[1] + 1.0) * CELL_SIZE
    return 0.0, first, second, second + (cells[2] + 0.5) * CELL_SIZE


def zone_rectangles() -> dict[str, Rectangle]:
    """Return the outline of each zone, in the order of the plan."""
    x = _edges(COLUMN_CELLS)
    south, middle, north = ROW_CELLS[::-1]
    y = _edges((south, middle, north))
    return {
        "F1_N": Rectangle(x[0], y[2], x[3], y[3]),
        "F1_W": Rectangle(x[0], y[1], x[1], y[2]),
        "F1_C": Rectangle(x[1], y[1], x[2], y[2]),
        "F1_E": Rectangle(x[2], y[1], x[3], y[2]),
        "F1_S": Rectangle(x[0], y[0], x[3], y[1]),
    }


def plan_tokens() -> NDArray[np.str_]:
    """Return the plan's tokens, shape (n_row, n_column), first row = the plan's up."""
    width = sum(COLUMN_CELLS) + 2
    wall, partition = ["#"], ["+"]
    west, core, east = COLUMN_CELLS
    middle = ["F1_W"] * west + partition + ["F1_C"] * core + partition + ["F1_E"] * east
    rows = [["#"] * (width + 2)]
    rows += [wall + ["F1_N"] * width + wall] * ROW_CELLS[0]
    rows += [wall + partition * width + wall]
    rows += [wall + middle + wall] * ROW_CELLS[1]
    rows += [wall + partition * width + wall]
    rows += [wall + ["F1_S"] * width + wall] * ROW_CELLS[2]
    rows += [["#"] * (width + 2)]
    return np.array(rows)


def plan_areas(tokens: NDArray[np.str_]) -> dict[str, float]:
    """Return each zone's floor area [m2] as the case format counts it: a '+' cell is half of each side's.

    Parameters
    ----------
    tokens : ndarray of str, shape (n_row, n_column)
        The plan.
    """
    areas = {zone: float((tokens == zone).sum()) for zone in ZONES}
    for row, column in zip(*np.where(tokens == "+"), strict=True):
        above_below = tokens[row - 1, column], tokens[row + 1, column]
        sides = [t for t in (*above_below, tokens[row, column - 1], tokens[row, column + 1]) if t in areas]
        for zone in sides:
            areas[zone] += 1.0 / max(len(sides), 2)
    return {zone: cells * CELL_SIZE**2 for zone, cells in areas.items()}


def segments() -> tuple[Segment, ...]:
    """Return every exterior wall and, once from each side, every partition."""
    outlines = zone_rectangles()
    found: list[Segment] = []
    for zone, a in outlines.items():
        for side, opposite in _OPPOSITE.items():
            level, low, high = _side(a, side)
            pieces: list[tuple[str | None, float, float]] = []
            for other, b in outlines.items():
                facing, other_low, other_high = _side(b, opposite)
                start, end = max(low, other_low), min(high, other_high)
                if other != zone and facing == level and end > start:
                    pieces.append((other, start, end))
            for neighbour, start, end in pieces or [(None, low, high)]:
                along = (start, end) if side in ("south", "east") else (end, start)  # the zone lies to the left
                first, last = ((s, level) if side in ("south", "north") else (level, s) for s in along)
                found.append(Segment(zone, side, neighbour, first, last))
    return tuple(found)


_OPPOSITE = MappingProxyType({"south": "north", "north": "south", "west": "east", "east": "west"})


def _side(outline: Rectangle, side: str) -> tuple[float, float, float]:
    """Return where a side lies and from where to where it goes [m]."""
    if side in ("south", "north"):
        return outline.y0 if side == "south" else outline.y1, outline.x0, outline.x1
    return outline.x0 if side == "west" else outline.x1, outline.y0, outline.y1


def glazing() -> dict[str, dict[str, float]]:
    """Return the glazed area [m2] per zone and facade."""
    return {
        zone: {side: round(length * PANE_HEIGHT, 6) for side, length in sides.items()}
        for zone, sides in PANE_LENGTHS.items()
    }
