"""``buildingmpc evaluate``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from mpc.cli.console import Waiting, answer, say, show_table
from mpc.cli.options import CaseFolder, Dx, Force, Horizon, Intervals, Json, Parameters, SchemeName, folder, interval

if TYPE_CHECKING:
    from calibration.evaluation.n_step import Evaluation


def evaluate(
    case: CaseFolder,
    parameters: Parameters = None,
    horizon: Horizon = "6h",
    interval: Annotated[Intervals, interval("Interval to evaluate, repeatable; default: all the telemetry.")] = None,
    dx: Dx = None,
    scheme: SchemeName = None,
    out: Annotated[Path | None, folder("evaluation.json, predictions.parquet, report.html")] = None,
    force: Force = False,
    json: Json = False,
) -> int:
    """N-step prediction error of a model on the telemetry of a case.

    Example: buildingmpc evaluate cases/office --parameters results/calibration.json
    --interval 2023-10-16/2023-10-23 --out errors
    """
    from calibration.evaluation.case_model import evaluate_case
    from calibration.evaluation.intervals import parse_interval
    from calibration.results import check_results_folder
    from mpc.reports.evaluation import write_evaluation
    from thermal.case.load import load_case

    if out is not None:
        check_results_folder(out, force)
    loaded = load_case(case)
    intervals = [parse_interval(text, loaded) for text in interval or ()]
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
