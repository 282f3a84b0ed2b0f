"""``buildingmpc control`` and ``buildingmpc compare``."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from mpc.cli.console import Force, Json, Waiting, complain, say, show_table, write_json
from mpc.cli.evaluate import Dx, Parameters

if TYPE_CHECKING:
    from mpc.studies.run import ControlRun
    from mpc.studies.study import Study

#: Options that both commands have.
CaseFolder = Annotated[Path, typer.Argument(metavar="CASE", help="Case folder.")]
Start = Annotated[str, typer.Option(metavar="T", help="Start, ISO 8601; local to the building without an offset.")]
End = Annotated[str, typer.Option(metavar="T", help="End; the telemetry must hold the weather until then.")]
Believed = Annotated[
    Path | None,
    typer.Option(
        metavar="Q", help="calibration.json that optimal control believes in; default: that of the plant, --parameters."
    ),
]
PlantModel = Annotated[
    str, typer.Option("--plant", metavar="KIND", help="How the plant's building steps: reduced, grid, random.")
]
ComfortPrice = Annotated[
    float,
    typer.Option(metavar="PRICE", help="Of a zone's kelvin outside of its band for an hour, for optimal control."),
]
TariffFile = Annotated[
    Path | None,
    typer.Option(
        metavar="FILE", help="Of electricity, from the Utility Rate Database; default: the paper's, as for gas."
    ),
]
Exact = Annotated[bool, typer.Option("--exact", help="Sensors without noise and weather forecasts without errors.")]
Seed = Annotated[int, typer.Option(metavar="N", help="Seed of noise, forecast errors and random shuffle.")]


def control(
    case: CaseFolder,
    start: Start,
    end: End,
    out: Annotated[Path, typer.Option(metavar="DIR", help="Folder for control.json, trajectory.parquet, report.html.")],
    controller: Annotated[
        str, typer.Option(metavar="NAME", help="mpc, schedule, reset, guideline36, or bound (perfect knowledge).")
    ] = "mpc",
    parameters: Parameters = None,
    controller_parameters: Believed = None,
    plant: PlantModel = "reduced",
    dx: Dx = None,
    comfort_price: ComfortPrice = 1.0,
    tariff: TariffFile = None,
    exact: Exact = False,
    seed: Seed = 0,
    force: Force = False,
    json: Json = False,
) -> int:
    """Run a building in closed loop with one controller."""
    from calibration.results import check_results_folder
    from mpc.reports.control import control_summary, write_control
    from mpc.reports.control_words import control_verdict
    from mpc.studies.run import check_controller, run_controller

    check_results_folder(out, force)
    check_controller(controller)
    study = _study(case, start, end, parameters, controller_parameters, plant, dx, comfort_price, tariff, exact, seed)
    with Waiting(f"control {case.name}") as progress:
        run = run_controller(study, controller, progress)
        report = write_control(run, out, command=_command(), force=force)
    if json:
        write_json(control_summary(run))
        return _exit_code([run])
    say(control_verdict(run))
    _show_assumed(study)
    say(f"Report: {report}")
    return _exit_code([run])


def compare(
    case: CaseFolder,
    start: Start,
    end: End,
    out: Annotated[
        Path,
        typer.Option(
            metavar="DIR", help="Folder for comparison.json, a trajectory_NAME.parquet a controller, report.html."
        ),
    ],
    controllers: Annotated[
        str, typer.Option(metavar="A,B,...", help="Among schedule, reset, guideline36, mpc, bound.")
    ] = "schedule,reset,guideline36,mpc,bound",
    parameters: Parameters = None,
    controller_parameters: Believed = None,
    plant: PlantModel = "reduced",
    dx: Dx = None,
    comfort_price: ComfortPrice = 1.0,
    tariff: TariffFile = None,
    exact: Exact = False,
    seed: Seed = 0,
    force: Force = False,
    json: Json = False,
) -> int:
    """Run a building with one controller after the other, on the same weather, people, prices and noise."""
    from calibration.results import check_results_folder
    from mpc.reports.control import comparison_summary, write_comparison
    from mpc.reports.control_words import comparison_rows, comparison_verdict
    from mpc.studies.compare import compare_controllers
    from mpc.studies.run import check_controller

    check_results_folder(out, force)
    names = [name.strip() for name in controllers.split(",") if name.strip()]
    for name in names:
        check_controller(name)
    study = _study(case, start, end, parameters, controller_parameters, plant, dx, comfort_price, tariff, exact, seed)
    with Waiting(f"compare controllers on {case.name}") as progress:
        found = compare_controllers(study, names, progress)
        report = write_comparison(found, out, command=_command(), force=force)
    if json:
        write_json(comparison_summary(found))
        return _exit_code(list(found.runs))
    say(comparison_verdict(found))
    show_table(
        "Controllers",
        ("controller", "cost", "with discomfort", "saved", "discomfort [K h]", "worst zone [K h]", "energy [kWh/m2]",
         "peak [W/m2]", "emissions [g/m2]", "way to bound"),
        comparison_rows(found),
    )  # fmt: skip
    _show_assumed(study)
    say(f"Report: {report}")
    return _exit_code(list(found.runs))


def _study(
    case: Path,
    start: str,
    end: str,
    parameters: Path | None,
    believed: Path | None,
    plant: str,
    dx: float | None,
    comfort_price: float,
    tariff: Path | None,
    exact: bool,
    seed: int,
) -> Study:
    from mpc.loop.noise import SensorNoise
    from mpc.scenario.forecast import DAY_AHEAD_ERRORS
    from mpc.scenario.paper import paper_tariff
    from mpc.scenario.urdb import read_urdb
    from mpc.scenario.weather_files import weather_of_case
    from mpc.studies.study import check_kind, make_study
    from thermal.case.load import load_case

    kind, loaded = check_kind(plant), load_case(case)
    prices = None if tariff is None else read_urdb(tariff, paper_tariff().gas)
    return make_study(
        loaded.building, weather_of_case(loaded), start, end, parameters=parameters, controller_parameters=believed,
        dx=dx, kind=kind, tariff=prices, noise=None if exact else SensorNoise(),
        errors=None if exact else DAY_AHEAD_ERRORS, comfort_price=comfort_price, seed=seed,
    )  # fmt: skip


def _command() -> str:
    """Command line as it was given, for the page."""
    return " ".join(["buildingmpc", *sys.argv[1:]])


def _show_assumed(study: Study) -> None:
    for note in study.notes:
        say(f"Assumed: {note}.")


def _exit_code(runs: list[ControlRun]) -> int:
    """1 when optimal control never had a plan of its own: then nothing was optimised."""
    failed = [run.controller for run in runs if run.decisions and not run.sources.get("optimal plan")]
    if failed:
        complain(f"error: no solve of {', '.join(failed)} gave a plan; the log in the results says why")
    return 1 if failed else 0
