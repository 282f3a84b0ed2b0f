"""Saving a case folder: whole or not at all."""

import csv
import os
import re
import tempfile
from collections.abc import Mapping
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import yaml
from pydantic import BaseModel

from thermal.case.building import Building, FloorPlans
from thermal.case.case import Case
from thermal.case.load import FORMAT, NAME, load_case
from thermal.case.points import POINT_TYPES, split_column
from thermal.case.telemetry import Telemetry
from thermal.errors import CaseError
from thermal.folders import check_writable
from thermal.units import QUANTITIES, from_si

TELEMETRY_FILE = "telemetry.parquet"
# Keys of the file that are fields of the building: before its geometry, and after it.
_WHOLE, _PARTS = ("name", "location", "orientation", "geometry_quality"), ("devices", "airflows", "weather_station")


def save_case(case: Case, path: str | PathLike[str], *, overwrite: bool = False) -> Path:
    """Save a case as a folder.

    Parameters
    ----------
    case
        Case to save; all of its telemetry as measured, flaws included, in the units of the case format's table.
    path
        Folder to make; parents are made too.
    overwrite
        Whether a case that is there already is replaced, with every file in its folder. Default: refuse.

    Returns
    -------
    Path
        The folder.

    Raises
    ------
    CaseError
        The folder holds something and `overwrite` is not set, or what it holds is not a case.
    CaseError
        One of its family: the case does not fit together. Nothing is written then.

    Notes
    -----
    Everything is written beside the target, read back, and moved there in one step, so that no one ever sees a
    half-written case, and every saved case loads.

    Examples
    --------
    >>> save_case(case, "cases/pilot")  # doctest: +SKIP
    PosixPath('cases/pilot')
    """
    target = Path(path)
    check_target(target, overwrite)
    telemetry = Telemetry.from_frame(case.telemetry.frame)
    reported = telemetry.frame.drop(index=pd.Index(case.telemetry.missing_rows))
    target.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix=f".{target.name}-", dir=target.parent) as work:
        new = Path(work) / "new"
        new.mkdir()
        _write(case.building, reported, new)
        load_case(new)  # what cannot be read back is not saved
        _move_in(new, target, Path(work) / "old")
    return target


def _move_in(new: Path, target: Path, old: Path) -> None:
    """Put `new` where `target` is; put what was there back when that fails."""
    if target.exists():
        os.replace(target, old)
    try:
        os.replace(new, target)
    except OSError:
        if old.exists():
            os.replace(old, target)
        raise


def check_target(target: Path, overwrite: bool) -> None:
    """Refuse a place where no case can be saved.

    Parameters
    ----------
    target
        Folder to make.
    overwrite
        Whether a case that is there already may be replaced.

    Raises
    ------
    CaseError
        There is a file, or a folder that holds something and may not, or no case, to be replaced; or it cannot be
        written to.
    """
    check_writable(target if target.is_dir() else target.parent, CaseError)
    if not target.exists():
        return
    CaseError.unless(target.is_dir(), str(target), "a folder to make", "a file", "choose another path")
    if any(target.iterdir()):
        advice = "choose another folder, or --force (overwrite=True)"
        CaseError.unless(overwrite, str(target), "no folder or an empty one", "a folder that holds files", advice)
        if not (target / NAME).is_file():
            raise CaseError(str(target), "a case to overwrite", f"a folder without {NAME}", "choose another folder")


def _write(building: Building, frame: pd.DataFrame, folder: Path) -> None:
    content = _plain(_content(building, frame))
    if isinstance(building.geometry, FloorPlans):
        for floor, entry in zip(building.geometry.floors, content["floors"], strict=True):
            with (folder / entry["plan"]).open("w", encoding="utf-8", newline="") as stream:
                csv.writer(stream, lineterminator="\n").writerows(floor.tokens.tolist())
    with (folder / NAME).open("w", encoding="utf-8") as stream:
        yaml.safe_dump(content, stream, sort_keys=False, allow_unicode=True, width=120)
    columns = {}
    for column in frame.columns:
        quantity = POINT_TYPES[split_column(str(column), TELEMETRY_FILE)[1]].quantity
        columns[str(column)] = from_si(frame[column].to_numpy(), QUANTITIES[quantity].file_unit, quantity)
    pd.DataFrame(columns, index=frame.index).to_parquet(folder / TELEMETRY_FILE, compression="zstd")


def _content(building: Building, frame: pd.DataFrame) -> dict[str, Any]:
    points = dict.fromkeys(split_column(str(column), TELEMETRY_FILE)[1] for column in frame.columns)
    units = {point: QUANTITIES[POINT_TYPES[point].quantity].file_unit for point in points}
    whole, parts = ({key: getattr(building, key) for key in keys} for keys in (_WHOLE, _PARTS))
    geometry = building.geometry
    if isinstance(geometry, FloorPlans):
        files = zip(geometry.floors, _plan_files(geometry), strict=True)
        floors = [{"name": floor.name, "height": floor.height, "plan": file} for floor, file in files]
        shape = {"cell_size": geometry.cell_size, "floors": floors, "glazing": geometry.glazing}
    else:
        shape = {key: getattr(geometry, key) for key in ("zones", "surfaces", "constructions")}
    return {"format": FORMAT, **whole, **shape, **parts, "telemetry": TELEMETRY_FILE, "units": units}


def _plain(content: Any) -> Any:
    """Turn numpy's numbers and texts, which YAML does not know, into Python's."""
    if isinstance(content, BaseModel):
        content = content.model_dump(by_alias=True, exclude_defaults=True)
    if isinstance(content, Mapping):
        return {_plain(key): _plain(value) for key, value in content.items()}
    if isinstance(content, list | tuple):
        return [_plain(value) for value in content]
    return str(content) if isinstance(content, str) else content.item() if isinstance(content, np.generic) else content


def _plan_files(plans: FloorPlans) -> list[str]:
    """Name a file for each floor: its own name as far as files allow it, numbered when two become the same."""
    names: list[str] = []
    for number, floor in enumerate(plans.floors, start=1):
        stem = re.sub(r"[^A-Za-z0-9_-]+", "_", floor.name) or str(number)
        taken = {name.casefold() for name in names}
        file = f"plan_{stem}.csv"
        names.append(f"plan_{stem}_{number}.csv" if file.casefold() in taken else file)
    return names
