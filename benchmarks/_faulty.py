"""A file system that fails now and then, and keeps a log of what workers begin and finish: for chaos runs.

Importing the module makes the protocol ``faulty://`` known; `calibration_files` and `diagnosis_files` are those of the
library, so that a worker that is given a job with them imports it.
"""

from __future__ import annotations

import os
import random
import time
from pathlib import Path
from typing import Any

import fsspec
from fsspec.implementations.local import LocalFileSystem

from calibration.fleet.diagnose import diagnosis_data
from calibration.fleet.job import data_files
from calibration.fleet.outcome import RECORD

#: Environment: file of the log, and share of writes that fail [-].
LOG, SHARE = "FAULTY_LOG", "FAULTY_SHARE"


class FaultyFileSystem(LocalFileSystem):
    """Local files, of which some writes fail half-way."""

    protocol = "faulty"

    @classmethod
    def _strip_protocol(cls, path: Any) -> Any:
        return super()._strip_protocol(str(path).removeprefix("faulty://"))

    def pipe_file(self, path: str, value: bytes, mode: str = "overwrite", **kwargs: Any) -> None:
        """Write a file, or half of it and then fail."""
        if random.random() < float(os.environ.get(SHARE, "0")):
            super().pipe_file(path, value[: len(value) // 2], mode, **kwargs)
            log("failed", path)
            raise OSError(f"{path}: a fault that was asked for")
        super().pipe_file(path, value, mode, **kwargs)
        log("wrote", path)

    def mv(self, path1: str, path2: str, **kwargs: Any) -> None:
        """Move a file to its place, and write down what that means."""
        super().mv(path1, path2, **kwargs)
        parts = Path(path2).parts
        if ".begun" in parts:
            log("begun", parts[-2])
        elif parts[-1] == RECORD:
            log("done", parts[-2])


def log(event: str, what: str) -> None:
    """Add a line to the log: time, process, event, and what; one write, which the system does not mix with others."""
    if LOG in os.environ:
        with Path(os.environ[LOG]).open("a", encoding="utf-8") as stream:
            stream.write(f"{time.time():.3f} {os.getpid()} {event} {what}\n")


def calibration_files(result: Any, case: Any) -> Any:
    """Files of a calibration."""
    return data_files(result, case)


def diagnosis_files(result: Any, case: Any) -> Any:
    """Files of a diagnosis."""
    return diagnosis_data(result, case)


fsspec.register_implementation("faulty", FaultyFileSystem, clobber=True)
