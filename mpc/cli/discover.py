"""``buildingmpc discover``: what the points of a building's network are."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from mpc.cli import options
from mpc.cli.console import Waiting, answer, say, show_table

if TYPE_CHECKING:
    from thermal.plan.discovery import Proposal


def discover(
    case: options.CaseFolder,
    out: Annotated[Path, options.folder("proposal.yaml, points.csv")],
    bacnet: Annotated[str, options.value("This machine on the BACnet/IP network, 10.0.0.5/24.", "ADDRESS")] = "",
    device: Annotated[
        list[str] | None, options.value("Device to ask, repeatable; default: all that answer.", "ADDRESS")
    ] = None,
    model: Annotated[Path | None, options.file("Brick (.ttl) or Haystack (.json, .zinc) instead.")] = None,
    force: options.Force = False,
    json: options.Json = False,
) -> int:
    """List the points of a network and propose what each is, for a person to confirm; nothing is written to devices.

    Example: buildingmpc discover cases/office --bacnet 10.0.0.5/24 --out found
    """
    import tempfile

    from calibration.results import check_results_folder, write_results
    from thermal.case.load import load_building
    from thermal.errors import PlanError
    from thermal.plan.discovery import points_of_model, propose, write_proposal
    from thermal.plan.match import write_matches
    from thermal.plan.models import read_devices

    check_results_folder(out, force)
    one = bool(bacnet) != (model is not None)
    PlanError.unless(one, "discover", "either --bacnet or --model", "both" if bacnet else "neither")
    building = load_building(case)
    if model is not None:
        found = points_of_model(read_devices(model, building.zone_names))
    else:
        from thermal.intake.bacnet import discover as ask

        with Waiting("discover") as progress:
            found = ask(bacnet, device or (), progress=progress)
    proposal = propose(found, building)
    with tempfile.TemporaryDirectory() as work:
        listed = write_matches(proposal.matches(), Path(work) / "points.csv").read_text(encoding="utf-8")
        told = write_proposal(proposal, Path(work) / "proposal.yaml").read_text(encoding="utf-8")
    write_results(out, {"proposal.yaml": told, "points.csv": listed}, force)
    return answer(json, proposal.model_dump(mode="json"), lambda: _show(proposal, out))


def _show(proposal: Proposal, out: Path) -> None:
    counts = ", ".join(f"{len(proposal.of(s))} {s}" for s in ("matched", "doubtful", "unmatched"))
    say(f"{len(proposal.points)} points: {counts}.")
    rows = [
        (p.address, p.name, p.description, f"{p.entity}/{p.point}" if p.entity else "", p.score, p.remark)
        for p in (*proposal.of("doubtful"), *proposal.of("unmatched"))
    ]
    columns = {"address": "", "name": "", "description": "", "best guess": "", "score": ".2f", "why": ""}
    if rows:
        show_table("To look at", columns, rows, f"{out / 'proposal.yaml'} lists them all")
    say(f"Confirm each point in {out / 'proposal.yaml'}, or give the labelling page {out / 'points.csv'}.")
