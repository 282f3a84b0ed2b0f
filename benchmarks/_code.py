"""Which version of the library a number comes from."""

from __future__ import annotations

import hashlib
from functools import cache
from pathlib import Path

import calibration
import thermal


@cache
def code() -> str:
    """Digest of the library's sources: lines of different code do not belong into one table."""
    digest = hashlib.sha256()
    for package in (thermal, calibration):
        for path in sorted(Path(str(package.__file__)).parent.rglob("*.py")):
            digest.update(path.read_bytes())
    return digest.hexdigest()[:12]
