"""Case folder of an import: writing it, and what a folder holds that must not be lost."""

from __future__ import annotations

import json
import shutil
import tempfile
from collections.abc import Sequence
from dataclasses import replace
from os import PathLike
from pathlib import Path

import numpy as np
import pandas as pd

from thermal.case.building import Building, Device, FloorPlans, Location
from thermal.case.case import Case
from thermal.case.load import NAME, load_case
from thermal.case.points import OUTDOOR_TEMPERATURE
from thermal.case.save import save_case
from thermal.case.telemetry import INDEX, Telemetry
from thermal.errors import CaseError, PlanError
from thermal.plan.assemble import PlanImport


def building_of(
    found: PlanImport, name: str, location: Location, *, orientation: float = 0.0, devices: Sequence[Device] = ()
) -> Building:
    """Describe a building by its imported plans.

    Parameters
    ----------
    found : PlanImport
        Plans of the building.
    name : str
        Of the case.
    location : Location
        Where it stands.
    orientation : float
        Clockwise from true north to "up" on the drawing of the lowest floor [deg]; the angle by which that drawing was
        turned upright is added.
    devices : sequence of Device
        What serves it.

    Returns
    -------
    Building
        For a case.
    """
    turned = orientation + found.floors[0].survey.turned
    upright = (turned + 180.0) % 360.0 - 180.0
    return Building(name, location, round(upright, 2), found.plans, tuple(devices))


def save_plan_case(building: Building, path: str | PathLike[str], *, overwrite: bool = False) -> Path:
    """Save a building as a case folder that has no telemetry yet.

    Parameters
    ----------
    building : Building
        With plans and devices.
    path : str or path
        Folder to make.
    overwrite : bool
        Whether a case that is there already is replaced. Default: refuse.

    Returns
    -------
    Path
        The folder. It holds a telemetry file of two stamps without a value, which is there to be replaced.

    Raises
    ------
    CaseError
        One of its family: the building does not fit together, or the folder holds something.
    """
    stamps = pd.date_range("2000-01-01", periods=2, freq="5min", tz=building.location.timezone, name=INDEX)
    column = f"{building.weather_station}/{OUTDOOR_TEMPERATURE}"
    telemetry = Telemetry.from_frame(pd.DataFrame({column: [np.nan, np.nan]}, index=stamps))
    return save_case(Case(building=building, telemetry=telemetry, path=Path(path)), path, overwrite=overwrite)


def with_devices(path: str | PathLike[str], devices: Sequence[Device]) -> Case:
    """Load a case and give it other devices.

    Parameters
    ----------
    path : str or path
        Case folder.
    devices : sequence of Device
        All devices it is to have.

    Returns
    -------
    Case
        Not saved yet.

    Raises
    ------
    CaseError
        One of its family: the case does not load.
    """
    case = load_case(path)
    return replace(case, building=replace(case.building, devices=tuple(devices)))


#: Folder inside a case that holds what is the labelling page's own: draft, drawings, pictures, reports.
OWN_FOLDER = "labelling"

#: The page's own file in that folder.
DRAFT = "labelling.json"


def save_with_labels(case: Case, source: str | PathLike[str], path: str | PathLike[str], *, overwrite: bool) -> Path:
    """Save a case that was made of another, with what the labelling page keeps in that one.

    Parameters
    ----------
    case : Case
        To save.
    source : str or path
        Case folder that it was made of.
    path : str or path
        Folder to make; may be `source`.
    overwrite : bool
        Whether a case that is there already is replaced.

    Returns
    -------
    Path
        The folder.

    Raises
    ------
    CaseError
        One of its family: the folder holds something, or the case does not fit together.
    """
    own = Path(source) / OWN_FOLDER
    with tempfile.TemporaryDirectory() as work:
        kept = Path(work) / OWN_FOLDER
        if own.is_dir() and not own.is_symlink():
            shutil.copytree(own, kept, symlinks=True)
        folder = save_case(case, path, overwrite=overwrite)
        if kept.is_dir():
            shutil.copytree(kept, folder / OWN_FOLDER, symlinks=True)
    return folder


def held_work(path: str | PathLike[str]) -> tuple[str, ...]:
    """Say what a folder holds that a case made of drawings would not.

    Parameters
    ----------
    path : str or path
        Case folder, or one that is to become one.

    Returns
    -------
    tuple of str
        In words: work on the labelling page, devices, glazing, airflows, telemetry. Empty where nothing is there.
    """
    folder, found = Path(path), []
    draft = folder / OWN_FOLDER / DRAFT
    try:
        content = json.loads(draft.read_text(encoding="utf-8"))
        placed = sum(device.get("x") is not None for device in content["devices"])
        minutes = float(content["seconds"]) / 60.0
        found.append(
            f"{minutes:.0f} minutes of work on the labelling page (corrected walls and zones of "
            f"{len(content['floors'])} floors, {placed} devices put in their places)"
        )
    except FileNotFoundError:
        pass
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        found.append(f"a draft of the labelling page that cannot be read ({OWN_FOLDER}/{DRAFT})")
    if not (folder / NAME).is_file():
        return tuple(found)
    try:
        case = load_case(folder)
    except CaseError as error:
        return (*found, f"a case that does not load ({error})")
    building = case.building
    glazing = building.geometry.glazing if isinstance(building.geometry, FloorPlans) else {}
    counts = {"devices": len(building.devices), "zones with glazing": len(glazing), "airflows": len(building.airflows)}
    found += [f"{number} {what}" for what, number in counts.items() if number]
    values = int(case.telemetry.frame.notna().to_numpy().sum())
    return (*found, f"telemetry of {case.telemetry.frame.shape[1]} columns") if values else tuple(found)


def check_nothing_lost(path: str | PathLike[str]) -> None:
    """Refuse a folder whose case holds what a case made of drawings anew would not.

    Parameters
    ----------
    path : str or path
        Case folder, or one that is to become one.

    Raises
    ------
    PlanError
        It does; the message names all of it.
    """
    held = held_work(path)
    if held:
        advice = "choose another folder, or correct the case with buildingmpc label; --force replaces all of it"
        raise PlanError(str(path), "nothing that would be lost", "; ".join(held), advice)
