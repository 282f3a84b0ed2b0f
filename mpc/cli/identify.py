"""``buildingmpc identify``: a model of a described plant, from an experiment or from telemetry."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from mpc.cli import many, options
from mpc.cli.console import Waiting, answer, say, show_table


def identify(
    plant: Annotated[
        str,
        typer.Argument(metavar="PLANT", help="plant.yaml, name of a ready plant, or a folder of such folders."),
    ],
    out: Annotated[str, options.folder("model.json, identify.json, telemetry.parquet, report.html")],
    days: Annotated[int, options.value("Length of the experiment [d].", "DAYS")] = 14,
    start: Annotated[
        str | None,
        options.value("When it begins, local; default: so that it ends where the description's period begins.", "T"),
    ] = None,
    telemetry: Annotated[
        Path | None,
        options.file(
            "Telemetry that is there already, such as trajectory.parquet of `control`; no experiment is made."
        ),
    ] = None,
    actuators: Annotated[
        str, options.value("What is controlled; default: commands of machines, else setpoints of zones.", "NAME,...")
    ] = "",
    cooling: Annotated[
        bool, options.switch("--cooling", "Control setpoints of cooling; beside them those of heating, kept clear of.")
    ] = False,
    at: Annotated[str | None, options.value("Unit or server in the place of the description's.", "FILE|URL")] = None,
    seed: Annotated[int, options.value("Seed of the excitation.")] = 0,
    workers: many.Workers = None,
    scheduler: many.Scheduler = None,
    retries: many.Retries = 2,
    limit: many.Limit = None,
    force: options.Force = False,
    json: options.Json = False,
) -> int:
    """Identify a described plant: excite it within its comfort bands, and fit a grey box and maps of its machines.

    Example: buildingmpc identify plant.yaml --days 14 --out model; then buildingmpc control plant.yaml --model model
    --out control
    """
    from calibration.results import check_results_folder
    from mpc.identify.excitation import ExcitationSettings
    from mpc.identify.identify import identify as identify_plant
    from mpc.identify.telemetry import read_telemetry
    from mpc.reports.identify import identify_rows, identify_summary, identify_verdict, map_rows, write_identified
    from mpc.studies.described import PlantStudy
    from mpc.studies.excited import experiment_period, run_experiment

    wanted = tuple(options.ids(actuators))
    if telemetry is None and at is None:
        settings = {"days": days, "start": start, "actuators": wanted, "cooling": cooling, "seed": seed}
        how = many.How(workers, scheduler, retries, limit, force, json)
        if (code := many.of_folder("identify", plant, out, settings, how)) is not None:
            return code
    check_results_folder(out, force)
    path = Path(plant)
    begin, end = (None, None) if telemetry is not None else experiment_period(path, at, days, start)
    study = PlantStudy(path, at, begin, end, actuators=wanted, cooling=cooling)
    made = None
    with Waiting(f"identify {path.stem}") as progress:
        if telemetry is None:
            made = run_experiment(study, days, ExcitationSettings(seed=seed), progress)
            seen, machines = made.telemetry, made.machines
        else:
            seen = read_telemetry(telemetry, study.site)
            machines = study.seen_machines(seen)
        found = identify_plant(seen, machines, progress)
        command = " ".join(["buildingmpc", *sys.argv[1:]])
        report = write_identified(found, made, out, command=command, force=force)

    def show() -> None:
        say(identify_verdict(found, made))
        columns = {"ahead": "", "grey box [K]": ".3f", "ridge ARX [K]": ".3f", "persistence [K]": ".3f"}
        show_table("Error on days that were held out", columns, identify_rows(found))
        show_table(
            "Machines", dict.fromkeys(("machine", "what", "term", "value", "95 % interval"), ""), map_rows(found.model)
        )
        for note in found.notes:
            say(f"Assumed: {note}.")

    return answer(json, identify_summary(found, made), show, report)
