"""Floor plan of an office: rectangles of cells, the walls about them, and their panes. All floors are alike."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

CELL = 0.5  # [m], side of a plan's cell; a partition is one cell thick, and its middle is the edge of two zones
CEILING_VOID = 0.3  # [m] between the ceiling of a floor and the next floor
SIDES = ("south", "east", "north", "west")
PANE_EDGE = 0.05  # [-], of a wall's length, on either side of its pane
PANE_SHARE = 1.0 - 2.0 * PANE_EDGE
SILL, PANE_MARGIN = 0.9, 0.1  # [m], a pane begins there, or lower where it would come nearer to the wall's top or foot
_SAME = 1e-6  # [m], between coordinates that are one

Point = tuple[float, float]


@dataclass(frozen=True)
class Rectangle:
    """A zone of the floor plan in cells, its walls left out, counted from the south-west corner inside.

    Parameters
    ----------
    name : str
        Name without the floor.
    west, east, south, north : int
        First cells and the ends, which are the next cells after the last.
    """

    name: str
    west: int
    east: int
    south: int
    north: int


@dataclass(frozen=True)
class Box:
    """A zone in metres: inner faces of exterior walls, middles of partitions.

    Parameters
    ----------
    west, east, south, north : float
        [m]
    """

    west: float
    east: float
    south: float
    north: float

    @property
    def area(self) -> float:
        """Floor area [m2]."""
        return (self.east - self.west) * (self.north - self.south)

    def at(self, side: str) -> float:
        """Coordinate of a side [m].

        Parameters
        ----------
        side : str
            One of `SIDES`.
        """
        return {"south": self.south, "north": self.north, "west": self.west, "east": self.east}[side]

    def along(self, side: str) -> tuple[float, float]:
        """First and last coordinate along a side [m].

        Parameters
        ----------
        side : str
            One of `SIDES`.
        """
        return (self.west, self.east) if side in ("south", "north") else (self.south, self.north)


@dataclass(frozen=True)
class Wall:
    """A wall of one floor, from left to right as seen from outside of its zone.

    Parameters
    ----------
    zone : str
        Name without the floor.
    side : str
        Of the zone.
    start, end : tuple of float
        [m]
    other : str or None
        Zone on its far side; None for outdoors.
    """

    zone: str
    side: str
    start: Point
    end: Point
    other: str | None

    @property
    def length(self) -> float:
        """Length of the wall [m]."""
        return float(np.hypot(self.end[0] - self.start[0], self.end[1] - self.start[1]))

    def point(self, share: float) -> Point:
        """Point at a share of the length [m].

        Parameters
        ----------
        share : float
            From the start [-].
        """
        (x0, y0), (x1, y1) = self.start, self.end
        return x0 + share * (x1 - x0), y0 + share * (y1 - y0)


@dataclass(frozen=True)
class Layout:
    """Geometry.

    Parameters
    ----------
    kind : str
        How the floor is cut into zones.
    columns, rows : int
        Cells of a floor inside of the exterior walls.
    rectangles : tuple of Rectangle
        Zones of one floor.
    floors : int
        Number of floors.
    height : float
        Clear height [m].
    orientation : float
        Clockwise from true north to the plan's up [degree].
    glazing : dict
        Glazed share of the facades [-]; 0 where there is no window.
    blank : str or None
        Facade without windows.
    """

    kind: str
    columns: int
    rows: int
    rectangles: tuple[Rectangle, ...]
    floors: int
    height: float
    orientation: float
    glazing: Mapping[str, float]
    blank: str | None

    @property
    def zone_names(self) -> tuple[str, ...]:
        """Every zone, floor by floor."""
        return tuple(zone_name(floor, r.name) for floor in range(self.floors) for r in self.rectangles)

    def box(self, rectangle: Rectangle) -> Box:
        """Return a zone in metres.

        Parameters
        ----------
        rectangle : Rectangle
            One of the layout.
        """
        r = rectangle
        return Box(
            0.0 if r.west == 0 else (r.west - 0.5) * CELL,
            r.east * CELL if r.east == self.columns else (r.east + 0.5) * CELL,
            0.0 if r.south == 0 else (r.south - 0.5) * CELL,
            r.north * CELL if r.north == self.rows else (r.north + 0.5) * CELL,
        )

    def boxes(self) -> dict[str, Box]:
        """Return the zones of a floor by their names without it."""
        return {r.name: self.box(r) for r in self.rectangles}

    def areas(self) -> dict[str, float]:
        """Floor area of every zone of the building [m2]."""
        boxes = self.boxes()
        return {zone_name(floor, name): box.area for floor in range(self.floors) for name, box in boxes.items()}

    def levels(self, floor: int) -> tuple[float, float]:
        """Heights of a floor's slab and of its ceiling [m].

        Parameters
        ----------
        floor : int
            From 0.
        """
        bottom = floor * (self.height + CEILING_VOID)
        return bottom, bottom + self.height


def zone_name(floor: int, name: str) -> str:
    """Return the name of a zone in the building.

    Parameters
    ----------
    floor : int
        From 0.
    name : str
        On the floor.
    """
    return f"F{floor + 1}_{name}"


def walls(layout: Layout) -> list[Wall]:
    """List the walls of one floor, partitions once from either side.

    Parameters
    ----------
    layout : Layout
        The office.
    """
    boxes, found = layout.boxes(), []
    edges = {"south": 0.0, "north": layout.rows * CELL, "west": 0.0, "east": layout.columns * CELL}
    for name, box in boxes.items():
        for side in SIDES:
            at, (low, high) = box.at(side), box.along(side)
            parts = [(low, high, None)] if abs(at - edges[side]) < _SAME else _beside(boxes, name, side)
            for first, last, other in parts:
                start, end = (first, last) if side in ("south", "east") else (last, first)
                if side in ("south", "north"):
                    found.append(Wall(name, side, (start, at), (end, at), other))
                else:
                    found.append(Wall(name, side, (at, start), (at, end), other))
    return found


def _beside(boxes: Mapping[str, Box], name: str, side: str) -> list[tuple[float, float, str | None]]:
    """First and last coordinate [m] and name of each zone beside a side of a zone."""
    facing = {"south": "north", "north": "south", "west": "east", "east": "west"}[side]
    found: list[tuple[float, float, str | None]] = []
    low, high = boxes[name].along(side)
    for other, box in boxes.items():
        first, last = max(low, box.along(side)[0]), min(high, box.along(side)[1])
        if other != name and abs(box.at(facing) - boxes[name].at(side)) < _SAME and last - first > _SAME:
            found.append((first, last, other))
    return found


def outer_zones(layout: Layout, side: str | None = None) -> list[str]:
    """List the zones of the building with an exterior wall, sorted by name.

    Parameters
    ----------
    layout : Layout
        The office.
    side : str, optional
        Facade that counts; all of them where not given.
    """
    there = {w.zone for w in walls(layout) if w.other is None and side in (None, w.side)}
    return sorted(zone_name(floor, name) for floor in range(layout.floors) for name in there)


def pane(layout: Layout, wall: Wall) -> tuple[float, float]:
    """Lowest and highest point of the pane in an exterior wall, above its floor [m]; equal where there is none.

    Parameters
    ----------
    layout : Layout
        The office.
    wall : Wall
        Of a facade.
    """
    height = layout.glazing[wall.side] * layout.height / PANE_SHARE
    sill = max(PANE_MARGIN, min(SILL, layout.height - height - PANE_MARGIN))
    return sill, sill + height


def glazing(layout: Layout) -> dict[str, dict[str, float]]:
    """Glazed area by zone and facade [m2].

    Parameters
    ----------
    layout : Layout
        The office.
    """
    found: dict[str, dict[str, float]] = {}
    for floor in range(layout.floors):
        for wall in walls(layout):
            if wall.other is None and layout.glazing[wall.side] > 0.0:
                low, high = pane(layout, wall)
                area = PANE_SHARE * wall.length * (high - low)
                found.setdefault(zone_name(floor, wall.zone), {})[wall.side] = area
    return found


def tokens(layout: Layout, floor: int) -> list[list[str]]:
    """Return the rows of the plan of a floor, the northern one first.

    Parameters
    ----------
    layout : Layout
        The office.
    floor : int
        From 0.
    """
    rows = [["#"] * (layout.columns + 2) for _ in range(layout.rows + 2)]
    for row in rows[1:-1]:
        row[1:-1] = ["+"] * layout.columns
    for r in layout.rectangles:
        for row in rows[r.south + 1 : r.north + 1]:
            row[r.west + 1 : r.east + 1] = [zone_name(floor, r.name)] * (r.east - r.west)
    return rows[::-1]
