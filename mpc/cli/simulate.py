"""``buildingmpc simulate``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from mpc.cli.console import Force, Json, Waiting, say, show_table, write_json
from mpc.cli.evaluate import Dx, Parameters, SchemeName


def simulate(
    case: Annotated[Path, typer.Argument(metavar="CASE", help="Case folder.")],
    start: Annotated[str, typer.Option(metavar="T", help="Start, ISO 8601; local to the building without an offset.")],
    end: Annotated[str, typer.Option(metavar="T", help="End.")],
    parameters: Parameters = None,
    dx: Dx = None,
    scheme: SchemeName = None,
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Folder for simulation.json, simulation.parquet, report.html.")
    ] = None,
    force: Force = False,
    json: Json = False,
) -> int:
    """Replay an interval on the grid, from the measured temperatures at its start."""
    from calibration.evaluation.case_model import case_model
    from calibration.results import check_results_folder
    from mpc.reports.case import simulation_summary, simulation_verdict, write_simulation
    from thermal.case.load import load_case
    from thermal.case.times import local_timestamp
    from thermal.model.simulation import simulate as replay

    if out is not None:
        check_results_folder(out, force)
    loaded = load_case(case)
    first, last = (local_timestamp(time, loaded.building) for time in (start, end))
    steps = max(1, int((last - first).total_seconds() // loaded.step))
    with Waiting("simulate") as progress:
        ready = case_model(loaded, parameters, dx=dx, scheme=scheme)
        found = replay(
            loaded,
            ready.grid,
            ready.theta,
            first,
            last,
            ready.settings.stepping,
            ready.settings.spin_up_seconds,
            progress=lambda done: progress("simulate", done, steps),
        )
        report = write_simulation(found, loaded, out, parameters=ready.source, force=force) if out is not None else None
    summary = simulation_summary(found, loaded, ready.source)
    if json:
        write_json(summary)
        return 0
    say(f"{simulation_verdict(summary)} Parameters: {ready.source}.")
    zones = sorted(summary["by_zone"].items(), key=lambda item: -item[1]["mae"])
    show_table(
        f"Zones, {summary['start']} to {summary['end']}",
        ("zone", "MAE [K]", "bias [K]", "mean heat [W]"),
        [(z, f"{e['mae']:.3f}", f"{e['bias']:.3f}", f"{e['mean_heat']:.0f}") for z, e in zones],
    )
    if report is not None:
        say(f"Report: {report}")
    return 0
