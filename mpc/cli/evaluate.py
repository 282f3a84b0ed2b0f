"""``buildingmpc evaluate``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from mpc.cli.console import Force, Json, Waiting, say, show_table, write_json

if TYPE_CHECKING:
    from calibration.evaluation.n_step import Evaluation

Dx = Annotated[
    float | None, typer.Option(metavar="M", help="Distance between control volumes of a plan; default its cell size.")
]
Parameters = Annotated[
    Path | None, typer.Option(metavar="FILE", help="calibration.json of this case; default: before calibration.")
]
SchemeName = Annotated[
    str | None,
    typer.Option(metavar="NAME", help="implicit_euler or tr_bdf2; default: as calibrated, else implicit_euler."),
]


def evaluate(
    case: Annotated[Path, typer.Argument(metavar="CASE", help="Case folder.")],
    parameters: Parameters = None,
    horizon: Annotated[str, typer.Option(metavar="TIME", help="Prediction horizon, such as 6h or 90min.")] = "6h",
    interval: Annotated[
        list[str] | None,
        typer.Option(metavar="START/END", help="Interval to evaluate, repeatable; default: all the telemetry."),
    ] = None,
    dx: Dx = None,
    scheme: SchemeName = None,
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Folder for evaluation.json, predictions.parquet, report.html.")
    ] = None,
    force: Force = False,
    json: Json = False,
) -> int:
    """Evaluate a model over N steps."""
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
    if json:
        write_json(found.to_dict())
        return 0
    _show(found, source)
    if report is not None:
        say(f"Report: {report}")
    return 0


def _show(found: Evaluation, source: str) -> None:
    from mpc.reports.evaluation import evaluation_verdict

    say(f"{evaluation_verdict(found)} Parameters: {source}.")
    show_table(
        "Intervals",
        ("from", "to", "runs", "skipped", "MAE [K]", "median [K]", "bias [K]"),
        left=(0, 1),
        rows=[
            (
                i["start"],
                i["end"],
                str(i["runs"]),
                str(i["skipped"]),
                *(f"{i[k]:.3f}" for k in ("mae", "median", "bias")),
            )
            for i in found.to_dict()["intervals"]
        ],
    )
    if found.by_horizon:
        show_table("Horizons", ("horizon", "MAE [K]"), [(h, f"{mae:.3f}") for h, mae in found.by_horizon.items()])
    zones = sorted(found.by_zone().items(), key=lambda item: -item[1]["mae"])
    show_table("Zones", ("zone", "MAE [K]", "bias [K]"), [(z, f"{e['mae']:.3f}", f"{e['bias']:.3f}") for z, e in zones])
