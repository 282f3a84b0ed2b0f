"""Rooms of one storey side by side: their names, boxes, and who is behind which wall."""

from __future__ import annotations

from dataclasses import dataclass

from energyplus_trials.frame import Objects

from foreign_models import objects as ep

_BESIDE = {"east": (1, 0), "west": (-1, 0), "north": (0, 1), "south": (0, -1)}
_COLUMNS = {1: ("",), 2: ("WEST", "EAST"), 3: ("WEST", "MIDDLE", "EAST")}
_ROWS = {1: ("",), 2: ("SOUTH", "NORTH")}


@dataclass(frozen=True)
class Rooms:
    """Rooms of one size in columns and rows.

    Parameters
    ----------
    columns, rows : int
        From west to east, 1 to 3, and from south to north, 1 or 2; two rooms at least.
    length, depth, height : float
        Of a room, inside [m].
    glass : tuple of float
        Of an outer wall to the south or north, and to the east or west [m2].
    """

    columns: int
    rows: int
    length: float
    depth: float
    height: float
    glass: tuple[float, float]

    @property
    def names(self) -> tuple[str, ...]:
        """By where they are, row by row."""
        return tuple(row + column for row in _ROWS[self.rows] for column in _COLUMNS[self.columns])

    @property
    def area(self) -> float:
        """Floor area of a room [m2]."""
        return self.length * self.depth

    @property
    def outer(self) -> tuple[float, float]:
        """Area of outer walls, windows among them, and of windows, of all rooms [m2]."""
        along, across = 2 * self.columns, 2 * self.rows
        walls = self.height * (along * self.length + across * self.depth)
        return walls, along * self.glass[0] + across * self.glass[1]

    def box(self, number: int) -> Objects:
        """Return a room's faces and windows.

        Parameters
        ----------
        number : int
            In the order of `names`.
        """
        listed = self.names
        i, k = number % self.columns, number // self.columns
        behind, glass = {}, {}
        for side, (a, b) in _BESIDE.items():
            if 0 <= i + a < self.columns and 0 <= k + b < self.rows:
                behind[side] = listed[(k + b) * self.columns + i + a]
            else:
                glass[side] = self.glass[0 if b else 1]
        corner = (i * self.length, k * self.depth)
        return ep.box(listed[number], corner, (self.length, self.depth, self.height), glass, behind)
