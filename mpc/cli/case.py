"""``buildingmpc case``: cases out of a historian."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from mpc.cli import options
from mpc.cli.console import Waiting, answer, say

Historian = Annotated[str, typer.Argument(metavar="ADDRESS", help="postgresql://USER@HOST/DATABASE of a historian.")]
Schema = Annotated[str, options.value("Schema of the historian's tables.", "NAME")]


def case_from(
    address: Historian,
    building: Annotated[Path, options.file("Case folder or building.yaml with zones and devices.")],
    out: Annotated[Path, typer.Option(metavar="DIR", help="Case folder to make.")],
    start: options.Start,
    end: Annotated[str, typer.Option(metavar="T", help="End, likewise.")],
    step: Annotated[str, options.value("Steps of 1min to 2h to average over.", "STEP")] = "5min",
    points: Annotated[Path | None, options.file("points.csv or proposal.yaml; default: by name.")] = None,
    schema: Schema = "buildingmpc",
    force: options.Force = False,
    json: options.Json = False,
) -> int:
    """Make a case of what a historian has kept of a building.

    Example: buildingmpc case from postgresql://me@localhost/site --building cases/office --start 2026-01-05
    --end 2026-03-02 --out cases/winter
    """
    from mpc.cli.imports import seconds_of, telemetry_answer
    from thermal.case.case import Case, local_timestamp
    from thermal.case.load import load_building
    from thermal.case.save import check_target
    from thermal.intake.historian import historian_telemetry
    from thermal.plan.discovery import read_points
    from thermal.plan.folder import save_with_labels

    check_target(out, force)
    there = load_building(building)
    with Waiting("case from historian") as progress:
        listed = read_points(points, there) if points is not None else None
        period = local_timestamp(start, there), local_timestamp(end, there)
        length = seconds_of(step, "--step") or 300.0
        found = historian_telemetry(there, address, period, length, listed, schema=schema, progress=progress)
        source = building.parent if building.is_file() else building
        folder = save_with_labels(Case(there, found.telemetry), source, out, overwrite=force)
    return telemetry_answer(found, folder, json)


def case_pack(
    address: Historian,
    before: Annotated[str, options.value("Days that end by then, ISO 8601 in UTC; default: a week ago.", "T")] = "",
    schema: Schema = "buildingmpc",
    json: options.Json = False,
) -> int:
    """Pack a historian's days, so that cases are read several times as fast; the samples stay.

    Example: buildingmpc case pack postgresql://me@localhost/site
    """
    from pandas import Timedelta, Timestamp

    from mpc.live.historian.store import Historian
    from thermal.errors import PlanError
    from thermal.intake.historian import pack_days

    try:
        last = Timestamp(before) if before else Timestamp.now("UTC") - Timedelta(days=7)
    except ValueError as error:
        raise PlanError("--before", "a time in ISO 8601", repr(before)) from error
    with Historian(address, schema) as historian:
        historian.migrate()
    days = pack_days(address, last.tz_localize("UTC") if last.tzinfo is None else last, schema)
    return answer(json, {"days": days}, lambda: say(f"{days} days packed."))
