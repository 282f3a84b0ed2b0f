"""``buildingmpc priors``: what a fleet of calibrated buildings teaches about the next one."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from mpc.cli import options
from mpc.cli.console import Waiting, answer, say, show_table

if TYPE_CHECKING:
    from calibration.evaluation.population import Population

#: File of the results.
PRIORS = "priors.json"


def priors(
    results: Annotated[
        str, typer.Argument(metavar="RESULTS", help="Folder that `buildingmpc calibrate FOLDER` wrote: path or URL.")
    ],
    out: Annotated[Path, options.folder(PRIORS)],
    force: options.Force = False,
    json: options.Json = False,
) -> int:
    """Learn the population that the buildings of a fleet come from: priors of the next building's parameters.

    Example: buildingmpc priors results --out taught; then buildingmpc calibrate cases/new --priors taught/priors.json
    --out new
    """
    from calibration.fleet.data_set import LocalFolder
    from calibration.fleet.priors import population_of
    from calibration.fleet.store import Store, is_url
    from calibration.results import check_results_folder, write_results

    check_results_folder(out, force)
    with Waiting("priors"):
        found = population_of(Store(results) if is_url(results) else LocalFolder(Path(results)))
        write_results(out, {PRIORS: found.to_dict()}, force)
    answer(json, found.to_dict(), lambda: _show(found, out))
    return 0


def _show(found: Population, out: Path) -> None:
    rows = [
        (name, float(mean), float(spread))
        for name, mean, spread in zip(found.names, found.mean, found.covariance.diagonal() ** 0.5, strict=True)
    ]
    columns = {"parameter": "", "mean from the drawing on [-]": "+.2f", "deviation [-]": ".2f"}
    show_table(f"Population of {len(found.members)} buildings, on the estimation scale", columns, rows)
    unlike = [case for case, weight in zip(found.members, found.weights, strict=True) if weight < 0.5]
    if unlike:
        say(f"Unlike the others, and counted by less than half: {', '.join(unlike)}.")
    say(f"Priors: {out / PRIORS}")
