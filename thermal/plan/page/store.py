"""Case folder behind the labelling page."""

import itertools
import json
import os
import tempfile
from os import PathLike
from pathlib import Path
from typing import Any

import yaml

from thermal.case.building import BuildingFile
from thermal.case.case import Case
from thermal.case.load import NAME, load_case, migrate, read_building_file
from thermal.case.save import TELEMETRY_FILE, save_case
from thermal.case.telemetry import Telemetry, check_units, read_telemetry
from thermal.errors import CaseError, LabelError, ThermalError
from thermal.folders import check_writable
from thermal.plan.folder import DRAFT, OWN_FOLDER, save_plan_case
from thermal.plan.guard import inside_folder
from thermal.plan.match import read_columns
from thermal.plan.page.draft import Draft, building_of_draft, draft_of, parse_draft
from thermal.plan.page.findings import DraftFinding, find_faults

_MOST_DRAFT = 50_000_000  # bytes
_NOTE = "# labelled with buildingmpc label, {minutes:.0f} minutes of work\n"


def write_whole(path: Path, content: bytes) -> None:
    """Write a file whole or not at all.

    Parameters
    ----------
    path : Path
        File; its folder is there.
    content : bytes
        What to write.
    """
    handle, name = tempfile.mkstemp(prefix=f".{path.name}-", dir=path.parent)
    try:
        with os.fdopen(handle, "wb") as stream:
            stream.write(content)
            stream.flush()
            os.fsync(stream.fileno())
        os.chmod(name, 0o644)
        os.replace(name, path)
    except BaseException:
        Path(name).unlink(missing_ok=True)
        raise


class CaseStore:
    """A case folder that is being labelled.

    Parameters
    ----------
    path : str or path
        Case folder; made where there is none.

    Raises
    ------
    LabelError
        It holds something that is no case, a case with a zone table, or a damaged draft; or it cannot be written to.
    CaseError
        One of its family: the case that is there cannot be read.
    """

    def __init__(self, path: str | PathLike[str]) -> None:
        self.folder = Path(path).absolute()
        if self.folder.exists() and not self.folder.is_dir():
            raise LabelError(str(path), "a case folder", "a file")
        check_writable(self.folder, LabelError)
        own = self.own = self.folder / OWN_FOLDER
        is_case = (self.folder / NAME).is_file()
        if self.folder.is_dir() and any(self.folder.iterdir()) and not is_case and not own.is_dir():
            advice = "choose another folder"
            raise LabelError(str(path), "a case, or an empty folder", "a folder of other files", advice)
        self.draft = _read_draft(self.folder, is_case)
        if own.is_symlink() or (own.exists() and not own.is_dir()):
            raise LabelError(f"{path}: {OWN_FOLDER}", "a folder of the page's own", "something else")
        for name in ("drawings", "pictures", "reports", "telemetry"):
            if (own / name).is_symlink():
                raise LabelError(f"{path}: {OWN_FOLDER}/{name}", "a folder of the page's own", "a link")
            (own / name).mkdir(parents=True, exist_ok=True)
        self.columns: tuple[str, ...] = ()
        self.telemetry, self._trouble = "", ""
        self._seen: tuple[str, int, str] | None = None
        self.findings: tuple[DraftFinding, ...] = ()
        self._find_faults()

    def _look_at_telemetry(self) -> None:
        """Read the telemetry when it has changed: somebody may put it there while the page is open."""
        content = self._content()
        if "telemetry" not in content:
            return
        try:
            file = inside_folder(self.folder, str(content["telemetry"]), "telemetry")
            state = (str(file), file.stat().st_mtime_ns, repr(content.get("units")))
            if state == self._seen:
                return
            self._seen, self._trouble = state, ""
            self.telemetry, self.columns = file.name, read_columns(file)
            parsed = read_building_file(self.folder)
            check_units(parsed.units)
            read_telemetry(file, parsed.units, parsed.location)
        except (ThermalError, OSError) as error:
            self._trouble = str(error)

    def _find_faults(self) -> None:
        self._look_at_telemetry()
        found = find_faults(self.draft, self.columns, self.telemetry or "telemetry")
        trouble = (DraftFinding("error", "case", self.telemetry, self._trouble),) if self._trouble else ()
        self.findings = (*trouble, *found)

    def _content(self) -> dict[str, Any]:
        """Read what `building.yaml` holds; nothing where there is none."""
        file = self.folder / NAME
        return yaml.safe_load(file.read_text(encoding="utf-8-sig")) if file.is_file() else {}

    def save(self, draft: Draft) -> bool:
        """Save a draft, and the case when the draft is one.

        Parameters
        ----------
        draft : Draft
            What is on the page.

        Returns
        -------
        bool
            Whether the case folder now says the same as the draft.
        """
        write_whole(self.own / DRAFT, draft.model_dump_json(by_alias=True).encode("utf-8"))
        self.draft = draft
        self._find_faults()
        if any(finding.level == "error" for finding in self.findings):
            return False
        try:
            self._write_case(draft)
        except CaseError as error:
            self.findings = (DraftFinding("error", "case", draft.name, str(error)), *self.findings)
            return False
        return True

    @property
    def has_telemetry(self) -> bool:
        """Whether the case has telemetry: one that the page has made has one column without a value."""
        return len(self.columns) > 1

    def files_state(self) -> tuple[Any, ...]:
        """When the files of the case were last changed, to tell whether what was made of them still holds."""
        self._look_at_telemetry()
        names = [NAME, self.telemetry, *sorted(path.name for path in self.folder.glob("*.csv"))]
        files = [self.folder / name for name in names if name]
        return tuple((file.name, file.stat().st_mtime_ns) for file in files if file.is_file())

    def put_telemetry(self, telemetry: Telemetry, replaces: str = "") -> str:
        """Give the case other telemetry.

        Parameters
        ----------
        telemetry : Telemetry
            Of the building of the draft, which is a valid case.
        replaces : str
            File of telemetry that the page has put there, and that may go; whatever else is there stays.

        Returns
        -------
        str
            File of the telemetry.

        Raises
        ------
        CaseError
            One of its family: telemetry and building do not fit together; nothing is changed then.
        """
        before = str(self._content().get("telemetry", ""))
        ours = before and (before == replaces or not self.has_telemetry)
        self._write_case(self.draft, telemetry)
        if ours:
            inside_folder(self.folder, before, "telemetry").unlink(missing_ok=True)
        self._find_faults()
        return self.telemetry

    def _write_case(self, draft: Draft, telemetry: Telemetry | None = None) -> None:
        """Write the case beside, read it back, and move what changed into place, `building.yaml` last."""
        before = self._content()
        with tempfile.TemporaryDirectory(prefix=".case-", dir=self.own) as work:
            building, new = building_of_draft(draft), Path(work) / "case"
            if telemetry is None:
                save_plan_case(building, new)
            else:
                save_case(Case(building, telemetry), new)
            content = yaml.safe_load((new / NAME).read_text(encoding="utf-8"))
            if telemetry is not None:  # under a new name: building.yaml goes over to it in one step
                source, content["telemetry"] = new / content["telemetry"], self._free_name()
                write_whole(self.folder / content["telemetry"], source.read_bytes())
            elif "telemetry" in before:
                content |= {key: before[key] for key in ("telemetry", "units")}
            elif not (self.folder / content["telemetry"]).exists():
                write_whole(self.folder / content["telemetry"], (new / content["telemetry"]).read_bytes())
            files = {floor["name"]: floor["plan"] for floor in before.get("floors") or ()}
            for floor in content["floors"]:
                drawn = (new / floor["plan"]).read_bytes()
                if files.keys() >= {f["name"] for f in content["floors"]}:
                    floor["plan"] = files[floor["name"]]
                _replace_if_other(inside_folder(self.folder, floor["plan"], "plan"), drawn)
        text = (self.folder / NAME).read_text(encoding="utf-8-sig") if before else ""
        same = bool(before) and _filled(migrate(before, NAME)) == _filled(content)
        if same and not text.startswith(_NOTE.partition("{")[0]):
            return  # nothing new to say: the file stays with the comments of its author
        text = yaml.safe_dump(content, sort_keys=False, allow_unicode=True, width=120)
        note = _NOTE.format(minutes=draft.seconds / 60.0)
        _replace_if_other(self.folder / NAME, (note + text).encode("utf-8"))
        for plan in {*files.values()} - {floor["plan"] for floor in content["floors"]}:
            inside_folder(self.folder, plan, "plan").unlink(missing_ok=True)

    def _free_name(self) -> str:
        stem, suffix = Path(TELEMETRY_FILE).stem, Path(TELEMETRY_FILE).suffix
        names = (f"{stem}{'' if k == 1 else f'_{k}'}{suffix}" for k in itertools.count(1))
        return next(name for name in names if not (self.folder / name).exists())


def _filled(content: dict[str, Any]) -> dict[str, Any]:
    """Leave out what is empty: a key without an entry says the same as no key."""
    parsed = BuildingFile.model_validate(content).model_dump()
    return {key: value for key, value in parsed.items() if value or value == 0}


def _replace_if_other(path: Path, content: bytes) -> None:
    if not path.is_file() or path.read_bytes() != content:
        write_whole(path, content)


def _read_draft(folder: Path, is_case: bool) -> Draft:
    """Read what was on the page the last time; else the case; else an empty page.

    A case that was changed by hand since the page last wrote it counts more than the page's own file.
    """
    file = folder / OWN_FOLDER / DRAFT
    draft: Draft | None = None
    if file.is_file():
        if file.stat().st_size > _MOST_DRAFT:
            raise LabelError(str(file), f"at most {_MOST_DRAFT} bytes", f"{file.stat().st_size}")
        try:
            draft = parse_draft(json.loads(file.read_text(encoding="utf-8")), file.name)
        except (OSError, ValueError, RecursionError, ThermalError) as error:
            advice = f"move {OWN_FOLDER}/{DRAFT} away to begin with the case"
            raise LabelError(str(file), "the page's own file", str(error), advice) from error
    if not is_case:
        return draft or Draft(name=folder.name)
    read_building_file(folder)
    if draft is not None and not _is_newer(folder, file):
        return draft
    fresh = draft_of(load_case(folder).building)
    return fresh if draft is None else _with_positions(fresh, draft)


def _is_newer(folder: Path, file: Path) -> bool:
    """Whether somebody has edited the case since the page saved its draft."""
    patience = 10.0  # s: the page writes the case right after its draft
    names = [NAME, *(path.name for path in folder.glob("plan_*.csv"))]
    return max((folder / name).stat().st_mtime for name in names) > file.stat().st_mtime + patience


def _with_positions(fresh: Draft, draft: Draft) -> Draft:
    """Take from the page's own file what a case does not hold: drawings, places of devices, time spent."""
    drawn = {(f.name, f.rows, f.columns): {"drawing": f.drawing, "picture": f.picture} for f in draft.floors}
    floors = tuple(f.model_copy(update=drawn.get((f.name, f.rows, f.columns), {})) for f in fresh.floors)
    placed = {(d.name, d.zone): d.model_dump(include={"room", "floor", "x", "y"}) for d in draft.devices}
    devices = tuple(d.model_copy(update=placed.get((d.name, d.zone), {})) for d in fresh.devices)
    kept = {"floors": floors, "devices": devices, "seconds": draft.seconds, "revision": draft.revision}
    return fresh.model_copy(update=kept)
