"""Folders of files at any fsspec URL (extra ``[fleet]``): read, listed, and written whole or not at all."""

from __future__ import annotations

import hashlib
import time
import uuid
from collections.abc import Callable, Iterator
from importlib import import_module
from pathlib import Path, PurePosixPath
from typing import Any, TypeVar

from calibration.errors import CalibrationError
from thermal.errors import MissingExtraError

T = TypeVar("T")

#: How often an access is tried, and the wait after the first failure, doubled after each further one [s]: with one
#: access in twenty failing, one in three million fails five times, and an outage of a second and a half is sat out.
TRIES, PAUSE = 5, 0.1

#: Protocols whose objects appear whole or not at all; elsewhere a file is written beside its place and moved there.
_OBJECTS = frozenset({"s3", "s3a", "gs", "gcs", "az", "abfs", "adl", "memory"})

#: Answers that trying again does not change.
_FINAL = (FileNotFoundError, PermissionError, IsADirectoryError, NotADirectoryError)


def is_url(place: object) -> bool:
    """Whether a place is named by a URL such as ``s3://bucket/fleet``, rather than by a path.

    Parameters
    ----------
    place : str or Path
        As a user gives it.
    """
    return isinstance(place, str) and "://" in place


class Store:
    """A folder at a URL; a failing access is tried again a few times.

    Credentials and endpoints come from where fsspec and the store's own library find them, such as the environment.

    Parameters
    ----------
    url : str
        Such as ``s3://bucket/fleet`` or ``file:///data/fleet``.

    Raises
    ------
    MissingExtraError
        When fsspec or the library of the protocol is not installed.
    CalibrationError
        When nobody knows the protocol.
    """

    def __init__(self, url: str) -> None:
        self.url = url.rstrip("/")
        try:
            core: Any = import_module("fsspec.core")
            self._fs, root = core.url_to_fs(self.url, use_listings_cache=False)
        except ImportError as error:
            raise MissingExtraError(f'{url}: needs the extra: pip install "buildingmpc[fleet]" ({error})') from error
        except ValueError as error:
            raise CalibrationError(f"{url}: expected a URL that fsspec knows, got: {error}") from error
        self._root = root.rstrip("/")
        protocols = (self._fs.protocol,) if isinstance(self._fs.protocol, str) else self._fs.protocol
        self._objects = bool(_OBJECTS & set(protocols))

    def at(self, name: str) -> Store:
        """Folder inside of this one.

        Parameters
        ----------
        name : str
            Its name.
        """
        return Store(f"{self.url}/{name}")

    def folders(self) -> Iterator[str]:
        """Names of the folders in it, in order; hidden ones are not there, and none where there is no such folder."""
        try:
            found = _tried(lambda: self._fs.ls(self._root, detail=True))
        except FileNotFoundError:
            return
        names = sorted(PurePosixPath(e["name"].rstrip("/")).name for e in found if e["type"] == "directory")
        yield from (name for name in names if not name.startswith("."))

    def files(self, under: str = "") -> list[str]:
        """Names of all files in it, or below a folder of it, relative to it and in order; none where nothing is there.

        Parameters
        ----------
        under : str
            Relative.
        """
        try:
            found = _tried(lambda: self._fs.find(f"{self._root}/{under}".rstrip("/")))
        except FileNotFoundError:
            return []
        root = PurePosixPath(self._fs._strip_protocol(self._root))
        return sorted(str(PurePosixPath(path).relative_to(root)) for path in found)

    def digest(self) -> str:
        """SHA-256 of names and contents of its files; of an object store by the digest that the store keeps (ETag)."""
        total = hashlib.sha256()
        for name in self.files():
            total.update(name.encode() + b"\0" + self._content_digest(name) + b"\0")
        return total.hexdigest()

    def read(self, name: str) -> bytes:
        """Read a file.

        Parameters
        ----------
        name : str
            Relative.

        Raises
        ------
        FileNotFoundError
            When it is not there.
        """
        content: bytes = _tried(lambda: self._fs.cat_file(f"{self._root}/{name}"))
        return content

    def write(self, name: str, content: bytes) -> None:
        """Write a file, whole or not at all.

        Parameters
        ----------
        name : str
            Relative; folders are made.
        content : bytes
            What it is to hold.
        """
        path = f"{self._root}/{name}"
        folder, _, own = path.rpartition("/")

        def once() -> None:
            if self._objects:
                self._fs.pipe_file(path, content)
                return
            self._fs.makedirs(folder, exist_ok=True)
            beside = f"{folder}/.{own}-{uuid.uuid4().hex[:12]}"
            try:
                self._fs.pipe_file(beside, content)
                self._fs.mv(beside, path)
            except BaseException:
                if self._fs.exists(beside):
                    self._fs.rm_file(beside)
                raise

        _tried(once)

    def remove(self, name: str) -> None:
        """Remove a file or a folder with all that it holds, if it is there.

        Parameters
        ----------
        name : str
            Relative.
        """

        def once() -> None:
            if self._fs.exists(f"{self._root}/{name}"):
                self._fs.rm(f"{self._root}/{name}", recursive=True)

        try:
            _tried(once)
        except FileNotFoundError:  # somebody else did
            return

    def fetch(self, folder: Path) -> None:
        """Copy its files to a folder of this machine.

        Parameters
        ----------
        folder : Path
            Made with its parents.
        """
        for name in self.files():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_bytes(self.read(name))

    def _content_digest(self, name: str) -> bytes:
        if self._objects:
            entry = _tried(lambda: self._fs.info(f"{self._root}/{name}"))
            if tag := entry.get("ETag") or entry.get("etag") or entry.get("md5Hash"):
                return f"{entry['size']} {tag}".encode()
        return hashlib.sha256(self.read(name)).digest()


def _tried(access: Callable[[], T]) -> T:
    """Do an access to a store, again where it fails by what may pass."""
    for number in range(TRIES - 1):
        try:
            return access()
        except _FINAL:
            raise
        except OSError:
            time.sleep(PAUSE * 2**number)
    return access()
