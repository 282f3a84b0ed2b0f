"""``buildingmpc import-plan``, ``import-devices`` and ``import-telemetry``."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from mpc.cli.console import Waiting, answer, say, show_table
from mpc.cli.options import Force, Json, file, value
from thermal.errors import PlanError

if TYPE_CHECKING:
    from thermal.intake.telemetry import TelemetryImport
    from thermal.plan.assemble import PlanImport
    from thermal.plan.devices import DeviceImport
    from thermal.plan.match import PointMatch


def import_plan(
    drawings: Annotated[Path, typer.Argument(metavar="LIST", help="YAML list of the floors' drawings.")],
    out: Annotated[Path, typer.Option(metavar="DIR", help="Case folder to make; report.html is in it.")],
    devices: Annotated[Path | None, file("Devices: CSV, Brick (.ttl), Haystack (.json, .zinc).")] = None,
    force: Force = False,
    json: Json = False,
) -> int:
    """Make a case folder of floor plans: PNG, JPEG, PDF, DXF, arrays of codes.

    Example: buildingmpc import-plan plans/plans.yaml --devices plans/devices.csv --out cases/office
    """
    from thermal.plan.folder import building_of, check_nothing_lost, held_work, import_page, save_plan_case
    from thermal.plan.list import import_drawings, read_drawing_list
    from thermal.plan.models import read_devices

    if not force:
        check_nothing_lost(out)
    lost = held_work(out)
    listed = read_drawing_list(drawings)
    with Waiting(f"import {drawings.name}") as progress:
        found = import_drawings(drawings, progress=progress)
    served = read_devices(devices, list(found.area_errors)) if devices is not None else None
    known = served.devices if served is not None else ()
    building = building_of(found, listed.name, listed.location, orientation=listed.orientation, devices=known)
    page = import_page(found, listed.name, served)
    folder = save_plan_case(building, out, overwrite=force)
    (folder / "report.html").write_text(page, encoding="utf-8")

    def show() -> None:
        _show_plan(found, listed.name)
        for work in lost:
            say(f"Replaced: {work}")
        if served is not None:
            _show_devices(served)
        say(f"Case: {folder}   Picture: {folder / 'report.html'}")
        say(f"Next: buildingmpc import-telemetry {folder} EXPORT --out CASE, or correct it: buildingmpc label {folder}")

    content = _plan_content(found) | ({} if served is None else {"devices": _device_content(served)})
    return answer(json, content, show)


def import_devices(
    case: Annotated[Path, typer.Argument(metavar="CASE", help="Case folder with the zones.")],
    devices: Annotated[Path, typer.Argument(metavar="FILE", help="CSV, Brick (.ttl), Haystack (.json, .zinc).")],
    out: Annotated[Path, typer.Option(metavar="DIR", help="Case folder to make, with these devices.")],
    telemetry: Annotated[Path | None, file("CSV or Parquet whose columns are matched to devices.")] = None,
    force: Force = False,
    json: Json = False,
) -> int:
    """Give a case its devices from CSV, Brick or Haystack, and match columns of telemetry to them.

    Example: buildingmpc import-devices cases/office devices.ttl --telemetry export.csv --out cases/office-2
    """
    from thermal.case.load import load_case
    from thermal.plan.folder import save_with_labels, with_devices
    from thermal.plan.match import match_points, read_columns, write_matches
    from thermal.plan.models import read_devices

    zones = load_case(case).building.zone_names
    served = read_devices(devices, zones)
    new = with_devices(case, served.devices)
    columns = read_columns(telemetry) if telemetry is not None else ()
    station = new.building.weather_station
    matches = match_points(columns, served.devices, zones, weather_station=station, listed=served.points)
    folder = save_with_labels(new, case, out, overwrite=force)
    if telemetry is not None:
        write_matches(matches, folder / "points.csv")

    def show() -> None:
        _show_devices(served)
        if telemetry is not None:
            _show_matches(matches)
            say(f"Points: {folder / 'points.csv'}")
        say(f"Case: {folder}")

    return answer(json, {"devices": _device_content(served), "points": [asdict(m) for m in matches]}, show)


def import_telemetry(
    case: Annotated[Path, typer.Argument(metavar="CASE", help="Case folder or building.yaml with zones and devices.")],
    source: Annotated[
        str, typer.Argument(metavar="SOURCE", help="Parquet, CSV, Excel or postgresql://; columns of any names.")
    ],
    out: Annotated[Path, typer.Option(metavar="DIR", help="Case folder to make, with this telemetry.")],
    points: Annotated[Path | None, file("points.csv or proposal.yaml; default: by name.")] = None,
    unit: Annotated[
        list[str] | None, value("Unit in the table, repeatable; of energy for counters.", "POINT=UNIT")
    ] = None,
    table: Annotated[str, value("Sheet of a workbook; table of a database, or SELECT.", "NAME")] = "",
    tz: Annotated[str, value("Time zone of stamps without offset, such as Europe/Berlin.", "ZONE")] = "",
    resample: Annotated[str, value("Steps of 1min to 2h to average over; default: the table's.", "STEP")] = "",
    force: Force = False,
    json: Json = False,
) -> int:
    """Give a building its telemetry: any table, whatever its columns are called.

    Example: buildingmpc import-telemetry cases/office export.csv --tz Europe/Berlin --resample 15min
    --out cases/office-3
    """
    from thermal.case.case import Case
    from thermal.case.load import load_building
    from thermal.intake.stamps import checked_zone
    from thermal.intake.telemetry import ImportSettings
    from thermal.intake.telemetry import import_telemetry as read
    from thermal.plan.discovery import read_points
    from thermal.plan.folder import save_with_labels

    building = load_building(case)
    settings = ImportSettings(table, checked_zone(tz, "--tz"), seconds_of(resample, "--resample"), _units(unit or ()))
    found = read(building, source, settings, read_points(points, building) if points is not None else None)
    new = Case(building, found.telemetry)
    folder = save_with_labels(new, case.parent if case.is_file() else case, out, overwrite=force)
    return telemetry_answer(found, folder, json)


def telemetry_answer(found: TelemetryImport, folder: Path, json: bool) -> int:
    """Write what became of the columns beside a new case, and say it.

    Parameters
    ----------
    found : TelemetryImport
        In the case.
    folder : Path
        Of the case.
    json : bool
        Whether JSON is asked for.

    Returns
    -------
    int
        Exit code: 0.
    """
    from mpc.reports.page import counted
    from thermal.plan.match import write_matches

    write_matches(found.matches, folder / "points.csv")
    if len(found.aside):
        found.aside.to_parquet(folder / "unmatched.parquet", index=False)
    frame = found.telemetry.frame
    first, last = frame.index[0], frame.index[-1]
    lost = f"{', '.join(found.unmatched_heat)}: heat, it seems, that is not in the case; say what it is in points.csv"

    def show() -> None:
        _show_matches(found.matches)
        for remark in (*found.remarks, *((lost,) if found.unmatched_heat else ())):
            say(f"- {remark}")
        say(
            f"{frame.shape[1]} columns from {first:%Y-%m-%d %H:%M} to {last:%Y-%m-%d %H:%M}, "
            f"every {found.telemetry.step:g} s"
        )
        if len(found.aside):
            say(f"Kept aside: {folder / 'unmatched.parquet'}, {counted(found.aside['column'].nunique(), 'column')}")
        say(f"Case: {folder}   Points: {folder / 'points.csv'}")
        say(f"Next: buildingmpc check {folder}")

    content = {"start": first.isoformat(), "end": last.isoformat(), "step_seconds": found.telemetry.step}
    content |= {"columns": frame.shape[1], "points": [asdict(m) for m in found.matches]}
    content |= {"remarks": list(found.remarks), "unmatched_heat": list(found.unmatched_heat)}
    return answer(json, content, show)


def seconds_of(text: str, where: str) -> float | None:
    """Read the length of a step, such as 5min or 1h [s]; None for none.

    Parameters
    ----------
    text : str
        As it was given.
    where : str
        Name of the option.

    Raises
    ------
    PlanError
        When it is no length of time.
    """
    from pandas import Timedelta

    from thermal.errors import PlanError

    if not text:
        return None
    try:
        return float(Timedelta(text).total_seconds())
    except ValueError as error:
        raise PlanError(where, "a time such as 5min or 1h", repr(text)) from error


def _units(given: Sequence[str]) -> dict[str, str]:
    """Take options POINT=UNIT apart."""
    parts = [text.partition("=") for text in given]
    for text in ("".join(part) for part in parts if not all(part)):
        raise PlanError("--unit", "POINT=UNIT, such as zone_air_temperature_sensor=degF", repr(text))
    return {point.strip(): unit.strip() for point, _, unit in parts}


def _plan_content(found: PlanImport) -> dict[str, Any]:
    floors = []
    for floor in found.floors:
        survey = floor.survey
        zones = [{"name": z, "area": area, "area_error": found.area_errors[z]} for z, area in floor.areas.items()]
        floors.append({
            "name": floor.name, "source": survey.source, "turned": survey.turned, "offset": list(floor.offset),
            "rooms": len(survey.rooms), "doors": len(survey.doors), "zones": zones,
        })  # fmt: skip
    return {
        "cell_size": found.plans.cell_size, "largest_area_error": found.largest_error, "floors": floors,
        "remarks": list(found.remarks),
    }  # fmt: skip


def _device_content(served: DeviceImport) -> dict[str, Any]:
    devices = [device.model_dump() for device in served.devices]
    return {"devices": devices, "unplaced": served.unplaced, "unknown_types": served.unknown_types}


def _show_plan(found: PlanImport, name: str) -> None:
    """Write floors and zones to stdout."""
    from mpc.reports.page import counted

    size = f"{counted(len(found.area_errors), 'zone')} on {counted(len(found.floors), 'floor')}"
    near = f"areas within {100 * found.largest_error:.1f} % of the drawings"
    say(f"{name}: {size}, cells of {found.plans.cell_size:g} m, {near}")
    for remark in found.remarks:
        say(f"- {remark}")
    rows = [(z, f.name, area, 100 * found.area_errors[z]) for f in found.floors for z, area in f.areas.items()]
    show_table("Zones", {"zone": "", "floor": "", "area on the drawing [m²]": ".1f", "plan [%]": "+.1f"}, rows)


def _show_devices(served: DeviceImport) -> None:
    """Write what became of the devices to stdout."""
    say(f"{len(served.devices)} devices, {len(served.unplaced)} of them in zones that the plans do not have")
    for device, kind in served.unknown_types.items():
        say(f"- device {device!r} has a type that the library does not know: {kind!r}")
    if served.unplaced:
        show_table("Devices without a zone", {"device": "", "zone in the list": ""}, served.unplaced.items())


def _show_matches(matches: tuple[PointMatch, ...]) -> None:
    """Write what columns were matched to, least certain first and without those of certain names, to stdout."""
    ordered = sorted((m for m in matches if m.confidence < 1.0), key=lambda m: (not m.remark, m.confidence))
    named = len(matches) - len(ordered)
    say(f"{sum(not m.remark for m in matches)} of {len(matches)} columns matched, {named} by the case's own names")
    taken = [f"not matched: {m.remark}" if m.remark else f"{m.entity}/{m.point}" for m in ordered]
    rows = [(m.column, m.confidence, what) for m, what in zip(ordered, taken, strict=True)]
    if rows:
        show_table("Columns", {"column": "", "confidence": ".2f", "taken for": ""}, rows)
