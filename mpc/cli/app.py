"""The subcommands of ``buildingmpc``, their help, and how an error becomes an exit code."""

from __future__ import annotations

import errno
import os
import sys
import traceback
from collections.abc import Callable
from functools import wraps
from io import TextIOWrapper
from typing import Annotated, ParamSpec

import typer

from mpc.cli.calibrate import calibrate
from mpc.cli.check import check
from mpc.cli.control import compare, control
from mpc.cli.demo import demo
from mpc.cli.diagnose import diagnose
from mpc.cli.doctor import doctor
from mpc.cli.evaluate import evaluate
from mpc.cli.imports import import_devices, import_plan, import_telemetry
from mpc.cli.label import label
from mpc.cli.serve import serve
from mpc.cli.simulate import simulate

P = ParamSpec("P")

#: Exit codes of the contract: success is 0.
FAILURE, BAD_INPUT = 1, 2

_settings = {"debug": False}

_FAMILIES = {"ThermalError", "CalibrationError", "MpcError"}

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
    debug: Annotated[bool, typer.Option("--debug", help="Show the traceback of an error.")] = False,
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Show the version and exit.")
    ] = False,
) -> None:
    """Take the options that stand before the subcommand."""
    _settings["debug"] = debug


def _guarded(command: Callable[P, int]) -> Callable[P, None]:
    """Turn what a command returns or raises into an exit code, and an error into one line on stderr."""

    @wraps(command)
    def run(*args: P.args, **kwargs: P.kwargs) -> None:
        try:
            code = command(*args, **kwargs)
        except (typer.Exit, typer.Abort):
            raise
        except OSError as error:
            if error.errno == errno.EPIPE:  # the reader of a pipe has gone: nothing to say to anyone
                raise
            code = _report(error, command.__name__)
        except Exception as error:
            code = _report(error, command.__name__)
        raise typer.Exit(code)

    return run


def _report(error: Exception, command: str) -> int:
    """Say what went wrong on stderr and choose the exit code."""
    if _settings["debug"]:
        traceback.print_exception(error, file=sys.stderr)
    typer.echo(f"error: {type(error).__name__}: {error}", err=True)
    if any(base.__name__ in _FAMILIES for base in type(error).__mro__):
        return BAD_INPUT
    if not _settings["debug"]:
        typer.echo(f"For the traceback: buildingmpc --debug {command} ...", err=True)
    return FAILURE


for _command, _help, _example in (
    (
        demo,
        "Check, calibrate, diagnose, evaluate and control the bundled case, in under two minutes.",
        "demo --out demo_results",
    ),
    (doctor, "Say what is installed and what is missing, and test the solvers.", "doctor"),
    (check, "Validate a case folder: geometry, quality of the telemetry, what each point is.", "check cases/office"),
    (
        import_plan,
        "Make a case folder of floor plans: PNG, JPEG, PDF, DXF, arrays of codes.",
        "import-plan plans/plans.yaml --devices plans/devices.csv --out cases/office",
    ),
    (
        import_devices,
        "Give a case its devices from CSV, Brick or Haystack, and match columns of telemetry to them.",
        "import-devices cases/office devices.ttl --telemetry export.csv --out cases/office-2",
    ),
    (
        import_telemetry,
        "Give a case its telemetry, whatever its columns are called.",
        "import-telemetry cases/office export.csv --points points.csv --out cases/office-3",
    ),
    (
        label,
        "Turn floor plans and a list of devices into a case, on a page in the browser; show its reports.",
        "label cases/office",
    ),
    (
        simulate,
        "Replay the inputs of a building through its model.",
        "simulate cases/office --start 2023-10-16 --end 2023-10-18 --parameters results/calibration.json --out replay",
    ),
    (
        evaluate,
        "N-step prediction error of a model on the telemetry of a case.",
        "evaluate cases/office --parameters results/calibration.json --interval 2023-10-16/2023-10-23 --out errors",
    ),
    (
        calibrate,
        "Fit the physical parameters of a building to its telemetry; of each case in a folder of cases.",
        "calibrate cases/office --tune 2023-10-02/2023-10-16 --hold-out 2023-10-16T00:05/2023-10-23 --out results",
    ),
    (
        diagnose,
        "Say where model and building disagree, which missing effect causes it, and how far the error falls with it.",
        "diagnose cases/office --out diagnosis",
    ),
    (
        control,
        "Run a building in closed loop with optimal control, or with a rule.",
        "control cases/office --parameters results/calibration.json --start 2023-10-16 --end 2023-10-18 --out control",
    ),
    (
        compare,
        "Run a building with several controllers on the same weather, people and prices, and compare them.",
        "compare cases/office --controllers guideline36,mpc,bound --start 2023-10-16 --end 2023-10-18 --out compared",
    ),
    (
        serve,
        "Put buildings behind BOPTEST's REST API, so that its controllers run on them; ends with Ctrl-C.",
        "serve cases/office --boptest --parameters results/calibration.json --weather town.epw --port 8000",
    ),
):
    app.command(help=_help, epilog=f"Example: buildingmpc {_example}")(_guarded(_command))


def main() -> None:
    """Run the console command and leave with its exit code."""
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(name, "1")  # matrices this small lose a fifth of the time to a second thread
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):
            stream.reconfigure(errors="replace")  # a terminal without the letter must not turn a result into an error
    app()
