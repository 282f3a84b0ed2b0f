"""``buildingmpc effects``: the catalogue of what a building may have and the baseline does not."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from mpc.cli.console import answer, say, show_table
from mpc.cli.options import Json


def effects(
    case: Annotated[
        Path | None, typer.Argument(metavar="[CASE]", help="Case folder: says which effects its telemetry can tell.")
    ] = None,
    json: Json = False,
) -> int:
    """List the effects that a diagnosis seeks, and that models may have.

    Example: buildingmpc effects cases/office
    """
    from thermal.effects.catalogue import CATALOGUE

    reasons = {} if case is None else _untestable(case)
    content = {
        e.id: {
            "title": e.title, "equation": e.equation, "source": e.source, "acts_on": e.acts_on, "needs": list(e.needs),
            "confounders": list(e.confounders), "separated_by": e.separated_by, "by_zone": e.zonal,
            "requires": list(e.requires),
            "parameters": {p.name: {"unit": p.unit, "range": [p.lower, p.upper]} for p in e.parameters},
        } | ({} if case is None else {"untestable": reasons.get(e.id)})
        for e in CATALOGUE.values()
    }  # fmt: skip

    def show() -> None:
        columns = {"effect": "", "what it is": "", "told apart by": ""}
        rows = [[e.id, e.title, e.separated_by] for e in CATALOGUE.values()]
        if case is not None:
            columns, rows = columns | {"this case": ""}, [[*r, reasons.get(r[0], "can tell")] for r in rows]
        show_table("Effects", columns, rows, more="--json lists equations, sources and ranges")
        say("Known to be there: buildingmpc diagnose CASE --effects ID,...; not there: --rule-out ID,...")

    return answer(json, {"effects": content}, show)


def _untestable(folder: Path) -> dict[str, str]:
    """Say of each effect why a case cannot tell it."""
    from calibration.diagnosis.refit.comparison import ModelComparison
    from thermal.case.load import load_case

    return ModelComparison(load_case(folder)).untestable()
