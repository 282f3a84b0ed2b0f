"""Where a trial lies: its case, which the diagnosis gets, and its sealed label, which it never gets."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np


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
