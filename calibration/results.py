"""Results as plain values, tables and figures, and folders of them, written whole or not at all."""

from __future__ import annotations

import json
import math
import os
import tempfile
from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import fields, is_dataclass
from datetime import date
from html import escape
from pathlib import Path, PurePath
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
import pandas as pd

from calibration.errors import CalibrationError, ResultsExistError
from thermal.case.load import NAME as CASE_FILE
from thermal.errors import some_of
from thermal.folders import check_writable

if TYPE_CHECKING:
    from matplotlib.axes import Axes as Axes
else:  # loaded by whoever draws
    Axes = Any

#: What a file of results is made of: bytes or text as they are, a mapping as JSON, a table as Parquet.
Content = bytes | str | dict[str, Any] | pd.DataFrame


class Plain:
    """A dataclass whose fields go into a file by their names."""

    #: Field by which one of several stands in a mapping; None where they are a list.
    key: ClassVar[str | None] = None

    def to_dict(self) -> dict[str, Any]:
        """Values by name, ready for JSON."""
        return {k: v for k, v in _fields(self).items() if k != self.key}


class Result(Plain, ABC):
    """A dataclass that shows itself: in a line, as a table, and as a figure."""

    @abstractmethod
    def to_frame(self) -> pd.DataFrame:
        """Tabulate the main numbers."""

    @abstractmethod
    def _summary(self) -> str:
        """Say the main numbers in a line."""

    @abstractmethod
    def _draw(self, axes: Axes) -> None:
        """Draw the main numbers."""

    def __repr__(self) -> str:
        return f"<{type(self).__name__}: {self._summary()}>"

    def _repr_html_(self) -> str:
        table = self.to_frame().to_html(float_format="{:.4g}".format, max_rows=30, na_rep="")
        return f"<p>{type(self).__name__}: {escape(self._summary())}</p>{table}"

    def plot(self, axes: Axes | None = None) -> Axes:
        """Draw the main numbers.

        Parameters
        ----------
        axes : Axes, optional
            Where to draw; axes of a new figure by default.
        """
        if axes is None:
            from matplotlib import pyplot

            axes = pyplot.figure(layout="constrained").subplots()
        self._draw(axes)
        return axes


def draw_rows(axes: Axes, table: pd.DataFrame, label: str) -> None:
    """Draw a value a row with its interval.

    Parameters
    ----------
    axes : Axes
        Where to draw.
    table : DataFrame
        Names of the rows as index; columns value, lower and upper end, NaN where there is no interval.
    label : str
        Of the values, with their unit.
    """
    value, lower, upper = table.to_numpy(dtype=float).T
    rows = np.arange(len(table))[::-1]
    axes.errorbar(value, rows, xerr=np.nan_to_num([value - lower, upper - value]).clip(0.0), fmt="o", capsize=2.0)
    axes.set_yticks(rows, labels=[str(name) for name in table.index])
    axes.set_xlabel(label)


def check_results_folder(out: str | Path, force: bool = False) -> Path:
    """Refuse a folder that results may not be written to; nothing is made.

    Parameters
    ----------
    out : str or Path
        Folder of the results.
    force : bool
        Allow a folder that holds something.

    Returns
    -------
    Path
        The folder.

    Raises
    ------
    ResultsExistError
        When it holds something and ``force`` is not set, is a case folder, or a file.
    CalibrationError
        When it cannot be written to.
    """
    folder = Path(out)
    if (folder.exists() or folder.is_symlink()) and not folder.is_dir():
        raise ResultsExistError(f"{folder}: expected a folder for results, found a file; choose another name")
    check_writable(folder, CalibrationError)
    if (folder / CASE_FILE).is_file():
        advice = "choose a folder of its own, such as one inside of it"
        raise ResultsExistError(str(folder), "a folder for results", "a case folder", advice)
    if folder.is_dir() and not force:
        held = sorted(path.name for path in folder.iterdir())
        if held:
            raise ResultsExistError(
                f"{folder}: expected an empty or new folder, found {some_of(held, most=4)}; choose another, or "
                "--force (force=True)"
            )
    return folder


def write_results(out: str | Path, files: Mapping[str, Content], force: bool = False, work: Path | None = None) -> Path:
    """Write the files of one result, whole or not at all.

    Everything is written elsewhere first and moved there at the end, so a failure leaves what was there before.

    Parameters
    ----------
    out : str or Path
        Folder of the results, made with its parents.
    files : mapping of str to bytes, str, dict or DataFrame
        Contents by file name. A dict becomes JSON (NaN as null), a table Parquet; its time index must have a time zone.
    force : bool
        Replace files of the same name; what else the folder holds stays.
    work : Path, optional
        Folder on the same disk that is written to first; by default `out` itself, or that which it is to lie in.

    Returns
    -------
    Path
        The folder.

    Raises
    ------
    ResultsExistError
        See `check_results_folder`.
    """
    folder = check_results_folder(out, force)
    for name in files:
        if PurePath(name).name != name or name in {"", ".", ".."}:
            raise ResultsExistError(f"{folder}: expected plain file names for results, got {name!r}")
    folder = folder.resolve()
    folder.parent.mkdir(parents=True, exist_ok=True)
    beside = folder if folder.is_dir() else folder.parent  # a folder that is there may be a disk of its own
    with tempfile.TemporaryDirectory(prefix=f".{folder.name}-", dir=work or beside) as made:
        new, old = Path(made) / "new", Path(made) / "old"
        new.mkdir()
        old.mkdir()
        for name, content in files.items():
            (new / name).write_bytes(content_bytes(name, content))
        if folder.is_dir():
            _move_into(folder, new, old, list(files))
        else:
            os.replace(new, folder)
    return folder


def to_json(content: Mapping[str, Any]) -> str:
    r"""Spell results as JSON that every reader takes: NaN and infinities become null, times ISO 8601.

    Parameters
    ----------
    content : mapping
        Plain types, numpy numbers and arrays, times and paths.

    Examples
    --------
    >>> to_json({"mae": float("nan")})
    '{\n  "mae": null\n}'
    """
    return json.dumps(plain(content), indent=2, ensure_ascii=False, allow_nan=False)


def plain(value: Any) -> Any:
    """Make plain values of data: dataclasses and mappings become dicts, NaN and infinities None.

    Parameters
    ----------
    value : Any
        Plain types, numpy numbers and arrays, times, paths, dataclasses, and mappings and sequences of them; entries of
        a sequence that have a `Plain.key` stand in a mapping by it.
    """
    if is_dataclass(value) and not isinstance(value, type):
        to_dict = getattr(value, "to_dict", None)
        return _fields(value) if to_dict is None else to_dict()
    if isinstance(value, Mapping):
        return {str(key): plain(entry) for key, entry in value.items()}
    if isinstance(value, np.ndarray):
        return plain(value.tolist())
    if isinstance(value, np.generic):
        return plain(value.item())
    if value is pd.NaT:
        return None
    if isinstance(value, date):
        return value.isoformat()
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, PurePath):
        return str(value)
    if isinstance(value, Iterable) and not isinstance(value, str | bytes):
        entries = list(value)
        if entries and all(isinstance(entry, Plain) and entry.key for entry in entries):
            return {getattr(entry, entry.key): plain(entry) for entry in entries}
        return [plain(entry) for entry in entries]
    return value


def _fields(value: Any) -> dict[str, Any]:
    return {f.name: plain(getattr(value, f.name)) for f in fields(value)}


def content_bytes(name: str, content: Content) -> bytes:
    """Spell the contents of a file of results.

    Parameters
    ----------
    name : str
        Of the file, for errors.
    content : bytes, str, dict or DataFrame
        A dict becomes JSON (NaN as null), a table Parquet; its time index must have a time zone.
    """
    if isinstance(content, pd.DataFrame):
        if isinstance(content.index, pd.DatetimeIndex) and content.index.tz is None:
            raise TypeError(f"{name}: expected stamps with a time zone, got an index without one")
        return bytes(content.to_parquet())
    if isinstance(content, bytes):
        return content
    return (content if isinstance(content, str) else to_json(content) + "\n").encode()


def _move_into(folder: Path, new: Path, old: Path, names: list[str]) -> None:
    """Move files into a folder; on a failure move back what was there."""
    moved: list[str] = []
    try:
        for name in names:
            moved.append(name)
            if (folder / name).exists():
                os.replace(folder / name, old / name)
            os.replace(new / name, folder / name)
    except BaseException:
        for name in moved:
            with suppress(OSError):
                if (old / name).exists():
                    os.replace(old / name, folder / name)
                elif not (new / name).exists():
                    (folder / name).unlink()
        raise
