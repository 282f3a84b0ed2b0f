"""``buildingmpc demo``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from mpc.cli.console import Waiting, answer, complain, say, show_table
from mpc.cli.options import Force, Json, folder

if TYPE_CHECKING:
    from mpc.studies.demo import Demo

OUT = Path("buildingmpc_demo")


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
    answer(json, found.to_dict(), lambda: _show(found, out))
    if not found.fine:
        complain("error: the calibration did not converge, or optimal control never had a plan; the reports say which")
    return 0 if found.fine else 1


def _show(found: Demo, out: Path) -> None:
    """Write what came of the error and of the costs to stdout."""
    from mpc.reports.control import comparison_rows

    content = found.to_dict()
    names = {"uncalibrated": "as it was drawn", "calibrated": "calibrated", "with_effects": "with what was found"}
    errors = [(names[key], mae) for key, mae in content["held_out_mae"].items()]
    show_table("Held-out error 6h ahead", {"model": "", "MAE [K]": ".3f"}, errors)
    columns = {"controller": "", "cost": ".2f", "discomfort [K h]": ".3f", "energy [kWh/m2]": ".3f"}
    rows = [(row[0], row[1], row[4], row[6]) for row in comparison_rows(found.comparison)]
    show_table(f"Controllers, {content['control']['start'][:10]}", columns, rows)
    say(f"Report: {out / 'report.html'}")
    say("Next: buildingmpc label, for a case of your own")
