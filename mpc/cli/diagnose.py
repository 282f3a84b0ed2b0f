"""``buildingmpc diagnose``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from mpc.cli.console import Force, Json, Waiting, say, show_table, write_json
from mpc.cli.evaluate import Dx

if TYPE_CHECKING:
    from calibration.diagnosis.diagnosis import Diagnosis

#: Candidates on the terminal; the page and diagnosis.json have them all.
_MOST_CANDIDATES = 5


def diagnose(
    case: Annotated[Path, typer.Argument(metavar="CASE", help="Case folder.")],
    out: Annotated[
        Path,
        typer.Option(
            metavar="DIR",
            help="Folder for diagnosis.json, calibration.json of the model with the effects found, "
            "missing_watts.parquet, predictions.parquet, report.html.",
        ),
    ],
    tune: Annotated[
        list[str] | None,
        typer.Option(
            metavar="START/END",
            help="Tuning interval, repeatable; default: the first two thirds, "
            "or two days in three where the last third shows other weather.",
        ),
    ] = None,
    hold_out: Annotated[
        list[str] | None,
        typer.Option(
            metavar="START/END", help="Held-out interval, repeatable; default: the last third, or every third day."
        ),
    ] = None,
    dx: Dx = None,
    horizon: Annotated[str, typer.Option(metavar="TIME", help="Prediction horizon, such as 6h or 90min.")] = "6h",
    force: Force = False,
    json: Json = False,
) -> int:
    """Diagnose a case."""
    from calibration.diagnosis.diagnosis import diagnose as answer
    from calibration.evaluation.intervals import parse_interval
    from calibration.results import check_results_folder
    from mpc.reports.diagnosis import diagnosis_summary, write_diagnosis
    from thermal.case.load import load_case

    check_results_folder(out, force)
    loaded = load_case(case)
    tuned, judged = ([parse_interval(text, loaded) for text in texts or ()] for texts in (tune, hold_out))
    with Waiting(f"diagnose {case.name}") as progress:
        result = answer(loaded, tuned, judged, dx=dx, horizon=horizon, progress=progress)
        report = write_diagnosis(result, loaded, out, force=force)
    if json:
        write_json(diagnosis_summary(result))
        return 0
    _show(result)
    say(f"Report: {report}")
    return 0


def _show(result: Diagnosis) -> None:
    from mpc.reports.diagnosis_words import called, diagnosis_verdict, in_zones, where_sentence

    say(diagnosis_verdict(result))
    say(f"Where: {where_sentence(result.where)}")
    show_table(
        "Candidates",
        ("effect", "id", "probability", "where", "told apart by"),
        [
            (called(s.effect), s.effect, f"{s.probability:.2f}", in_zones(s.zones), s.separate_by)
            for s in result.verdict.candidates[:_MOST_CANDIDATES]
        ],
        left=(0, 1, 3, 4),
    )
    untestable = [s.effect for s in result.verdict.candidates if not s.testable]
    if untestable:
        say(f"These data cannot test: {', '.join(untestable)}; the report says why.")
    rows = [("calibrated model", f"{result.gap:.3f}", "")]
    for step in result.steps:
        share = "–" if step.share_closed is None else f"{step.share_closed:.0%}"
        rows.append((f"+ {step.effects[-1]}", f"{step.after:.3f}", share))
    rows.append(("floor", f"{result.floor:.3f}", ""))
    show_table(f"Held-out error {result.horizon} ahead", ("", "MAE [K]", "share closed"), rows)
