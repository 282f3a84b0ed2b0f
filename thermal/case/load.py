"""Loading a case folder: all of it, checked, or a named error."""

from __future__ import annotations

from os import PathLike
from pathlib import Path

from thermal.case.building import Building, FloorPlan, FloorPlans, ZoneTable
from thermal.case.building_file import read_building_file
from thermal.case.case import Case
from thermal.case.plan import read_plan
from thermal.case.schema import BuildingFile
from thermal.case.telemetry_file import check_units, read_telemetry
from thermal.case.validation import check_building, check_columns
from thermal.errors import CaseError, describe


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
        return _load(folder)
    except CaseError as error:
        error.args = (f"{folder}: {error}",)
        raise


def _load(folder: Path) -> Case:
    parsed = read_building_file(folder)
    check_units(parsed.units)
    building = _building(parsed, folder)
    plan_files = {floor.name: floor.plan for floor in parsed.floors or ()}
    check_building(building, plan_files)
    file = _inside(folder, parsed.telemetry, "telemetry")
    telemetry = read_telemetry(file, parsed.units, parsed.location)
    check_columns(building, list(telemetry.frame.columns), file.name)
    return Case(building=building, telemetry=telemetry, path=folder)


def _building(parsed: BuildingFile, folder: Path) -> Building:
    geometry: FloorPlans | ZoneTable
    if parsed.floors is not None and parsed.cell_size is not None:
        floors = tuple(
            FloorPlan(floor.name, floor.height, read_plan(_inside(folder, floor.plan, f"floors[{i}].plan")))
            for i, floor in enumerate(parsed.floors)
        )
        geometry = FloorPlans(parsed.cell_size, floors, parsed.glazing or {})
    else:
        geometry = ZoneTable(parsed.zones or (), parsed.surfaces or (), parsed.constructions or {})
    return Building(
        name=parsed.name,
        location=parsed.location,
        orientation=parsed.orientation,
        geometry=geometry,
        devices=parsed.devices,
        airflows=parsed.airflows,
        weather_station=parsed.weather_station,
    )


def _inside(folder: Path, name: str, key: str) -> Path:
    """Resolve a file of the case; refuse one that lies elsewhere."""
    where = f"building.yaml: {key}"
    try:
        target = (folder / name).resolve()
        is_file = target.is_file()
    except (OSError, ValueError, RuntimeError) as error:  # a NUL, a name too long, links in a circle
        raise CaseError(describe(where, "the name of a file", repr(name))) from error
    if not target.is_relative_to(folder.resolve()):
        raise CaseError(
            describe(where, "a file inside the case folder", repr(name), "copy the file into the case")
        )
    if not is_file:
        raise CaseError(
            describe(where, "a file of the case folder", repr(name), "add the file or correct the name")
        )
    return target
