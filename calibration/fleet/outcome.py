"""How one case of many went, and the record of it beside its results."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, fields
from pathlib import Path, PurePath
from typing import Any, ClassVar

from calibration.fleet.job import Status
from calibration.results import Plain

#: File in the results of each case: what they were made from, and how it went.
RECORD = "case.json"

#: Keys of the record.
_KEYS = {"settings", "files", "version", "run", "outcome", "tables"}


@dataclass(frozen=True)
class CaseOutcome(Plain):
    """How one of many calibrations or diagnoses went.

    Parameters
    ----------
    case : str
        Name of the case folder, and of the folder of its results.
    status : {"calibrated", "diagnosed", "not_converged", "failed", "lost", "interrupted"}
        The first three have results. A case is lost when its worker died more often than it may, and interrupted when
        the run ended before it.
    held_out_mae_before, held_out_mae_after : float, optional
        Held-out error before and after calibration [K]; of a diagnosis, of the calibrated baseline and of the model
        that it hands on.
    seconds : float
        Wall time of loading, calibrating and writing [s]; of the run that did it, for a case that was done before.
    resumed : bool
        Whether the results are of an earlier run.
    attempts : int
        How many workers began it.
    solver : mapping of str to Any, optional
        Entry ``solver`` of its ``calibration.json``; None without results, and of a diagnosis.
    verdict : str, optional
        Of a diagnosis.
    effects : tuple of str
        That it found, in order.
    error, message : str, optional
        Name and text of what went wrong.
    bad_input : bool
        Whether that is for the user to mend in the case or the settings, rather than a failure.
    has_windows : bool, optional
        Whether the building has glazing at all; None without results.
    memory : float, optional
        Largest memory of its worker up to its end [MB].
    """

    case: str
    status: Status
    held_out_mae_before: float | None = None
    held_out_mae_after: float | None = None
    seconds: float = 0.0
    resumed: bool = False
    attempts: int = 0
    solver: Mapping[str, Any] | None = None
    verdict: str | None = None
    effects: tuple[str, ...] = ()
    error: str | None = None
    message: str | None = None
    bad_input: bool = False
    has_windows: bool | None = None
    memory: float | None = None
    key: ClassVar[str] = "case"


def read_record(out: Path) -> dict[str, Any] | None:
    """Read the record of finished results; None where there are none, or they are of no such run.

    Parameters
    ----------
    out : Path
        Folder of the results of a case.
    """
    try:
        return parse_record((out / RECORD).read_bytes())
    except OSError:
        return None


def parse_record(text: bytes) -> dict[str, Any] | None:
    """Parse the record of finished results; None where it is no such record.

    Parameters
    ----------
    text : bytes
        Contents of the file.
    """
    try:
        content = json.loads(text)
    except ValueError:
        return None
    whole = isinstance(content, dict) and set(content) == _KEYS
    outcome = content["outcome"] if whole else None
    return content if isinstance(outcome, dict) and set(outcome) == {f.name for f in fields(CaseOutcome)} else None


def key_of(record: Mapping[str, Any]) -> str:
    """Key of results: the same where contents of the case, settings and version of the library are, and only there.

    Parameters
    ----------
    record : mapping of str to Any
        With ``files``, ``settings`` and ``version``.
    """
    spelled = json.dumps([record[k] for k in ("files", "settings", "version")], sort_keys=True)
    return hashlib.sha256(spelled.encode()).hexdigest()


def outcome_of(record: Mapping[str, Any], out: PurePath) -> CaseOutcome:
    """Outcome in a record.

    Parameters
    ----------
    record : mapping of str to Any
        From `read_record`.
    out : PurePath
        Folder that it lies in.
    """
    outcome = record["outcome"]
    return CaseOutcome(**{**outcome, "case": out.name, "effects": tuple(outcome["effects"])})
