"""``buildingmpc demo``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from mpc.cli._calibrate import calibrate_and_write, show_calibration
from mpc.cli._check import show_check
from mpc.cli._console import Force, Json, complain, say, write_json

OUT = Path("buildingmpc_demo")


def demo(
    out: Annotated[Path, typer.Option(metavar="DIR", help="Folder of the results.")] = OUT,
    force: Force = False,
    json: Json = False,
) -> int:
    """Do the main job on the bundled case."""
    from calibration import check_results_folder
    from thermal import load_bundled_case
    from thermal.case import describe_case

    check_results_folder(out, force)
    case = load_bundled_case()
    if not json:
        say(f"The bundled case: {case.path}")
        show_check(describe_case(case))
    result, report = calibrate_and_write(case, out, "calibrate the bundled case", force)
    if json:
        write_json(result.to_dict())
    else:
        show_calibration(result, report)
        say(f"Next: buildingmpc calibrate {case.path} --out results, or a case of your own")
    if not result.solver.success:
        complain(f"error: {result.solver.name} did not converge: {result.solver.status}")
    return 0 if result.solver.success else 1
