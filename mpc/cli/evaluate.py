"""``buildingmpc evaluate``, ``simulate`` and ``check``: a model on the telemetry of a case, and the case itself."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from mpc.cli import options
from mpc.cli.console import Progress, Waiting, answer, is_narrow, say, show_table, silent

if TYPE_CHECKING:
    from calibration.evaluation.n_step import Evaluation
    from thermal.case.check import CaseCheck, PointSummary


def evaluate(
    case: options.CaseFolder,
    parameters: options.Parameters = None,
    horizon: options.Horizon = "6h",
    interval: Annotated[options.Intervals, options.interval("Evaluated", "all the telemetry")] = None,
    dx: options.Dx = None,
    scheme: options.SchemeName = None,
    out: Annotated[Path | None, options.folder("evaluation.json, predictions.parquet, report.html")] = None,
    force: options.Force = False,
    json: options.Json = False,
) -> int:
    """N-step prediction error of a model on the telemetry of a case.

    Example: buildingmpc evaluate cases/office --parameters results/calibration.json
    --interval 2023-10-16/2023-10-23 --out errors
    """
    from calibration.evaluation.case_model import evaluate_case
    from mpc.reports.evaluation import write_evaluation

    loaded = options.open_case(case, out, force)
    intervals = options.parse_intervals(interval, loaded)
    source = parameters.name if parameters is not None else "uncalibrated start values"
    with Waiting("evaluate") as progress:
        found = evaluate_case(
            loaded, intervals, parameters=parameters, horizon=horizon, dx=dx, scheme=scheme,
            trajectories=out is not None, progress=progress,
        )  # fmt: skip
        report = write_evaluation(found, loaded, out, parameters=source, force=force) if out is not None else None
    return answer(json, found.to_dict(), lambda: _show(found, source), report)


def _show(found: Evaluation, source: str) -> None:
    from mpc.reports.evaluation import evaluation_verdict, horizon_rows

    say(f"{evaluation_verdict(found)} Parameters: {source}.")
    errors = {"MAE [K]": ".3f", "median [K]": ".3f", "bias [K]": ".3f"}
    keys = ("start", "end", "runs", "skipped", "mae", "median", "bias")
    rows = [[i[key] for key in keys] for i in found.to_dict()["intervals"]]
    show_table("Intervals", {"from": "", "to": "", "runs": "d", "skipped": "d", **errors}, rows)
    if found.by_horizon:
        show_table("Horizons", {"horizon": "", "MAE [K]": ".3f", "heat carried on [K]": ".3f"}, horizon_rows(found))
    zones = sorted(((z, e["mae"], e["bias"]) for z, e in found.by_zone().items()), key=lambda row: -row[1])
    show_table("Zones", {"zone": "", "MAE [K]": ".3f", "bias [K]": ".3f"}, zones)


def simulate(
    case: options.CaseFolder,
    start: options.Start,
    end: Annotated[str, typer.Option(metavar="T", help="End.")],
    parameters: options.Parameters = None,
    dx: options.Dx = None,
    scheme: options.SchemeName = None,
    out: Annotated[Path | None, options.folder("simulation.json, simulation.parquet, report.html")] = None,
    force: options.Force = False,
    json: options.Json = False,
) -> int:
    """Replay the inputs of a building through its model.

    Example: buildingmpc simulate cases/office --start 2023-10-16 --end 2023-10-18
    --parameters results/calibration.json --out replay
    """
    from calibration.evaluation.case_model import case_model
    from mpc.reports.case import simulation_summary, write_simulation
    from thermal.case.case import local_timestamp
    from thermal.model.simulation import simulate as replay

    loaded = options.open_case(case, out, force)
    first, last = (local_timestamp(time, loaded.building) for time in (start, end))
    steps = max(1, int((last - first).total_seconds() // loaded.step))
    with Waiting("simulate") as progress:
        ready = case_model(loaded, parameters, dx=dx, scheme=scheme)
        stepping, spin_up = ready.settings.stepping, ready.settings.spin_up_seconds
        found = replay(
            loaded, ready.grid, ready.theta, first, last, stepping, spin_up,
            progress=lambda done: progress("simulate", done, steps),
        )  # fmt: skip
        report = write_simulation(found, loaded, out, parameters=ready.source, force=force) if out is not None else None
    summary = simulation_summary(found, loaded, ready.source)
    return answer(json, summary, lambda: _show_replay(summary, ready.source), report)


def _show_replay(summary: dict[str, Any], source: str) -> None:
    from mpc.reports.case import simulation_verdict

    say(f"{simulation_verdict(summary)} Parameters: {source}.")
    zones = sorted(([z, *(e[k] for k in ("mae", "bias", "mean_heat"))] for z, e in summary["by_zone"].items()),
                   key=lambda row: -row[1])  # fmt: skip
    columns = {"zone": "", "MAE [K]": ".3f", "bias [K]": ".3f", "mean heat [W]": ".0f"}
    show_table(f"Zones, {summary['start']} to {summary['end']}", columns, zones)


def check(
    case: options.CaseFolder,
    out: Annotated[Path | None, options.folder("check.json and report.html")] = None,
    force: options.Force = False,
    json: options.Json = False,
) -> int:
    """Validate a case folder: geometry, quality of the telemetry, what each point is.

    Example: buildingmpc check cases/office
    """
    found, report = run_check(case, out, force)
    return answer(json, found.to_dict(), lambda: _show_check(found), report)


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


def _show_check(found: CaseCheck) -> None:
    """Write geometry, quality and points of a case to stdout."""
    from mpc.reports.case import anomaly_rows, check_verdict, quality_rows

    say(
        f"{found.name} ({found.geometry}), {found.start:%Y-%m-%d %H:%M} to {found.end:%Y-%m-%d %H:%M} "
        f"{found.location.timezone}"
    )
    say(check_verdict(found))
    for severity, sure, when, what, advice in anomaly_rows(found):
        say(f"- {severity}, {sure}, {when}: {what}; {advice}")
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
    from mpc.reports.page import unit

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
        rows.append((name, points[0].meaning, unit(points[0].unit), len(points), lowest, mean, highest, usable))
    numbers = {"sensors": "d", "lowest": ".4g", "mean": ".4g", "highest": ".4g", "usable [%]": ".1f"}
    columns = {"point": "", "meaning": "", "unit": "", **numbers}
    if is_narrow():
        del columns["point"]
        rows = [row[1:] for row in rows]  # type: ignore[misc]
    show_table("Measured points", columns, rows)
