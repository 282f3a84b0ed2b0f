"""Desk of the labelling page: the draft of one case, its jobs, sessions and reports."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from threading import RLock
from typing import Any

from thermal.errors import SessionHeldError
from thermal.plan.guard import inside_folder, reading
from thermal.plan.list import read_drawing_list
from thermal.plan.page.draft import Draft, Site, parse_draft
from thermal.plan.page.drawings import DRAWING_KINDS, add_floors, checked_name, look_at
from thermal.plan.page.findings import zone_facts
from thermal.plan.page.jobs import Jobs, Progress
from thermal.plan.page.reports import ReportMaker, Reports
from thermal.plan.page.sessions import Sessions
from thermal.plan.page.store import CaseStore, write_whole
from thermal.plan.page.telemetry import TelemetryDesk


class LabelDesk:
    """Everything that the labelling page of one case works on.

    Parameters
    ----------
    case : Path
        Case folder; made where there is none.
    reports : sequence of Path
        Further folders of results whose reports are shown.
    makers : mapping
        What makes a report, by its name.
    take_over : bool
        Whether to take the case from another program that has it open.

    Raises
    ------
    LabelError
        The case is open elsewhere, or cannot be labelled.
    CaseError
        One of its family: the case that is there cannot be read.
    """

    def __init__(
        self,
        case: Path,
        *,
        reports: Sequence[Path] = (),
        makers: Mapping[str, ReportMaker] | None = None,
        take_over: bool = False,
    ) -> None:
        self.store = CaseStore(case)
        self.sessions = Sessions(self.store.own, take_over=take_over)
        self.telemetry = TelemetryDesk(self.store)
        self.jobs = Jobs()
        self.reports = Reports(self.store.folder, reports, makers or {})
        self._lock = RLock()
        self._saver, self._since = "", 0

    def state(self) -> dict[str, Any]:
        """Give all that the page shows, as plain types.

        Returns
        -------
        dict
            Draft, findings, areas, reports that can be made, jobs that are not done; which window saved last, and the
            revision from which on it was the only one. A page that was loaded anew tells by them whether what it kept
            is later.
        """
        with self._lock:
            draft = self.store.draft
            saver = {"saved_by": self._saver, "saved_since": self._since}
            shown: dict[str, Any] = {"draft": draft.model_dump(by_alias=True), "reports": self.reports.kinds}
            shown |= {"running": self.jobs.unfinished()}
            return {**shown, **saver, **self._verdict(draft)}

    def save(self, window: str, content: Any) -> dict[str, Any]:
        """Save what a window sends.

        Parameters
        ----------
        window : str
            Who sends it.
        content : object
            A draft as JSON; its revision is the one that it follows.

        Returns
        -------
        dict
            New revision, whether the case is written, findings, areas.

        Raises
        ------
        SessionHeldError
            Another window has the case, or has changed it.
        LabelError
            It is no draft.
        """
        draft = parse_draft(content, "draft")
        with self._lock:
            self.sessions.check(window)
            revision = self.store.draft.revision
            found, expected = f"a change of revision {draft.revision}", f"one of revision {revision}"
            SessionHeldError.unless(draft.revision == revision, "draft", expected, found, "load the page anew")
            if window != self._saver:
                self._saver, self._since = window, revision
            saved = draft.model_copy(update={"revision": revision + 1})
            written = self.store.save(saved)
            return {"revision": saved.revision, "written": written, **self._verdict(saved)}

    def take_telemetry(self, window: str, progress: Progress) -> dict[str, Any]:
        """Put the table that was read into the case, unless another window has taken it meanwhile.

        Parameters
        ----------
        window : str
            Who asked for it.
        progress : callable
            Told stage, steps done and all steps.

        Returns
        -------
        dict
            What the check of the case finds.

        Raises
        ------
        SessionHeldError
            Another window has the case.
        ThermalError
            One of its family, as `TelemetryDesk.take` raises them.
        """

        @contextmanager
        def guard() -> Iterator[None]:
            with self._lock:
                self.sessions.check(window)
                yield

        return self.telemetry.take(progress, guard)

    def end(self) -> None:
        """Stop what is being done, and give the case back."""
        self.jobs.end()
        self.sessions.end()

    def _verdict(self, draft: Draft) -> dict[str, Any]:
        findings = [asdict(finding) for finding in self.store.findings]
        telemetry = self.store.telemetry if self.store.has_telemetry else ""
        return {"findings": findings, "zones": zone_facts(draft), "telemetry": telemetry}


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
        YAML file of a `thermal.plan.list.DrawingList`; drawings lie in its folder.
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
        "glazing": found.glazing,
    }
    desk.store.save(desk.store.draft.model_copy(update=changes))


def _copy(source: Path, target: Path) -> None:
    with reading(source, "a file that can be copied"):
        write_whole(target, source.read_bytes())
