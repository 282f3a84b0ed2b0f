"""The subcommands of ``buildingmpc``, their help, and how an error becomes an exit code."""

import errno
import os
import sys
import traceback
from collections.abc import Callable
from functools import wraps
from io import TextIOWrapper
from typing import Annotated, Any, ParamSpec

import typer

from mpc.cli.calibrate import calibrate, diagnose
from mpc.cli.control import compare, control, demo
from mpc.cli.doctor import doctor
from mpc.cli.effects import effects
from mpc.cli.evaluate import check, evaluate, simulate
from mpc.cli.experiment import experiment
from mpc.cli.imports import import_devices, import_plan, import_telemetry
from mpc.cli.monitor import monitor
from mpc.cli.options import switch, value
from mpc.cli.serve import label, serve
from mpc.plugins import load_plugins
from thermal.errors import Described

P = ParamSpec("P")

#: Exit codes of the contract: success is 0.
FAILURE, BAD_INPUT = 1, 2

_settings: dict[str, Any] = {"debug": False, "plugins": []}

app = typer.Typer(
    name="buildingmpc",
    help="Model a real building, calibrate it on telemetry, and say how far its predictions are off.",
    epilog="Start with: buildingmpc demo",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _version(asked: bool) -> None:
    if asked:
        from importlib.metadata import version

        typer.echo(f"buildingmpc {version('buildingmpc')}")
        raise typer.Exit


@app.callback()
def options(
    debug: Annotated[bool, switch("--debug", "Show the traceback of an error.")] = False,
    plugin: Annotated[
        list[str] | None, value("Module or .py file that adds controllers, effects, ...; repeatable.", "MODULE")
    ] = None,
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Show the version and exit.")
    ] = False,
) -> None:
    """Take the options that stand before the subcommand."""
    _settings["debug"] = debug
    _settings["plugins"] = plugin or []


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
            code = _report(error, command.__name__)
        raise typer.Exit(code)

    return run


def _report(error: Exception, command: str) -> int:
    """Say what went wrong on stderr and choose the exit code."""
    if _settings["debug"]:
        traceback.print_exception(error, file=sys.stderr)
    typer.echo(f"error: {type(error).__name__}: {error}", err=True)
    if isinstance(error, Described):
        return BAD_INPUT
    if not _settings["debug"]:
        typer.echo(f"For the traceback: buildingmpc --debug {command} ...", err=True)
    return FAILURE


for _command in (
    *(demo, doctor, check, import_plan, import_devices, import_telemetry, label),
    *(simulate, evaluate, calibrate, diagnose, experiment, monitor, effects, control, compare, serve),
):
    app.command()(_guarded(_command))


def main() -> None:
    """Run the console command and leave with its exit code."""
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(name, "1")  # matrices this small lose a fifth of the time to a second thread
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):
            stream.reconfigure(errors="replace")  # a terminal without the letter must not turn a result into an error
    app()
