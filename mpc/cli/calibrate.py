"""``buildingmpc calibrate``."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from mpc.cli.console import Force, Json, Waiting, complain, say, show_table, write_json
from mpc.cli.evaluate import Dx, SchemeName

if TYPE_CHECKING:
    from calibration.fit.result import CalibrationResult
    from calibration.fleet.case import CaseOutcome

_BUILDING = "building.yaml"


def calibrate(
    case: Annotated[Path, typer.Argument(metavar="CASE", help="Case folder, or a folder of case folders.")],
    out: Annotated[
        Path,
        typer.Option(
            metavar="DIR",
            help="Folder for calibration.json, evaluation.json, predictions.parquet, report.html; of a folder of cases "
            "one such folder a case, and summary.json.",
        ),
    ],
    tune: Annotated[
        list[str] | None,
        typer.Option(metavar="START/END", help="Tuning interval, repeatable; default: the first two thirds."),
    ] = None,
    hold_out: Annotated[
        list[str] | None,
        typer.Option(metavar="START/END", help="Held-out interval, repeatable; default: the last third."),
    ] = None,
    dx: Dx = None,
    effects: Annotated[
        str | None,
        typer.Option(metavar="ID,...", help="Effects that are known to be there, in the whole building."),
    ] = None,
    horizon: Annotated[str, typer.Option(metavar="TIME", help="Prediction horizon, such as 6h or 90min.")] = "6h",
    scheme: SchemeName = None,
    objective: Annotated[
        str,
        typer.Option(metavar="OBJECTIVE", help="multi_step: errors of runs; innovations: a filter's likelihood."),
    ] = "multi_step",
    loss: Annotated[str, typer.Option(metavar="LOSS", help="linear, or pseudo_huber against outliers.")] = "linear",
    starts: Annotated[int, typer.Option(metavar="N", help="Starts of the solver; the best is kept.")] = 3,
    seed: Annotated[int, typer.Option(metavar="N", help="Seed of the further starts.")] = 0,
    workers: Annotated[
        int | None,
        typer.Option(metavar="N", help="Processes that share a folder of cases; default: one a core."),
    ] = None,
    scheduler: Annotated[
        str | None,
        typer.Option(metavar="ADDRESS", help="Of a dask cluster for a folder of cases, such as tcp://10.0.0.1:8786."),
    ] = None,
    force: Force = False,
    json: Json = False,
) -> int:
    """Calibrate a case, or each case of a folder; a folder that was interrupted goes on where it stopped."""
    from calibration.errors import CalibrationError
    from calibration.fleet.run import case_folders
    from calibration.results import check_results_folder

    settings = {
        "tune": tune or [], "hold_out": hold_out or [], "dx": dx, "horizon": horizon,
        "scheme": scheme or "implicit_euler", "objective": objective, "loss": loss, "starts": starts, "seed": seed,
        "effects": [name.strip() for name in (effects or "").split(",") if name.strip()],
    }  # fmt: skip
    if workers is not None and scheduler is not None:
        raise CalibrationError("--workers and --scheduler: expected one of them; a cluster has workers of its own")
    if not (case / _BUILDING).exists() and case_folders(case):
        return _calibrate_many(case, out, settings, workers, scheduler, force, json)
    if workers is not None or scheduler is not None:
        raise CalibrationError(
            f"{case}: --workers and --scheduler are for a folder of cases, one folder each; expected {_BUILDING} in "
            "some of its folders, and not beside them"
        )
    check_results_folder(out, force)
    result, report = _calibrate_one(case, out, settings, force)
    if json:
        from mpc.reports.calibration import calibration_content

        write_json(calibration_content(result))
    else:
        _show(result, report)
    return _exit_code(result)


def _calibrate_one(folder: Path, out: Path, settings: dict[str, Any], force: bool) -> tuple[CalibrationResult, Path]:
    from calibration.evaluation.intervals import parse_interval
    from calibration.fit.calibrate import calibrate as fit
    from mpc.reports.calibration import write_calibration
    from thermal.case.load import load_case

    case = load_case(folder)
    tune, hold_out = ([parse_interval(text, case) for text in settings.pop(name)] for name in ("tune", "hold_out"))
    with Waiting(f"calibrate {folder.name}") as progress:
        result = fit(case, tune, hold_out, settings=settings, progress=progress)
        report = write_calibration(result, case, out, force=force)
    return result, report


def _show(result: CalibrationResult, report: Path) -> None:
    """Write what a calibration found to stdout."""
    from mpc.reports.calibration import calibration_verdict

    say(calibration_verdict(result))
    rows = []
    for key, name in (("tuning", "tuning"), ("held_out", "held out")):
        for when, evaluations in (("before", result.uncalibrated), ("after", result.calibrated)):
            e = evaluations[key]
            runs, skipped = sum(len(p.start) for p in e.predictions), sum(p.skipped for p in e.predictions)
            m = e.metrics
            rows.append(
                (f"{name}, {when}", f"{m.mae:.3f}", f"{m.median:.3f}", f"{m.bias:.3f}", str(runs), str(skipped))
            )
    show_table(f"Error {result.horizon} ahead", ("", "MAE [K]", "median [K]", "bias [K]", "runs", "skipped"), rows)
    show_table(
        "Parameters",
        ("parameter", "value", "standard error", "unit", "lower", "upper", "determined"),
        [
            (p.name, f"{p.value:.4g}", f"{p.standard_error:.2g}", p.unit, f"{p.lower:.4g}", f"{p.upper:.4g}",
             "on a bound" if p.at_bound else "yes" if p.identifiable else "no")
            for p in result.parameters
            if p.standard_error is not None
        ],
        left=(0, 3, 6),
        more="calibration.json lists them all",
    )  # fmt: skip
    solver = result.solver
    say(f"Solver: {solver.name} {solver.status}, {solver.iterations} iterations, {solver.seconds:.1f} s")
    say(f"Report: {report}")


def _exit_code(result: CalibrationResult) -> int:
    from calibration.fit.least_squares import INTERRUPTED

    if result.solver.success:
        return 0
    if result.solver.status == INTERRUPTED:
        complain("interrupted: these are the results of the best so far")
        return 130
    complain(f"error: {result.solver.name} did not converge: {result.solver.status}; the results say so too")
    return 1


def _calibrate_many(
    folder: Path,
    out: Path,
    settings: dict[str, Any],
    workers: int | None,
    scheduler: str | None,
    force: bool,
    json: bool,
) -> int:
    """Calibrate each case into a folder of its name; one that fails is reported beside the others."""
    from calibration.fleet.cluster import ClusterExecutor
    from calibration.fleet.run import calibrate_many, case_folders
    from mpc.reports.calibration import calibration_files

    cases = case_folders(folder)
    inside = [p for p in sorted(folder.iterdir()) if p.is_dir() and p.name[0] != "."]
    others = [p.name for p in inside if p not in cases and p != out]
    if others:
        complain(f"left out, for want of {_BUILDING}: {', '.join(others)}")
    try:
        with (
            Waiting("calibrate cases") as waiting,
            ClusterExecutor(scheduler, folders=[folder]) if scheduler is not None else nullcontext() as executor,
        ):
            outcomes = calibrate_many(
                cases, out, settings, files=calibration_files, workers=executor or workers, force=force,
                progress=lambda _, done, total: waiting(f"{done} of {total}", done, total),
            )  # fmt: skip
    except KeyboardInterrupt:
        complain(f"interrupted: what is finished is in {out}, and the same command goes on from there")
        raise
    for outcome in outcomes:
        _complain_of(outcome)
    if json:
        write_json({"cases": {outcome.case: outcome.to_dict() for outcome in outcomes}})
    else:
        _show_outcomes(outcomes, str(settings["horizon"]))
        say(f"Results: {out}")
    if all(outcome.status == "calibrated" for outcome in outcomes):
        return 0
    return 2 if all(outcome.bad_input for outcome in outcomes) else 1


def _complain_of(outcome: CaseOutcome) -> None:
    if outcome.error is not None:
        complain(f"error: {outcome.case}: {outcome.error}: {outcome.message}")
    elif outcome.solver is not None and outcome.status == "not_converged":
        solver = outcome.solver
        complain(
            f"error: {outcome.case}: {solver['name']} did not converge: {solver['status']}; the results say so too"
        )


def _show_outcomes(outcomes: Sequence[CaseOutcome], horizon: str) -> None:
    rows = []
    for o in outcomes:
        errors = ("–" if mae is None else f"{mae:.3f}" for mae in (o.held_out_mae_before, o.held_out_mae_after))
        status = o.error or o.status.replace("_", " ") + (", done before" if o.resumed else "")
        rows.append((o.case, *errors, f"{o.seconds:.1f}", status))
    show_table(
        f"Held-out error {horizon} ahead", ("case", "before [K]", "after [K]", "time [s]", "status"), rows, left=(0, 4),
        more="summary.json lists them all",
    )  # fmt: skip
