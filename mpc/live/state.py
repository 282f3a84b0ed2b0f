"""What a process says of itself, in a file that is whole at any time."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any


def write_state(path: Path, content: Mapping[str, Any]) -> None:
    """Replace a file of JSON; a disk that is full leaves the old one.

    Parameters
    ----------
    path : Path
        Of the file.
    content : mapping
        Plain types.
    """
    fresh = path.with_suffix(f".{os.getpid()}.tmp")
    try:
        fresh.write_text(json.dumps(content), encoding="utf-8")
        fresh.replace(path)
    except OSError:
        fresh.unlink(missing_ok=True)


def read_state(path: Path) -> dict[str, Any]:
    """Read what a process said last; empty where it never did.

    Parameters
    ----------
    path : Path
        Of the file.
    """
    try:
        return dict(json.loads(path.read_text(encoding="utf-8")))
    except (OSError, ValueError, TypeError):
        return {}
