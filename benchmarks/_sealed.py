"""Trials on disk: the case, which the diagnosis gets, and its sealed label, which it never gets."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Mapping
from importlib.util import find_spec
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np


class TrialError(Exception):
    """A trial could not be made; the message says what and where."""


class EnergyPlusMissingError(TrialError):
    """EnergyPlus is not installed."""


class Made(NamedTuple):
    """A trial that was run.

    Parameters
    ----------
    label : mapping
        All that it holds, and what is known of the run.
    write : callable
        Writes its case to a folder.
    """

    label: Mapping[str, Any]
    write: Callable[[Path], None]


def make_trial(name: str, cases: Path, sealed: Path, run: Callable[[], Made]) -> bool:
    """Make a trial unless it is there, and return whether it was made.

    Parameters
    ----------
    name : str
        Of the trial.
    cases, sealed : Path
        Folders of what the diagnosis gets, and of the labels; the second outside of the first.
    run : callable
        Runs it.

    Raises
    ------
    ValueError
        The labels would lie within reach of the diagnosis.
    TrialError
        EnergyPlus is not installed or failed, or what came out is not what was asked for.
    """
    case, label = places(name, cases, sealed)
    if case.exists() and label.exists():
        return False
    if find_spec("pyenergyplus") is None:
        raise EnergyPlusMissingError("EnergyPlus is not installed: pip install -e .[energyplus]")
    made = run()
    seal(label, made.label)
    if not case.exists():
        made.write(case)
    return True


def places(name: str, cases: Path, sealed: Path) -> tuple[Path, Path]:
    """Folder of a trial's case, and file of its label.

    Parameters
    ----------
    name : str
        Of the trial.
    cases, sealed : Path
        Folders of what the diagnosis gets, and of the labels.

    Raises
    ------
    ValueError
        The labels would lie within reach of the diagnosis.
    """
    kept, hidden = cases.resolve(), sealed.resolve()
    if hidden == kept or kept in hidden.parents:
        raise ValueError(f"expected labels outside of the cases, found {sealed} within {cases}")
    return kept / name, hidden / f"{name}.json"


def seal(path: Path, label: Mapping[str, Any]) -> None:
    """Write a label, whole or not at all.

    Parameters
    ----------
    path : Path
        From `places`.
    label : mapping
        All that the trial holds.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_suffix(".part")
    part.write_text(json.dumps(label, indent=1, default=_plain) + "\n", encoding="utf-8")
    os.replace(part, path)


def _plain(value: Any) -> Any:
    return value.item() if isinstance(value, np.generic) else str(value)
