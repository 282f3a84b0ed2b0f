"""Samples on disk while there is no database."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

from mpc.errors import HistorianError
from mpc.live.historian.samples import Samples

#: Size from which on a new file is begun [bytes].
_FILE = 16_000_000


class Spool:
    """Files of samples in a folder, oldest first; one line a batch, on disk when `append` returns.

    A line that a crash cut off was never acknowledged, and is left out.

    Parameters
    ----------
    folder : Path
        Made where it is not there.
    most : int
        Size of all files that is not exceeded [bytes]; 890 points at a minute write some 60 MB a day.

    Raises
    ------
    HistorianError
        When the folder cannot be written to, or is full.
    """

    def __init__(self, folder: Path, most: int = 2_000_000_000) -> None:
        self.folder, self.most = folder, most
        folder.mkdir(parents=True, exist_ok=True)
        self._torn = {path for path in self._files() if not path.read_bytes().endswith(b"\n")}

    @property
    def empty(self) -> bool:
        """Whether nothing waits."""
        return not self._files()

    def append(self, samples: Samples) -> None:
        """Keep a batch; it is on disk when this returns.

        Parameters
        ----------
        samples : Samples
            Batch.
        """
        line = (samples.to_line() + "\n").encode()
        files = self._files()
        held = sum(path.stat().st_size for path in files)
        advice = "start the database, or allow more in `historian.spool`"
        HistorianError.unless(held + len(line) <= self.most, "spool", f"at most {self.most} bytes", f"{held}", advice)
        last = files[-1] if files else None
        if last is None or last in self._torn or last.stat().st_size + len(line) > _FILE:
            number = int(last.stem) + 1 if last is not None else 0
            last = self.folder / f"{number:08d}.jsonl"
        try:
            new = not last.exists()
            self._write(last, line)
            if new:
                _sync_folder(self.folder)
        except OSError as error:
            self._torn.add(last)
            raise HistorianError("spool", "a disk that can be written to", str(error)) from error

    def drain(self, write: Callable[[Samples], object]) -> int:
        """Hand all batches on, oldest first, and forget each file whose batches all were taken; count the samples.

        Parameters
        ----------
        write : callable
            Takes a batch; what it raises stops, and what it has not taken stays.
        """
        count = 0
        for path in self._files():
            for line in path.read_bytes().splitlines(keepends=True):
                if line.endswith(b"\n"):
                    batch = Samples.from_line(line.decode())
                    write(batch)
                    count += len(batch)
            path.unlink()
            self._torn.discard(path)
        return count

    def _files(self) -> list[Path]:
        return sorted(self.folder.glob("*.jsonl"))

    def _write(self, path: Path, line: bytes) -> None:
        with path.open("ab", buffering=0) as file:
            written = file.write(line)
            if written != len(line):
                raise OSError(f"{written} of {len(line)} bytes written")
            os.fsync(file.fileno())


def _sync_folder(folder: Path) -> None:
    """Bring a new file's name to disk."""
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
