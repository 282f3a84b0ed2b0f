"""Options that commands have in common, each declared once."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import wraps
from inspect import Parameter, Signature, signature
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from mpc.cli.console import complain

if TYPE_CHECKING:
    from calibration.evaluation.intervals import Interval
    from thermal.case.case import Case


def folder(contents: str) -> Any:
    """Declare the option of a folder of results.

    Parameters
    ----------
    contents : str
        What is written there.
    """
    return typer.Option(metavar="DIR", help=f"Folder for {contents}.")


def file(text: str) -> Any:
    """Declare the option of a file.

    Parameters
    ----------
    text : str
        What it holds.
    """
    return typer.Option(metavar="FILE", help=text)


def value(text: str, metavar: str = "N") -> Any:
    """Declare an option with a value.

    Parameters
    ----------
    text : str
        What it is for.
    metavar : str
        What stands for it.
    """
    return typer.Option(metavar=metavar, help=text)


def switch(name: str, text: str) -> Any:
    """Declare an option without a value.

    Parameters
    ----------
    name : str
        As it is written, such as ``--force``.
    text : str
        Help.
    """
    return typer.Option(name, help=text)


CaseFolder = Annotated[Path, typer.Argument(metavar="CASE", help="Case folder.")]
Json = Annotated[bool, switch("--json", "Write JSON on stdout, and nothing else.")]
Force = Annotated[bool, switch("--force", "Replace earlier results in the folder.")]
Dx = Annotated[float | None, value("Distance between control volumes of a plan; default its cell size.", "M")]
Horizon = Annotated[str, value("Prediction horizon, such as 6h or 90min.", "TIME")]
Intervals = list[str] | None
Parameters = Annotated[Path | None, file("calibration.json of this case; default: before calibration.")]
SchemeName = Annotated[
    str | None, value("implicit_euler or tr_bdf2; default: as calibrated, else implicit_euler.", "NAME")
]
Start = Annotated[str, typer.Option(metavar="T", help="Start, ISO 8601; local to the building without an offset.")]


def interval(what: str, default: str) -> Any:
    """Declare the option of intervals, which may be repeated.

    Parameters
    ----------
    what : str
        What they are for.
    default : str
        What holds without any.
    """
    return typer.Option(metavar="START/END", help=f"{what} interval, repeatable; default: {default}.")


def open_case(case: Path, out: Path | None, force: bool) -> Case:
    """Load a case, once it is sure that the results may be written; say on stderr when it has no windows.

    Parameters
    ----------
    case : Path
        Case folder.
    out : Path or None
        Folder of the results, where there are to be any.
    force : bool
        Whether earlier results are replaced.
    """
    from calibration.results import check_results_folder
    from thermal.case.load import load_case
    from thermal.case.validation import NO_WINDOWS, has_windows

    if out is not None:
        check_results_folder(out, force)
    loaded = load_case(case)
    if not has_windows(loaded.building):
        complain(f"warning: {NO_WINDOWS.replace('CASE', str(case))}")
    return loaded


def parse_intervals(texts: Sequence[str] | None, case: Case) -> list[Interval]:
    """Read intervals START/END.

    Parameters
    ----------
    texts : sequence of str, optional
        As they were given.
    case : Case
        Whose clock they are on.
    """
    from calibration.evaluation.intervals import parse_interval

    return [parse_interval(text, case) for text in texts or ()]


class DisplayOptions:
    """Options of every command that writes a report: how results are shown."""

    units: Annotated[str, value("Of pages, figures and tables: si, or ip (°F, ft²). Files of numbers stay SI.", "U")]
    figures: Annotated[str, value("Write figures as files too: svg or png; default: in the page only.", "KIND")]
    table_format: Annotated[
        str,
        typer.Option("--format", metavar="KIND", help="Write tables as csv or xlsx too, beside parquet."),
    ]


def displaying(command: Callable[..., int]) -> Callable[..., int]:
    """Give a command the options of how results are shown, which hold while it runs.

    Parameters
    ----------
    command : callable
        That writes a report.
    """
    from inspect import get_annotations

    from mpc.reports.display import FIGURES, FORMATS, UNITS, Display, showing

    own = signature(command, eval_str=True)
    defaults = {"units": UNITS[0], "figures": FIGURES[0], "table_format": FORMATS[0]}
    kinds = get_annotations(DisplayOptions, eval_str=True)
    added = [Parameter(n, Parameter.KEYWORD_ONLY, default=d, annotation=kinds[n]) for n, d in defaults.items()]

    @wraps(command)
    def run(**given: Any) -> int:
        with showing(Display(**{name: given.pop(name) for name in defaults})):
            return command(**given)

    parameters = [p.replace(kind=Parameter.KEYWORD_ONLY) for p in own.parameters.values()]
    run.__signature__ = own.replace(parameters=[*parameters, *added])  # type: ignore[attr-defined]
    run.__annotations__ = {}
    return run


def ids(text: str) -> list[str]:
    """Read ids between commas.

    Parameters
    ----------
    text : str
        As it was given.
    """
    return [name.strip() for name in text.split(",") if name.strip()]


def share(text: str, where: str) -> float:
    """Read a share, such as 5% or 0.05 [-].

    Parameters
    ----------
    text : str
        As it was given.
    where : str
        Name of the option.

    Raises
    ------
    MpcError
        When it is none.
    """
    from mpc.errors import MpcError

    try:
        return float(text.strip().removesuffix("%")) / (100.0 if text.strip().endswith("%") else 1.0)
    except ValueError as error:
        raise MpcError(where, "a share such as 5% or 0.05", repr(text)) from error


def spread(command: Callable[..., int]) -> Callable[..., int]:
    """Make options of the fields of a command's first argument, a dataclass.

    Parameters
    ----------
    command : callable
        Takes an instance of the dataclass, then arguments and options of its own.
    """
    first, *own = signature(command, eval_str=True).parameters.values()
    fields = signature(first.annotation, eval_str=True).parameters

    @wraps(command)
    def run(**given: Any) -> int:
        return command(first.annotation(**{name: given.pop(name) for name in fields}), **given)

    required_first = sorted((*fields.values(), *own), key=lambda p: p.default is not p.empty)
    run.__signature__ = Signature([p.replace(kind=Parameter.KEYWORD_ONLY) for p in required_first])  # type: ignore[attr-defined]
    run.__annotations__ = {}
    return run
