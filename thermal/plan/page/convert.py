"""Drafts from cases, from JSON, and back: nothing gets in that would break what works on it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError

from thermal.case.building import Building, FloorPlan, FloorPlans, ZoneTable
from thermal.case.schema import Device, Location
from thermal.errors import LabelError, describe
from thermal.plan.list import FloorEntry
from thermal.plan.page.draft import BASIC, Draft, DraftDevice, DraftFloor, Picture, Site

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
    return DraftFloor(
        name=name, height=height, rows=rows, columns=columns, legend=legend, runs=tuple(runs), drawing=drawing,
        picture=picture,
    )  # fmt: skip


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
        first = error.errors(include_url=False)[0]
        place = f"{where}: {'.'.join(str(part) for part in first['loc']) or 'content'}"
        raise LabelError(describe(place, first["msg"], repr(first["input"])[:80])) from error
    for floor in draft.floors:
        _check_runs(floor, f"{where}: floor {floor.name!r}")
    return draft


def _check_runs(floor: DraftFloor, where: str) -> None:
    runs = np.asarray(floor.runs, dtype=np.float64)  # an integer of any size
    if floor.rows * floor.columns > _MOST_CELLS:
        found = f"{floor.rows} x {floor.columns}"
        raise LabelError(describe(where, f"at most {_MOST_CELLS} cells", found))
    if floor.legend[: len(BASIC)] != BASIC or len(set(floor.legend)) < len(floor.legend):
        expected = f"a legend of different names that begins with {' '.join(BASIC)}"
        raise LabelError(describe(where, expected, repr(floor.legend[:4])))
    fits = runs.size % 2 == 0 and (runs >= 0).all() and runs[1::2].sum() == floor.rows * floor.columns
    if not fits or (runs[::2] >= len(floor.legend)).any():
        raise LabelError(describe(where, "runs of all cells, within the legend", "others"))


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
    if isinstance(building.geometry, ZoneTable):
        advice = "a zone table is edited as text: see the case format"
        raise LabelError(describe(building.name, "a case with floor plans", "a zone table", advice))
    plans = building.geometry
    return Draft(
        name=building.name,
        site=Site(**building.location.model_dump()),
        orientation=building.orientation,
        cell_size=plans.cell_size,
        floors=tuple(encode_floor(floor.name, floor.height, floor.tokens) for floor in plans.floors),
        devices=tuple(DraftDevice(name=d.name, type=d.type, zone=d.zone) for d in building.devices),
        glazing={zone: dict(by_facade) for zone, by_facade in plans.glazing.items()},
        airflows=building.airflows,
        weather_station=building.weather_station,
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
    devices = tuple(Device(name=d.name, type=d.type, zone=d.zone) for d in draft.devices)
    return Building(
        name=draft.name,
        location=Location.model_validate(draft.site.model_dump()),
        orientation=draft.orientation,
        geometry=FloorPlans(draft.cell_size, floors, _glazing(draft.glazing)),
        devices=devices,
        airflows=draft.airflows,
        weather_station=draft.weather_station,
    )


def _glazing(glazing: Mapping[str, Mapping[str, float]]) -> dict[str, dict[str, float]]:
    """Leave out facades without glass."""
    kept = {zone: {side: area for side, area in by_facade.items() if area} for zone, by_facade in glazing.items()}
    return {zone: by_facade for zone, by_facade in kept.items() if by_facade}


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
