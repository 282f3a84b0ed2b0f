"""The server of the labelling page: what the page asks for, and what it is answered."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from threading import RLock
from typing import Any

from thermal.errors import LabelError, MissingExtraError, SessionHeldError, describe
from thermal.plan.page.access import Application, Gate
from thermal.plan.page.convert import parse_draft
from thermal.plan.page.draft import Draft
from thermal.plan.page.findings import zone_facts
from thermal.plan.page.jobs import Jobs
from thermal.plan.page.reports import ReportMaker, Reports
from thermal.plan.page.sessions import Sessions
from thermal.plan.page.store import CaseStore


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
        self.jobs = Jobs()
        self.reports = Reports(self.store.folder, reports, makers or {})
        self._lock = RLock()
        self._saver, self._since = "", 0

    def state(self) -> dict[str, Any]:
        """Give all that the page shows, as plain types.

        Returns
        -------
        dict
            Draft, findings, areas, reports that can be made; which window saved last, and the revision from which on
            it was the only one. A page that was loaded anew tells by them whether what it kept is later.
        """
        with self._lock:
            draft = self.store.draft
            saver = {"saved_by": self._saver, "saved_since": self._since}
            shown = {"draft": draft.model_dump(by_alias=True), "reports": self.reports.kinds}
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
            if draft.revision != revision:
                found = f"a change of revision {draft.revision}"
                raise SessionHeldError(describe("draft", f"one of revision {revision}", found, "load the page anew"))
            if window != self._saver:
                self._saver, self._since = window, revision
            saved = draft.model_copy(update={"revision": revision + 1})
            written = self.store.save(saved)
            return {"revision": saved.revision, "written": written, **self._verdict(saved)}

    def end(self) -> None:
        """Stop what is being done, and give the case back."""
        self.jobs.end()
        self.sessions.end()

    def _verdict(self, draft: Draft) -> dict[str, Any]:
        findings = [finding.to_dict() for finding in self.store.findings]
        # A case that the page has made has one column without a value, to be replaced.
        telemetry = self.store.telemetry if len(self.store.columns) > 1 else ""
        return {"findings": findings, "zones": zone_facts(draft), "telemetry": telemetry}


def create_app(desk: LabelDesk, token: str) -> Application:
    """Make the server of a labelling page.

    Parameters
    ----------
    desk : LabelDesk
        What it works on.
    token : str
        First part of every address; without it nothing is answered.

    Returns
    -------
    callable
        ASGI application.

    Raises
    ------
    MissingExtraError
        The extra ``[pages]`` is not installed.
    """
    try:
        from thermal.plan.page.routes import routes_of
    except ImportError as error:
        advice = 'run: pip install "buildingmpc[pages]"'
        raise MissingExtraError(describe("labelling page", "FastAPI", str(error), advice)) from error
    return Gate(routes_of(desk), token)


def parse_json(body: bytes) -> Any:
    """Read the body of a request.

    Parameters
    ----------
    body : bytes
        JSON in UTF-8.

    Returns
    -------
    object
        Plain types.

    Raises
    ------
    LabelError
        It is no JSON, or blocks within blocks without end.
    """
    try:
        return json.loads(body)
    except (ValueError, RecursionError) as error:  # ValueError: no UTF-8, no JSON, an integer of 5000 digits
        raise LabelError(describe("body", "JSON", f"{type(error).__name__}: {error}"[:200])) from error


def plain(value: Any) -> dict[str, Any]:
    """Give a dataclass as plain types.

    Parameters
    ----------
    value : object
        Dataclass instance.

    Returns
    -------
    dict
        Its fields.
    """
    return asdict(value)
