"""``buildingmpc evaluate`` and ``buildingmpc simulate``: a model on the telemetry of a case."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from mpc.cli import options
from mpc.cli.console import Waiting, answer, say, show_table

if TYPE_CHECKING:
    from calibration.evaluation.n_step import Evaluation


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
    from mpc.reports.evaluation import evaluation_verdict

    say(f"{evaluation_verdict(found)} Parameters: {source}.")
    errors = {"MAE [K]": ".3f", "median [K]": ".3f", "bias [K]": ".3f"}
    keys = ("start", "end", "runs", "skipped", "mae", "median", "bias")
    rows = [[i[key] for key in keys] for i in found.to_dict()["intervals"]]
    show_table("Intervals", {"from": "", "to": "", "runs": "d", "skipped": "d", **errors}, rows)
    if found.by_horizon:
        show_table("Horizons", {"horizon": "", "MAE [K]": ".3f"}, found.by_horizon.items())
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
