"""Reports beside a case, and how they are made."""

import hashlib
import html
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from thermal.errors import ReportError, nearest
from thermal.plan.folder import OWN_FOLDER
from thermal.plan.guard import inside_folder
from thermal.plan.page.jobs import Progress

#: Makes a report of a case: case folder, folder of the results, progress, units that it is shown in (si, ip).
ReportMaker = Callable[[Path, Path, Progress, str], None]

_PAGE = "report.html"
_KINDS = {
    "demo.json": "from check to control",
    "diagnosis.json": "diagnosis",  # before the next: a diagnosis has a calibration beside it
    "calibration.json": "calibration",
    "comparison.json": "comparison of controllers",
    "control.json": "control",
    "simulation.json": "simulation",
    "evaluation.json": "evaluation",
    "experiment.json": "experiment",
    "monitoring.json": "monitoring",
    "identify.json": "identified plant",
    "summary.json": "buildings of a folder",
    "check.json": "check",
}
_VERDICT = re.compile(r'<p class="verdict[^>]*>(.*?)</p>', re.DOTALL)
_HEAD = 40_000  # characters of a page in which its verdict is looked for
_DEEP = 3  # folders below the case, or below a folder of results, in which reports are looked for
_MOST = 200


@dataclass(frozen=True)
class _Report:
    """A report that is there.

    Parameters
    ----------
    key : str
        To ask for it.
    kind : str
        ``check``, ``calibration``, ``diagnosis``, ..., or ``other``.
    title : str
        Its folder, as seen from the case; empty for one that the page has made.
    verdict : str
        What it found, in plain words; empty where it does not say.
    time : float
        When it was written [s since 1970].
    path : Path
        Its page.
    """

    key: str
    kind: str
    title: str
    verdict: str
    time: float
    path: Path

    def to_dict(self) -> dict[str, Any]:
        """Give it as plain types, for JSON."""
        return {name: getattr(self, name) for name in ("key", "kind", "title", "verdict", "time")}


class Reports:
    """The reports of a case.

    Parameters
    ----------
    case : Path
        Case folder.
    folders : sequence of Path
        Further folders of results.
    makers : mapping
        What makes a report, by its name.
    """

    def __init__(self, case: Path, folders: Sequence[Path], makers: Mapping[str, ReportMaker]) -> None:
        self._case = case
        self._folders = [Path(folder).absolute() for folder in folders]
        self._makers = dict(makers)

    @property
    def kinds(self) -> tuple[str, ...]:
        """Reports that can be made."""
        return tuple(self._makers)

    def found(self) -> tuple[_Report, ...]:
        """Look for reports in the case and in the folders of results.

        Returns
        -------
        tuple of _Report
            Newest first.
        """
        pages = {page for root in (self._case, *self._folders) for page in _pages(root)}
        return tuple(sorted(map(self._report, pages), key=lambda report: -report.time)[:_MOST])

    def page(self, key: str, name: str = _PAGE) -> Path:
        """Path of a report, or of one that it leads to.

        Parameters
        ----------
        key : str
            Of the report.
        name : str
            Of the page, as seen from the report's folder.

        Returns
        -------
        Path
            The page.

        Raises
        ------
        ReportError
            There is none.
        PlanError
            The name leads out of the report's folder.
        """
        for report in self.found():
            if report.key == key:
                path = inside_folder(report.path.parent, name, "report")
                if path.name == _PAGE and path.is_file():
                    return path
        raise ReportError("report", "one of the list", repr(key[:40]), "load the list anew")

    def make(self, kind: str, progress: Progress, units: str = "si") -> dict[str, Any]:
        """Make a report.

        Parameters
        ----------
        kind : str
            One of `kinds`.
        progress : callable
            Told stage, steps done and all steps.
        units : {"si", "ip"}
            That the report is shown in.

        Returns
        -------
        dict
            The report, as in the list.

        Raises
        ------
        ReportError
            It is not one of `kinds`.
        """
        out = self._case / OWN_FOLDER / "reports" / self.checked_kind(kind)
        ReportError.unless(not out.is_symlink(), str(out), "a folder of the page's own", "a link", "remove it")
        self._makers[kind](self._case, out, progress, units)
        return self._report(out / _PAGE).to_dict()

    def checked_kind(self, kind: str) -> str:
        """Refuse a report that cannot be made.

        Parameters
        ----------
        kind : str
            What is asked for.

        Returns
        -------
        str
            The same.

        Raises
        ------
        ReportError
            It is not one of `kinds`.
        """
        if kind not in self._makers:
            raise ReportError("report", "one that can be made", repr(kind[:40]), nearest(kind, self._makers))
        return kind

    def _report(self, page: Path) -> _Report:
        folder = page.parent
        kind = next((kind for name, kind in _KINDS.items() if (folder / name).is_file()), "other")
        made = folder.parent == self._case / OWN_FOLDER / "reports"
        seen = folder.relative_to(self._case).as_posix() if folder.is_relative_to(self._case) else folder.name
        title = "" if made else "imported plans" if seen == "." else seen
        key = hashlib.sha256(str(page).encode("utf-8", "surrogateescape")).hexdigest()[:16]
        return _Report(key, kind, title, _verdict(page), page.stat().st_mtime, page)


def _verdict(page: Path) -> str:
    """Sentence that a report begins with."""
    with page.open(encoding="utf-8", errors="replace") as stream:
        found = _VERDICT.search(stream.read(_HEAD))
    return " ".join(html.unescape(found[1]).split()) if found else ""


def _pages(root: Path) -> list[Path]:
    """Pages below a folder; a link that leads out of it is none of its own."""
    found = [page for deep in range(_DEEP + 1) for page in root.glob("*/" * deep + _PAGE)]
    return [page for page in found if page.is_file() and page.resolve().is_relative_to(root.resolve())]
