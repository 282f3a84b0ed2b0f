"""``buildingmpc check``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from mpc.cli.console import Force, Json, is_narrow, say, show_table, write_json

if TYPE_CHECKING:
    from thermal.case.check import CaseCheck, PointSummary


def check(
    case: Annotated[Path, typer.Argument(metavar="CASE", help="Case folder.")],
    out: Annotated[Path | None, typer.Option(metavar="DIR", help="Folder for check.json and report.html.")] = None,
    force: Force = False,
    json: Json = False,
) -> int:
    """Validate a case and say what is in it."""
    from calibration.results import check_results_folder
    from mpc.reports.case import write_check
    from thermal.case.check import check_case

    if out is not None:
        check_results_folder(out, force)
    found = check_case(case)
    report = write_check(found, out, force=force) if out is not None else None
    if json:
        write_json(found.to_dict())
        return 0
    _show(found)
    _show_points(found)
    if report is not None:
        say(f"Report: {report}")
    return 0


def _show(found: CaseCheck) -> None:
    """Write the geometry and the quality of a case to stdout."""
    from mpc.reports.case import check_verdict, quality_rows

    say(
        f"{found.name} ({found.geometry}), {found.start:%Y-%m-%d %H:%M} to {found.end:%Y-%m-%d %H:%M} "
        f"{found.location.timezone}"
    )
    say(check_verdict(found))
    for remark in found.remarks:
        say(f"- {remark}")
    show_table(
        "Zones",
        ("zone", "floor", "area [m²]", "volume [m³]", "sensors", "devices"),
        left=(0, 1, 5),
        rows=[
            (
                z.name,
                z.floor or "–",
                f"{z.floor_area:.1f}",
                f"{z.volume:.1f}",
                str(len(z.measured_by)),
                ", ".join(z.devices),
            )
            for z in found.zones
        ],
    )
    rows = quality_rows(found)
    if rows:
        show_table(
            "Findings in the telemetry, by column",
            ("column", "missing [%]", "unusable [%]", "gaps", "impossible", "flat", "spikes", "constant"),
            rows,
        )


def _show_points(found: CaseCheck) -> None:
    """Write one row a point type; `--json` and the page have one a column."""
    by_type: dict[str, list[PointSummary]] = {}
    for point in found.points:
        by_type.setdefault(point.point, []).append(point)
    rows = []
    for name, points in by_type.items():
        means = [p.mean for p in points if p.mean is not None]
        lowest = [p.lowest for p in points if p.lowest is not None]
        highest = [p.highest for p in points if p.highest is not None]
        numbers = (min(lowest), sum(means) / len(means), max(highest)) if means else ()
        usable = 100 * sum(p.usable_share for p in points) / len(points)
        spelled = [f"{number:.4g}" for number in numbers] or ["–"] * 3
        rows.append((name, points[0].meaning, points[0].unit, str(len(points)), *spelled, f"{usable:.1f}"))
    columns: tuple[str, ...] = ("point", "meaning", "unit", "sensors", "lowest", "mean", "highest", "usable [%]")
    if is_narrow():
        show_table("Measured points", columns[1:], [row[1:] for row in rows], left=(0, 1))
    else:
        show_table("Measured points", columns, rows, left=(0, 1, 2))
