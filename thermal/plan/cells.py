"""Zones of a survey, and their drawing as the cells of a plan.

The plan's walls run along the middle of the drawing's interior walls and along the inner face of its exterior walls,
as a ``+`` cell counts half to each side and a ``#`` cell to nobody.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from thermal._types import BoolArray, FloatArray, Int32Array
from thermal.case.building import EXTERIOR_WALL, INTERIOR_WALL, OUTSIDE, FloorPlan
from thermal.case.validation import RESERVED
from thermal.errors import LostRoomError, PlanError
from thermal.plan.guard import checked_number
from thermal.plan.survey import OUTSIDE_LABEL, WALL_LABEL, FloorSurvey
from thermal.plan.windows import WINDOW_HEIGHT

_SAMPLES = 5  # points a cell's side at which the drawing is looked at


@dataclass(frozen=True, eq=False)
class ZonedFloor:
    """A floor whose rooms are grouped to zones.

    Parameters
    ----------
    name : str
        Of the floor.
    height : float
        Clear height [m].
    survey : FloorSurvey
        The drawing.
    zones : ndarray of int, shape (n_row, n_col)
        Zone, from 1, of each element of the survey; interior walls are split at their middle, 0 is outside and
        exterior wall.
    names : tuple of str
        Names of the zones, in the order of their numbers.
    offset : tuple of float
        Rightwards and downwards, from the common origin of the floors to the survey's first corner [m].
    glazing : mapping
        Area of the windows that the drawing shows, by zone and facade [m2].
    """

    name: str
    height: float
    survey: FloorSurvey
    zones: Int32Array
    names: tuple[str, ...]
    offset: tuple[float, float] = (0.0, 0.0)
    glazing: Mapping[str, Mapping[str, float]] = field(default_factory=dict)

    @property
    def areas(self) -> dict[str, float]:
        """Area of each zone on the drawing, with half of its interior walls [m2]."""
        counts = np.bincount(self.zones.ravel(), minlength=len(self.names) + 1)[1:]
        return {name: float(n) * self.survey.pixel**2 for name, n in zip(self.names, counts, strict=True)}


def split_walls(survey: FloorSurvey) -> tuple[Int32Array, BoolArray]:
    """Tell exterior from interior walls, and give each interior wall half to each side.

    Parameters
    ----------
    survey : FloorSurvey
        A floor.

    Returns
    -------
    tuple
        Room of each element, 0 for outside and exterior wall; and where exterior wall is.

    Notes
    -----
    An element of wall is exterior when it is no deeper in the wall than the wall is thick where it stands, which is the
    way from the nearest point outside to the nearest room.
    """
    labels = survey.labels
    to_room, room = ndimage.distance_transform_edt(labels <= 0, return_indices=True)
    wall = labels == WALL_LABEL
    exterior = np.zeros_like(wall)
    if (labels == OUTSIDE_LABEL).any():
        to_outside, outside = ndimage.distance_transform_edt(labels != OUTSIDE_LABEL, return_indices=True)
        thickness = to_room[outside[0], outside[1]]
        exterior = wall & (to_outside < thickness - 1e-6)
    rooms: Int32Array = np.where(wall & ~exterior, labels[room[0], room[1]], np.maximum(labels, 0)).astype(np.int32)
    return rooms, exterior


def draw_cells(
    floors: Sequence[ZonedFloor], cell_size: float, phase: tuple[float, float]
) -> tuple[tuple[FloorPlan, ...], tuple[float, float]]:
    """Draw floors as plans of tokens on one grid.

    Parameters
    ----------
    floors : sequence of ZonedFloor
        Lowest first.
    cell_size : float
        Side of a cell [m].
    phase : tuple of float
        Rightwards and downwards, from the common origin to a corner of the grid [-], in cells.

    Returns
    -------
    tuple
        Plans of all floors, of one shape, cropped to what is built; and rightwards and downwards, from the common
        origin to their first corner [m].

    Raises
    ------
    LostRoomError
        A zone has no cell, or falls apart, at this size.
    """
    frame = _frame(floors, cell_size, phase)
    drawn = [_floor_tokens(floor, cell_size, *frame) for floor in floors]
    built = np.any([tokens != OUTSIDE for tokens in drawn], axis=0)
    rows, columns = (np.flatnonzero(built.any(axis=axis)) for axis in (1, 0))
    part = np.s_[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
    corner = (frame[0] + float(columns[0]) * cell_size, frame[1] + float(rows[0]) * cell_size)
    return tuple(FloorPlan(f.name, f.height, tokens[part]) for f, tokens in zip(floors, drawn, strict=True)), corner


def _frame(floors: Sequence[ZonedFloor], cell_size: float, phase: tuple[float, float]) -> tuple[float, float, int, int]:
    """Corner of a grid that holds all floors with two cells around them [m], and its rows and columns."""
    left = min(f.offset[0] for f in floors)
    top = min(f.offset[1] for f in floors)
    right = max(f.offset[0] + f.zones.shape[1] * f.survey.pixel for f in floors)
    bottom = max(f.offset[1] + f.zones.shape[0] * f.survey.pixel for f in floors)
    x, y = left + (phase[0] - 3.0) * cell_size, top + (phase[1] - 3.0) * cell_size
    return x, y, int((bottom - y) / cell_size) + 4, int((right - x) / cell_size) + 4


def _floor_tokens(
    floor: ZonedFloor, cell_size: float, left: float, top: float, n_row: int, n_col: int
) -> NDArray[np.str_]:
    """Look at points of each cell, take what most of it is, and put one-cell walls between."""
    samples = _sample(floor, cell_size, left, top, n_row, n_col)
    middle = samples[:, _SAMPLES // 2, :, _SAMPLES // 2]
    purity = (samples == middle[:, None, :, None]).mean(axis=(1, 3))
    cells = _connected(middle, floor, cell_size)
    interior = _between(cells, purity)
    beside = ndimage.binary_dilation((cells > 0) | interior, np.ones((3, 3))) & (cells == 0)
    cells = np.where(interior, 0, cells)
    cells = _connected(cells, floor, cell_size)
    tokens = np.array([OUTSIDE, *floor.names])[cells]
    tokens[(cells == 0) & (interior | ((middle > 0) & ~beside))] = INTERIOR_WALL
    tokens[beside] = EXTERIOR_WALL
    return tokens


def _sample(floor: ZonedFloor, cell_size: float, left: float, top: float, n_row: int, n_col: int) -> Int32Array:
    """Zones at points of the cells, shape (n_row, samples, n_col, samples)."""
    pixel = floor.survey.pixel
    step = (np.arange(_SAMPLES) + 0.5) / _SAMPLES
    found = []
    for start, offset, count, most in (
        (top, floor.offset[1], n_row, floor.zones.shape[0]),
        (left, floor.offset[0], n_col, floor.zones.shape[1]),
    ):
        metres = start + (np.arange(count)[:, None] + step) * cell_size - offset
        # A point on the line between two elements is in the second, whatever rounding says.
        index = np.floor(metres.ravel() / pixel + 1e-6).astype(int) + 1
        found.append(np.clip(index, 0, most + 1))
    framed = np.pad(floor.zones, 1)
    sampled: Int32Array = framed[np.ix_(found[0], found[1])]
    return sampled.reshape(n_row, _SAMPLES, n_col, _SAMPLES)


def _between(cells: Int32Array, purity: FloatArray) -> BoolArray:
    """Cells to make a wall of: of each two zones side by side, the cell that is more on the line between them."""
    wall = np.zeros(cells.shape, dtype=bool)
    for here, there in ((np.s_[:, :-1], np.s_[:, 1:]), (np.s_[:-1], np.s_[1:])):
        a, b = cells[here], cells[there]
        apart = (a != b) & (a > 0) & (b > 0) & ~wall[here] & ~wall[there]
        first = (purity[here] < purity[there]) | ((purity[here] == purity[there]) & (a < b))
        wall[here] |= apart & first
        wall[there] |= apart & ~first
    return wall


def _connected(cells: Int32Array, floor: ZonedFloor, cell_size: float) -> Int32Array:
    """Keep the largest part of each zone; refuse when there is none, or when much of one is lost."""
    result = cells.copy()
    pieces = ndimage.find_objects(cells, len(floor.names))
    for number, where in enumerate(pieces, start=1):
        if where is None:
            raise _lost(floor, number, cell_size, "no cell")
        parts, count = ndimage.label(cells[where] == number)
        if count > 1:
            sizes = np.bincount(parts.ravel())[1:]
            if sizes.max() < 0.9 * sizes.sum():
                raise _lost(floor, number, cell_size, f"{count} parts")
            result[where][(parts > 0) & (parts != 1 + int(sizes.argmax()))] = 0
    return result


def _lost(floor: ZonedFloor, number: int, cell_size: float, found: str) -> LostRoomError:
    where = f"floor {floor.name!r}: zone {floor.names[number - 1]!r}"
    expected = f"a room with cells of {cell_size:g} m that hang together"
    return LostRoomError(where, expected, found, "choose a smaller cell_size")


def propose_zones(
    survey: FloorSurvey,
    floor: str,
    height: float,
    *,
    names: Mapping[str, tuple[float, float]] | None = None,
    smallest_zone: float = 4.0,
    window_height: float = WINDOW_HEIGHT,
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
    window_height : float
        Of windows that the drawing shows [m], 0 to 30; no more than `height` counts.

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
    numbers = number[rooms]
    checked_number(window_height, "window_height", 0.0, 30.0, "m")
    glazing = _glazing(survey, numbers, titles, min(window_height, height))
    if glazing:
        width = sum(window.width for window in survey.windows)
        remark = f"{width:.1f} m of windows are drawn, taken as {min(window_height, height):g} m high"
        survey = replace(survey, remarks=(*survey.remarks, remark))
    return ZonedFloor(floor, float(height), survey, numbers, tuple(titles), glazing=glazing)


def _glazing(
    survey: FloorSurvey, zones: Int32Array, names: Sequence[str], height: float
) -> dict[str, dict[str, float]]:
    """Area of the windows that a drawing shows, by zone and facade [m2]."""
    found: dict[str, dict[str, float]] = {}
    for window in survey.windows:
        zone = int(zones[round(window.room[1]), round(window.room[0])])
        if zone > 0:
            sides = found.setdefault(names[zone - 1], {})
            sides[window.facade] = sides.get(window.facade, 0.0) + window.width * height
    return found


def distinct_names(floors: Sequence[ZonedFloor], taken: Collection[str] = ()) -> tuple[ZonedFloor, ...]:
    """Tell apart rooms of several floors to which their drawings give the same name, as each has its kitchen.

    Parameters
    ----------
    floors : sequence of ZonedFloor
        Of a building.
    taken : collection of str
        Names of zones that are there already.

    Returns
    -------
    tuple of ZonedFloor
        With the floor's name before such names; names that a person gave stay, and are refused where they collide.
    """
    listed = [*taken, *(name for floor in floors for name in floor.names)]
    again = {name for name in listed if listed.count(name) > 1}
    changed = []
    for floor in floors:
        drawn = {room.name for room in floor.survey.rooms if room.name} & again
        new = {name: f"{floor.name} {name}" for name in drawn if f"{floor.name} {name}" not in listed}
        names = tuple(new.get(name, name) for name in floor.names)
        glazing = {new.get(zone, zone): sides for zone, sides in floor.glazing.items()}
        changed.append(replace(floor, names=names, glazing=glazing))
    return tuple(changed)


def _given_names(survey: FloorSurvey, floor: str, names: Mapping[str, tuple[float, float]]) -> dict[int, str]:
    """Names that were chosen, by room; the drawing's own where there is no other and they are not in doubt."""
    chosen: dict[int, str] = {}
    for name, point in names.items():
        label = survey.label_at(point)
        where = f"floor {floor!r}: name {name!r}"
        if name in RESERVED or not name.strip() or name != name.strip():
            raise PlanError(where, "a name that plans have no use for themselves", repr(name))
        if label <= 0:
            place = f"({point[0]:g}, {point[1]:g}), a wall" if label == 0 else f"({point[0]:g}, {point[1]:g}), outside"
            raise PlanError(where, "a point in a room", place)
        if label in chosen:
            raise PlanError(where, "a room of its own", f"that of {chosen[label]!r}")
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
