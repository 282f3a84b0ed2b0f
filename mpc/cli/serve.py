"""``buildingmpc serve``."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from mpc.cli.console import Waiting, answer, say, show_table
from mpc.cli.options import Dx, Json, Parameters, file, switch, value

if TYPE_CHECKING:
    from mpc.adapters.boptest.case import BoptestCase
    from mpc.adapters.boptest.server import BoptestServer

PORT = 8000

#: A pilot of a size that many tests at once are quick with: floor area [m2], zones, distance of control volumes [m].
SMALL_PILOT: dict[str, Any] = {"floor_area": 600.0, "zones": 12, "dx": 1.0, "name": "pilot_12"}


def serve(
    cases: Annotated[
        list[Path] | None, typer.Argument(metavar="[CASE]...", help="Case folders; default: the bundled case.")
    ] = None,
    boptest: Annotated[bool, switch("--boptest", "Behind BOPTEST's REST API.")] = False,
    pilot: Annotated[
        bool, switch("--pilot", "Serve the generated pilot, too: 'pilot', and 'pilot_12' with 12 zones.")
    ] = False,
    host: Annotated[str, value("Where to listen.", "ADDRESS")] = "127.0.0.1",
    port: Annotated[int, value("Port; 0 takes a free one.")] = PORT,
    allow_remote: Annotated[bool, switch("--allow-remote", "Let other machines in; there is no password.")] = False,
    name: Annotated[list[str] | None, value("A name that clients call the server by, repeatable.", "NAME")] = None,
    parameters: Parameters = None,
    weather: Annotated[Path | None, file("EPW or CSV of a whole year; default: the case's telemetry.")] = None,
    step: Annotated[float, value("Step of the plants.", "SECONDS")] = 300.0,
    dx: Dx = None,
    most: Annotated[int, value("Tests that may run at once.")] = 64,
    idle: Annotated[float, value("A test unused this long is freed.", "SECONDS")] = 900.0,
    json: Json = False,
) -> int:
    """Put buildings behind BOPTEST's REST API, so that its controllers run on them; ends with Ctrl-C.

    Example: buildingmpc serve cases/office --boptest --parameters results/calibration.json --weather town.epw
    --port 8000
    """
    from mpc.adapters.boptest.server import BoptestServer, check_host
    from mpc.errors import BoptestError

    if not boptest:
        raise BoptestError("serve: expected what to serve as, found nothing; say --boptest")
    if parameters is not None and len(cases or ()) > 1:
        raise BoptestError("--parameters: expected one case that they belong to, found several; serve it alone")
    check_host(host, allow_remote)  # before the minutes that a large building takes
    with Waiting("reduce the buildings") as progress:
        settings = {"parameters": parameters, "weather": weather, "step_seconds": step, "dx": dx}
        made = list(_made(cases or [], pilot, settings, progress))
        server = BoptestServer(
            made, host, port, allow_remote=allow_remote, names=name or (), most=most, idle_seconds=idle
        )
    _announce(server, made, json)
    with suppress(KeyboardInterrupt):
        server.run()
    return 0


def _made(cases: list[Path], pilot: bool, settings: dict[str, Any], progress: Waiting) -> Iterator[BoptestCase]:
    """Make what is served, one after the other."""
    from mpc.adapters.boptest.make import case_to_serve, pilot_to_serve
    from thermal.case.load import load_case
    from thermal.data import load_bundled_case

    loaded = [load_case(path) for path in cases] or [load_bundled_case()]
    makers = [partial(case_to_serve, case, **settings) for case in loaded]
    if pilot:
        pilots = partial(pilot_to_serve, step_seconds=settings["step_seconds"])
        makers += [pilots, partial(pilots, 1, **SMALL_PILOT)]
    for done, make in enumerate(makers, 1):
        yield (made := make())
        progress(made.name, done, len(makers))


def _announce(server: BoptestServer, made: list[BoptestCase], json: bool) -> None:
    """Say where the server is and what it serves; a line of JSON for programs that wait for it."""

    def show() -> None:
        columns = dict.fromkeys(("test case", "zones", "weather", "time periods"), "") | {"zones": "d"}
        rows = [(case.name, len(case.building.zone_names), _covered(case), ", ".join(case.periods)) for case in made]
        show_table(f"BOPTEST's API at {server.url}", columns, rows)
        say(f"Begin a test: curl -X POST {server.url}/testcases/{made[0].name}/select")
        say("Ctrl-C ends the server and all its tests.")

    listed = {case.name: {"zones": len(case.building.zone_names), "periods": list(case.periods)} for case in made}
    answer(json, {"url": server.url, "testcases": listed}, show)


def _covered(case: BoptestCase) -> str:
    first, last = (case.clock.stamp(time) for time in case.covered)
    return "a typical year" if case.weather.typical else f"{first:%Y-%m-%d %H:%M} to {last:%Y-%m-%d %H:%M}"
