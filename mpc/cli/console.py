"""What a command writes: tables and sentences or JSON on stdout, a progress bar on stderr."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from threading import Timer
from types import TracebackType
from typing import TYPE_CHECKING, Any

import typer

if TYPE_CHECKING:
    from rich.console import Console
    from rich.progress import Progress as Bar

#: Called with stage, done, total.
Progress = Callable[[str, int, int], None]

#: Width of tables where the output is no terminal [characters].
PLAIN_WIDTH = 240

#: Tables drop a column of words below this width [characters].
WIDE = 130

#: A bar appears after this time [s].
PATIENCE = 2.0

#: Time over which the speed is taken that the time left is estimated from [s]: all of it, for parts differ.
_PERIOD = 3600.0

#: A table on the terminal ends after this many rows.
MOST_ROWS = 40


def _console() -> Console:
    """Console on stdout that takes text as it stands: names may hold brackets."""
    from rich.console import Console

    width = None if sys.stdout.isatty() else PLAIN_WIDTH
    return Console(file=sys.stdout, width=width, markup=False, highlight=False, emoji=False)


def silent(stage: str, done: int, total: int) -> None:
    """Tell nobody of progress.

    Parameters
    ----------
    stage : str
        What is being done.
    done, total : int
        How much of it.
    """


def is_narrow() -> bool:
    """Whether the terminal has less room than a wide table needs."""
    return _console().width < WIDE


def say(text: str) -> None:
    """Write a sentence or two to stdout.

    Parameters
    ----------
    text : str
        Wrapped at the width of the terminal.
    """
    from mpc.reports.display import display

    _console().print(display().text(text), soft_wrap=not sys.stdout.isatty())


def complain(text: str) -> None:
    """Write a line to stderr.

    Parameters
    ----------
    text : str
        As it stands.
    """
    typer.echo(text, err=True)


def show_table(
    title: str, columns: Mapping[str, str], rows: Iterable[Sequence[Any]], more: str = "--json lists them all"
) -> None:
    """Write a table to stdout.

    Parameters
    ----------
    title : str
        Above the table.
    columns : mapping of str to str
        How the numbers below each header are spelled, such as ``.3f`` or ``percent``; columns of text have none.
    rows : iterable of sequence
        Cells; None is a dash, and text stands as it is in columns of numbers too.
    more : str
        Where to find the rows that are left out of a long table.
    """
    from rich.box import SIMPLE_HEAD
    from rich.table import Table
    from rich.text import Text

    from mpc.reports.display import display

    listed, shown = list(rows), display()
    table = Table(box=SIMPLE_HEAD, pad_edge=False)
    for name, spelled in columns.items():
        table.add_column(shown.text(name), justify="right" if spelled else "left", overflow="fold")
    for row in listed[:MOST_ROWS]:
        cells = [_cell(value, spelled) for value, spelled in zip(row, columns.values(), strict=True)]
        table.add_row(*shown.row(list(columns), cells))
    out = _console()
    out.print(Text(f"\n{shown.text(title)}", style="bold"))
    out.print(table)
    if len(listed) > MOST_ROWS:
        out.print(f"and {len(listed) - MOST_ROWS} more; {more}")


def _cell(value: Any, spelled: str) -> str:
    from mpc.reports.page import spell

    return value if isinstance(value, str) else spell(value, spelled)


def answer(json: bool, content: Mapping[str, Any], show: Callable[[], None], report: Path | None = None) -> int:
    """Write what a command found, as JSON or in sentences and tables, and where its page is.

    Parameters
    ----------
    json : bool
        Whether JSON is asked for.
    content : mapping
        Plain types.
    show : callable
        Writes it in words.
    report : Path, optional
        The page.

    Returns
    -------
    int
        Exit code: 0.
    """
    from calibration.results import to_json

    if json:
        typer.echo(to_json(content))
        return 0
    show()
    if report is not None:
        say(f"Report: {report}")
    return 0


class Waiting:
    """A progress bar on stderr that appears when a command takes long and someone is watching.

    Parameters
    ----------
    label : str
        What is being done.
    """

    def __init__(self, label: str) -> None:
        self.label = label
        self.share = 0.0  # of the whole: it never falls
        self._bar: Bar | None = None
        self._timer: Timer | None = None

    def __enter__(self) -> Waiting:
        if sys.stderr.isatty():
            from rich.console import Console
            from rich.progress import (
                BarColumn,
                Progress,
                SpinnerColumn,
                TextColumn,
                TimeElapsedColumn,
                TimeRemainingColumn,
            )

            words = TextColumn("{task.description}", markup=False)
            columns = (SpinnerColumn(), words, BarColumn(), TimeElapsedColumn(), TextColumn("left about"))
            self._bar = Progress(
                *columns, TimeRemainingColumn(), console=Console(stderr=True), transient=True,
                speed_estimate_period=_PERIOD,
            )  # fmt: skip
            self._bar.add_task(self.label, total=None)
            self._timer = Timer(PATIENCE, self._bar.start)
            self._timer.daemon = True
            self._timer.start()
        return self

    def __call__(self, stage: str, done: int, total: int) -> None:
        """Say what goes on, and how much of it is done."""
        if self._bar is not None:
            name = f"{self.label}: {stage}" if stage not in self.label else self.label
            known = 1.0 if total > 0 else None  # shares of the whole, as commands may count one thing after another
            self.share = max(self.share, done / total if total > 0 else 0.0)
            self._bar.update(self._bar.task_ids[0], description=name, completed=self.share, total=known)

    def say(self, text: str) -> None:
        """Write a sentence or two to stdout, above the bar.

        Parameters
        ----------
        text : str
            As for `say`.
        """
        shown = self._bar if self._bar is not None and self._bar.live.is_started else None
        if shown is not None:
            shown.stop()
        say(text)
        if shown is not None:
            shown.start()

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._bar is not None and self._timer is not None:
            self._timer.cancel()
            self._timer.join()  # it may be about to start the bar
            self._bar.stop()
