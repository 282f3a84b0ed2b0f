"""Zones proposed from rooms: a closet joins the room that its door leads to, and everything gets a name."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from thermal._types import Int32Array
from thermal.case.validation import RESERVED
from thermal.errors import PlanError, describe
from thermal.plan.cells import ZonedFloor, split_walls
from thermal.plan.guard import checked_number
from thermal.plan.survey import FloorSurvey


def propose_zones(
    survey: FloorSurvey,
    floor: str,
    height: float,
    *,
    names: Mapping[str, tuple[float, float]] | None = None,
    smallest_zone: float = 4.0,
) -> ZonedFloor:
    """Propose the zones of a floor: its rooms, with those that are too small for one joined to the room next to them.

    Parameters
    ----------
    survey : FloorSurvey
        The floor.
    floor : str
        Its name.
    height : float
        Clear height [m], 1.5 to 30.
    names : mapping, optional
        A point of the drawing [px] by name, for rooms whose zone is to have that name. Others are named as in the
        drawing (texts of a DXF), or ``<floor>_R01`` and so on, row by row.
    smallest_zone : float
        Smaller rooms without a name [m2] join the one behind their widest door, or else along their longest wall.

    Returns
    -------
    ZonedFloor
        Zones of the floor.

    Raises
    ------
    PlanError
        A name stands for two rooms, is one that plans use for themselves, or points at no room.
    PlanError
        A number is out of its range.
    """
    checked_number(height, "height", 1.5, 30.0, "m")
    checked_number(smallest_zone, "smallest_zone", 0.0, 100.0, "m2")
    given = _given_names(survey, floor, names or {})
    rooms, _ = split_walls(survey)
    owner = _join_small(survey, rooms, given, smallest_zone)
    zones = [label for label in range(1, len(owner)) if owner[label] == label]
    number = np.zeros(len(owner), dtype=np.int32)
    for position, label in enumerate(zones, start=1):
        number[owner == label] = position
    taken = set(given.values())
    titles: list[str] = []
    for label in zones:
        title = given.get(label, "")
        count = len(titles)
        while not title or (label not in given and title in taken):
            count += 1
            title = f"{floor}_R{count:02d}"
        taken.add(title)
        titles.append(title)
    joined = int(np.count_nonzero(owner[1:] != np.arange(1, len(owner))))
    if joined:
        small = "1 room" if joined == 1 else f"{joined} rooms"
        remark = f"{small} under {smallest_zone:g} m2 joined the zone behind the door, or beside where there is none"
        survey = replace(survey, remarks=(*survey.remarks, remark))
    return ZonedFloor(floor, float(height), survey, number[rooms], tuple(titles))


def _given_names(survey: FloorSurvey, floor: str, names: Mapping[str, tuple[float, float]]) -> dict[int, str]:
    """Names that were chosen, by room; the drawing's own where there is no other and they are not in doubt."""
    chosen: dict[int, str] = {}
    for name, point in names.items():
        label = survey.label_at(point)
        where = f"floor {floor!r}: name {name!r}"
        if name in RESERVED or not name.strip() or name != name.strip():
            raise PlanError(describe(where, "a name that plans have no use for themselves", repr(name)))
        if label <= 0:
            place = f"({point[0]:g}, {point[1]:g}), a wall" if label == 0 else f"({point[0]:g}, {point[1]:g}), outside"
            raise PlanError(describe(where, "a point in a room", place))
        if label in chosen:
            raise PlanError(describe(where, "a room of its own", f"that of {chosen[label]!r}"))
        chosen[label] = name
    own = [room.name for room in survey.rooms]
    for room in survey.rooms:
        unique = own.count(room.name) == 1 and room.name not in chosen.values()
        if room.name and room.label not in chosen and room.name not in RESERVED and unique:
            chosen[room.label] = room.name
    return chosen


def _join_small(survey: FloorSurvey, rooms: Int32Array, given: Mapping[int, str], smallest: float) -> NDArray[np.int32]:
    """Room whose zone each room belongs to; itself for most."""
    area = {room.label: room.area for room in survey.rooms}
    owner = np.arange(len(survey.rooms) + 1, dtype=np.int32)
    shared: dict[tuple[int, int], int] = {}
    for here, there in ((rooms[:, :-1], rooms[:, 1:]), (rooms[:-1], rooms[1:])):
        apart = (here != there) & (here > 0) & (there > 0)
        pairs, lengths = np.unique(np.sort(np.column_stack([here[apart], there[apart]])), axis=0, return_counts=True)
        for (a, b), length in zip(pairs.tolist(), lengths.tolist(), strict=True):
            shared[a, b] = shared.get((a, b), 0) + length
    for label in sorted(area, key=lambda label: area[label]):
        if area[label] >= smallest or label in given:
            continue
        beside = {other: n for pair, n in shared.items() if label in pair for other in pair if other != label}
        doors = {o: d.width for d in survey.doors if label in d.rooms for o in d.rooms if o != label and o in beside}
        choice = doors or {o: float(n) for o, n in beside.items()}
        if choice:
            target = owner[max(choice, key=lambda other: choice[other])]
            if target != owner[label]:
                owner[owner == owner[label]] = target
    return owner
