"""The subcommands of ``buildingmpc``, their help, and how an error becomes an exit code."""

import errno
import os
import re
import sys
import traceback
from collections.abc import Callable
from functools import wraps
from importlib import metadata
from io import TextIOWrapper
from json import dumps
from typing import Annotated, Any, ParamSpec

import typer

from mpc.cli.calibrate import calibrate, diagnose
from mpc.cli.case import case_from, case_pack
from mpc.cli.control import compare, control, demo
from mpc.cli.discover import discover
from mpc.cli.doctor import doctor
from mpc.cli.effects import effects
from mpc.cli.evaluate import check, evaluate, simulate
from mpc.cli.experiment import experiment
from mpc.cli.identify import identify
from mpc.cli.imports import import_devices, import_plan, import_telemetry
from mpc.cli.monitor import monitor
from mpc.cli.operate import operate, rehearse, replay
from mpc.cli.options import displaying, switch, value
from mpc.cli.priors import priors
from mpc.cli.serve import label, serve
from mpc.cli.verify import verify
from mpc.plugins import load_plugins
from thermal.errors import Described

P = ParamSpec("P")

#: Exit codes of the contract: success is 0.
FAILURE, BAD_INPUT = 1, 2

#: What typer ends with on Ctrl-C: 128 and the signal's number, as shells have it.
INTERRUPTED = 130

#: Error of the command line itself, such as an option that there is not.
_USAGE: Any = typer.BadParameter.__base__

#: What a message says to a caller of the Python function, in brackets behind the option of the command. What is in
#: brackets elsewhere may be part of a path.
_KEYWORD = re.compile(r"( --[a-z-]+(?: [\w:]+)?) \(\w+=[\w']+\)")

_settings: dict[str, Any] = {"debug": False, "plugins": []}

app = typer.Typer(
    name="buildingmpc",
    help="Model a real building, calibrate it on telemetry, and say how far its predictions are off.",
    epilog="Start with: buildingmpc demo",
    rich_markup_mode="markdown",  # a unit in brackets is no markup
    no_args_is_help=True,
    invoke_without_command=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


@app.callback()
def options(
    context: typer.Context,
    debug: Annotated[bool, switch("--debug", "Show where in the code an error came up.")] = False,
    plugin: Annotated[
        list[str] | None, value("Module or .py file that adds controllers, effects, ...; repeatable.", "MODULE")
    ] = None,
    version: Annotated[bool, switch("--version", "Show the version and exit; with --json as JSON.")] = False,
    json: Annotated[bool, typer.Option("--json", hidden=True)] = False,
) -> None:
    """Take the options that stand before the subcommand."""
    _settings["debug"] = debug
    _settings["plugins"] = plugin or []
    if version:
        found = {"name": "buildingmpc", "version": metadata.version("buildingmpc")}
        typer.echo(dumps(found) if json else f"{found['name']} {found['version']}")
        raise typer.Exit
    if context.invoked_subcommand is None:
        if json:
            raise _USAGE("Missing command.", context)
        typer.echo(context.get_help())
        raise typer.Exit


def _guarded(command: Callable[P, int]) -> Callable[P, None]:
    """Turn what a command returns or raises into an exit code, and an error into one line on stderr."""

    @wraps(command)
    def run(*args: P.args, **kwargs: P.kwargs) -> None:
        try:
            if command is not doctor:  # it works where half of the packages are missing
                load_plugins(_settings["plugins"])
            code = command(*args, **kwargs)
        except (typer.Exit, typer.Abort):
            raise
        except Exception as error:
            if isinstance(error, OSError) and error.errno == errno.EPIPE:  # a pipe's reader has gone: nothing to say
                raise
            code = _report(error, command.__name__.replace("_", "-"), kwargs.get("json") is True)
        raise typer.Exit(code)

    return run


def _report(error: Exception, command: str, json: bool) -> int:
    """Say what went wrong on stderr, and on stdout where JSON is asked for; choose the exit code."""
    if _settings["debug"]:
        traceback.print_exception(error, file=sys.stderr)
    told = _KEYWORD.sub(r"\1", str(error))
    typer.echo(f"error: {type(error).__name__}: {told}", err=True)
    code = BAD_INPUT if isinstance(error, Described) else FAILURE
    if json:
        typer.echo(dumps({"error": {"name": type(error).__name__, "message": told, "exit_code": code}}))
    if code == FAILURE and not _settings["debug"]:
        typer.echo(f"For the place in the code: buildingmpc --debug {command} ...", err=True)
    return code


_REPORTING = (
    demo, check, simulate, evaluate, calibrate, diagnose, experiment, monitor, identify, control, compare, verify,
)  # fmt: skip

for _command in (
    *(demo, doctor, check, import_plan, import_devices, import_telemetry, discover, label),
    *(simulate, evaluate, calibrate, priors, diagnose, experiment, monitor, effects, identify, control, compare),
    *(verify, operate, rehearse, replay, serve),
):
    app.command()(_guarded(displaying(_command) if _command in _REPORTING else _command))

_cases = typer.Typer(no_args_is_help=True, help="Cases out of a historian.")
for _name, _command in (("from", case_from), ("pack", case_pack)):
    _cases.command(_name)(_guarded(_command))
app.add_typer(_cases, name="case")


def main() -> None:
    """Run the console command and leave with its exit code."""
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(name, "1")  # matrices this small lose a fifth of the time to a second thread
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):
            stream.reconfigure(errors="replace")  # a terminal without the letter must not turn a result into an error
    if "--json" not in sys.argv:
        app()
    try:
        code = app(standalone_mode=False)
    except _USAGE as error:
        error.show()
        content = {"name": "UsageError", "message": error.format_message(), "exit_code": error.exit_code}
        typer.echo(dumps({"error": content}))
        sys.exit(error.exit_code)
    except typer.Abort:
        code = INTERRUPTED
    if code == INTERRUPTED:
        typer.echo(dumps({"error": {"name": "Interrupted", "message": "stopped by Ctrl-C", "exit_code": code}}))
    sys.exit(code)
