"""``buildingmpc operate``, ``buildingmpc rehearse`` and ``buildingmpc replay``."""

from __future__ import annotations

import getpass
import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from mpc.cli.console import Waiting, answer, complain, say, show_table
from mpc.cli.options import Force, Json, file, folder, ids, value
from mpc.errors import LiveError

if TYPE_CHECKING:
    from pandas import Timestamp

    from mpc.live.guard.socket import GuardClient
    from mpc.live.site import Site

_PARTS = ("guard", "collector", "controller", "page", "nightly")

#: How long the guard may read and write after its wait, before an operator is told that it does not answer [s].
_PATIENCE = 10.0


def operate(
    site: Annotated[Path, typer.Argument(metavar="SITE", help="site.yaml.")],
    part: Annotated[
        str | None, value(f"Run one of {', '.join(_PARTS)} alone, in this process; default: all.", "PART")
    ] = None,
    check: Annotated[bool, typer.Option("--check", help="Read the files, say what they ask for, and end.")] = False,
    status: Annotated[bool, typer.Option("--status", help="Say what the guard of a running site does.")] = False,
    approve: Annotated[
        str, value("Approve the values of advised points in the plan that is in force; 'all' for all.", "POINT,...")
    ] = "",
    mode: Annotated[
        str, value("Switch points to shadow, advise or act: MODE, or MODE:POINT,...", "MODE[:POINT,...]")
    ] = "",
    json: Json = False,
) -> int:
    """Operate a real building: shadow, advise or act on the points of a site.yaml.

    Example: buildingmpc operate site.yaml
    """
    from mpc.live.site import Site

    read = Site(site)
    if check:
        return _check(read, json)
    if status:
        return _status(read, json)
    if approve or mode:
        return _ask(read, approve, mode, json)
    if part is not None:
        LiveError.unless_known(part, _PARTS, "--part", f"one of {', '.join(_PARTS)}")
        return _run(read, part)
    from mpc.live.supervise import PARTS, Supervisor

    if not json:
        say(f"Operating {read.file.name}; page: http://{read.file.page.host}:{read.file.page.port}   Ctrl-C ends it")
        say(f"Logs: {read.folder}; addresses of the page for viewers and operators: {read.folder / 'page.json'}")
    parts = PARTS if read.file.nightly is None else (*PARTS, "nightly")
    return Supervisor(site, read.folder, parts).run()


def _run(site: Site, part: str) -> int:
    if part == "guard":
        from mpc.live.guard.process import run_guard

        return run_guard(site)
    if part == "collector":
        from mpc.live.collector import run_collector

        return run_collector(site)
    if part == "controller":
        from mpc.live.controller import run_controller_process

        return run_controller_process(site)
    if part == "nightly":
        from mpc.live.nightly import run_nightly

        return run_nightly(site)
    from mpc.live.page.serve import run_page

    return run_page(site)


def _check(site: Site, json: bool) -> int:
    from mpc.live.planner import Planner

    Planner(site)  # says what is wrong with model and plant
    rows = [
        (name, entry.connection, entry.at, entry.mode if name in site.writable else "read")
        for name, entry in site.file.points.items()
    ]
    content = {
        "name": site.file.name, "configuration": site.hash, "controller": site.file.controller, "step": site.step,
        "limits": site.limits(), "points": {name: mode for name, _, _, mode in rows},
    }  # fmt: skip

    def show() -> None:
        show_table(f"Points of {site.file.name}", dict.fromkeys(("point", "connection", "at", "mode"), ""), rows)

    return answer(json, content, show)


def _guard(site: Site) -> dict[str, Any]:
    from mpc.live.guard.socket import GuardClient

    client = GuardClient(site.sockets)
    told = client.ask({"kind": "status"})
    client.close()
    LiveError.unless("decision" in told, "guard", "a guard that runs", told.get("error", "none"), "start it: operate")
    return told


def _status(site: Site, json: bool) -> int:
    told = _guard(site)
    decision = told["decision"]
    planned = (told["plan"] or {"values": {}})["values"]
    rows = [
        (name, decision["modes"][name], told["readings"].get(name, {}).get("value"), planned.get(name),
         decision["held"].get(name), decision["why"].get(name, ""))
        for name in decision["modes"]
    ]  # fmt: skip

    def show() -> None:
        numbers = dict.fromkeys(("shows", "planned", "in force"), "g")
        show_table(site.file.name, {"point": "", "mode": "", **numbers, "why not": ""}, rows)
        for doubt in decision["doubts"]:
            say(f"Doubt: {doubt}.")

    return answer(json, told, show)


def _ask(site: Site, approve: str, mode: str, json: bool) -> int:
    """Send an operator's request, signed with the key of the site's folder."""
    from mpc.live.guard.socket import GuardClient
    from mpc.live.operators import operator_key, sign

    told = _guard(site)
    request: dict[str, Any]
    if approve:
        plan = told["plan"]
        LiveError.unless(plan is not None, "--approve", "a plan that is in force", "none")
        modes = told["decision"]["modes"]
        points = [n for n in plan["values"] if modes.get(n) == "advise"] if approve == "all" else list(ids(approve))
        request = {"kind": "approve", "points": points, "plan": plan["number"]}
    else:
        name, _, listed = mode.partition(":")
        LiveError.unless_known(name, ("shadow", "advise", "act"), "--mode", "a mode")
        request = {"kind": "mode", "mode": name, "points": list(ids(listed)) or list(told["decision"]["modes"])}
    for point in request["points"]:
        LiveError.unless_known(point, told["decision"]["modes"], "points", "one that may be written to")
    tick = float(site.limits()["tick"])
    signed = sign(request, operator_key(site.folder), site.clock().wall(), getpass.getuser(), tick)
    client = GuardClient(site.sockets)
    try:
        error = client.ask(signed)["error"] or _answered(client, signed["nonce"], site.clock().real(2.0 * tick))
    finally:
        client.close()
    if error:
        complain(f"error: refused by the guard: {error}")
        return 1
    done = f"{request['kind']}: {', '.join(request['points']) or 'no point'}"
    return answer(json, request, lambda: say(f"The guard took it: {done}"))


def _answered(client: GuardClient, nonce: str, wait: float) -> str:
    """Wait for what the guard makes of a request at its next look; empty where it took it."""
    end = time.monotonic() + wait + _PATIENCE
    while time.monotonic() < end:
        known = client.ask({"kind": "status"}).get("answers", {})
        if nonce in known:
            return str(known[nonce])
        time.sleep(0.1)
    return "no answer in time; --status says what is in force"


def rehearse(
    site: Annotated[Path, typer.Argument(metavar="SITE", help="site.yaml, with a building as its model.")],
    out: Annotated[Path, folder("rehearsal.json, days.parquet, report.html")],
    start: Annotated[str, value("First recorded step that counts, local; default: of all.", "TIME")] = "",
    end: Annotated[str, value("Where it ends, local; default: with the last one.", "TIME")] = "",
    force: Force = False,
    json: Json = False,
) -> int:
    """Tell what acting would have saved on recorded days: both controls in closed loop with the site's model.

    Example: buildingmpc rehearse site.yaml --out rehearsed
    """
    from calibration.results import check_results_folder
    from mpc.live.rehearsal import rehearse as rehearsed
    from mpc.live.site import Site
    from mpc.reports.rehearsal import day_rows, rehearsal_verdict, write_rehearsal

    check_results_folder(out, force)
    read = Site(site)
    zone = read.plant.location.timezone
    with Waiting(f"rehearse {read.file.name}") as progress:
        found = rehearsed(read, _local(start, "--start", zone), _local(end, "--end", zone), progress=progress)
        report = write_rehearsal(found, out, force=force)

    def show() -> None:
        say(rehearsal_verdict(found))
        heads = ("day", "own control", "acting", "saved", "own K h", "acting K h", "promised by plans")
        show_table("Days", dict.fromkeys(heads, ""), day_rows(found))

    return answer(json, found.to_dict(), show, report)


def _local(text: str, where: str, timezone: str) -> Timestamp | None:
    """Read a local time; None for none."""
    from pandas import Timestamp, isna

    if not text:
        return None
    try:
        read = Timestamp(text)
        if isna(read):
            raise ValueError(text)
        return read.tz_localize(timezone) if read.tzinfo is None else read
    except ValueError as error:
        raise LiveError(where, "a time in ISO 8601", repr(text), "for example 2026-01-05") from error


def replay(
    log: Annotated[Path, typer.Argument(metavar="LOG", help="A file of an audit log, or the folder of all.")],
    site: Annotated[Path | None, file("site.yaml of that time, to repeat the plans of the controller too.")] = None,
    json: Json = False,
) -> int:
    """Repeat every decision of an audit log bit for bit, and check the chain of its lines.

    Example: buildingmpc replay live/guard-000000.jsonl
    """
    from mpc.live.audit import log_files
    from mpc.live.replay import replay_logs

    files = log_files(log) if log.is_dir() else [log]
    LiveError.unless(files, str(log), "files of an audit log", "none")
    found, rows = dict[str, dict[str, Any]](), []
    for path, one in replay_logs(files, site).items():
        found[path.name] = {"lines": one.lines, "decisions": one.decisions, "broken": one.broken,
                            "different": one.different, "notes": one.notes, "last": one.last}  # fmt: skip
        rows.append((path.name, one.lines, one.decisions, one.broken or "; ".join(one.different[:3]) or "repeats"))

    def show() -> None:
        show_table("Replay", {"file": "", "lines": "d", "decisions": "d", "result": ""}, rows)
        for note in {note for one in found.values() for note in one["notes"]}:
            say(f"Note: {note}.")

    answer(json, found, show)
    return 0 if all(not one["broken"] and not one["different"] for one in found.values()) else 1
