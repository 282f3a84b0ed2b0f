"""What is on the labelling page: a building that may be unfinished, as it is saved after every change."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from thermal.case.building import EXTERIOR_WALL, INTERIOR_WALL, OUTSIDE
from thermal.case.schema import Airflow
from thermal.plan.list import FloorEntry

Finite = Annotated[float, Field(allow_inf_nan=False)]
Name = Annotated[str, Field(max_length=200)]

#: The first tokens of every legend: outside, exterior wall, interior wall.
BASIC = (OUTSIDE, EXTERIOR_WALL, INTERIOR_WALL)

_MOST_FLOORS, _MOST_DEVICES = 200, 20_000


class _Entry(BaseModel):
    """Base of the models: what is not named is refused, and nothing changes afterwards."""

    model_config = ConfigDict(frozen=True, extra="forbid")


class Picture(_Entry):
    """A drawing under a floor's plan.

    Parameters
    ----------
    file
        PNG in the page's folder of pictures.
    width, height
        Of the drawing [px].
    matrix
        Takes column and row of the drawing [px] to those of the plan [cells]: a, b, c, d, e, f of ``a x + c y + e``
        and ``b x + d y + f``.
    """

    file: Name
    width: Finite
    height: Finite
    matrix: tuple[Finite, Finite, Finite, Finite, Finite, Finite]


class DraftFloor(_Entry):
    """A floor on the page.

    Parameters
    ----------
    name
        Of the floor.
    height
        Clear height [m].
    rows, columns
        Of its plan.
    legend
        Tokens of its cells, `BASIC` first, then the zones.
    runs
        Cells row by row: number in the legend, how many of it, and so on.
    drawing
        What it was made from.
    picture
        Drawing under it.
    """

    name: Name
    height: Finite
    rows: Annotated[int, Field(ge=0, le=100_000)]
    columns: Annotated[int, Field(ge=0, le=100_000)]
    legend: tuple[Name, ...] = BASIC
    runs: tuple[int, ...] = ()
    drawing: FloorEntry | None = None
    picture: Picture | None = None

    @property
    def tokens(self) -> NDArray[np.str_]:
        """Tokens of the cells, shape (rows, columns)."""
        cells = np.repeat(np.asarray(self.runs[::2], dtype=np.int64), self.runs[1::2])
        return np.asarray(self.legend, dtype=np.str_)[cells.reshape(self.rows, self.columns)]


class DraftDevice(_Entry):
    """A device on the page.

    Parameters
    ----------
    name, type
        As in a case.
    zone
        The zone it serves.
    room
        What the list of devices says of its place, where no zone has that name.
    floor, x, y
        Where it stands on the page, if it was put anywhere [cells].
    """

    name: Name
    type: Name
    zone: Name | None = None
    room: Name = ""
    floor: Name | None = None
    x: Finite | None = None
    y: Finite | None = None


class Site(_Entry):
    """Where the building stands, as far as that is known.

    Parameters
    ----------
    latitude, longitude
        North and east positive [deg].
    elevation
        Height above the sea [m].
    timezone
        IANA name.
    """

    latitude: Finite | None = None
    longitude: Finite | None = None
    elevation: Finite | None = None
    timezone: Name = ""


class Draft(_Entry):
    """A building on the page.

    Parameters
    ----------
    format
        Version of the file.
    revision
        Counts the changes.
    name
        Of the case.
    site
        Where it stands.
    orientation
        Clockwise from true north to the plan's "up" [deg].
    cell_size
        Side of a cell [m].
    floors
        Lowest first.
    devices
        In the order of the case.
    glazing
        Glazed area [m2] by zone and facade.
    airflows
        As in a case.
    weather_station
        Entity of the site's weather.
    seconds
        Time that somebody worked on it [s].
    """

    format: Literal[1] = 1
    revision: Annotated[int, Field(ge=0)] = 0
    name: Name
    site: Site = Site()
    orientation: Finite = 0.0
    cell_size: Annotated[float, Field(gt=0, allow_inf_nan=False)] = 0.5
    floors: Annotated[tuple[DraftFloor, ...], Field(max_length=_MOST_FLOORS)] = ()
    devices: Annotated[tuple[DraftDevice, ...], Field(max_length=_MOST_DEVICES)] = ()
    glazing: dict[Name, dict[Name, Finite]] = Field(default_factory=dict)
    airflows: tuple[Airflow, ...] = ()
    weather_station: Name = "weather_station"
    seconds: Annotated[float, Field(ge=0, allow_inf_nan=False)] = 0.0
