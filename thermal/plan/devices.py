"""Devices from lists: names, types and zones of a CSV, and what all such lists have in common."""

import csv
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from thermal.case.building import Device
from thermal.case.load import certain_feeders
from thermal.components.registry import device_types
from thermal.errors import PlanError, nearest
from thermal.plan.guard import reading, vocabulary

_COLUMNS = {
    "name": ("name", "device", "device_name", "equipment", "equip", "id", "tag", "asset"),
    "type": ("type", "device_type", "class", "kind", "category", "equipment_type"),
    "zone": ("zone", "zone_name", "room", "space", "serves", "location", "area"),
    "fed_by": ("fed_by", "supplied_by", "parent"),
}

_TYPES = vocabulary("device_words")


@dataclass(frozen=True)
class ListedPoint:
    """A point of telemetry that a list of devices says something of.

    Parameters
    ----------
    column : str
        Its identifier where the measurements are, or its name.
    entity : str
        Device or zone it belongs to.
    point : str
        Point type of the case format; empty when the list's type has none.
    """

    column: str
    entity: str
    point: str


@dataclass(frozen=True)
class DeviceImport:
    """Devices of a list.

    Parameters
    ----------
    devices : tuple of Device
        In the order of the list; without a zone where theirs is not known.
    unplaced : mapping
        What the list says of the zone, by device, where no zone has that name.
    unknown_types : mapping
        Type by device, where the library does not know the type.
    points : tuple of ListedPoint
        Points, where the list has them.
    """

    devices: tuple[Device, ...]
    unplaced: dict[str, str]
    unknown_types: dict[str, str]
    points: tuple[ListedPoint, ...] = ()


def import_devices(
    rows: Iterable[tuple[str, str, str]],
    zones: Sequence[str],
    where: str,
    points: Sequence[ListedPoint] = (),
    fed_by: Mapping[str, Sequence[str]] | None = None,
) -> DeviceImport:
    """Make devices of names, types and zones.

    Parameters
    ----------
    rows : iterable of tuple
        Name, type and zone of each, as the list has them; type and zone may be empty.
    zones : sequence of str
        Zones of the building.
    where : str
        File, for messages.
    points : sequence of ListedPoint
        Points, where the list has them.
    fed_by : mapping, optional
        Names of what feeds it, by device, where the list says so; else those that are certain (`certain_feeders`).

    Returns
    -------
    DeviceImport
        Devices with the format's types; zones are found by name whatever the case, signs and leading zeros.

    Raises
    ------
    PlanError
        A name stands twice, or there is no device.
    """
    by_key: dict[tuple[str, ...], list[str]] = {}
    for zone in zones:
        by_key.setdefault(key(zone), []).append(zone)
    devices: list[Device] = []
    unplaced: dict[str, str] = {}
    unknown: dict[str, str] = {}
    seen: dict[str, int] = {}
    for number, (name, kind, zone) in enumerate(rows, start=1):
        if name in seen:
            found = f"{name!r}, which device {seen[name]} has too"
            raise PlanError(f"{where}: device {number}", "a name of its own", found)
        seen[name] = number
        known = device_type(kind or name)
        if known is None:
            unknown[name] = kind
        place = [zone] if zone in zones else by_key.get(key(zone), []) if zone else []
        if zone and len(place) != 1:
            unplaced[name] = zone
        devices.append(Device(name=name, type=known or kind or "unknown", zone=place[0] if len(place) == 1 else None))
    PlanError.unless(devices, where, "at least one device", "none")
    certain = certain_feeders({device.name: device.type for device in devices})
    for i, device in enumerate(devices):
        told = tuple(f for f in dict.fromkeys((fed_by or {}).get(device.name, ())) if f in seen and f != device.name)
        devices[i] = device.model_copy(update={"fed_by": told or certain.get(device.name, ())})
    return DeviceImport(tuple(devices), unplaced, unknown, tuple(points))


def device_type(words: str) -> str | None:
    """Device type of the case format for a list's words.

    Parameters
    ----------
    words : str
        Such as ``VAV w/ reheat`` or ``AHU-1``.

    Returns
    -------
    str or None
        One of the format's types.

    Examples
    --------
    >>> device_type("Fan Coil Unit")
    'fan_coil'
    """
    plain = words.strip().casefold()
    if plain in device_types():
        return plain
    # "VAV_1" and "VAV-F1": signs and digits part words, but not for the pattern's \b.
    plain = " ".join(re.findall(r"[a-z]+", plain))
    return next((kind for pattern, kind in _TYPES.items() if re.search(pattern, plain)), None)


def key(name: str) -> tuple[str, ...]:
    """Words and numbers of a name, so that ``VAV-01.03`` and ``vav_1_3`` are the same.

    Parameters
    ----------
    name : str
        Any.

    Returns
    -------
    tuple of str
        In lower case, numbers without leading zeros.

    Examples
    --------
    >>> key("VAV-01.03")
    ('vav', '1', '3')
    """
    return tuple(part.lstrip("0") or "0" if part.isdigit() else part for part in words_of(name))


def words_of(name: str) -> list[str]:
    """Words and numbers of a name, in lower case; ``ZoneAirTemp`` is three words.

    Parameters
    ----------
    name : str
        Any.

    Returns
    -------
    list of str
        In their order.
    """
    parted = re.sub(r"(?<=[a-zäöüß])(?=[A-Z])", " ", name)
    return re.findall(r"[^\W\d_]+|\d+", parted.casefold())


def read_rows(file: Path) -> list[dict[str, str]]:
    """Rows of a CSV by what their columns are for."""
    with reading(file, "a CSV in UTF-8 with a header", csv.Error):
        lines = file.read_text(encoding="utf-8-sig").splitlines() or [""]
        sign = max(",;\t", key=lines[0].count)
        rows = [row for row in csv.reader(lines, delimiter=sign, strict=True) if any(x.strip() for x in row)]
    PlanError.unless(rows, file.name, "a header and a row a device", "an empty file")
    header = ["_".join(words_of(cell)) for cell in rows[0]]
    named = {use: [header.index(name) for name in names if name in header] for use, names in _COLUMNS.items()}
    found = {use: places[0] for use, places in named.items() if places}
    if "name" not in found:
        advice = nearest(header[0], _COLUMNS["name"])
        raise PlanError(f"{file.name}: header", "a column 'name'", ", ".join(header[:6]), advice)
    result = []
    for number, row in enumerate(rows[1:], start=2):
        if len(row) != len(header):
            raise PlanError(f"{file.name}: row {number}", f"{len(header)} cells as in the header", f"{len(row)}")
        entry = {use: row[place].strip() for use, place in found.items()}
        PlanError.unless(entry["name"], f"{file.name}: row {number}", "the name of a device", "a blank")
        result.append(entry)
    return result
