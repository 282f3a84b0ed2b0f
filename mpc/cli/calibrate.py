"""``buildingmpc calibrate`` and ``buildingmpc diagnose``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from calibration.errors import CalibrationError
from mpc.cli import many, options
from mpc.cli.console import Progress, Waiting, answer, complain, say, show_table

if TYPE_CHECKING:
    from calibration.diagnosis.diagnosis import Diagnosis
    from calibration.fit.result import CalibrationResult

#: Candidates on the terminal; the page and diagnosis.json have them all.
_MOST_CANDIDATES = 5


def calibrate(
    case: many.Cases,
    out: Annotated[
        str,
        options.folder(
            "calibration.json, evaluation.json, predictions.parquet, report.html; of a folder of cases one such folder "
            "a case, summary.json, fleet.parquet and report.html"
        ),
    ],
    tune: Annotated[options.Intervals, options.interval("Tuning", "the first two thirds")] = None,
    hold_out: Annotated[options.Intervals, options.interval("Held-out", "the last third")] = None,
    dx: options.Dx = None,
    structure: Annotated[
        str,
        options.value("drawn; lumped, free a zone and a pair; chosen: which predicts left-out days better.", "NAME"),
    ] = "chosen",
    effects: Annotated[str, options.value("Effects that are known to be there, in the whole building.", "ID,...")] = "",
    horizon: options.Horizon = "6h",
    scheme: options.SchemeName = None,
    objective: Annotated[
        str, options.value("multi_step: errors of runs; innovations: a filter's likelihood.", "OBJECTIVE")
    ] = "multi_step",
    loss: Annotated[str, options.value("linear, or pseudo_huber against outliers.", "LOSS")] = "linear",
    starts: Annotated[int, options.value("Starts of the solver; the best is kept.")] = 3,
    seed: Annotated[int, options.value("Seed of the further starts.")] = 0,
    priors: Annotated[
        Path | None, options.file("What a fleet taught, of `buildingmpc priors`; default: physical ranges.")
    ] = None,
    workers: many.Workers = None,
    scheduler: many.Scheduler = None,
    retries: many.Retries = 2,
    limit: many.Limit = None,
    force: options.Force = False,
    json: options.Json = False,
) -> int:  # fmt: skip
    """Fit the physical parameters of a building to its telemetry; of each case in a folder of cases.

    What was interrupted in a folder of cases goes on where it stopped.

    Example: buildingmpc calibrate cases/office --tune 2023-10-02/2023-10-16
    --hold-out 2023-10-16T00:05/2023-10-23 --out results
    """
    settings: dict[str, Any] = {
        "tune": tune or [], "hold_out": hold_out or [], "dx": dx, "horizon": horizon,
        "scheme": scheme or "implicit_euler", "objective": objective, "loss": loss, "starts": starts, "seed": seed,
        "effects": options.ids(effects),
        "climb": structure == "chosen", "yardsticks": True,
        "structure": {"lumped": True, "sun": True} if structure == "lumped" else {},
    }  # fmt: skip
    CalibrationError.unless_known(structure, ("chosen", "drawn", "lumped"), "--structure", "chosen, drawn or lumped")
    if priors is not None:
        from calibration.evaluation.population import read_population

        settings["population"] = read_population(priors)
    how = many.How(workers, scheduler, retries, limit, force, json)
    if (code := many.of_folder("calibrate", case, out, settings, how)) is not None:
        return code
    from mpc.reports.calibration import calibration_content

    with Waiting(f"calibrate {Path(case).name}") as progress:
        result, report = run_calibration(Path(case), Path(out), force, progress, settings)
    answer(json, calibration_content(result), lambda: _show(result), report)
    return _exit_code(result)


def run_calibration(
    folder: Path, out: Path, force: bool, progress: Progress, settings: dict[str, Any] | None = None
) -> tuple[CalibrationResult, Path]:
    """Calibrate a case and write what was found.

    Parameters
    ----------
    folder, out : Path
        Case folder, folder of the results.
    force : bool
        Whether earlier results are replaced.
    progress : callable
        Called with stage, done, total.
    settings : dict, optional
        Arguments of `calibration.calibrate`, intervals as text.
    """
    from calibration.fit import calibrate as fit
    from mpc.reports.calibration import write_calibration

    case, given = options.open_case(folder, out, force), dict(settings or {})
    tuned, judged = (options.parse_intervals(given.pop(name, None), case) for name in ("tune", "hold_out"))
    result = fit.calibrate(case, tuned, judged, settings=given, progress=progress)
    return result, write_calibration(result, case, out, force=force)


def _show(result: CalibrationResult) -> None:
    """Write what a calibration found to stdout."""
    from mpc.reports.calibration import calibration_verdict
    from mpc.reports.page import unit

    say(calibration_verdict(result))
    rows = []
    for key, name in (("tuning", "tuning"), ("held_out", "held out")):
        for when, evaluations in (("before", result.uncalibrated), ("after", result.calibrated)):
            runs = evaluations[key].predictions
            m, count, skipped = evaluations[key].metrics, sum(len(p.start) for p in runs), sum(p.skipped for p in runs)
            rows.append((f"{name}, {when}", m.mae, m.median, m.bias, count, skipped))
    errors = {"MAE [K]": ".3f", "median [K]": ".3f", "bias [K]": ".3f", "runs": "d", "skipped": "d"}
    show_table(f"Error {result.horizon} ahead", {"": "", **errors}, rows)
    columns = {"parameter": "", "value": ".4g", "standard error": ".2g", "unit": "", "lower": ".4g", "upper": ".4g"}
    estimates = [
        (p.name, p.value, p.standard_error, unit(p.unit), p.lower, p.upper,
         "on a bound" if p.at_bound else "yes" if p.identifiable else "no")
        for p in result.parameters
        if p.standard_error is not None
    ]  # fmt: skip
    show_table("Parameters", columns | {"determined": ""}, estimates, more="calibration.json lists them all")
    solver = result.solver
    say(f"Solver: {solver.name} {solver.status}, {solver.iterations} iterations, {solver.seconds:.1f} s")


def _exit_code(result: CalibrationResult) -> int:
    from calibration.fit.least_squares import INTERRUPTED

    if result.solver.success:
        return 0
    if result.solver.status == INTERRUPTED:
        complain("interrupted: these are the results of the best so far")
        return 130
    complain(f"error: {result.solver.name} did not converge: {result.solver.status}; the results say so too")
    return 1


def diagnose(
    case: many.Cases,
    out: Annotated[
        str,
        options.folder(
            "diagnosis.json, calibration.json of the model with the effects found, missing_watts.parquet, "
            "predictions.parquet, report.html; of a folder of cases one such folder a case, summary.json, "
            "fleet.parquet and report.html"
        ),
    ],
    tune: Annotated[
        options.Intervals,
        options.interval(
            "Tuning", "the first two thirds, or two days in three where the last third shows other weather"
        ),
    ] = None,
    hold_out: Annotated[options.Intervals, options.interval("Held-out", "the last third, or every third day")] = None,
    dx: options.Dx = None,
    effects: Annotated[str, options.value("Effects that are known to be there: part of the baseline.", "ID,...")] = "",
    rule_out: Annotated[str, options.value("Effects that are known not to be there.", "ID,...")] = "",
    experiment: Annotated[
        Path | None,
        options.file(
            "experiment.json of one in the telemetry: its days tune, and say which of the group it is; --dx as there."
        ),
    ] = None,
    horizon: options.Horizon = "6h",
    workers: many.Workers = None,
    scheduler: many.Scheduler = None,
    retries: many.Retries = 2,
    limit: many.Limit = None,
    force: options.Force = False,
    json: options.Json = False,
) -> int:
    """Say where model and building disagree, which missing effect causes it, and how far the error falls with it.

    What was interrupted in a folder of cases goes on where it stopped.

    Example: buildingmpc diagnose cases/office --out diagnosis
    """
    from mpc.reports.diagnosis import diagnosis_summary

    settings = {"dx": dx, "horizon": horizon, "known": options.ids(effects), "ruled_out": options.ids(rule_out)}
    how = many.How(workers, scheduler, retries, limit, force, json)
    if experiment is None:
        both = {"tune": tune or [], "hold_out": hold_out or []}
        if (code := many.of_folder("diagnose", case, out, settings | both, how)) is not None:
            return code
    else:
        CalibrationError.unless(not many.is_folder(case, out), "--experiment", "one case", "a folder of them")
    with Waiting(f"diagnose {Path(case).name}") as progress:
        if experiment is not None:
            free = not tune and not hold_out
            CalibrationError.unless(free, "--experiment", "no other intervals", "--tune or --hold-out")
            result, report = _after_experiment(Path(case), Path(out), force, progress, experiment, settings)
        else:
            own = (tune or (), hold_out or ())
            result, report = run_diagnosis(Path(case), Path(out), force, progress, own, settings)
    return answer(json, diagnosis_summary(result), lambda: _show_diagnosis(result), report)


def _after_experiment(
    case: Path, out: Path, force: bool, progress: Progress, experiment: Path, settings: Mapping[str, Any]
) -> tuple[Diagnosis, Path]:
    """Diagnose telemetry that holds an experiment, and write what was found."""
    from calibration.experiment.members import read_experiment
    from calibration.experiment.outcome import diagnose_further
    from mpc.reports.diagnosis import write_diagnosis

    loaded = options.open_case(case, out, force)
    plan = read_experiment(experiment, loaded)
    CalibrationError.unless(settings["horizon"] == "6h", "--experiment", "the horizon 6h", settings["horizon"])
    model = plan.model if settings["dx"] is None else replace(plan.model, dx=settings["dx"])
    result, outcome = diagnose_further(
        loaded, plan.question, plan.interval, model, plan.odds, settings["known"], settings["ruled_out"], progress,
    )  # fmt: skip
    progress("experiment", 1, 1)
    return result, write_diagnosis(result, loaded, out, force=force, experiment=outcome.to_dict())


def run_diagnosis(
    case: Path,
    out: Path,
    force: bool,
    progress: Progress,
    intervals: Sequence[Sequence[str]] = ((), ()),
    settings: Mapping[str, Any] | None = None,
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
    settings : mapping of str to Any, optional
        Further arguments of `diagnose`.
    """
    from calibration.diagnosis import diagnosis
    from mpc.reports.diagnosis import write_diagnosis

    loaded = options.open_case(case, out, force)
    tuned, judged = (options.parse_intervals(texts, loaded) for texts in intervals)
    result = diagnosis.diagnose(loaded, tuned, judged, progress=progress, **(settings or {}))
    return result, write_diagnosis(result, loaded, out, force=force)


def _show_diagnosis(result: Diagnosis) -> None:
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
    show_table(f"Held-out error {result.horizon} ahead", {"": "", "MAE [K]": ".3f", "share closed": "percent"}, errors)
