"""A run of EnergyPlus in a process of its own, from the side of who started it."""

import contextlib
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import threading
import time
import weakref
from collections.abc import Mapping, Sequence
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any, NamedTuple

from mpc.errors import EnergyPlusError

_WORKER = Path(__file__).with_name("worker.py")
_SEVERE = re.compile(r"(\d+) Severe Errors")
_UNSETTLED = "CheckWarmupConvergence"
_GOODBYE = 30.0  # s, for a process that was told to end


@cache
def data_folder() -> Path:
    """Find the data that EnergyPlus' package brings.

    Raises
    ------
    EnergyPlusError
        When it is not installed.
    """
    spec = find_spec("pyenergyplus")
    if spec is None or spec.origin is None:
        advice = "pip install 'buildingmpc[energyplus]'"
        raise EnergyPlusError("EnergyPlus", "the package pyenergyplus-lbnl", "none", advice)
    return Path(spec.origin).parent / "data"


class Job(NamedTuple):
    """What a run reads, and what it may be told.

    Parameters
    ----------
    model : str
        Text of the input file.
    name : str
        File name of it, whose ending says what it is.
    weather : Path
        An ``.epw`` file.
    variables : sequence of tuple of str
        Name and key of each output.
    products : sequence of tuple of int
        Pairs of positions in `variables` whose product is averaged too.
    meters : sequence of str
        Names.
    actuators : sequence of tuple of str
        Component type, control type and key of each.
    options : sequence of str
        Of EnergyPlus' command line.
    stepped : bool
        Whether it waits for a command at each step.
    """

    model: str
    name: str
    weather: Path
    variables: Sequence[tuple[str, str]] = ()
    products: Sequence[tuple[int, int]] = ()
    meters: Sequence[str] = ()
    actuators: Sequence[tuple[str, str, str]] = ()
    options: Sequence[str] = ()
    stepped: bool = True


class EnergyPlusProcess:
    """EnergyPlus, waiting for commands at each step.

    Parameters
    ----------
    job : Job
        What to run.
    patience : float
        Longest time for an answer [s]; the process is ended then.

    Raises
    ------
    EnergyPlusError
        When EnergyPlus is not installed.
    """

    def __init__(self, job: Job, patience: float = 600.0) -> None:
        data_folder()
        self._patience = patience
        self.folder = Path(tempfile.mkdtemp(prefix="buildingmpc-energyplus-"))
        (self.folder / job.name).write_text(job.model, encoding="latin-1")
        paths = {"model": str(self.folder / job.name), "weather": str(job.weather), "out": str(self.output)}
        content, path = {**job._asdict(), **paths}, self.folder / "job.json"
        path.write_text(json.dumps(content), encoding="utf-8")
        environment = os.environ | {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
        with (self.folder / "log.txt").open("w", encoding="utf-8") as log:
            self._process: Any = subprocess.Popen(
                [sys.executable, str(_WORKER), str(path)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=log,
                env=environment, text=True, encoding="utf-8",
            )  # fmt: skip
        self._finalizer = weakref.finalize(self, _end, self._process, self.folder)

    @property
    def output(self) -> Path:
        """Folder of EnergyPlus' own files, while the process is there."""
        return self.folder / "out"

    def ask(self, steps: int, values: Sequence[float | None]) -> Mapping[str, Any]:
        """Let EnergyPlus take some steps.

        Parameters
        ----------
        steps : int
            How many; 0 stops the simulation.
        values : sequence of float or None
            Of the actuators [EnergyPlus' units]; None leaves one to the building.

        Returns
        -------
        mapping
            ``rows``, ``ends`` and ``energy``, one row a step: means of variables and products, their last values, and
            the meters [J].

        Raises
        ------
        EnergyPlusError
            When EnergyPlus breaks off, has not what the job names, or does not answer.
        """
        try:
            self._process.stdin.write(json.dumps({"steps": steps, "values": list(values)}) + "\n")
            self._process.stdin.flush()
        except (OSError, ValueError) as error:
            self._fail(f"its process is gone ({error})")
        return self._answer("rows")

    def finish(self) -> None:
        """Wait for the end of the run and check it.

        Raises
        ------
        EnergyPlusError
            When it did not end well, with severe errors, or not at all.
        """
        self._answer("done")
        self.check()

    def check(self) -> None:
        """Read the end file: EnergyPlus returns 0 with severe errors too.

        Zones that swing from warm-up day to warm-up day without end are no error of the run: each begins after days
        under the building's own control, which forget where they started.
        """
        path = self.output / "eplusout.end"
        said = path.read_text(encoding="latin-1").strip() if path.exists() else "no end file"
        severe = _SEVERE.search(said)
        unsettled = sum(_UNSETTLED in line for line in _severe(self.output / "eplusout.err"))
        if severe is None or int(severe[1]) > unsettled or "Successfully" not in said:
            self._fail(said)

    def close(self) -> None:
        """End the process and remove its folder; can be called twice."""
        self._finalizer()

    def _answer(self, kind: str) -> Mapping[str, Any]:
        began, timer = time.monotonic(), threading.Timer(self._patience, self._process.kill)
        timer.start()
        line = self._process.stdout.readline()
        timer.cancel()
        if not line and time.monotonic() - began >= self._patience:
            self.close()
            expected = f"an answer within {self._patience:g} s"
            raise EnergyPlusError("EnergyPlus", expected, "none", "its process was ended")
        message: dict[str, Any] = json.loads(line or "{}")
        if kind not in message:
            self._fail(_reason(message))
        return message

    def _fail(self, found: str) -> None:
        errors = _errors(self.output / "eplusout.err", self.folder / "log.txt")
        self.close()
        raise EnergyPlusError("EnergyPlus", "a run without severe errors", f"{found}{errors}")


def run_energyplus(job: Job, read: Sequence[str]) -> dict[str, bytes]:
    """Run EnergyPlus by itself and read some of its files.

    Parameters
    ----------
    job : Job
        What to run.
    read : sequence of str
        Names of files in its output folder.

    Returns
    -------
    dict of str to bytes
        Content of each.

    Raises
    ------
    EnergyPlusError
        When the run failed, or there is no such file.
    """
    process = EnergyPlusProcess(job)
    try:
        if "--convert-only" in job.options:
            process._answer("done")
        else:
            process.finish()
        missing = [name for name in read if not (process.output / name).is_file()]
        if missing:
            process._fail(f"no file {missing[0]}")
        return {name: (process.output / name).read_bytes() for name in read}
    finally:
        process.close()


def _end(process: Any, folder: Path) -> None:
    """End a process and remove its folder."""
    with contextlib.suppress(OSError):
        process.stdin.close()
    process.kill()
    with contextlib.suppress(subprocess.TimeoutExpired):
        process.wait(_GOODBYE)
    process.stdout.close()
    shutil.rmtree(folder, ignore_errors=True)


def _reason(message: Mapping[str, Any]) -> str:
    if "missing" in message:
        return "no handle for " + "; ".join(f"{kind}: {names[:5]}" for kind, names in message["missing"].items())
    if "broken" in message:
        return str(message["broken"])
    return f"an early end with code {message['done']}" if "done" in message else "a process that died"


def _errors(path: Path, log: Path) -> str:
    """First severe or fatal error that EnergyPlus wrote, else the last line of what the process said."""
    told = [line for line in _severe(path) if _UNSETTLED not in line] or _severe(path)
    told = told or (log.read_text(encoding="utf-8", errors="replace").splitlines()[-1:] if log.is_file() else [])
    return ": " + " ".join(told[0].strip(" *").split()) if told else ""


def _severe(path: Path) -> list[str]:
    """Lines of severe and fatal errors in EnergyPlus' error file; none where there is no file."""
    lines = path.read_text(encoding="latin-1").splitlines() if path.is_file() else []
    return [line for line in lines if "** Severe" in line or "**  Fatal" in line]
