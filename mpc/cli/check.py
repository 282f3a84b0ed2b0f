"""``buildingmpc check``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from mpc.cli.console import Progress, answer, is_narrow, say, show_table, silent
from mpc.cli.options import CaseFolder, Force, Json, folder

if TYPE_CHECKING:
    from thermal.case.check import CaseCheck, PointSummary


def check(
    case: CaseFolder,
    out: Annotated[Path | None, folder("check.json and report.html")] = None,
    force: Force = False,
    json: Json = False,
) -> int:
    """Validate a case folder: geometry, quality of the telemetry, what each point is.

    Example: buildingmpc check cases/office
    """
    found, report = run_check(case, out, force)
    return answer(json, found.to_dict(), lambda: _show(found), report)


def run_check(case: Path, out: Path | None, force: bool, progress: Progress = silent) -> tuple[CaseCheck, Path | None]:
    """Check a case and write what was found, where a folder is given.

    Parameters
    ----------
    case : Path
        Case folder.
    out : Path or None
        Folder of the results.
    force : bool
        Whether earlier results are replaced.
    progress : callable
        Called with stage, done, total.
    """
    from calibration.results import check_results_folder
    from mpc.reports.case import write_check
    from thermal.case.check import check_case

    if out is not None:
        check_results_folder(out, force)
    progress("check", 0, 1)
    found = check_case(case)
    return found, None if out is None else write_check(found, out, force=force)


def _show(found: CaseCheck) -> None:
    """Write geometry, quality and points of a case to stdout."""
    from mpc.reports.case import check_verdict, quality_rows

    say(
        f"{found.name} ({found.geometry}), {found.start:%Y-%m-%d %H:%M} to {found.end:%Y-%m-%d %H:%M} "
        f"{found.location.timezone}"
    )
    say(check_verdict(found))
    for remark in found.remarks:
        say(f"- {remark}")
    columns = {"zone": "", "floor": "", "area [m²]": ".1f", "volume [m³]": ".1f", "sensors": "d", "devices": ""}
    zones = [
        (z.name, z.floor or None, z.floor_area, z.volume, len(z.measured_by), ", ".join(z.devices)) for z in found.zones
    ]
    show_table("Zones", columns, zones)
    rows = quality_rows(found)
    if rows:
        counted = ("missing [%]", "unusable [%]", "gaps", "impossible", "flat", "spikes", "constant")
        show_table("Findings in the telemetry, by column", {"column": "", **dict.fromkeys(counted, "g")}, rows)
    _show_points(found)


def _show_points(found: CaseCheck) -> None:
    """Write one row a point type; `--json` and the page have one a column."""
    by_type: dict[str, list[PointSummary]] = {}
    for point in found.points:
        by_type.setdefault(point.point, []).append(point)
    rows = []
    for name, points in by_type.items():
        means = [p.mean for p in points if p.mean is not None]
        lowest = min((p.lowest for p in points if p.lowest is not None), default=None)
        highest = max((p.highest for p in points if p.highest is not None), default=None)
        mean = sum(means) / len(means) if means else None
        usable = 100 * sum(p.usable_share for p in points) / len(points)
        rows.append((name, points[0].meaning, points[0].unit, len(points), lowest, mean, highest, usable))
    numbers = {"sensors": "d", "lowest": ".4g", "mean": ".4g", "highest": ".4g", "usable [%]": ".1f"}
    columns = {"point": "", "meaning": "", "unit": "", **numbers}
    if is_narrow():
        del columns["point"]
        rows = [row[1:] for row in rows]  # type: ignore[misc]
    show_table("Measured points", columns, rows)
