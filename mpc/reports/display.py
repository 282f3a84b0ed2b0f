"""How results are shown: in which units, figures as files too, tables in further formats. Pages and tables ask here."""

from __future__ import annotations

import io
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mpc.errors import MpcError
from mpc.reports.units import converted_page, converted_row, converted_text
from thermal.errors import MissingExtraError

if TYPE_CHECKING:  # `buildingmpc doctor` shows tables where half of the packages are missing
    import pandas as pd

    from calibration.results import Content

#: What may be chosen, the default first.
UNITS, FIGURES, FORMATS = ("si", "ip"), ("page", "svg", "png"), ("parquet", "csv", "xlsx")

#: Rows of a sheet of a workbook: Excel has 1,048,576.
_MOST_ROWS = 1_000_000

#: Longest name of a file of a figure, without its ending [characters].
_LONGEST = 60


@dataclass(frozen=True)
class Display:
    """How results are shown.

    Parameters
    ----------
    units : {"si", "ip"}
        Of pages, figures and tables on the terminal; files of numbers stay in the units of the case format.
    figures : {"page", "svg", "png"}
        Whether figures are also written as files of their own.
    table_format : {"parquet", "csv", "xlsx"}
        Format in which tables are written beside Parquet.
    drawn : list of (str, bytes)
        Figures that are still to be written, with their titles; filled by whoever draws.

    Raises
    ------
    MpcError
        When a choice is not known.
    MissingExtraError
        When workbooks are asked for and openpyxl is not installed.
    """

    units: str = "si"
    figures: str = "page"
    table_format: str = "parquet"
    drawn: list[tuple[str, bytes]] = field(default_factory=list, repr=False, compare=False)

    def __post_init__(self) -> None:
        for option, value, known in (
            ("--units", self.units, UNITS), ("--figures", self.figures, FIGURES),
            ("--format", self.table_format, FORMATS),
        ):  # fmt: skip
            MpcError.unless_known(value, known, option, f"one of {', '.join(known)}")
        if self.table_format == "xlsx":
            try:
                import openpyxl  # noqa: F401
            except ImportError as error:
                raise MissingExtraError(
                    "--format xlsx", "the package 'openpyxl'", str(error), 'pip install "buildingmpc[reports]"'
                ) from error

    @property
    def converts(self) -> bool:
        """Whether units are others than those that pages are written in."""
        return self.units == "ip"

    def text(self, text: str) -> str:
        """Write a sentence in the units that are shown.

        Parameters
        ----------
        text : str
            In SI units.
        """
        return converted_text(text) if self.converts else text

    def row(self, titles: Sequence[str], cells: Sequence[str]) -> list[str]:
        """Cells of a row in the units that are shown: by the heads of their columns, by a cell ``unit``, in sentences.

        Parameters
        ----------
        titles : sequence of str
            Heads of the columns, with their SI units in brackets where all rows have the same.
        cells : sequence of str
            In SI units.
        """
        if not self.converts:
            return list(cells)
        return converted_row(titles, cells)

    def page(self, page: str) -> str:
        """Write a page in the units that are shown.

        Parameters
        ----------
        page : str
            HTML, in SI units.
        """
        return converted_page(page) if self.converts else page

    def complete(self, files: Mapping[str, Content]) -> dict[str, Content]:
        """Add the figures that were drawn since the last time, and tables in the further format.

        Parameters
        ----------
        files : mapping of str to bytes, str, dict or DataFrame
            By name.
        """
        import pandas as pd

        added: dict[str, Content] = dict(files)
        for name, content in files.items():
            if isinstance(content, pd.DataFrame) and self.table_format != "parquet":
                added[f"{Path(name).stem}.{self.table_format}"] = _table(content, self.table_format)
        for number, (title, drawing) in enumerate(self.drawn, 1):
            added[f"figure_{number:02d}_{_plain(title)}.{self.figures}"] = drawing
        self.drawn.clear()
        return added


_current: ContextVar[Display] = ContextVar("display")


def display() -> Display:
    """How results are shown now; in SI units, with nothing beside, unless a command or `showing` says otherwise."""
    try:
        return _current.get()
    except LookupError:
        return Display()


@contextmanager
def showing(chosen: Display) -> Iterator[Display]:
    """Show results in a way until the context ends.

    Parameters
    ----------
    chosen : Display
        How.

    Examples
    --------
    >>> with showing(Display(units="ip")):
    ...     display().text("0.5 K")
    '0.90 °F'
    """
    before = _current.set(chosen)
    try:
        yield chosen
    finally:
        _current.reset(before)


def write_results(out: str | Path, files: Mapping[str, Content], force: bool = False) -> Path:
    """Write the files of one result as `calibration.results.write_results` does, with what the display adds.

    Parameters
    ----------
    out : str or Path
        Folder of the results.
    files : mapping of str to bytes, str, dict or DataFrame
        By name.
    force : bool
        Replace earlier results.
    """
    from calibration.results import write_results as write_whole

    return write_whole(out, display().complete(files), force)


class Displayed:
    """Makes files of results as they are displayed here, in another process too.

    Parameters
    ----------
    function : callable
        Importable by name, gives files by name.
    chosen : Display
        How they are shown.
    """

    def __init__(self, function: Callable[..., Mapping[str, Content]], chosen: Display) -> None:
        self._function, self._chosen = function, chosen

    def __call__(self, *arguments: Any) -> dict[str, Content]:
        """Make the files."""
        with showing(self._chosen) as here:
            return here.complete(self._function(*arguments))


def _table(table: pd.DataFrame, table_format: str) -> bytes | str:
    """Spell a table as CSV or as a workbook, units in the heads of its columns."""
    import pandas as pd

    units = table.attrs.get("units", {})
    flat = table.rename(columns={c: f"{c} [{units[c]}]" for c in table if c in units}).reset_index()
    if table_format == "csv":
        return str(flat.to_csv(index=False, lineterminator="\n", float_format="%.7g"))
    for name in flat.select_dtypes("datetimetz"):  # a workbook knows no time zones
        flat.insert(int(flat.columns.get_loc(name)) + 1, f"{name} UTC", flat[name].dt.tz_convert(None))  # type: ignore[arg-type]
        flat[name] = flat[name].dt.tz_localize(None)
    stream = io.BytesIO()
    with pd.ExcelWriter(stream, engine="openpyxl") as book:
        for number, first in enumerate(range(0, max(1, len(flat)), _MOST_ROWS), 1):
            part = flat.iloc[first : first + _MOST_ROWS]
            part.to_excel(book, sheet_name=f"rows {number}" if len(flat) > _MOST_ROWS else "results", index=False)
    return stream.getvalue()


def _plain(title: str) -> str:
    """Name of a file for a figure."""
    return re.sub(r"[^a-z0-9]+", "_", title.lower()).strip("_")[:_LONGEST].rstrip("_")
