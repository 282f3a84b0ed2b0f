"""What is wrong with a draft, object by object: the library's own checks of a case, told beside what they are about."""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any
from zoneinfo import ZoneInfo

import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError
from scipy import ndimage

from thermal.case.building import INTERIOR_WALL, PLAN_TOKENS, FloorPlan, FloorPlans, Location
from thermal.case.plan import check_plan, facade_areas, zone_floor_areas
from thermal.case.validation import (
    GLAZING_TOLERANCE,
    RESERVED,
    TERMINAL_TYPES,
    check_building,
    check_columns,
    has_windows,
)
from thermal.components.registry import device_types
from thermal.errors import CaseError, nearest
from thermal.plan.page.draft import Draft, DraftFloor, building_of_draft, glazed_areas, zones_of

_PLACE = re.compile(r"(?<!')\b(row|column) (\d+)")  # of a cell, not in the name of a zone


@dataclass(frozen=True)
class DraftFinding:
    """Something that is wrong with a draft, or worth a look.

    Parameters
    ----------
    level : str
        ``error``: it is no valid case with that; ``remark``: it is valid, and yet worth a look.
    kind : str
        What it is about: ``site``, ``floor``, ``zone``, ``device`` or ``case``.
    name : str
        Which; a key of the site.
    message : str
        What was expected, what was got, what to do.
    floor : str
        Where a zone stands.
    """

    level: str
    kind: str
    name: str
    message: str
    floor: str = ""


_error, _remark = partial(DraftFinding, "error"), partial(DraftFinding, "remark")


NO_GLAZING = (
    "the building has no windows: without any, the model lets no sun in; give window-to-wall ratios on the tab Building"
)


def find_faults(draft: Draft, columns: Sequence[str] = (), telemetry: str = "telemetry") -> tuple[DraftFinding, ...]:
    """Check a draft, object by object, and then as a whole.

    Parameters
    ----------
    draft : Draft
        What is on the page.
    columns : sequence of str
        Columns of the case's telemetry.
    telemetry : str
        Its file, for messages.

    Returns
    -------
    tuple of DraftFinding
        Errors first; a draft without errors is a case that loads.
    """
    found = [*_on_site(draft), *_on_floors(draft), *_on_zones(draft), *_on_devices(draft)]
    if not any(finding.level == "error" for finding in found):
        try:
            building = building_of_draft(draft)
            check_building(building)
            check_columns(building, columns, telemetry)
            if not has_windows(building):
                found.append(_remark("case", draft.name, NO_GLAZING))
        except CaseError as error:
            found.append(_error("case", draft.name, str(error)))
    return tuple(sorted(found, key=lambda finding: finding.level != "error"))


def zone_facts(draft: Draft) -> dict[str, dict[str, Any]]:
    """Areas of the zones of a draft.

    Parameters
    ----------
    draft : Draft
        What is on the page.

    Returns
    -------
    dict
        Floor area, area of each facade, and glazed area of each [m2], by zone.
    """
    glass = glazed_areas(draft)
    facts: dict[str, dict[str, Any]] = {}
    for floor in draft.floors:
        if not floor.rows * floor.columns:
            continue
        plans = FloorPlans(draft.cell_size, (FloorPlan(floor.name, floor.height, floor.tokens),))
        facades = facade_areas(plans)
        for zone, area in zone_floor_areas(plans).items():
            facts[zone] = {"area": area, "facades": facades[zone], "glazing": glass.get(zone, {})}
    return facts


def _on_site(draft: Draft) -> Iterator[DraftFinding]:
    try:
        Location.model_validate(draft.site.model_dump())
    except ValidationError as error:
        for detail in error.errors(include_url=False):
            key = str(detail["loc"][0])
            expected = f"expected {detail['msg'].removeprefix('Input should be ')}, found {detail['input']!r}"
            if detail["input"] in (None, ""):
                expected = "fill it in"
            yield _error("site", key, f"{key}: {expected}")
    if draft.site.timezone:
        try:
            ZoneInfo(draft.site.timezone)
        except (KeyError, ValueError, OSError):
            text = f"timezone: expected an IANA name such as Europe/Berlin, found {draft.site.timezone!r}"
            yield _error("site", "timezone", text)
    if not draft.name.strip():
        yield _error("site", "name", "name: give the case a name")
    if not -360.0 <= draft.orientation <= 360.0:
        yield _error("site", "orientation", f"orientation: expected -360 to 360 degrees, found {draft.orientation:g}")


def _on_floors(draft: Draft) -> Iterator[DraftFinding]:
    if not draft.floors:
        yield _error("floor", "", "there is no floor: import a drawing, or draw one")
    names = [floor.name for floor in draft.floors]
    for floor in draft.floors:
        if not floor.name.strip():
            yield _error("floor", floor.name, "give the floor a name")
        if names.count(floor.name) > 1:
            yield _error("floor", floor.name, f"two floors are named {floor.name!r}: rename one")
        if not floor.height > 0.0:
            text = f"clear height: expected a positive number of metres, found {floor.height:g}"
            yield _error("floor", floor.name, text)
        if not any(number >= len(PLAN_TOKENS) for number in floor.runs[::2]):
            yield _error("floor", floor.name, "the floor has no zone: draw walls around one")


def _on_zones(draft: Draft) -> Iterator[DraftFinding]:
    places = zones_of(draft.floors)
    for floor in draft.floors:
        for zone, message in _faulty_zones(floor):
            yield _error("zone", zone, message, floor.name)
    served = {device.zone for device in draft.devices}
    for zone, floors in places.items():
        if len(floors) > 1:
            text = f"zone names are unique in the building, {zone!r} is on {' and '.join(floors)}: rename one"
            yield _error("zone", zone, text, floors[-1])
        if zone in RESERVED or not zone.strip() or zone != zone.strip():
            yield _error("zone", zone, f"{zone!r} is a name that plans use for themselves", floors[0])
        if zone == draft.weather_station:
            yield _error("zone", zone, "the weather station has this name: rename the zone", floors[0])
        if zone not in served:
            yield _remark("zone", zone, "no device serves this zone", floors[0])
    yield from _on_glazing(draft, places)


def _on_glazing(draft: Draft, places: dict[str, list[str]]) -> Iterator[DraftFinding]:
    for floor, by_facade in draft.glazing_ratio.items():
        for facade, ratio in by_facade.items():
            if not 0.0 <= ratio <= 1.0:
                where = f"{floor or 'the whole building'}, {facade or 'all facades'}"
                text = f"window-to-wall ratio of {where}: expected 0 to 100 %, found {100.0 * ratio:g} %"
                yield _error("case", floor, text)
    facts = zone_facts(draft) if draft.glazing else {}
    for zone, by_facade in draft.glazing.items():
        if zone not in places:
            yield _error("case", zone, f"glazing of zone {zone!r}, which is on no floor: remove it")
            continue
        for facade, area in by_facade.items():
            most = facts.get(zone, {"facades": {}})["facades"].get(facade)
            if most is None or area < 0.0 or not area <= most * GLAZING_TOLERANCE:
                expected = "no such facade" if most is None else f"at most the zone's {most:.2f} m2"
                yield _error("zone", zone, f"glazing {facade}: expected {expected}, found {area:g} m2", places[zone][0])


def _faulty_zones(floor: DraftFloor) -> Iterator[tuple[str, str]]:
    """Look at each zone of a plan by itself, so that the first fault does not hide the others."""
    tokens = floor.tokens
    numbers = np.unique(tokens, return_inverse=True)
    cells: NDArray[np.int64] = numbers[1].reshape(tokens.shape) + 1
    for token, where in zip(numbers[0].tolist(), ndimage.find_objects(cells), strict=True):
        if token in PLAN_TOKENS or where is None:
            continue
        part = tuple(slice(max(0, s.start - 1), s.stop + 1) for s in where)
        alone = tokens[part]
        try:
            check_plan(np.where(np.isin(alone, [*PLAN_TOKENS, token]), alone, INTERIOR_WALL), f"floor {floor.name!r}")
        except CaseError as error:
            yield token, _shifted(str(error), part)


def _shifted(message: str, part: tuple[slice, ...]) -> str:
    """Count rows and columns from the plan's first cell, not the part's."""
    offsets = {"row": part[0].start, "column": part[1].start}
    return _PLACE.sub(lambda match: f"{match[1]} {int(match[2]) + offsets[match[1]]}", message)


def _on_devices(draft: Draft) -> Iterator[DraftFinding]:
    zones = zones_of(draft.floors)
    names = [device.name for device in draft.devices]
    twice = {name for name in names if names.count(name) > 1} if len(set(names)) < len(names) else set()
    for device in draft.devices:
        if not device.name or not device.type:
            yield _error("device", device.name, "give the device a name and a type")
        if device.name in twice:
            yield _error("device", device.name, f"device names are unique, two are named {device.name!r}: rename one")
        if device.name == draft.weather_station:
            yield _error("device", device.name, "the weather station has this name: rename the device")
        if device.zone is not None and device.zone not in zones:
            yield _error("device", device.name, f"zone {device.zone!r} is on no floor; {nearest(device.zone, zones)}")
        if device.zone is None and device.type in TERMINAL_TYPES:
            yield _remark("device", device.name, f"{device.type} that serves no zone: its heat is not counted")
        if device.type and device.type not in device_types():
            text = f"a type that the library does not know: {device.type!r}; {nearest(device.type, device_types())}"
            yield _remark("device", device.name, text)
