"""What is kept of one of many calibrations: its outcome, and the record by which a later run knows that it is done."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass, replace
from importlib.metadata import version
from inspect import signature
from pathlib import Path
from typing import Any, Literal

from calibration.errors import CalibrationError, ResultsExistError
from calibration.evaluation.intervals import Interval
from calibration.fit.calibrate import calibrate
from calibration.results import to_json
from thermal.case.load import NAME, read_building_file
from thermal.errors import CaseError, nearest

#: File in the results of each case: what they were made from, and how it went.
RECORD = "case.json"

#: Settings that name intervals, as texts that each case reads in its own time zone.
INTERVALS = ("tune", "hold_out")

Status = Literal["calibrated", "not_converged", "failed", "lost", "interrupted"]


@dataclass(frozen=True)
class CaseOutcome:
    """How one of many calibrations went.

    Parameters
    ----------
    case : str
        Name of the case folder, and of the folder of its results.
    status : {"calibrated", "not_converged", "failed", "lost", "interrupted"}
        The first two have results. A case is lost when its worker died more often than it may, and interrupted when the
        run ended before it.
    held_out_mae_before, held_out_mae_after : float, optional
        Held-out error before and after calibration [K].
    seconds : float
        Wall time of loading, calibrating and writing [s]; of the run that did it, for a case that was done before.
    resumed : bool
        Whether the results are of an earlier run.
    attempts : int
        How many workers began it.
    solver : mapping of str to Any, optional
        Entry ``solver`` of its ``calibration.json``; None without results.
    error, message : str, optional
        Name and text of what went wrong.
    bad_input : bool
        Whether that is for the user to mend in the case or the settings, rather than a failure.
    """

    case: str
    status: Status
    held_out_mae_before: float | None = None
    held_out_mae_after: float | None = None
    seconds: float = 0.0
    resumed: bool = False
    attempts: int = 0
    solver: Mapping[str, Any] | None = None
    error: str | None = None
    message: str | None = None
    bad_input: bool = False

    def to_dict(self) -> dict[str, Any]:
        """Entry of ``summary.json``."""
        return {k: getattr(self, k) for k in self.__dataclass_fields__ if k != "case"}


def check_settings(settings: Mapping[str, Any]) -> dict[str, Any]:
    """Refuse what `calibrate` does not take; return every setting as a record spells it.

    Parameters
    ----------
    settings : mapping of str to Any
        Keywords of `calibrate`, but for the case and the progress.

    Raises
    ------
    CalibrationError
        When a name is unknown, or a value cannot be written down.
    """
    known = {n: p.default for n, p in signature(calibrate).parameters.items() if n not in ("case", "progress")}
    for name, value in settings.items():
        if name not in known:
            raise CalibrationError(f"settings: calibrate takes no {name!r}; {nearest(name, known)}")
        if name in INTERVALS and (isinstance(value, str) or not isinstance(value, Sequence)):
            raise CalibrationError(f"settings.{name}: expected a list of intervals START/END, came {value!r}")
    spelled = {}
    for name, value in (known | dict(settings)).items():
        try:
            spelled[name] = json.loads(to_json({name: _plain(value)}))[name]
        except TypeError as error:
            if name in settings:  # a default that cannot be written down goes with the version
                raise CalibrationError(
                    f"settings.{name}: expected plain values that a record can hold, came {value!r}"
                ) from error
    return spelled


def _plain(value: Any) -> Any:
    if isinstance(value, Interval):
        return f"{value.start.isoformat()}/{value.end.isoformat()}"
    if is_dataclass(value) and not isinstance(value, type):
        return {f.name: _plain(getattr(value, f.name)) for f in fields(value)}
    if isinstance(value, Mapping):
        return {key: _plain(entry) for key, entry in value.items()}
    return [_plain(entry) for entry in value] if isinstance(value, list | tuple) else value


def earlier_outcome(case: Path, out: Path, settings: Mapping[str, Any]) -> CaseOutcome | None:
    """Read what an earlier run with the same settings, on the same case, left behind.

    Parameters
    ----------
    case, out : Path
        Case folder, and folder of its results.
    settings : mapping of str to Any
        From `check_settings`.

    Returns
    -------
    CaseOutcome or None
        None without results.

    Raises
    ------
    ResultsExistError
        When the results there are of other settings, other telemetry, or another version.
    """
    there = read_record(out)
    if there is None:
        if out.exists() or out.is_symlink():
            raise ResultsExistError(f"{out}: holds no results of such a run; choose another --out or --force")
        return None
    here = {"settings": dict(settings), "files": digest(case), "version": version("buildingmpc")}
    for what in here:
        if there[what] != here[what]:
            raise ResultsExistError(
                f"{out}: holds results of {_difference(what, there[what], here[what])}; "
                "choose another --out, or --force (force=True) to replace them"
            )
    return replace(outcome_of(there, out), resumed=True)


def _difference(what: str, there: Any, here: Any) -> str:
    if what == "files":
        return "other plans or telemetry than the case holds now"
    if what == "version":
        return f"version {there}, and this is {here}"
    name = next(n for n in {**there, **here} if there.get(n) != here.get(n))
    return f"other settings: {name} is {there.get(name)!r} there and {here.get(name)!r} here"


def read_record(out: Path) -> dict[str, Any] | None:
    """Read the record of finished results; None where there are none, or they are of no such run.

    Parameters
    ----------
    out : Path
        Folder of the results of a case.
    """
    try:
        content = json.loads((out / RECORD).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    whole = isinstance(content, dict) and set(content) == {"settings", "files", "version", "run", "outcome"}
    outcome = content["outcome"] if whole else None
    return content if isinstance(outcome, dict) and set(outcome) == set(CaseOutcome.__dataclass_fields__) else None


def outcome_of(record: Mapping[str, Any], out: Path) -> CaseOutcome:
    """Outcome in a record.

    Parameters
    ----------
    record : mapping of str to Any
        From `read_record`.
    out : Path
        Folder that it lies in.
    """
    return CaseOutcome(**{**record["outcome"], "case": out.name})


def digest(case: Path) -> str:
    """SHA-256 of the files that make up a case, by which a later run knows it again; empty when they cannot be read.

    Parameters
    ----------
    case : Path
        Case folder.
    """
    total = hashlib.sha256()
    try:
        parsed = read_building_file(case)
        for name in (NAME, *(floor.plan for floor in parsed.floors or ()), parsed.telemetry):
            with (case / name).open("rb") as stream:
                total.update(hashlib.file_digest(stream, "sha256").digest())
    except (CaseError, OSError):
        return ""
    return total.hexdigest()
