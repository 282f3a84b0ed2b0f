"""``buildingmpc calibrate``."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from mpc.cli._console import Force, Json, Waiting, complain, say, show_table, write_json
from mpc.cli._evaluate import Dx, SchemeName

if TYPE_CHECKING:
    from calibration import CalibrationResult
    from thermal import Case

_BUILDING = "building.yaml"


@dataclass(frozen=True)
class _Options:
    """What the user asked for, the same for each case."""

    tune: tuple[str, ...]
    hold_out: tuple[str, ...]
    dx: float | None
    horizon: str
    scheme: str
    starts: int
    seed: int
    force: bool


def calibrate(
    case: Annotated[Path, typer.Argument(metavar="CASE", help="Case folder, or a folder of case folders.")],
    out: Annotated[
        Path,
        typer.Option(
            metavar="DIR", help="Folder for calibration.json, evaluation.json, predictions.parquet, report.html."
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
    horizon: Annotated[str, typer.Option(metavar="TIME", help="Prediction horizon, such as 6h or 90min.")] = "6h",
    scheme: SchemeName = None,
    starts: Annotated[int, typer.Option(metavar="N", help="Number of starts of the solver.")] = 1,
    seed: Annotated[int, typer.Option(metavar="N", help="Seed of the further starts.")] = 0,
    force: Force = False,
    json: Json = False,
) -> int:
    """Calibrate a case, or each case of a folder."""
    from calibration import check_results_folder

    options = _Options(
        tuple(tune or ()), tuple(hold_out or ()), dx, horizon, scheme or "implicit_euler", starts, seed, force
    )
    check_results_folder(out, force)
    inside = sorted(path.parent for path in case.glob(f"*/{_BUILDING}")) if not (case / _BUILDING).exists() else []
    if inside:
        return _calibrate_all(inside, out, options, json)
    result, report = _calibrate_one(case, out, options, f"calibrate {case.name}")
    if json:
        write_json(result.to_dict())
    else:
        show_calibration(result, report)
    return _exit_code(result)


def _calibrate_one(folder: Path, out: Path, options: _Options, label: str) -> tuple[CalibrationResult, Path]:
    from calibration import parse_interval
    from thermal import load_case

    case = load_case(folder)
    tune, hold_out = ([parse_interval(text, case) for text in texts] for texts in (options.tune, options.hold_out))
    return calibrate_and_write(
        case, out, label, options.force, tune=tune, hold_out=hold_out, dx=options.dx, horizon=options.horizon,
        scheme=options.scheme, starts=options.starts, seed=options.seed,
    )  # fmt: skip


def calibrate_and_write(
    case: Case, out: Path, label: str, force: bool, **settings: Any
) -> tuple[CalibrationResult, Path]:
    """Calibrate a case behind a progress bar and write its results.

    Parameters
    ----------
    case : Case
        What to calibrate.
    out : Path
        Folder of the results.
    label : str
        Of the progress bar.
    force : bool
        Replace earlier results.
    **settings
        Passed to `calibration.calibrate`.
    """
    import calibration

    with Waiting(label) as progress:
        result = calibration.calibrate(case, progress=progress, **settings)
        report = calibration.write_calibration(result, case, out, force=force)
    return result, report


def show_calibration(result: CalibrationResult, report: Path) -> None:
    """Write what a calibration found to stdout.

    Parameters
    ----------
    result : CalibrationResult
        From `calibration.calibrate`.
    report : Path
        Its page.
    """
    from calibration import calibration_verdict

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
    if result.solver.success:
        return 0
    complain(f"error: {result.solver.name} did not converge: {result.solver.status}; the results say so too")
    return 1


def _calibrate_all(folders: list[Path], out: Path, options: _Options, json: bool) -> int:
    """Calibrate each case into a folder of its name; one that fails is reported beside the others."""
    from calibration import CalibrationError
    from thermal import ThermalError

    found: dict[str, dict[str, Any]] = {}
    rows, codes = [], []
    for number, folder in enumerate(folders, start=1):
        try:
            result, _ = _calibrate_one(
                folder, out / folder.name, options, f"calibrate {folder.name} ({number} of {len(folders)})"
            )
        except Exception as error:  # one case must not take the others down
            codes.append(2 if isinstance(error, ThermalError | CalibrationError) else 1)
            found[folder.name] = {"error": type(error).__name__, "message": str(error)}
            complain(f"error: {folder.name}: {type(error).__name__}: {error}")
            rows.append((folder.name, "–", "–", type(error).__name__))
            continue
        codes.append(_exit_code(result))
        found[folder.name] = result.to_dict()
        before, after = (e["held_out"].metrics.mae for e in (result.uncalibrated, result.calibrated))
        rows.append((folder.name, f"{before:.3f}", f"{after:.3f}", result.solver.status))
    if json:
        write_json({"cases": found})
    else:
        show_table(
            f"Held-out error {options.horizon} ahead", ("case", "before [K]", "after [K]", "status"), rows, left=(0, 3)
        )
        say(f"Results: {out}")
    return 0 if not any(codes) else 2 if all(code == 2 for code in codes) else 1
