"""``buildingmpc label`` and ``buildingmpc serve``."""

from __future__ import annotations

import multiprocessing
import signal
import webbrowser
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from mpc import plugins
from mpc.cli.calibrate import run_calibration, run_diagnosis
from mpc.cli.console import Progress, Waiting, answer, say, show_table
from mpc.cli.evaluate import run_check
from mpc.cli.options import Dx, Json, Parameters, file, switch, value
from mpc.errors import BoptestError, MpcError
from mpc.reports.display import Display, showing
from thermal.errors import LabelError

if TYPE_CHECKING:
    from multiprocessing.connection import Connection

    from mpc.adapters.boptest.case import BoptestCase
    from mpc.adapters.boptest.server import BoptestServer
    from thermal.plan.page.desk import LabelDesk

#: A pilot of a size that many tests at once are quick with: floor area [m2], zones, distance of control volumes [m].
SMALL_PILOT: dict[str, Any] = {"floor_area": 600.0, "zones": 12, "dx": 1.0, "name": "pilot_12"}


def serve(
    cases: Annotated[
        list[Path] | None, typer.Argument(metavar="[CASE]...", help="Case folders; default: the bundled case.")
    ] = None,
    boptest: Annotated[
        bool, typer.Option("--boptest", hidden=True, help="As without it: there is one API.")
    ] = True,
    pilot: Annotated[
        bool, switch("--pilot", "Serve the generated pilot, too: 'pilot', and 'pilot_12' with 12 zones.")
    ] = False,
    host: Annotated[str, value("Where to listen.", "ADDRESS")] = "127.0.0.1",
    port: Annotated[int, value("Port; 0 takes a free one.")] = 8000,
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

    Example: buildingmpc serve cases/office --parameters results/calibration.json --weather town.epw
    --port 8000
    """
    from mpc.adapters.boptest.server import BoptestServer, check_host

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


#: How long a report that is stopped may take to clear away what it was writing [s].
_PATIENCE = 10.0

_MAKERS: dict[str, Callable[[Path, Path, bool, Progress], Any]] = {
    "check": run_check, "calibrate": run_calibration, "diagnose": run_diagnosis,
}  # fmt: skip


def label(
    target: Annotated[
        Path | None,
        typer.Argument(
            metavar="CASE|PLAN", help="Case folder, or a drawing, or the YAML list of the floors' drawings."
        ),
    ] = None,
    out: Annotated[Path | None, value("Case folder to make of a drawing; default: named after it.", "DIR")] = None,
    results: Annotated[
        list[Path] | None, value("Folder of results whose reports are shown; repeatable.", "DIR")
    ] = None,
    port: Annotated[int, typer.Option(metavar="N", min=0, max=65535, help="Port; default: any that is free.")] = 0,
    browser: Annotated[bool, switch("--browser/--no-browser", "Open the page in the browser.")] = True,
    take_over: Annotated[bool, switch("--take-over", "Take the case from a program that has it open.")] = False,
) -> int:
    """Turn floor plans and a list of devices into a case, on a page in the browser; show its reports.

    Example: buildingmpc label cases/office
    """
    from thermal.plan.page.desk import LabelDesk
    from thermal.plan.page.serve import serve_page

    case, drawings = _case_of(target, out)
    makers = {name: partial(_make_apart, name) for name in _MAKERS}
    desk = LabelDesk(case, reports=results or (), makers=makers, take_over=take_over)
    try:
        if drawings is not None:
            _prepare(desk, drawings)
    except BaseException:
        desk.end()
        raise

    def ready(address: str) -> None:
        say(f"Labelling {case}   Ctrl-C ends it, everything is saved")
        say(address)
        if browser and not webbrowser.open(address):
            say("No browser could be opened: open this address in one on this machine.")

    serve_page(desk, port=port, ready=ready)
    say(f"Case: {case}   Next: buildingmpc check {case}")
    return 0


def _case_of(target: Path | None, out: Path | None) -> tuple[Path, Path | None]:
    """Case folder to label, and the drawing or list to begin with."""
    if target is None or target.is_dir() or not target.suffix:
        if target is not None and out is not None:
            raise LabelError("--out", "a drawing beside it", f"the case folder {target}", "drop --out")
        return target or out or Path("case"), None
    LabelError.unless(target.is_file(), str(target), "a case folder, a drawing or a list of drawings", "nothing")
    return out or target.with_suffix(""), target


def _prepare(desk: LabelDesk, drawings: Path) -> None:
    """Put a drawing, or all floors of a list, on the page of a new case."""
    from thermal.plan.page.desk import import_list, import_sheet

    advice, where = "open the case itself, and import the drawing on the page", str(desk.store.folder)
    LabelError.unless(not desk.store.draft.floors, where, "a new case folder", "a case with floors", advice)
    if drawings.suffix.lower() in (".yaml", ".yml"):
        with Waiting(f"import {drawings.name}") as progress:
            import_list(desk, drawings, progress)
    else:
        import_sheet(desk, drawings)


def _make_apart(kind: str, case: Path, out: Path, progress: Progress, units: str = "si") -> None:
    """Make a report in a process of its own, so that the page stays quick, and stop it with the job."""
    context = multiprocessing.get_context("spawn")
    here, there = context.Pipe(duplex=False)
    process = context.Process(target=_make, args=(kind, case, out, there, units, plugins.loaded), daemon=True)
    process.start()
    there.close()
    try:
        last: tuple[str, int, int] = ("", 0, 0)
        while True:
            if here.poll(0.5):
                try:
                    message = here.recv()
                except EOFError:
                    break
                if message[0] == "error":
                    raise MpcError(message[1])
                last = message
            progress(*last)
        process.join()
    finally:
        if process.is_alive():
            process.terminate()
        process.join(_PATIENCE)
        if process.is_alive():  # in the middle of a solve, which hears no signal
            process.kill()
        process.join()
    if process.exitcode:
        raise MpcError(f"the process that makes the report ended with code {process.exitcode}")


def _leave(number: int, frame: object) -> None:
    """End as on Ctrl-C, so that what was being written is taken away."""
    raise SystemExit(128 + number)


def _make(
    kind: str, case: Path, out: Path, connection: Connection[Any, Any], units: str, named: Sequence[str]
) -> None:
    """Make a report; what goes wrong is told in a sentence."""
    signal.signal(signal.SIGTERM, _leave)
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the page's: it ends this process by the other signal
    try:
        plugins.load_plugins(named)
        with showing(Display(units=units)):
            _MAKERS[kind](case, out, True, lambda *told: connection.send(told))
    except Exception as error:
        connection.send(("error", f"{type(error).__name__}: {error}"))
    finally:
        connection.close()
