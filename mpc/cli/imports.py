"""``buildingmpc import-plan``, ``import-devices`` and ``import-telemetry``."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from mpc.cli.console import Force, Json, Waiting, say, show_table, write_json

if TYPE_CHECKING:
    from thermal.plan.assemble import PlanImport
    from thermal.plan.devices import DeviceImport
    from thermal.plan.match import PointMatch


def import_plan(
    drawings: Annotated[Path, typer.Argument(metavar="LIST", help="YAML list of the floors' drawings.")],
    out: Annotated[Path, typer.Option(metavar="DIR", help="Case folder to make; report.html is in it.")],
    devices: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Devices: CSV, Brick (.ttl), Haystack (.json, .zinc).")
    ] = None,
    force: Force = False,
    json: Json = False,
) -> int:
    """Make a case of drawings."""
    from thermal.plan.folder import building_of, check_nothing_lost, held_work, save_plan_case
    from thermal.plan.list import import_drawings, read_drawing_list
    from thermal.plan.models import read_devices
    from thermal.plan.picture import import_page

    if not force:
        check_nothing_lost(out)
    lost = held_work(out)
    listed = read_drawing_list(drawings)
    with Waiting(f"import {drawings.name}") as progress:
        found = import_drawings(drawings, progress=progress)
    zones = list(found.area_errors)
    served = read_devices(devices, zones) if devices is not None else None
    building = building_of(
        found,
        listed.name,
        listed.location,
        orientation=listed.orientation,
        devices=served.devices if served is not None else (),
    )
    page = import_page(found, listed.name, served)
    folder = save_plan_case(building, out, overwrite=force)
    (folder / "report.html").write_text(page, encoding="utf-8")
    if json:
        write_json({**_plan_content(found), **({"devices": _device_content(served)} if served is not None else {})})
        return 0
    _show_plan(found, listed.name)
    for work in lost:
        say(f"Replaced: {work}")
    if served is not None:
        _show_devices(served)
    say(f"Case: {folder}   Picture: {folder / 'report.html'}")
    say(f"Next: buildingmpc import-telemetry {folder} EXPORT --out CASE, or correct it: buildingmpc label {folder}")
    return 0


def import_devices(
    case: Annotated[Path, typer.Argument(metavar="CASE", help="Case folder with the zones.")],
    devices: Annotated[Path, typer.Argument(metavar="FILE", help="CSV, Brick (.ttl), Haystack (.json, .zinc).")],
    out: Annotated[Path, typer.Option(metavar="DIR", help="Case folder to make, with these devices.")],
    telemetry: Annotated[
        Path | None, typer.Option(metavar="FILE", help="CSV or Parquet whose columns are matched to devices.")
    ] = None,
    force: Force = False,
    json: Json = False,
) -> int:
    """Give a case its devices, and match columns of telemetry to them."""
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
    if json:
        write_json({"devices": _device_content(served), "points": [_match_content(m) for m in matches]})
        return 0
    _show_devices(served)
    if telemetry is not None:
        _show_matches(matches)
        say(f"Points: {folder / 'points.csv'}")
    say(f"Case: {folder}")
    return 0


def import_telemetry(
    case: Annotated[Path, typer.Argument(metavar="CASE", help="Case folder with zones and devices.")],
    file: Annotated[Path, typer.Argument(metavar="FILE", help="CSV or Parquet; columns of any names.")],
    out: Annotated[Path, typer.Option(metavar="DIR", help="Case folder to make, with this telemetry.")],
    points: Annotated[
        Path | None, typer.Option(metavar="FILE", help="points.csv, corrected by hand; default: matched by name.")
    ] = None,
    unit: Annotated[
        list[str] | None,
        typer.Option(metavar="POINT=UNIT", help="Unit in the file, repeatable; default: degC, kg/s, W, %, W/m^2."),
    ] = None,
    force: Force = False,
    json: Json = False,
) -> int:
    """Give a case its telemetry, whatever its columns are called."""
    from thermal.case.load import load_case
    from thermal.plan.folder import save_with_labels
    from thermal.plan.match import match_points, read_columns, read_matches, with_telemetry, write_matches

    units = _units(unit or ())
    if points is not None:
        matches = read_matches(points)
    else:
        building = load_case(case).building
        columns = read_columns(file)
        matches = match_points(columns, building.devices, building.zone_names, weather_station=building.weather_station)
    new = with_telemetry(case, file, matches, units)
    folder = save_with_labels(new, case, out, overwrite=force)
    write_matches(matches, folder / "points.csv")
    frame = new.telemetry.frame
    if json:
        span = {"start": frame.index[0].isoformat(), "end": frame.index[-1].isoformat(), "step_seconds": new.step}
        write_json({**span, "columns": frame.shape[1], "points": [_match_content(m) for m in matches]})
        return 0
    _show_matches(matches)
    say(f"{frame.shape[1]} columns from {frame.index[0]:%Y-%m-%d %H:%M} to {frame.index[-1]:%Y-%m-%d %H:%M}")
    say(f"Case: {folder}   Points: {folder / 'points.csv'}")
    say(f"Next: buildingmpc check {folder}")
    return 0


def _units(given: Sequence[str]) -> dict[str, str]:
    """Take options POINT=UNIT apart."""
    from thermal.errors import PlanError, describe

    for text in given:
        if not all(text.partition("=")):
            raise PlanError(describe("--unit", "POINT=UNIT, such as zone_air_temperature_sensor=degF", repr(text)))
    return {point.strip(): unit.strip() for point, _, unit in (text.partition("=") for text in given)}


def _plan_content(found: PlanImport) -> dict[str, Any]:
    return {
        "cell_size": found.plans.cell_size,
        "largest_area_error": found.largest_error,
        "floors": [
            {
                "name": floor.name,
                "source": floor.survey.source,
                "turned": floor.survey.turned,
                "offset": list(floor.offset),
                "rooms": len(floor.survey.rooms),
                "doors": len(floor.survey.doors),
                "zones": [
                    {"name": zone, "area": area, "area_error": found.area_errors[zone]}
                    for zone, area in floor.areas.items()
                ],
            }
            for floor in found.floors
        ],
        "remarks": list(found.remarks),
    }


def _device_content(served: DeviceImport) -> dict[str, Any]:
    return {
        "devices": [device.model_dump() for device in served.devices],
        "unplaced": served.unplaced,
        "unknown_types": served.unknown_types,
    }


def _match_content(match: PointMatch) -> dict[str, Any]:
    from dataclasses import asdict

    return asdict(match)


def _show_plan(found: PlanImport, name: str) -> None:
    """Write floors and zones to stdout."""
    from mpc.reports.page import counted

    size = f"{counted(len(found.area_errors), 'zone')} on {counted(len(found.floors), 'floor')}"
    near = f"areas within {100 * found.largest_error:.1f} % of the drawings"
    say(f"{name}: {size}, cells of {found.plans.cell_size:g} m, {near}")
    for remark in found.remarks:
        say(f"- {remark}")
    rows = [
        (zone, floor.name, f"{area:.1f}", f"{100 * found.area_errors[zone]:+.1f}")
        for floor in found.floors
        for zone, area in floor.areas.items()
    ]
    show_table("Zones", ("zone", "floor", "area on the drawing [m²]", "plan [%]"), rows, left=(0, 1))


def _show_devices(served: DeviceImport) -> None:
    """Write what became of the devices to stdout."""
    say(f"{len(served.devices)} devices, {len(served.unplaced)} of them in zones that the plans do not have")
    for device, kind in served.unknown_types.items():
        say(f"- device {device!r} has a type that the library does not know: {kind!r}")
    if served.unplaced:
        show_table("Devices without a zone", ("device", "zone in the list"), list(served.unplaced.items()), left=(0, 1))


def _show_matches(matches: tuple[PointMatch, ...]) -> None:
    """Write what columns were matched to, least certain first, to stdout."""
    missed = [m for m in matches if m.remark]
    say(f"{len(matches) - len(missed)} of {len(matches)} columns matched")
    rows = [
        (m.column, m.entity or "–", m.point or "–", f"{m.confidence:.2f}", m.remark)
        for m in sorted(matches, key=lambda m: (not m.remark, m.confidence))
    ]
    show_table("Columns", ("column", "device", "point", "confidence", "not matched because"), rows, left=(0, 1, 2, 4))
