"""``buildingmpc diagnose``."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from mpc.cli import options
from mpc.cli.console import Progress, Waiting, answer, say, show_table

if TYPE_CHECKING:
    from calibration.diagnosis.diagnosis import Diagnosis

#: Candidates on the terminal; the page and diagnosis.json have them all.
_MOST_CANDIDATES = 5


def diagnose(
    case: options.CaseFolder,
    out: Annotated[
        Path,
        options.folder(
            "diagnosis.json, calibration.json of the model with the effects found, missing_watts.parquet, "
            "predictions.parquet, report.html"
        ),
    ],
    tune: Annotated[
        options.Intervals,
        options.interval(
            "Tuning", "the first two thirds, or two days in three where the last third shows other weather"
        ),
    ] = None,
    hold_out: Annotated[
        options.Intervals, options.interval("Held-out", "the last third, or every third day")
    ] = None,
    dx: options.Dx = None,
    horizon: options.Horizon = "6h",
    force: options.Force = False,
    json: options.Json = False,
) -> int:
    """Say where model and building disagree, which missing effect causes it, and how far the error falls with it.

    Example: buildingmpc diagnose cases/office --out diagnosis
    """
    from mpc.reports.diagnosis import diagnosis_summary

    with Waiting(f"diagnose {case.name}") as progress:
        result, report = run_diagnosis(case, out, force, progress, (tune or (), hold_out or ()), dx, horizon)
    return answer(json, diagnosis_summary(result), lambda: _show(result), report)


def run_diagnosis(
    case: Path,
    out: Path,
    force: bool,
    progress: Progress,
    intervals: Sequence[Sequence[str]] = ((), ()),
    dx: float | None = None,
    horizon: str = "6h",
) -> tuple[Diagnosis, Path]:
    """Diagnose a case and write what was found.

    Parameters
    ----------
    case, out : Path
        Case folder, folder of the results.
    force : bool
        Whether earlier results are replaced.
    progress : callable
        Called with stage, done, total.
    intervals : sequence of sequence of str
        To tune and to hold out.
    dx : float, optional
        Distance between control volumes of a plan [m].
    horizon : str
        Prediction horizon.
    """
    from calibration.diagnosis import diagnosis
    from mpc.reports.diagnosis import write_diagnosis

    loaded = options.open_case(case, out, force)
    tuned, judged = (options.parse_intervals(texts, loaded) for texts in intervals)
    result = diagnosis.diagnose(loaded, tuned, judged, dx=dx, horizon=horizon, progress=progress)
    return result, write_diagnosis(result, loaded, out, force=force)


def _show(result: Diagnosis) -> None:
    from mpc.reports.diagnosis_words import called, diagnosis_verdict, in_zones, where_sentence

    say(diagnosis_verdict(result))
    say(f"Where: {where_sentence(result.where)}")
    candidates = result.verdict.candidates
    columns = {"effect": "", "id": "", "probability": ".2f", "where": "", "told apart by": ""}
    rows = [(called(s.effect), s.effect, s.probability, in_zones(s.zones), s.separate_by) for s in candidates]
    show_table("Candidates", columns, rows[:_MOST_CANDIDATES])
    untestable = [s.effect for s in candidates if not s.testable]
    if untestable:
        say(f"These data cannot test: {', '.join(untestable)}; the report says why.")
    steps = [(f"+ {step.effects[-1]}", step.after, step.share_closed) for step in result.steps]
    errors = [("calibrated model", result.gap, ""), *steps, ("floor", result.floor, "")]
    show_table(f"Held-out error {result.horizon} ahead", {"": "", "MAE [K]": ".3f", "share closed": ".0%"}, errors)
