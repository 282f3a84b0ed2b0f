"""Migration of `building.yaml` from earlier formats, one small step a format, and what feeds what for certain."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from thermal.errors import CaseError

FORMAT = 3
"""Number of the case format that is written."""
#: Types of device that the only one of a type feeds for certain: an air handler its terminals, a boiler its radiators.
_FED_BY_THE_ONLY = {"ahu": ("vav", "supply_air_terminal"), "boiler": ("radiator",)}


def certain_feeders(types: Mapping[str, str]) -> dict[str, tuple[str, ...]]:
    """Feeders that follow from the types of a building's devices alone.

    Parameters
    ----------
    types
        Type by device.

    Returns
    -------
    dict
        Feeders by device, of those devices only of which they are certain.

    Examples
    --------
    >>> certain_feeders({"VAV_1": "vav", "AHU": "ahu", "BOILER": "boiler"})
    {'VAV_1': ('AHU',)}
    """
    fed: dict[str, tuple[str, ...]] = {}
    for kind, terminals in _FED_BY_THE_ONLY.items():
        feeders = tuple(name for name, type_ in types.items() if type_ == kind)
        if len(feeders) == 1:
            fed |= {name: feeders for name, type_ in types.items() if type_ in terminals}
    return fed


def migrate(content: Mapping[str, Any], file: str) -> dict[str, Any]:
    """Bring the content of a `building.yaml` to the present format.

    Parameters
    ----------
    content
        As parsed; what is malformed stays so, for the schema to refuse.
    file
        Name for messages.

    Returns
    -------
    dict
        Content of format 3; the argument is left alone.

    Raises
    ------
    CaseError
        The format is missing or unknown, or a key is of a later format than the file's.
    """
    if "format" not in content:
        raise CaseError(f"{file}: format", "1, 2 or 3", "no such key", f"add 'format: {FORMAT}'")
    number = content["format"]
    if type(number) is not int or not 1 <= number <= FORMAT:
        advice = "use a library that reads this format, or migrate the case"
        raise CaseError(f"{file}: format", "1, 2 or 3", repr(number), advice)
    migrated = dict(content)
    for step in _STEPS[number - 1 :]:
        migrated = step(migrated, file)
    return migrated


def _from_1(content: dict[str, Any], file: str) -> dict[str, Any]:
    """Format 2 has four more points, of pressures."""
    return content | {"format": 2}


def _from_2(content: dict[str, Any], file: str) -> dict[str, Any]:
    """Format 3 has feeders of devices and the quality of the geometry."""
    listed = content.get("devices")
    devices = listed if isinstance(listed, list) and all(isinstance(device, dict) for device in listed) else []
    later = ["geometry_quality"] if "geometry_quality" in content else []
    later += [f"devices[{i}].fed_by" for i, device in enumerate(devices) if "fed_by" in device]
    if later:
        expected, advice = "a key of the file's own format", f"write 'format: {FORMAT}'"
        raise CaseError(f"{file}: {later[0]}", expected, repr(later[0].rpartition(".")[2]), advice)
    fed = certain_feeders({str(device.get("name")): str(device.get("type")) for device in devices})
    if fed:
        new = [d | ({"fed_by": [*fed[str(d["name"])]]} if str(d.get("name")) in fed else {}) for d in devices]
        content = content | {"devices": new}
    return content | {"format": 3}


_STEPS: tuple[Callable[[dict[str, Any], str], dict[str, Any]], ...] = (_from_1, _from_2)
