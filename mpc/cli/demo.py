"""``buildingmpc demo``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from mpc.cli.console import Force, Json, Waiting, complain, say, show_table, write_json

if TYPE_CHECKING:
    from mpc.studies.demo import Demo

OUT = Path("buildingmpc_demo")


def demo(
    out: Annotated[Path, typer.Option(metavar="DIR", help="Folder of the results.")] = OUT,
    force: Force = False,
    json: Json = False,
) -> int:
    """Do the main job on the bundled case, from check to control."""
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
    if json:
        write_json(found.to_dict())
    else:
        _show(found)
        say(f"Report: {out / 'report.html'}")
        say("Next: buildingmpc label, for a case of your own")
    if not found.fine:
        complain("error: the calibration did not converge, or optimal control never had a plan; the reports say which")
    return 0 if found.fine else 1


def _show(found: Demo) -> None:
    """Write what came of the error and of the costs to stdout."""
    from mpc.reports.control_words import comparison_rows

    content = found.to_dict()
    names = {"uncalibrated": "as it was drawn", "calibrated": "calibrated", "with_effects": "with what was found"}
    errors = [(names[key], f"{mae:.3f}") for key, mae in content["held_out_mae"].items()]
    show_table("Held-out error 6h ahead", ("model", "MAE [K]"), errors)
    show_table(
        f"Controllers, {content['control']['start'][:10]}",
        ("controller", "cost", "discomfort [K h]", "energy [kWh/m2]"),
        [(row[0], row[1], row[4], row[6]) for row in comparison_rows(found.comparison)],
    )
