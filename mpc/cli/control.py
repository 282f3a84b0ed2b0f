"""``buildingmpc control`` and ``buildingmpc compare``."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from mpc.cli.console import Waiting, answer, complain, say, show_table
from mpc.cli.options import CaseFolder, Dx, Force, Json, Parameters, Start, file, folder, number, spread

if TYPE_CHECKING:
    from mpc.studies.run import ControlRun
    from mpc.studies.study import Study


@dataclass(frozen=True)
class StudyOptions:
    """Options that both commands have: what is controlled."""

    case: CaseFolder
    start: Start
    end: Annotated[str, typer.Option(metavar="T", help="End; the telemetry must hold the weather until then.")]
    parameters: Parameters = None
    controller_parameters: Annotated[
        Path | None,
        typer.Option(
            metavar="Q",
            help="calibration.json that optimal control believes in; default: that of the plant, --parameters.",
        ),
    ] = None
    plant: Annotated[
        str, typer.Option(metavar="KIND", help="How the plant's building steps: reduced, grid, random.")
    ] = "reduced"
    dx: Dx = None
    comfort_price: Annotated[
        float, number("Of a zone's kelvin outside of its band for an hour, for optimal control.", "PRICE")
    ] = 1.0
    tariff: Annotated[
        Path | None, file("Of electricity, from the Utility Rate Database; default: the paper's, as for gas.")
    ] = None
    exact: Annotated[
        bool, typer.Option("--exact", help="Sensors without noise and weather forecasts without errors.")
    ] = False
    seed: Annotated[int, number("Seed of noise, forecast errors and random shuffle.")] = 0
    force: Force = False
    json: Json = False

    def study(self) -> Study:
        """Put together what controllers run on."""
        from mpc.loop.noise import SensorNoise
        from mpc.scenario.forecast import DAY_AHEAD_ERRORS
        from mpc.scenario.tariff import paper_tariff
        from mpc.scenario.urdb import read_urdb
        from mpc.scenario.weather_files import weather_of_case
        from mpc.studies.study import StudySettings, make_study
        from thermal.case.load import load_case

        prices = paper_tariff()
        settings = StudySettings(
            parameters=self.parameters, controller_parameters=self.controller_parameters, dx=self.dx,
            kind=self.plant, tariff=prices if self.tariff is None else read_urdb(self.tariff, prices.gas),  # type: ignore[arg-type]
            noise=None if self.exact else SensorNoise(), errors={} if self.exact else DAY_AHEAD_ERRORS,
            comfort_price=self.comfort_price, seed=self.seed,
        )  # fmt: skip
        case = load_case(self.case)
        return make_study(case.building, weather_of_case(case), self.start, self.end, settings)


@spread
def control(
    given: StudyOptions,
    out: Annotated[Path, folder("control.json, trajectory.parquet, report.html")],
    controller: Annotated[
        str,
        typer.Option(
            metavar="NAME", help="mpc, schedule, reset, guideline36, bound (perfect knowledge), or one of a plugin."
        ),
    ] = "mpc",
) -> int:
    """Run a building in closed loop with optimal control, or with a rule.

    Example: buildingmpc control cases/office --parameters results/calibration.json --start 2023-10-16
    --end 2023-10-18 --out control
    """
    from calibration.results import check_results_folder
    from mpc.reports.control import control_summary, write_control
    from mpc.reports.control_words import control_verdict
    from mpc.studies.controllers import find_controller
    from mpc.studies.run import run_controller

    check_results_folder(out, given.force)
    find_controller(controller)
    study = given.study()
    with Waiting(f"control {given.case.name}") as progress:
        run = run_controller(study, controller, progress)
        report = write_control(run, out, command=_command(), force=given.force)

    def show() -> None:
        say(control_verdict(run))
        _show_assumed(study)

    answer(given.json, control_summary(run), show, report)
    return _exit_code([run])


@spread
def compare(
    given: StudyOptions,
    out: Annotated[Path, folder("comparison.json, a trajectory_NAME.parquet a controller, report.html")],
    controllers: Annotated[
        str, typer.Option(metavar="A,B,...", help="Among schedule, reset, guideline36, mpc, bound, those of plugins.")
    ] = "schedule,reset,guideline36,mpc,bound",
) -> int:
    """Run a building with several controllers on the same weather, people and prices, and compare them.

    Example: buildingmpc compare cases/office --controllers guideline36,mpc,bound --start 2023-10-16
    --end 2023-10-18 --out compared
    """
    from calibration.results import check_results_folder
    from mpc.reports.control import comparison_summary, write_comparison
    from mpc.reports.control_words import comparison_rows, comparison_verdict
    from mpc.studies.compare import compare_controllers
    from mpc.studies.controllers import find_controller

    check_results_folder(out, given.force)
    names = [name.strip() for name in controllers.split(",") if name.strip()]
    for name in names:
        find_controller(name)
    study = given.study()
    with Waiting(f"compare controllers on {given.case.name}") as progress:
        found = compare_controllers(study, names, progress)
        report = write_comparison(found, out, command=_command(), force=given.force)

    def show() -> None:
        say(comparison_verdict(found))
        numbers = ("cost", "with discomfort", "saved", "discomfort [K h]", "worst zone [K h]", "energy [kWh/m2]",
                   "peak [W/m2]", "emissions [g/m2]", "way to bound")  # fmt: skip
        show_table("Controllers", {"controller": "", **dict.fromkeys(numbers, "g")}, comparison_rows(found))
        _show_assumed(study)

    answer(given.json, comparison_summary(found), show, report)
    return _exit_code(found.runs)


def _command() -> str:
    """Command line as it was given, for the page."""
    return " ".join(["buildingmpc", *sys.argv[1:]])


def _show_assumed(study: Study) -> None:
    for note in study.notes:
        say(f"Assumed: {note}.")


def _exit_code(runs: Sequence[ControlRun]) -> int:
    """1 when optimal control never had a plan of its own: then nothing was optimised."""
    failed = [run.controller for run in runs if run.decisions and not run.sources.get("optimal plan")]
    if failed:
        complain(f"error: no solve of {', '.join(failed)} gave a plan; the log in the results says why")
    return 1 if failed else 0
