"""What a page begins with when the command names a drawing, or a list of drawings."""

from __future__ import annotations

from pathlib import Path

from thermal.errors import PlanError, describe
from thermal.plan.guard import inside_folder
from thermal.plan.list import read_drawing_list
from thermal.plan.page.app import LabelDesk
from thermal.plan.page.draft import Site
from thermal.plan.page.floors import Progress, add_floors
from thermal.plan.page.store import write_whole
from thermal.plan.page.uploads import DRAWING_KINDS, checked_name, look_at


def import_sheet(desk: LabelDesk, path: Path) -> None:
    """Put a drawing among those of the page; the page asks for its scale.

    Parameters
    ----------
    desk : LabelDesk
        Of a new case.
    path : Path
        PNG, JPEG, PDF, DXF; CSV, ``.npy`` or ``.npz`` of codes.

    Raises
    ------
    PlanError
        One of its family: it is not what its name says.
    """
    checked_name(path.name, DRAWING_KINDS)
    look_at(path)
    _copy(path, desk.store.own / "drawings" / path.name)


def import_list(desk: LabelDesk, path: Path, progress: Progress) -> None:
    """Put all floors of a list of drawings on the page.

    Parameters
    ----------
    desk : LabelDesk
        Of a new case.
    path : Path
        YAML file of a `thermal.plan.DrawingList`; drawings lie in its folder.
    progress : callable
        Told stage, steps done and all steps.

    Raises
    ------
    PlanError
        One of its family, for the first thing that does not fit.
    """
    listed = read_drawing_list(path)
    own, entries = desk.store.own, []
    for entry in listed.floors:
        source = inside_folder(path.absolute().parent, entry.file, f"floors: {entry.name}: file")
        look_at(source)
        # Two folders of the list may hold files of the same name; a PDF may have several floors.
        name = entry.file.replace("\\", "/").replace("/", "_")
        _copy(source, own / "drawings" / checked_name(name, DRAWING_KINDS))
        entries.append(entry.model_copy(update={"file": name}))
    found = add_floors(desk.store.draft, entries, own, listed.cell_size, progress)
    turned = listed.orientation + (found.orientation or 0.0)
    changes = {
        "name": listed.name,
        "site": Site(**listed.location.model_dump()),
        "orientation": round((turned + 180.0) % 360.0 - 180.0, 2),
        "cell_size": found.cell_size,
        "floors": found.floors,
    }
    desk.store.save(desk.store.draft.model_copy(update=changes))


def _copy(source: Path, target: Path) -> None:
    try:
        write_whole(target, source.read_bytes())
    except OSError as error:
        raise PlanError(describe(source.name, "a file that can be copied", str(error))) from error
