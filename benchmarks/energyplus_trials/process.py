"""Runs EnergyPlus in a process of its own, and checks how the run ended."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from energyplus_trials.errors import EnergyPlusRunError
from energyplus_trials.frame import Objects

#: Files of a run's folder: weather, and series of driven schedules.
WEATHER, DRIVE = "in.epw", "drive.npz"


def run_worker(folder: Path, worker: Path, objects: Objects, job: Mapping[str, Any], name: str) -> list[str]:
    """Run EnergyPlus in a process of its own, and return what it warned of.

    Parameters
    ----------
    folder : Path
        With `WEATHER` and `DRIVE`; what is made goes there, too.
    worker : Path
        The process: it reads its job, and writes its result.
    objects : dict
        EnergyPlus' input.
    job : mapping
        What the worker is told beside its files.
    name : str
        Of the trial.

    Raises
    ------
    EnergyPlusRunError
        It stopped, or had severe errors.
    """
    (folder / "in.epJSON").write_text(json.dumps(objects), encoding="utf-8")
    files = {"input": "in.epJSON", "weather": WEATHER, "out": "out", "drive": DRIVE}
    told = {key: str(folder / file) for key, file in files.items()} | dict(job)
    (folder / "job.json").write_text(json.dumps(told), encoding="utf-8")
    done = subprocess.run(
        [sys.executable, str(worker), str(folder / "job.json")],
        env=os.environ | {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}, capture_output=True, text=True,
    )  # fmt: skip
    end, log = (
        path.read_text(encoding="utf-8", errors="replace") if path.exists() else ""
        for path in (folder / "out" / "eplusout.end", folder / "out" / "eplusout.err")
    )
    severe = re.search(r"(\d+) Severe Errors", end)
    if done.returncode != 0 or "Completed Successfully" not in end or severe is None or int(severe[1]) != 0:
        said = "\n".join(line for line in log.splitlines() if "Severe" in line or "Fatal" in line or "~~~" in line)
        raise EnergyPlusRunError(
            f"{name}: expected a run without severe errors, EnergyPlus returned {done.returncode}: "
            f"{end.strip() or 'no end file'}\n{said[:3000]}\n{done.stderr[-2000:]}"
        )
    return [part[2].strip() for part in (line.partition("** Warning **") for line in log.splitlines()) if part[1]]
