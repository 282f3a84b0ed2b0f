"""``buildingmpc serve``."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from mpc.cli.console import Json, Waiting, say, show_table, write_json
from mpc.cli.evaluate import Dx, Parameters

if TYPE_CHECKING:
    from mpc.adapters.boptest.case import BoptestCase
    from mpc.adapters.boptest.server import BoptestServer

PORT = 8000

#: A pilot of a size that many tests at once are quick with: floor area [m2], zones, distance of control volumes [m].
SMALL_PILOT = (600.0, 12, 1.0)


def serve(
    cases: Annotated[
        list[Path] | None, typer.Argument(metavar="[CASE]...", help="Case folders; default: the bundled case.")
    ] = None,
    boptest: Annotated[bool, typer.Option("--boptest", help="Behind BOPTEST's REST API.")] = False,
    pilot: Annotated[
        bool, typer.Option("--pilot", help="Serve the generated pilot, too: 'pilot', and 'pilot_12' with 12 zones.")
    ] = False,
    host: Annotated[str, typer.Option(metavar="ADDRESS", help="Where to listen.")] = "127.0.0.1",
    port: Annotated[int, typer.Option(metavar="N", help="Port; 0 takes a free one.")] = PORT,
    allow_remote: Annotated[
        bool, typer.Option("--allow-remote", help="Let other machines in; there is no password.")
    ] = False,
    name: Annotated[
        list[str] | None, typer.Option(metavar="NAME", help="A name that clients call the server by, repeatable.")
    ] = None,
    parameters: Parameters = None,
    weather: Annotated[
        Path | None, typer.Option(metavar="FILE", help="EPW or CSV of a whole year; default: the case's telemetry.")
    ] = None,
    step: Annotated[float, typer.Option(metavar="SECONDS", help="Step of the plants.")] = 300.0,
    dx: Dx = None,
    most: Annotated[int, typer.Option(metavar="N", help="Tests that may run at once.")] = 64,
    idle: Annotated[float, typer.Option(metavar="SECONDS", help="A test unused this long is freed.")] = 900.0,
    json: Json = False,
) -> int:
    """Serve plants until interrupted."""
    from mpc.adapters.boptest.server import BoptestServer, check_host
    from mpc.errors import BoptestError

    if not boptest:
        raise BoptestError("serve: expected what to serve as, found nothing; say --boptest")
    if parameters is not None and len(cases or ()) > 1:
        raise BoptestError("--parameters: expected one case that they belong to, found several; serve it alone")
    check_host(host, allow_remote)  # before the minutes that a large building takes
    with Waiting("reduce the buildings") as progress:
        made = _make(cases or [], pilot, parameters, weather, step, dx, progress)
        server = BoptestServer(
            made, host, port, allow_remote=allow_remote, names=name or (), most=most, idle_seconds=idle
        )
    _announce(server, made, json)
    with suppress(KeyboardInterrupt):
        server.run()
    return 0


def _make(
    cases: list[Path],
    pilot: bool,
    parameters: Path | None,
    weather: Path | None,
    step: float,
    dx: float | None,
    progress: Waiting,
) -> list[BoptestCase]:
    from mpc.adapters.boptest.make import case_to_serve, pilot_to_serve
    from thermal.case.load import load_case
    from thermal.data import load_bundled_case

    made: list[BoptestCase] = []
    count = (len(cases) or 1) + 2 * pilot
    for case in [load_case(path) for path in cases] or [load_bundled_case()]:
        made.append(case_to_serve(case, parameters, weather=weather, step_seconds=step, dx=dx))
        progress(made[-1].name, len(made), count)
    if pilot:
        area, zones, spacing = SMALL_PILOT
        made.append(pilot_to_serve(step_seconds=step))
        progress(made[-1].name, len(made), count)
        made.append(pilot_to_serve(1, floor_area=area, zones=zones, dx=spacing, step_seconds=step, name="pilot_12"))
    return made


def _announce(server: BoptestServer, made: list[BoptestCase], json: bool) -> None:
    """Say where the server is and what it serves; a line of JSON for programs that wait for it."""
    if json:
        listed = {case.name: {"zones": len(case.building.zone_names), "periods": list(case.periods)} for case in made}
        write_json({"url": server.url, "testcases": listed})
    else:
        show_table(
            f"BOPTEST's API at {server.url}",
            ("test case", "zones", "weather", "time periods"),
            [_row(case) for case in made],
            left=(0, 2, 3),
        )
        say(f"Begin a test: curl -X POST {server.url}/testcases/{made[0].name}/select")
        say("Ctrl-C ends the server and all its tests.")


def _row(case: BoptestCase) -> tuple[str, str, str, str]:
    first, last = (case.clock.stamp(time) for time in case.covered)
    if case.weather.typical:
        covered = "a typical year"
    else:
        covered = f"{first:%Y-%m-%d %H:%M} to {last:%Y-%m-%d %H:%M}"
    return case.name, str(len(case.building.zone_names)), covered, ", ".join(case.periods)
