"""``buildingmpc simulate``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from mpc.cli.console import Waiting, answer, say, show_table
from mpc.cli.options import CaseFolder, Dx, Force, Json, Parameters, SchemeName, Start, folder


def simulate(
    case: CaseFolder,
    start: Start,
    end: Annotated[str, typer.Option(metavar="T", help="End.")],
    parameters: Parameters = None,
    dx: Dx = None,
    scheme: SchemeName = None,
    out: Annotated[Path | None, folder("simulation.json, simulation.parquet, report.html")] = None,
    force: Force = False,
    json: Json = False,
) -> int:
    """Replay the inputs of a building through its model.

    Example: buildingmpc simulate cases/office --start 2023-10-16 --end 2023-10-18
    --parameters results/calibration.json --out replay
    """
    from calibration.evaluation.case_model import case_model
    from calibration.results import check_results_folder
    from mpc.reports.case import simulation_summary, write_simulation
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
        stepping, spin_up = ready.settings.stepping, ready.settings.spin_up_seconds
        found = replay(
            loaded, ready.grid, ready.theta, first, last, stepping, spin_up,
            progress=lambda done: progress("simulate", done, steps),
        )  # fmt: skip
        report = write_simulation(found, loaded, out, parameters=ready.source, force=force) if out is not None else None
    summary = simulation_summary(found, loaded, ready.source)
    return answer(json, summary, lambda: _show(summary, ready.source), report)


def _show(summary: dict[str, Any], source: str) -> None:
    from mpc.reports.case import simulation_verdict

    say(f"{simulation_verdict(summary)} Parameters: {source}.")
    zones = sorted(([z, *(e[k] for k in ("mae", "bias", "mean_heat"))] for z, e in summary["by_zone"].items()),
                   key=lambda row: -row[1])  # fmt: skip
    columns = {"zone": "", "MAE [K]": ".3f", "bias [K]": ".3f", "mean heat [W]": ".0f"}
    show_table(f"Zones, {summary['start']} to {summary['end']}", columns, zones)
