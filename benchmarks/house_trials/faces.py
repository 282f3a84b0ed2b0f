"""Surfaces of a house: what bounds each room, which rooms share it, and where it looks to."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations

from house_trials.specification import SIDES, House, Room

Point = tuple[float, float, float]

STRUCTURE = 0.3  # [m], thickness of what lies between two floors
DOORWAY_AREA = 1.8  # [m2]
_PANE_HEIGHT, _SILL = 1.25, 0.85  # [m]
_LEAST = 0.05  # [m], side of the smallest surface


@dataclass(frozen=True)
class Face:
    """A surface.

    Parameters
    ----------
    name : str
        Name, which no other surface has.
    kind : str
        `wall`, `floor` or `ceiling`, as its room sees it.
    room : str
        Room that it belongs to.
    other : str
        Room, `outdoor`, `ground`, `cellar` or `attic` behind it.
    corners : tuple of Point
        Counterclockwise seen from outside of the room, upper left first [m].
    side : str
        Of an exterior wall; empty for others.
    length : float
        Of a wall [m].
    glass : float
        Area of its window [m2].
    """

    name: str
    kind: str
    room: str
    other: str
    corners: tuple[Point, ...]
    side: str = ""
    length: float = 0.0
    glass: float = 0.0

    @property
    def area(self) -> float:
        """Area, window included [m2]."""
        a, b, c = self.corners[:3]
        return _distance(a, b) * _distance(b, c)

    @property
    def pane(self) -> tuple[float, float, float, float]:
        """Window on the wall: start, sill, length and height [m]."""
        length = self.glass / _PANE_HEIGHT
        return (self.length - length) / 2.0, _SILL, length, _PANE_HEIGHT


def _distance(a: Point, b: Point) -> float:
    return float(sum((p - q) ** 2 for p, q in zip(a, b, strict=True)) ** 0.5)


def faces(house: House) -> tuple[Face, ...]:
    """Return every surface; one between two rooms comes twice, once as each of them sees it.

    Parameters
    ----------
    house : House
        Geometry.
    """
    found = [face for room in house.rooms for face in _outside(house, room)]
    for a, b in combinations(house.rooms, 2):
        found += [*_partition(house, a, b), *_between_floors(house, a, b)]
    return tuple(found)


def partner(face: Face) -> str:
    """Return the name of a surface between rooms as the room behind it sees it.

    Parameters
    ----------
    face : Face
        Of one room.
    """
    seen = {"wall": "wall", "floor": "ceiling", "ceiling": "floor"}[face.kind]
    return f"{face.other} {seen} {face.room}"


def bottom(house: House, floor: int) -> float:
    """Return the height of a floor's surface [m].

    Parameters
    ----------
    house : House
        Geometry.
    floor : int
        From 0.
    """
    return floor * (house.height + STRUCTURE)


def upright(start: tuple[float, float], end: tuple[float, float], low: float, high: float) -> tuple[Point, ...]:
    """Return the corners of a wall that goes from start to end, seen from outside [m].

    Parameters
    ----------
    start, end : tuple of float
        Plan.
    low, high : float
        Heights [m].
    """
    return (*start, high), (*start, low), (*end, low), (*end, high)


def _edges(room: Room) -> dict[str, tuple[tuple[float, float], tuple[float, float]]]:
    """Start and end of each side, from left to right seen from outside."""
    w, e, s, n = room.west, room.east, room.south, room.north
    return {
        "south": ((w, s), (e, s)),
        "east": ((e, s), (e, n)),
        "north": ((e, n), (w, n)),
        "west": ((w, n), (w, s)),
    }


def _outside(house: House, room: Room) -> Iterator[Face]:
    """Exterior walls, and floor and ceiling where no room lies beyond."""
    west, east = min(r.west for r in house.rooms), max(r.east for r in house.rooms)
    south, north = min(r.south for r in house.rooms), max(r.north for r in house.rooms)
    low = bottom(house, room.floor)
    outer = {
        "west": room.west == west,
        "east": room.east == east,
        "south": room.south == south,
        "north": room.north == north,
    }
    for side in SIDES:
        if outer[side]:
            start, end = _edges(room)[side]
            length = abs(end[0] - start[0]) + abs(end[1] - start[1])
            most = max(length - 0.4, 0.0) * _PANE_HEIGHT
            glass = round(min(house.glazing[side] * length * house.height, most), 3)
            yield Face(f"{room.name} wall {side}", "wall", room.name, "outdoor",
                       upright(start, end, low, low + house.height), side, length, glass)  # fmt: skip
    if room.floor == 0:
        yield Face(f"{room.name} floor {house.bottom}", "floor", room.name, house.bottom, _flat(room, low, up=False))
    if room.floor == house.floors - 1:
        yield Face(f"{room.name} ceiling {house.top}", "ceiling", room.name, house.top,
                   _flat(room, low + house.height, up=True))  # fmt: skip


def _flat(room: Room, z: float, *, up: bool) -> tuple[Point, ...]:
    ring = [(room.west, room.south), (room.east, room.south), (room.east, room.north), (room.west, room.north)]
    return tuple((x, y, z) for x, y in (ring if up else ring[::-1]))


def _partition(house: House, a: Room, b: Room) -> Iterator[Face]:
    """Yield the wall between two rooms of one floor, as each of them sees it."""
    if a.floor != b.floor:
        return
    low, opposite = bottom(house, a.floor), {"east": "west", "west": "east", "north": "south", "south": "north"}
    for side, other in opposite.items():
        if getattr(a, side) != getattr(b, other):
            continue
        across = ("south", "north") if side in ("east", "west") else ("west", "east")
        start, end = (
            max(getattr(a, across[0]), getattr(b, across[0])),
            min(getattr(a, across[1]), getattr(b, across[1])),
        )
        if end - start < _LEAST:
            continue
        line = getattr(a, side)
        points = [(line, start), (line, end)] if side in ("east", "west") else [(start, line), (end, line)]
        for room, behind, seen in ((a, b, side), (b, a, other)):
            p, q = points if seen in ("east", "south") else points[::-1]
            yield Face(f"{room.name} wall {behind.name}", "wall", room.name, behind.name,
                       upright(p, q, low, low + house.height), "", end - start)  # fmt: skip


def _between_floors(house: House, a: Room, b: Room) -> Iterator[Face]:
    """Yield what two rooms share that lie one above the other."""
    lower, upper = sorted((a, b), key=lambda room: room.floor)
    shared = Room(
        "", lower.floor, max(a.west, b.west), min(a.east, b.east), max(a.south, b.south), min(a.north, b.north)
    )
    if upper.floor - lower.floor != 1 or min(shared.east - shared.west, shared.north - shared.south) < _LEAST:
        return
    low, high = bottom(house, upper.floor) - STRUCTURE, bottom(house, upper.floor)
    yield Face(f"{lower.name} ceiling {upper.name}", "ceiling", lower.name, upper.name, _flat(shared, low, up=True))
    yield Face(f"{upper.name} floor {lower.name}", "floor", upper.name, lower.name, _flat(shared, high, up=False))
