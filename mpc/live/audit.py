"""The audit log: one line of JSON an event, each with the hash of the line before."""

from __future__ import annotations

import contextlib
import gzip
import hashlib
import json
import os
import re
import shutil
import zlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cache
from importlib.metadata import version
from pathlib import Path
from threading import Lock, Thread
from typing import Any

from mpc.errors import LiveError

#: Before the first line of the first file.
NOTHING = "0" * 64

#: Length of a file from which on a further one is begun [bytes]: half a day of the pilot's plans.
LARGEST = 32_000_000

_PLAIN, _HALF, _NAMED = ".jsonl", ".part", re.compile(r".+-\d+\.jsonl(\.gz)?")


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
    a whole file that is missing in between is seen. Once it is full, a further one goes on from it the same way, with
    a first line of kind ``turned``, and the full one is compressed.

    Parameters
    ----------
    folder : Path
        Where the files are.
    name : str
        Of the process, such as ``guard``.
    again : callable
        Gives what a further file must say first, so that it can be read without those before it.

    Raises
    ------
    LiveError
        When the disk does not take a line or a file, or a closed log is to take one.
    """

    def __init__(self, folder: Path, name: str, again: Callable[[], Mapping[str, Any]]) -> None:
        folder.mkdir(parents=True, exist_ok=True, mode=0o700)
        for half in folder.glob(f"{name}-*{_HALF}"):
            half.unlink(missing_ok=True)
        earlier, self._again, self._length = log_files(folder, name), again, 0
        self._before, self._number = _end(earlier[-1]) if earlier else (NOTHING, -1)
        self._name, self._count = name, _place(earlier[-1])[1] if earlier else -1
        self._writing, self._closed = Lock(), False
        self.path, self._file = self._begun(folder)
        _compress_beside([p for p in earlier if p.suffix == _PLAIN and p.stat().st_size >= LARGEST])

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
        with self._writing:
            LiveError.unless(not self._closed, "audit log", "one that is open", "a closed one")
            try:
                digest = self._add(kind, content)
                if self._length >= LARGEST and not self._closed:
                    self._turn()
                return digest
            finally:
                if self._closed:  # meanwhile, by who could not wait for the disk
                    os.close(self._file)

    def _add(self, kind: str, content: Mapping[str, Any]) -> str:
        entry = {"n": self._number + 1, "before": self._before, "kind": kind, "content": content}
        digest = hashlib.sha256(canonical(entry).encode()).hexdigest()
        line = (canonical(entry | {"hash": digest}) + "\n").encode()
        try:
            if os.write(self._file, line) != len(line):
                raise OSError("the disk is full")
            os.fsync(self._file)
        except OSError as error:
            raise LiveError("audit log", "a disk that can be written to", str(error)) from error
        self._number, self._before, self._length = self._number + 1, digest, self._length + len(line)
        return digest

    def _begun(self, folder: Path) -> tuple[Path, int]:
        self._count, self._length = self._count + 1, 0
        path = folder / f"{self._name}-{self._count:06d}{_PLAIN}"
        try:
            return path, os.open(path, os.O_WRONLY | os.O_APPEND | os.O_CREAT | os.O_EXCL, 0o600)
        except OSError as error:
            raise LiveError("audit log", "a folder that can be written to", str(error)) from error

    def _turn(self) -> None:
        """Go on in a further file; the full one is compressed beside."""
        full, file = self.path, self._file
        self.path, self._file = self._begun(full.parent)
        with contextlib.suppress(OSError):  # every line of it is on disk
            os.close(file)
        self._add("turned", self._again())
        _compress_beside([full])

    def close(self) -> None:
        """End the file; at once, even where a line is still waiting for the disk."""
        if self._closed:
            return
        self._closed = True
        if self._writing.acquire(blocking=False):
            os.close(self._file)
            self._writing.release()


def log_files(folder: Path, name: str = "*") -> list[Path]:
    """List the files of a process' log, oldest first, or of all logs by process.

    Parameters
    ----------
    folder : Path
        Of the logs.
    name : str
        Of the process; all by default.
    """
    found = dict[tuple[str, int], Path]()
    for end in (_PLAIN, f"{_PLAIN}.gz"):  # in this order one that is being compressed is never missed
        for path in folder.glob(f"{name}-*{end}"):
            if _NAMED.fullmatch(path.name):
                found.setdefault(_place(path), path)
    return [found[place] for place in sorted(found)]


def log_lines(path: Path) -> list[bytes]:
    """Read the lines of a file of a log, compressed or not, with their ends.

    Parameters
    ----------
    path : Path
        The file.

    Raises
    ------
    LiveError
        When it cannot be unpacked.
    """
    try:
        content = path.read_bytes()
    except FileNotFoundError:  # it has been compressed meanwhile
        path = path.with_name(path.name + ".gz")
        content = path.read_bytes()
    if path.suffix == ".gz":
        try:
            content = gzip.decompress(content)
        except (OSError, EOFError, zlib.error) as error:
            raise LiveError(path.name, "a whole compressed file", str(error)) from error
    return content.splitlines(keepends=True)


def _place(path: Path) -> tuple[str, int]:
    """Name of a file's process, and its number."""
    name, _, number = path.name.partition(".")[0].rpartition("-")
    return name, int(number)


def _compress_beside(full: Sequence[Path]) -> None:
    def compress() -> None:
        for path in full:
            _compress(path)

    if full:
        Thread(target=compress, daemon=True).start()


def _compress(full: Path) -> None:
    """Put a compressed file in the place of a full one; where that fails it stays as it is."""
    half = full.with_name(full.name + _HALF)
    try:
        with full.open("rb") as source, half.open("wb") as file:
            os.chmod(half, 0o600)
            with gzip.GzipFile(full.name, "wb", 6, file, 0) as target:
                shutil.copyfileobj(source, target)
            file.flush()
            os.fsync(file.fileno())
        half.replace(full.with_name(full.name + ".gz"))
        full.unlink()
    except OSError:
        with contextlib.suppress(OSError):
            half.unlink(missing_ok=True)


def _end(path: Path) -> tuple[str, int]:
    """Hash and number of the last whole line of a file; those of the files before where it has none."""
    for line in reversed(log_lines(path)):
        if line.endswith(b"\n"):
            try:
                entry = json.loads(line)
                return str(entry["hash"]), int(entry["n"])
            except (ValueError, KeyError, TypeError):
                continue
    others = log_files(path.parent, _place(path)[0])
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
    for at, line in enumerate(log_lines(path), 1):
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
