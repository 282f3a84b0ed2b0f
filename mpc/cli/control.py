"""``buildingmpc control``, ``compare``, and ``demo``, which ends with them."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, cast

import typer

from mpc.cli import many
from mpc.cli.console import Waiting, answer, complain, say, show_table
from mpc.cli.doctor import missing_extras
from mpc.cli.options import Dx, Force, Json, file, folder, ids, share, spread, switch, value

if TYPE_CHECKING:
    from mpc.studies.demo import Demo
    from mpc.studies.described import PlantStudy
    from mpc.studies.run import ControlRun
    from mpc.studies.study import Study

OUT = Path("buildingmpc_demo")

_OF_CASES, _OF_PLANTS = "schedule,reset,guideline36,mpc,bound", "own,full_speed,mpc"


@dataclass(frozen=True)
class StudyOptions:
    """Options that both commands have: what is controlled."""

    place: Annotated[
        str,
        typer.Argument(
            metavar="CASE", help="Case folder, plant.yaml, name of a ready plant; of compare also a folder of cases."
        ),
    ]
    start: Annotated[
        str | None, value("Start, ISO 8601, local; of a plant.yaml by default that of its period.", "T")
    ] = None
    end: Annotated[
        str | None, value("End; without --weather the telemetry of a case must hold the weather until then.", "T")
    ] = None
    model: Annotated[
        Path | None, value("Folder that `buildingmpc identify` wrote, for optimal control of a plant.yaml.", "DIR")
    ] = None
    at: Annotated[str | None, value("Unit or server in the place of that of a plant.yaml.", "FILE|URL")] = None
    violations: Annotated[
        str,
        value(
            "Share of occupied steps below the band, where it cools above it, that is kept, such as 5%, or none; "
            "of a plant.yaml.",
            "P",
        ),
    ] = "1%"
    starts: Annotated[int, value("Most starts of a machine in 24 hours; of a plant.yaml.")] = 10
    runs: Annotated[
        str,
        value("How runs of whole machines are planned: dithering, or mixed_integer by HiGHS; of a plant.yaml.", "HOW"),
    ] = "dithering"
    parameters: Annotated[str | None, file("calibration.json of this case; default: before calibration.")] = None
    controller_parameters: Annotated[
        Path | None,
        value("calibration.json that optimal control believes in; default: that of the plant, --parameters.", "Q"),
    ] = None
    plant: Annotated[str, value("How the plant's building steps: reduced, grid, random.", "KIND")] = "reduced"
    dx: Dx = None
    comfort_price: Annotated[
        float | None,
        value("Of a zone's kelvin outside of its band for an hour; default 1, of a plant.yaml 10.", "PRICE"),
    ] = None
    weather: Annotated[
        Path | None, file("EPW: a typical year in place of the weather that was measured with the case.")
    ] = None
    tariff: Annotated[
        str | None,
        value("Of electricity: a price per kWh, or a file of the Utility Rate Database; default: the paper's.", "P"),
    ] = None
    gas_price: Annotated[
        str | None, value("Of a kWh of gas, or of another unit: 1.2/therm; default: the paper's.", "P")
    ] = None
    currency: Annotated[
        str | None, value("Of all prices that are given; nothing is converted. Default: USD.", "NAME")
    ] = None
    comfort: Annotated[
        str | None,
        value("Band of occupied hours, and of others: 21,24 or 21,24,15,30 [degC], or 70F,75F.", "LOW,HIGH"),
    ] = None
    exact: Annotated[bool, switch("--exact", "Sensors without noise and weather forecasts without errors.")] = False
    seed: Annotated[int, value("Seed of noise, forecast errors and random shuffle.")] = 0
    force: Force = False
    json: Json = False

    @property
    def case(self) -> Path:
        """What is controlled, as a path."""
        return Path(self.place)

    @property
    def described(self) -> bool:
        """Whether a described plant is controlled, rather than the building of a case."""
        from mpc.adapters.described.read import ready_plants

        return self.case.suffix in (".yaml", ".yml") or (str(self.case) in ready_plants() and not self.case.exists())

    def study(self) -> Study | PlantStudy:
        """Put together what controllers run on."""
        return self._described() if self.described else self._case()

    def _described(self) -> PlantStudy:
        from mpc.control.identified.conformal import Guarantee
        from mpc.control.identified.controller import IdentifiedSettings, RunPlanning
        from mpc.identify.model import read_model
        from mpc.studies.described import PlantStudy

        asked = self.violations
        guarantee = None if asked == "none" else Guarantee(share(asked, "--violations"))
        settings = IdentifiedSettings(starts=self.starts, guarantee=guarantee, runs=cast(RunPlanning, self.runs))
        if self.comfort_price is not None:
            settings = replace(settings, comfort_price=self.comfort_price)
        model = None if self.model is None else read_model(self.model)
        return PlantStudy(self.case, self.at, self.start, self.end, model, settings)

    def _case(self) -> Study:
        from mpc.studies.many import study_of
        from thermal.case.load import load_case

        return study_of(load_case(self.case), self.chosen)

    @property
    def chosen(self) -> dict[str, Any]:
        """Settings of a case's study by name."""
        from mpc.studies.many import COMPARISON

        return {name: getattr(self, name) for name in COMPARISON if hasattr(self, name)}


@spread
def control(
    given: StudyOptions,
    out: Annotated[Path, folder("control.json, trajectory.parquet, report.html")],
    controller: Annotated[
        str,
        value(
            "mpc, schedule, reset, guideline36, bound (perfect knowledge), of a plant.yaml mpc, full_speed or own, or "
            "one of a plugin.", "NAME",
        ),
    ] = "mpc",
) -> int:
    """Run a building in closed loop with optimal control, or with a rule.

    Example: buildingmpc control cases/office --parameters results/calibration.json --start 2023-10-16
    --end 2023-10-18 --out control; or of a described plant: buildingmpc control plant.yaml --model model --out control
    """
    from calibration.results import check_results_folder
    from mpc.reports.control import control_summary, control_verdict, write_control
    from mpc.studies.registry import find_controller
    from mpc.studies.run import run_controller

    check_results_folder(out, given.force)
    find_controller(controller, "plant" if given.described else "case")
    study = given.study()
    with Waiting(f"control {given.case.name}") as progress:
        run = run_controller(study, controller, progress)
        report = write_control(run, out, command=_command(), force=given.force)

    def show() -> None:
        say(control_verdict(run))
        _show_assumed(run)

    answer(given.json, control_summary(run), show, report)
    return _exit_code([run])


@spread
def compare(
    given: StudyOptions,
    out: Annotated[str, folder("comparison.json, a trajectory_NAME.parquet a controller, report.html")],
    controllers: Annotated[
        str | None,
        value(
            "Among schedule, reset, guideline36, mpc, bound, of a plant.yaml own, full_speed, mpc, those of plugins; "
            "default: all of these.", "A,B,...",
        ),
    ] = None,
    workers: many.Workers = None,
    scheduler: many.Scheduler = None,
    retries: many.Retries = 2,
    limit: many.Limit = None,
) -> int:
    """Run a building with several controllers on the same weather, people and prices, and compare them.

    Of a folder of cases each; --parameters then is the folder of results of `buildingmpc calibrate` of these cases.

    Example: buildingmpc compare cases/office --controllers guideline36,mpc,bound --start 2023-10-16
    --end 2023-10-18 --out compared
    """
    from calibration.results import check_results_folder
    from mpc.reports.comparison import comparison_table
    from mpc.reports.control import comparison_summary, comparison_verdict, write_comparison
    from mpc.studies.registry import find_controller
    from mpc.studies.run import compare_controllers

    names = ids(controllers or (_OF_PLANTS if given.described else _OF_CASES))
    for name in names:
        find_controller(name, "plant" if given.described else "case")
    if not given.described:
        how = many.How(workers, scheduler, retries, limit, given.force, given.json)
        settings = given.chosen | {"controllers": names, "parameters": many.absolute(given.parameters)}
        if (code := many.of_folder("compare", given.place, out, settings, how)) is not None:
            return code
    check_results_folder(out, given.force)
    study = given.study()
    with Waiting(f"compare controllers on {given.case.name}") as progress:
        found = compare_controllers(study, names, progress)
        report = write_comparison(found, out, command=_command(), force=given.force)

    def show() -> None:
        say(comparison_verdict(found))
        (name, *numbers), rows = comparison_table(found)
        show_table("Controllers", {name: "", **dict.fromkeys(numbers, "g")}, rows)
        _show_assumed(found.runs[0])

    answer(given.json, comparison_summary(found), show, report)
    return _exit_code(found.runs)


def _command() -> str:
    """Command line as it was given, for the page."""
    return " ".join(["buildingmpc", *sys.argv[1:]])


def _show_assumed(run: ControlRun) -> None:
    from mpc.reports.assumptions import assumption_rows

    show_table("What these costs rest on", {"assumption": "", "value": ""}, assumption_rows(run.study))
    for note in run.study.notes:
        say(f"Assumed: {note}.")


def _exit_code(runs: Sequence[ControlRun]) -> int:
    """1 when optimal control never had a plan of its own: then nothing was optimised."""
    failed = [run.controller for run in runs if run.decisions and not run.sources.get("optimal plan")]
    if failed:
        complain(f"error: no solve of {', '.join(failed)} gave a plan; the log in the results says why")
    return 1 if failed else 0


def demo(out: Annotated[Path, folder("the results")] = OUT, force: Force = False, json: Json = False) -> int:
    """Check, calibrate, diagnose, evaluate and control the bundled case, in under two minutes.

    Example: buildingmpc demo --out demo_results
    """
    from calibration.results import check_results_folder
    from mpc.studies.demo import run_demo
    from thermal.data import load_bundled_case

    check_results_folder(out, force)
    case = load_bundled_case()
    if not json:
        say(f"The bundled case: {case.path}")
    with Waiting("demo") as progress:

        def told(step: str, verdict: str) -> None:
            if not json:
                progress.say(f"{step}: {verdict}")

        found = run_demo(out, case=case, force=force, progress=progress, told=told)
    answer(json, found.to_dict(), lambda: _show_demo(found, out))
    if not found.fine:
        complain("error: the calibration did not converge, or optimal control never had a plan; the reports say which")
    return 0 if found.fine else 1


def _show_demo(found: Demo, out: Path) -> None:
    """Write what came of the error and of the costs to stdout."""
    from mpc.reports.comparison import comparison_rows

    content = found.to_dict()
    names = {"uncalibrated": "as it was drawn", "calibrated": "calibrated", "with_effects": "with what was found"}
    errors = [(names[key], mae) for key, mae in content["held_out_mae"].items()]
    show_table("Held-out error 6h ahead", {"model": "", "MAE [K]": ".3f"}, errors)
    currency = found.comparison.study.scenario.currency
    columns = {"controller": "", f"energy cost [{currency}]": ".2f", "discomfort, mean zone [K h]": ".3f",
               "energy [kWh/m²]": ".3f"}  # fmt: skip
    rows = [(row[0], row[1], row[4], row[6]) for row in comparison_rows(found.comparison)]
    show_table(f"Controllers, {content['control']['start'][:10]}", columns, rows)
    say("Of one day on a simulated building; prices, people and comfort are in the report.")
    say(f"Report: {out / 'report.html'}")
    add = missing_extras("pages", "plan")
    say(f"Next: {f'{add}, then ' if add else ''}buildingmpc label, for a case of your own")
