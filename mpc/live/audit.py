"""The audit log: one line of JSON an event, each with the hash of the line before."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterator, Mapping
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

from mpc.errors import LiveError

#: Before the first line of the first file.
NOTHING = "0" * 64


def canonical(content: Any) -> str:
    """Write JSON in one way only: keys in order, no spaces, numbers as Python spells them, NaN refused.

    Parameters
    ----------
    content : object
        Of plain types.
    """
    return json.dumps(content, sort_keys=True, separators=(",", ":"), allow_nan=False)


@cache
def code_version() -> str:
    """Name the version of the package, and the hash of the code that decides."""
    total = hashlib.sha256()
    for path in sorted(Path(__file__).parent.rglob("*.py")):
        total.update(path.read_bytes())
    return f"{version('buildingmpc')}+{total.hexdigest()[:16]}"


class AuditLog:
    """A file that lines are only ever added to; a line is on disk when `append` returns.

    A process begins a file of its own, whose first line goes on with the hash of the last file of its name, so that
    a whole file that is missing in between is seen.

    Parameters
    ----------
    folder : Path
        Where the files are.
    name : str
        Of the process, such as ``guard``.
    wall : float
        Wall clock, since 1970 in UTC [s], for the file's name.

    Raises
    ------
    LiveError
        From `append`, when the disk does not take the line.
    """

    def __init__(self, folder: Path, name: str, wall: float) -> None:
        folder.mkdir(parents=True, exist_ok=True, mode=0o700)
        earlier = log_files(folder, name)
        self._before, self._number = _end(earlier[-1]) if earlier else (NOTHING, -1)
        count = int(earlier[-1].stem.rpartition("-")[2]) + 1 if earlier else 0
        self.path = folder / f"{name}-{count:06d}.jsonl"
        self._file = os.open(self.path, os.O_WRONLY | os.O_APPEND | os.O_CREAT | os.O_EXCL, 0o600)

    @property
    def last(self) -> str:
        """Hash of the last line."""
        return self._before

    def append(self, kind: str, content: Mapping[str, Any]) -> str:
        """Add an event; return its hash.

        Parameters
        ----------
        kind : str
            What happened.
        content : mapping
            Plain types, finite numbers.
        """
        entry = {"n": self._number + 1, "before": self._before, "kind": kind, "content": content}
        digest = hashlib.sha256(canonical(entry).encode()).hexdigest()
        line = (canonical(entry | {"hash": digest}) + "\n").encode()
        try:
            if os.write(self._file, line) != len(line):
                raise OSError("the disk is full")
            os.fsync(self._file)
        except OSError as error:
            raise LiveError("audit log", "a disk that can be written to", str(error)) from error
        self._number, self._before = self._number + 1, digest
        return digest

    def close(self) -> None:
        """End the file."""
        os.close(self._file)


def log_files(folder: Path, name: str) -> list[Path]:
    """List the files of a process' log, oldest first.

    Parameters
    ----------
    folder : Path
        Of the logs.
    name : str
        Of the process.
    """
    return sorted(folder.glob(f"{name}-[0-9]*.jsonl"))


def _end(path: Path) -> tuple[str, int]:
    """Hash and number of the last whole line of a file; those of the files before where it has none."""
    for line in reversed(path.read_bytes().splitlines(keepends=True)):
        if line.endswith(b"\n"):
            try:
                entry = json.loads(line)
                return str(entry["hash"]), int(entry["n"])
            except (ValueError, KeyError, TypeError):
                continue
    others = log_files(path.parent, path.stem.rpartition("-")[0])
    at = others.index(path)
    return _end(others[at - 1]) if at else (NOTHING, -1)


def read_log(path: Path, before: str | None = None) -> Iterator[tuple[int, dict[str, Any]]]:
    """Read the events of a log, and check its chain.

    Parameters
    ----------
    path : Path
        A file of it.
    before : str, optional
        Hash that it must go on from; what its first line says by default.

    Yields
    ------
    tuple of int and dict
        Number of the line in the file, from 1, and the event.

    Raises
    ------
    LiveError
        At the line that was changed, inserted, or whose neighbour is missing. A last line without its end, which a
        crash leaves, is left out: it was never acknowledged.
    """
    number: int | None = None
    for at, line in enumerate(path.read_bytes().splitlines(keepends=True), 1):
        where = f"{path.name}: line {at}"
        if not line.endswith(b"\n"):
            return
        try:
            entry = json.loads(line)
            told = entry.pop("hash")
            link, count = entry["before"], entry["n"]
        except (ValueError, KeyError, TypeError, AttributeError) as error:
            raise LiveError(where, "an event of the log", f"{line[:60]!r}") from error
        found = hashlib.sha256(canonical(entry).encode()).hexdigest()
        LiveError.unless(found == told, where, f"the hash {told[:12]} that it carries", found[:12], "it was changed")
        advice = "a line before it is missing or was changed"
        LiveError.unless(before in (None, link), where, f"the hash {str(before)[:12]} before it", link[:12], advice)
        LiveError.unless(number is None or count == number + 1, where, f"number {(number or 0) + 1}", count, advice)
        before, number = told, count
        yield at, entry | {"hash": told}
