"""Folders of results: refused when they hold something, and written whole or not at all."""

from __future__ import annotations

import json
import math
import os
import tempfile
from collections.abc import Iterable, Mapping
from contextlib import suppress
from datetime import date
from pathlib import Path, PurePath
from typing import Any

import numpy as np
import pandas as pd

from calibration.errors import CalibrationError, ResultsExistError


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
        When it holds something and ``force`` is not set, or is a file.
    CalibrationError
        When it cannot be written to.
    """
    folder = Path(out)
    if (folder.exists() or folder.is_symlink()) and not folder.is_dir():
        raise ResultsExistError(f"{folder}: expected a folder for results, found a file; choose another name")
    nearest = next((p for p in (folder, *folder.absolute().parents) if p.exists()), Path("/"))
    if not nearest.is_dir() or not os.access(nearest, os.W_OK | os.X_OK):
        raise CalibrationError(
            f"{folder}: expected a place that can be written to, and {nearest} cannot; choose another"
        )
    if folder.is_dir() and not force:
        held = sorted(path.name for path in folder.iterdir())
        if held:
            shown = ", ".join(held[:4]) + (f" and {len(held) - 4} more" if len(held) > 4 else "")
            raise ResultsExistError(
                f"{folder}: expected an empty or new folder, found {shown}; choose another, or --force (force=True)"
            )
    return folder


def write_results(
    out: str | Path, files: Mapping[str, bytes | str | dict[str, Any] | pd.DataFrame], force: bool = False
) -> Path:
    """Write the files of one result, whole or not at all.

    Everything is written beside the folder first and moved there at the end, so a failure leaves what was there before.

    Parameters
    ----------
    out : str or Path
        Folder of the results, made with its parents.
    files : mapping of str to bytes, str, dict or DataFrame
        Contents by file name. A dict becomes JSON (NaN as null), a table Parquet; its time index must have a time zone.
    force : bool
        Replace files of the same name; what else the folder holds stays.

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
            raise ResultsExistError(f"{folder}: expected plain file names for results, came {name!r}")
    folder = folder.resolve()
    folder.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix=f".{folder.name}-", dir=folder.parent) as work:
        new, old = Path(work) / "new", Path(work) / "old"
        new.mkdir()
        old.mkdir()
        for name, content in files.items():
            _write(new / name, content)
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
    return json.dumps(_plain(content), indent=2, ensure_ascii=False, allow_nan=False)


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {str(key): _plain(entry) for key, entry in value.items()}
    if isinstance(value, np.ndarray):
        return _plain(value.tolist())
    if isinstance(value, np.generic):
        return _plain(value.item())
    if value is pd.NaT:
        return None
    if isinstance(value, date):
        return value.isoformat()
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, PurePath):
        return str(value)
    if isinstance(value, Iterable) and not isinstance(value, str | bytes):
        return [_plain(entry) for entry in value]
    return value


def _write(path: Path, content: bytes | str | dict[str, Any] | pd.DataFrame) -> None:
    if isinstance(content, pd.DataFrame):
        if isinstance(content.index, pd.DatetimeIndex) and content.index.tz is None:
            raise TypeError(f"{path.name}: expected stamps with a time zone, came an index without one")
        content.to_parquet(path)
    elif isinstance(content, bytes):
        path.write_bytes(content)
    else:
        path.write_text(content if isinstance(content, str) else to_json(content) + "\n", encoding="utf-8")


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
