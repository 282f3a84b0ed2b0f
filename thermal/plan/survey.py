"""What was understood of one floor's drawing: walls, rooms, doors, and how large all of it is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from thermal._types import FloatArray, Int32Array
from thermal.errors import PlanError
from thermal.plan.guard import checked_number

#: Labels of what is no room.
OUTSIDE_LABEL, WALL_LABEL = -1, 0


@dataclass(frozen=True)
class PlanSettings:
    """What counts as a wall, a door and a room.

    Parameters
    ----------
    widest_door : float
        Gaps in walls up to this width are doors and closed [m], 0.3 to 4. Default: a wide single door; double doors
        need 2.
    thickest_wall : float
        Two lines at most this far apart are the faces of one wall [m], 0.1 to 2. Default: an insulated exterior wall.
    thinnest_wall : float
        Thinner strokes are no walls but doors' arcs, furniture, text, dimensions [m], 0 to 0.5; 0 keeps every stroke.
        Default: less than the thinnest partition (75 mm).
    smallest_room : float
        Smaller spaces are shafts and count as wall [m2], 0.1 to 50.
    smallest_zone : float
        Smaller rooms are proposed as part of the zone next to them [m2], 0 to 100; 0 makes each room a zone. Default:
        less than a single office, more than a closet.

    Raises
    ------
    PlanError
        A value is out of its range.
    """

    widest_door: float = 1.3
    thickest_wall: float = 0.6
    thinnest_wall: float = 0.06
    smallest_room: float = 1.0
    smallest_zone: float = 4.0

    def __post_init__(self) -> None:
        checked_number(self.widest_door, "widest_door", 0.3, 4.0, "m")
        checked_number(self.thickest_wall, "thickest_wall", 0.1, 2.0, "m")
        checked_number(self.thinnest_wall, "thinnest_wall", 0.0, 0.5, "m")
        checked_number(self.smallest_room, "smallest_room", 0.1, 50.0, "m2")
        checked_number(self.smallest_zone, "smallest_zone", 0.0, 100.0, "m2")
        if self.thinnest_wall >= self.thickest_wall:
            raise PlanError(
                f"thinnest_wall: expected less than thickest_wall ({self.thickest_wall} m), found {self.thinnest_wall}"
            )


@dataclass(frozen=True)
class Room:
    """A room of a drawing.

    Parameters
    ----------
    label : int
        Its number in `FloorSurvey.labels`, from 1.
    area : float
        Clear floor area, between the faces of its walls [m2].
    centre : tuple of float
        Column and row of its innermost point [px of the survey].
    name : str
        As the drawing has it; empty when it has none.
    """

    label: int
    area: float
    centre: tuple[float, float]
    name: str = ""


@dataclass(frozen=True)
class Door:
    """A gap in a wall that was closed.

    Parameters
    ----------
    rooms : tuple of int
        Labels on its two sides, the lower first; -1 is outside.
    width : float
        Clear width [m].
    centre : tuple of float
        Column and row [px of the survey].
    """

    rooms: tuple[int, int]
    width: float
    centre: tuple[float, float]


@dataclass(frozen=True, eq=False)
class FloorSurvey:
    """One floor as it was understood from its drawing.

    Parameters
    ----------
    source : str
        The drawing.
    labels : ndarray of int, shape (n_row, n_col)
        -1 outside, 0 wall, else the room; upright.
    pixel : float
        Side of an element of `labels` [m].
    rooms : tuple of Room
        In the order of their labels.
    doors : tuple of Door
        Closed gaps.
    turned : float
        Angle by which the drawing's walls stood clockwise of upright, taken out of `labels` [deg].
    placement : ndarray, shape (3, 3)
        Takes (column, row, 1) of the drawing to those of `labels` [px].
    remarks : tuple of str
        What a look at the picture should confirm.
    ink : ndarray of bool or None, shape (n_row, n_col)
        What is drawn there, walls or not, for pictures.
    """

    source: str
    labels: Int32Array
    pixel: float
    rooms: tuple[Room, ...]
    doors: tuple[Door, ...] = ()
    turned: float = 0.0
    placement: FloatArray | None = None
    remarks: tuple[str, ...] = ()
    ink: NDArray[np.bool_] | None = None

    def place(self, point: tuple[float, float]) -> tuple[float, float]:
        """Where a point of the drawing lies.

        Parameters
        ----------
        point : tuple of float
            Column and row of the drawing [px]; of a DXF, its own x and y.

        Returns
        -------
        tuple of float
            Column and row of `labels` [px].
        """
        matrix = np.eye(3) if self.placement is None else self.placement
        column, row, _ = matrix @ np.array([point[0], point[1], 1.0])
        return float(column), float(row)

    def label_at(self, point: tuple[float, float]) -> int:
        """Label at a point of the drawing.

        Parameters
        ----------
        point : tuple of float
            Column and row of the drawing [px]; of a DXF, its own x and y.

        Returns
        -------
        int
            As in `labels`; -1 beyond them.
        """
        column, row = (round(x) for x in self.place(point))
        n_row, n_col = self.labels.shape
        return int(self.labels[row, column]) if 0 <= row < n_row and 0 <= column < n_col else OUTSIDE_LABEL
