"""Draft of the labelling page, and its translation from and to buildings."""

from collections.abc import Mapping, Sequence
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, ValidationError

from thermal.case.building import PLAN_TOKENS as BASIC
from thermal.case.building import (
    Airflow,
    Building,
    Device,
    Emitting,
    Entry,
    FloorPlan,
    FloorPlans,
    GeometryQuality,
    Location,
)
from thermal.case.plan import facade_areas
from thermal.errors import LabelError
from thermal.plan.drawing import Finite
from thermal.plan.guard import first_fault
from thermal.plan.list import FloorEntry

Name = Annotated[str, Field(max_length=200)]


_MOST_FLOORS, _MOST_DEVICES = 200, 20_000


class Picture(Entry):
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


class DraftFloor(Entry):
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


class DraftDevice(Entry):
    """A device on the page.

    Parameters
    ----------
    name, type
        As in a case.
    zone
        The zone it serves.
    fed_by
        Devices that feed it.
    emitter
        What it gives its heat by, as in a case; the page keeps it.
    room
        What the list of devices says of its place, where no zone has that name.
    floor, x, y
        Where it stands on the page, if it was put anywhere [cells].
    """

    name: Name
    type: Name
    zone: Name | None = None
    fed_by: tuple[Name, ...] = ()
    emitter: Emitting | None = None
    room: Name = ""
    floor: Name | None = None
    x: Finite | None = None
    y: Finite | None = None


class Site(Entry):
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


class Draft(Entry):
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
        Glazed area [m2] by zone and facade, where it is not what `glazing_ratio` says.
    glazing_ratio
        Glazed share of facades, 0 to 1 [-]: by floor (empty: of the whole building), then by facade (empty: of all).
    airflows
        As in a case.
    weather_station
        Entity of the site's weather.
    geometry_quality
        How the geometry was come by.
    seconds
        Time that somebody worked on it [s].
    """

    format: Literal[1] = 1
    revision: Annotated[int, Field(ge=0)] = 0
    name: Name
    site: Site = Site()
    orientation: Finite = 0.0
    cell_size: Annotated[float, Field(gt=0, le=100, allow_inf_nan=False)] = 0.5
    floors: Annotated[tuple[DraftFloor, ...], Field(max_length=_MOST_FLOORS)] = ()
    devices: Annotated[tuple[DraftDevice, ...], Field(max_length=_MOST_DEVICES)] = ()
    glazing: dict[Name, dict[Name, Finite]] = Field(default_factory=dict)
    glazing_ratio: dict[Name, dict[Name, Finite]] = Field(default_factory=dict)
    airflows: tuple[Airflow, ...] = ()
    weather_station: Name = "weather_station"
    geometry_quality: GeometryQuality = "approximate"
    seconds: Annotated[float, Field(ge=0, allow_inf_nan=False)] = 0.0


#: What a draft and a building hold alike.
_SHARED = ("name", "orientation", "airflows", "weather_station", "geometry_quality")
_MOST_CELLS = 4_000_000  # of one floor, as in the import of drawings


def encode_floor(
    name: str,
    height: float,
    tokens: NDArray[np.str_],
    drawing: FloorEntry | None = None,
    picture: Picture | None = None,
) -> DraftFloor:
    """Write a plan of tokens as runs.

    Parameters
    ----------
    name : str
        Of the floor.
    height : float
        Clear height [m].
    tokens : ndarray of str, shape (n_row, n_col)
        As in a case.
    drawing : FloorEntry, optional
        What it was made from.
    picture : Picture, optional
        Drawing under it.

    Returns
    -------
    DraftFloor
        The floor.
    """
    names, cells = np.unique(tokens, return_inverse=True)
    legend = (*BASIC, *(str(n) for n in names if n not in BASIC))
    number = np.array([legend.index(str(n)) for n in names])[cells.ravel()]
    starts = np.flatnonzero(np.concatenate([[True], number[1:] != number[:-1]]))
    counts = np.diff(np.concatenate([starts, [number.size]]))
    runs = np.column_stack([number[starts], counts]).ravel().tolist()
    rows, columns = tokens.shape
    cells_of = {"rows": rows, "columns": columns, "legend": legend, "runs": tuple(runs)}
    return DraftFloor(name=name, height=height, drawing=drawing, picture=picture, **cells_of)


def parse_draft(content: Any, where: str) -> Draft:
    """Make a draft of JSON, after a look at everything that could break what works on it.

    Parameters
    ----------
    content : object
        What the JSON holds.
    where : str
        Where it comes from, for messages.

    Returns
    -------
    Draft
        Each floor has as many cells as its rows and columns say, all of its legend.

    Raises
    ------
    LabelError
        It is no draft; the message names the key.
    """
    try:
        draft = Draft.model_validate(content)
    except ValidationError as error:
        raise LabelError(*first_fault(error, where)) from error
    for floor in draft.floors:
        _check_runs(floor, f"{where}: floor {floor.name!r}")
    return draft


def _check_runs(floor: DraftFloor, where: str) -> None:
    try:
        runs = np.asarray(floor.runs, dtype=np.float64)  # an integer of any size
    except OverflowError as error:
        raise LabelError(where, "runs of all cells, within the legend", "an integer of over 300 digits") from error
    if floor.rows * floor.columns > _MOST_CELLS:
        raise LabelError(where, f"at most {_MOST_CELLS} cells", f"{floor.rows} x {floor.columns}")
    if floor.legend[: len(BASIC)] != BASIC or len(set(floor.legend)) < len(floor.legend):
        expected = f"a legend of different names that begins with {' '.join(BASIC)}"
        raise LabelError(where, expected, repr(floor.legend[:4]))
    fits = runs.size % 2 == 0 and (runs >= 0).all() and runs[1::2].sum() == floor.rows * floor.columns
    if not fits or (runs[::2] >= len(floor.legend)).any():
        raise LabelError(where, "runs of all cells, within the legend", "others")


def draft_of(building: Building) -> Draft:
    """Put a building on the page.

    Parameters
    ----------
    building : Building
        With floor plans.

    Returns
    -------
    Draft
        The same.

    Raises
    ------
    LabelError
        It has a zone table.
    """
    plans = building.geometry
    if not isinstance(plans, FloorPlans):
        advice = "a zone table is edited as text: see the case format"
        raise LabelError(building.name, "a case with floor plans", "a zone table", advice)
    return Draft(
        site=Site(**building.location.model_dump()),
        cell_size=plans.cell_size,
        floors=tuple(encode_floor(floor.name, floor.height, floor.tokens) for floor in plans.floors),
        devices=tuple(DraftDevice(**d.model_dump()) for d in building.devices),
        glazing={zone: dict(by_facade) for zone, by_facade in plans.glazing.items()},
        **{key: getattr(building, key) for key in _SHARED},
    )


def building_of_draft(draft: Draft) -> Building:
    """Make a building of what is on the page.

    Parameters
    ----------
    draft : Draft
        Its site, names and types are there; whether its parts fit together is not asked.

    Returns
    -------
    Building
        For a case.

    Raises
    ------
    pydantic.ValidationError
        A part of the site, or a device's name or type, is missing.
    """
    floors = tuple(FloorPlan(floor.name, floor.height, floor.tokens) for floor in draft.floors)
    return Building(
        location=Location.model_validate(draft.site.model_dump()),
        geometry=FloorPlans(draft.cell_size, floors, glazed_areas(draft)),
        devices=tuple(Device(**d.model_dump(include=set(Device.model_fields))) for d in draft.devices),
        **{key: getattr(draft, key) for key in _SHARED},
    )


def glazed_areas(draft: Draft) -> dict[str, dict[str, float]]:
    """Find the glazed areas of zones: their own, else what the ratio of their floor or of the building gives.

    Parameters
    ----------
    draft : Draft
        What is on the page.

    Returns
    -------
    dict
        Area by zone and facade [m2]; facades without glass are left out.
    """
    found = {zone: dict(own) for zone, own in draft.glazing.items()}
    for floor in draft.floors if draft.glazing_ratio else ():
        plans = FloorPlans(draft.cell_size, (FloorPlan(floor.name, floor.height, floor.tokens),))
        for zone, facades in facade_areas(plans).items() if floor.rows * floor.columns else ():
            for side, area in facades.items():
                glass = round(_ratio(draft.glazing_ratio, floor.name, side) * area, 2)
                found.setdefault(zone, {}).setdefault(side, glass)
    kept = {zone: {side: area for side, area in by_facade.items() if area} for zone, by_facade in found.items()}
    return {zone: by_facade for zone, by_facade in kept.items() if by_facade}


def _ratio(ratios: Mapping[str, Mapping[str, float]], floor: str, side: str) -> float:
    """Ratio of a facade of a floor, the nearest that is given: floor before building, facade before all [-]."""
    given = (ratios.get(where, {}).get(which) for where in (floor, "") for which in (side, ""))
    return next((ratio for ratio in given if ratio is not None), 0.0)


def zones_of(floors: Sequence[DraftFloor]) -> dict[str, list[str]]:
    """Floors on which each zone stands; more than one when a name stands twice.

    Parameters
    ----------
    floors : sequence of DraftFloor
        Floors of the draft.

    Returns
    -------
    dict
        Names of floors, by zone, in the order of floors and legends.
    """
    found: dict[str, list[str]] = {}
    for floor in floors:
        used = {number for number, count in zip(floor.runs[::2], floor.runs[1::2], strict=True) if count}
        for number in sorted(used):
            if number >= len(BASIC):
                found.setdefault(floor.legend[number], []).append(floor.name)
    return found
