"""``buildingmpc experiment``: designs what tells a group apart, and carries it out on a simulated site."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from mpc.cli import options
from mpc.cli.console import Waiting, answer, say, show_table

if TYPE_CHECKING:
    from calibration.evaluation.settings import ModelSettings
    from calibration.experiment.design import Experiment
    from calibration.experiment.outcome import Outcome


def experiment(
    case: options.CaseFolder,
    diagnosis: Annotated[
        Path, typer.Option(metavar="DIR", help="Folder that `buildingmpc diagnose` wrote, or its diagnosis.json.")
    ],
    out: Annotated[
        Path,
        options.folder(
            "experiment.json, schedule.csv, expected.parquet, report.html; with --run also case, the telemetry with "
            "that of the experiment, and diagnosis, which goes on from it"
        ),
    ],
    members: Annotated[str, options.value("Effects to tell apart; default: the group of the first.", "ID,...")] = "",
    start: Annotated[
        str | None, options.value("When it begins; default: the first midnight after the telemetry.", "T")
    ] = None,
    hours: Annotated[float, options.value("Longest length [h].", "H")] = 48.0,
    discomfort: Annotated[float, options.value("Most discomfort of a zone beyond usual [K h].", "KH")] = 0.5,
    odds: Annotated[float, options.value("Odds from which one is named.", "N")] = 20.0,
    prices: Annotated[
        str, options.value("Of a kWh of heat, and of cold, given to the zones.", "HEAT,COLD")
    ] = "0.10,0.10",
    dx: options.Dx = None,
    run: Annotated[
        str | None,
        options.value("Simulated site that it is carried out on: MODULE:FUNCTION or FILE.py:FUNCTION.", "SITE"),
    ] = None,
    force: options.Force = False,
    json: options.Json = False,
) -> int:
    """Design the cheapest experiment that tells apart what a diagnosis cannot, and carry it out on a simulated site.

    In a real building follow schedule.csv, add the telemetry to the case, and: buildingmpc diagnose LONGER_CASE
    --experiment DIR/experiment.json --out NEXT

    Example: buildingmpc experiment cases/office --diagnosis diagnosis --out experiment
    """
    import pandas as pd

    from calibration.experiment.days import begin_of
    from calibration.experiment.design import design_experiment
    from calibration.experiment.members import question_of
    from mpc.reports.display import write_results
    from mpc.reports.experiment import experiment_files, experiment_verdict

    loaded = options.open_case(case, out, force)
    content, model = _diagnosis(diagnosis, dx)
    question = question_of(loaded, content, options.ids(members), model.effects)
    settings = _settings(start, loaded, {"hours": hours, "discomfort": discomfort, "odds": odds}, prices)
    site = None
    if run is not None:
        from mpc.studies.experiment import made_by, open_site

        site = open_site(run)
        made_by(site, loaded, begin_of(loaded, settings.start) + pd.Timedelta(hours=hours))
    with Waiting(f"experiment {case.name}") as progress:
        found = design_experiment(loaded, question, settings, model, progress)
        outcome = None
        report = write_results(out, experiment_files(found, loaded), force) / "report.html"  # a run may fail
        if site is not None:
            outcome = _carry_out(found, loaded, site, _told(content, model, question.members), out, force, progress)
            report = write_results(out, experiment_files(found, loaded, outcome), True) / "report.html"
    numbers = found.to_dict() | {"outcome": None if outcome is None else outcome.to_dict()}
    return answer(json, numbers, lambda: _show(found, experiment_verdict(found, outcome)), report)


def _diagnosis(path: Path, dx: float | None) -> tuple[dict[str, Any], ModelSettings]:
    """Read a diagnosis, and the settings of its final model."""
    import json

    from calibration.errors import CalibrationError
    from calibration.evaluation.settings import ModelSettings, read_settings

    file = path / "diagnosis.json" if path.is_dir() else path
    try:
        content = json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        found = "nothing" if isinstance(error, FileNotFoundError) else str(error)
        advice = "give --diagnosis the folder that `buildingmpc diagnose` wrote"
        expected = "diagnosis.json as `buildingmpc diagnose` writes it"
        raise CalibrationError(str(file), expected, found, advice) from error
    CalibrationError.unless(isinstance(content, Mapping), str(file), "a mapping", type(content).__name__)
    known = read_settings(file.with_name("calibration.json"))
    return content, ModelSettings(**(known | ({} if dx is None else {"dx": dx})))


def _told(content: Mapping[str, Any], model: ModelSettings, members: Collection[str]) -> list[str]:
    """Effects that a diagnosis was told of: those of its final model that it did not find."""
    from thermal.effects.catalogue import CATALOGUE

    found = {step["effects"][-1] for step in content["how_far"] if step["effects"]}
    return [e for e in model.effects if e in CATALOGUE and e not in found and e not in members]


def _settings(start: str | None, case: Any, numbers: Mapping[str, float], prices: str) -> Any:
    """Read what the experiment may do."""
    from calibration.errors import CalibrationError
    from calibration.experiment.design import DesignSettings
    from thermal.case.case import local_timestamp

    try:
        heat, cold = (float(part) for part in prices.split(","))
    except ValueError as error:
        raise CalibrationError("--prices", "two numbers, such as 0.08,0.12", repr(prices)) from error
    begin = None if start is None else local_timestamp(start, case.building)
    hours, discomfort, odds = (numbers[key] for key in ("hours", "discomfort", "odds"))
    return DesignSettings(begin, hours, discomfort, odds, (heat, cold))


def _carry_out(
    found: Experiment, case: Any, site: Any, known: Sequence[str], out: Path, force: bool, progress: Any
) -> Outcome:
    """Carry out an experiment, keep the telemetry, and go on with the diagnosis."""
    from calibration.evaluation.intervals import Interval
    from calibration.experiment.outcome import diagnose_further
    from mpc.reports.diagnosis import write_diagnosis
    from mpc.studies.experiment import carry_out
    from thermal.case.save import save_case

    longer = carry_out(case, found.schedule, site, progress)
    interval = Interval(found.schedule.start, found.schedule.end)
    result, outcome = diagnose_further(
        longer, found.question, interval, found.model, found.settings.odds, known, progress=progress
    )
    save_case(longer, out / "case", overwrite=force)
    write_diagnosis(result, longer, out / "diagnosis", force=force, experiment=outcome.to_dict())
    return outcome


def _show(found: Experiment, verdict: str) -> None:
    from mpc.reports.experiment import steps_of

    say(verdict)
    rows = [(a, b, v, found.usual.separation.log_odds[a, b]) for (a, b), v in found.best.separation.log_odds.items()]
    columns = {"were it": "", "against": "", "experiment": ".1f", "usual operation": ".1f"}
    show_table("Expected logarithm of the odds", columns, rows)
    show_table("What is to be done", {"when": "", "where": "", "what": ""}, steps_of(found))
