"""What somebody has done on a case: kept where a case is made of another, named before it would be lost."""

from __future__ import annotations

import json
import shutil
import tempfile
from os import PathLike
from pathlib import Path

from thermal.case.building import FloorPlans
from thermal.case.building_file import NAME
from thermal.case.case import Case
from thermal.case.load import load_case
from thermal.case.save import save_case
from thermal.errors import CaseError, PlanError, describe

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
        raise PlanError(describe(str(path), "nothing that would be lost", "; ".join(held), advice))
