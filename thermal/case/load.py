"""Loading a case folder: all of it, checked, or a named error."""

from collections.abc import Mapping
from dataclasses import fields
from os import PathLike
from pathlib import Path
from typing import Any
from zoneinfo import ZoneInfo, available_timezones

from pydantic import ValidationError

from thermal.case import building as schema
from thermal.case.building import Building, BuildingFile, FloorPlan, FloorPlans, ZoneTable
from thermal.case.case import Case
from thermal.case.plan import read_plan
from thermal.case.schema_file import read_mapping, schema_error
from thermal.case.telemetry import check_units, read_telemetry
from thermal.case.validation import check_building, check_columns
from thermal.errors import CaseError, ThermalError, nearest

NAME = "building.yaml"
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
    CaseError.unless("format" in content, f"{file}: format", "1, 2 or 3", "no such key", f"add 'format: {FORMAT}'")
    number = content["format"]
    advice, where = "use a library that reads this format, or migrate the case", f"{file}: format"
    CaseError.unless(type(number) is int and 1 <= number <= FORMAT, where, "1, 2 or 3", repr(number), advice)
    if number == FORMAT:
        return dict(content)
    # Format 2 has four more points, of pressures; format 3 has feeders of devices and the quality of the geometry.
    listed = content.get("devices")
    devices = listed if isinstance(listed, list) and all(isinstance(device, dict) for device in listed) else []
    later = ["geometry_quality"] if "geometry_quality" in content else []
    of_devices = ("fed_by", "emitter")
    later += [f"devices[{i}].{key}" for i, device in enumerate(devices) for key in of_devices if key in device]
    if later:
        expected, advice = "a key of the file's own format", f"write 'format: {FORMAT}'"
        raise CaseError(f"{file}: {later[0]}", expected, repr(later[0].rpartition(".")[2]), advice)
    fed = certain_feeders({str(device.get("name")): str(device.get("type")) for device in devices})
    if fed:
        new = [d | ({"fed_by": [*fed[str(d["name"])]]} if str(d.get("name")) in fed else {}) for d in devices]
        content = {**content, "devices": new}
    return {**content, "format": FORMAT}


def read_building_file(folder: Path, *, with_telemetry: bool = True) -> schema.BuildingFile:
    """Read and check `building.yaml` by itself, without the files it names.

    Parameters
    ----------
    folder
        Case folder.
    with_telemetry
        Whether it must name its telemetry and units; a building that is to get some may not have them yet.

    Returns
    -------
    BuildingFile
        What the file holds.

    Raises
    ------
    CaseError
        One of its family: the file is missing, no YAML, of another format, or holds a key or value that does not fit.
    """
    try:
        content = migrate(_read_yaml(folder), NAME)
        if not with_telemetry:
            content |= {"telemetry": content.get("telemetry") or "telemetry.parquet", "units": {}}
        parsed = schema.BuildingFile.model_validate(content)
    except ValidationError as error:
        raise schema_error(error, CaseError, NAME, BuildingFile) from error
    _check_geometry_choice(parsed)
    _check_time_zone(parsed.location.timezone)
    return parsed


def _read_yaml(folder: Path) -> dict[str, Any]:
    if not folder.is_dir():
        found = "a file" if folder.exists() else "nothing"
        raise CaseError("path", "a case folder", found, f"give the folder that holds {NAME}")
    return read_mapping(folder / NAME, CaseError, NAME, "the description of the building")


def _check_time_zone(name: str) -> None:
    try:
        ZoneInfo(name)
    except (KeyError, ValueError, OSError) as error:
        advice = nearest(name, sorted(available_timezones()))
        raise CaseError(f"{NAME}: location.timezone", "an IANA name", repr(name), advice) from error


def _check_geometry_choice(parsed: schema.BuildingFile) -> None:
    plans = [key for key in ("cell_size", "floors", "glazing") if getattr(parsed, key) is not None]
    table = [key for key in ("zones", "surfaces", "constructions") if getattr(parsed, key) is not None]
    if plans and table:
        raise CaseError(NAME, "floor plans or a zone table", f"keys of both: {', '.join(plans + table)}", "drop one")
    CaseError.unless(plans or table, NAME, "'floors' (plans) or 'zones' (a zone table)", "neither", "add one")
    for key in ("cell_size", "floors") if plans else ("zones",):
        if getattr(parsed, key) is None:
            raise CaseError(f"{NAME}: {key}", "a value", "no such key", f"needed beside {plans + table}")
        CaseError.unless(getattr(parsed, key) != (), f"{NAME}: {key}", "at least one entry", "none")


def load_case(path: str | PathLike[str]) -> Case:
    """Load a case folder.

    Parameters
    ----------
    path
        Folder that holds ``building.yaml``, the plans and the telemetry it names.

    Returns
    -------
    Case
        The building and its telemetry, in SI units.

    Raises
    ------
    CaseError
        One of its family, for the first thing that does not fit; nothing is half-read.

    Examples
    --------
    >>> case = load_case("../shared/cases/practice_none_prbs")  # doctest: +SKIP
    >>> case.zone_heat().shape  # doctest: +SKIP
    (6048, 12)
    """
    folder = Path(path)
    try:
        parsed = read_building_file(folder)
        check_units(parsed.units)
        building = _building(parsed, folder)
        check_building(building, {floor.name: floor.plan for floor in parsed.floors or ()})
        file = _file(folder, parsed.telemetry, "telemetry")
        telemetry = read_telemetry(file, parsed.units, parsed.location)
        check_columns(building, list(telemetry.frame.columns), file.name)
    except CaseError as error:
        error.args = (f"{folder}: {error}",)
        raise
    return Case(building, telemetry, folder)


def load_building(path: str | PathLike[str]) -> Building:
    """Load the building of a case folder, whether it has telemetry or not.

    Parameters
    ----------
    path
        Folder that holds ``building.yaml`` and the plans it names, or that file.

    Returns
    -------
    Building
        Checked like that of a case.

    Raises
    ------
    CaseError
        One of its family, for the first thing that does not fit.
    """
    given = Path(path)
    folder = given.parent if given.name == NAME else given
    try:
        parsed = read_building_file(folder, with_telemetry=False)
        building = _building(parsed, folder)
        check_building(building, {floor.name: floor.plan for floor in parsed.floors or ()})
    except CaseError as error:
        error.args = (f"{folder}: {error}",)
        raise
    return building


def _building(parsed: BuildingFile, folder: Path) -> Building:
    geometry: FloorPlans | ZoneTable
    if parsed.floors is not None and parsed.cell_size is not None:
        floors = tuple(
            FloorPlan(floor.name, floor.height, read_plan(_file(folder, floor.plan, f"floors[{i}].plan")))
            for i, floor in enumerate(parsed.floors)
        )
        geometry = FloorPlans(parsed.cell_size, floors, parsed.glazing or {})
    else:
        geometry = ZoneTable(parsed.zones or (), parsed.surfaces or (), parsed.constructions or {})
    kept = {
        field.name: getattr(parsed, field.name) for field in fields(Building) if field.name in BuildingFile.model_fields
    }
    return Building(geometry=geometry, **kept)


def file_inside(folder: Path, name: str, where: str, expected: str, advice: str, kind: type[ThermalError]) -> Path:
    """Resolve a name to a file inside a folder; refuse one that lies elsewhere.

    Parameters
    ----------
    folder
        The folder.
    name
        As a user or a file gives it.
    where, expected, advice
        Where it stands, what would be right and what to do, for the message.
    kind
        Error to raise.

    Returns
    -------
    Path
        Absolute, so that no link leads elsewhere; the file may not be there.
    """
    try:
        target = (folder / name).resolve()
        target.is_file()  # a name that is too long for the disk says so here
    except (OSError, ValueError, RuntimeError) as error:  # a NUL, links in a circle
        raise kind(where, "the name of a file", repr(name)) from error
    if not target.is_relative_to(folder.resolve()):
        raise kind(where, expected, repr(name), advice)
    return target


def _file(folder: Path, name: str, key: str) -> Path:
    """File that the case has to have."""
    where, inside, advice = f"{NAME}: {key}", "a file inside the case folder", "copy the file into the case"
    target = file_inside(folder, name, where, inside, advice, CaseError)
    if not target.is_file():
        raise CaseError(where, "a file of the case folder", repr(name), "add the file or correct the name")
    return target
