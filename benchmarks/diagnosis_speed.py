"""CPU time of a diagnosis: the whole command on a folder's case, and on the generated pilot building.

The pilot building has people, lights and equipment that its baseline does not know of, and on top of these the effects
that are listed here. Each case is diagnosed by the command in a process of its own, with one thread.

Run from the repository's root::

    pip install -e .
    python benchmarks/diagnosis_speed.py --case ../shared/cases/practice_everything --out results/diagnosis [--publish]

``--publish`` replaces the table in ``docs/diagnosis_trials.md``.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import subprocess
import sys
import time
from dataclasses import asdict, dataclass
from pathlib import Path

from _code import code
from _table import markdown, write

from mpc.loop.make import PlantSettings, save_pilot
from mpc.loop.noise import SensorNoise
from thermal import load_case
from thermal.effects.catalogue import chosen

NAME = "diagnosis_speed"

#: What the pilot building has beside its people, and how strongly.
EFFECTS = ("internal_gains", "solar_gain", "infiltration")
STRENGTHS = {
    "internal_gain": 10.0, "base_load": 2.0, "solar_heat_gain_coefficient": 0.4, "infiltration_rate": 0.3,
}  # fmt: skip

_COLUMNS = ("case", "zones", "days", "step [min]", "rounds", "first", "MAE [K]", "CPU [s]", "wall [s]")


@dataclass(frozen=True)
class Timing:
    """One diagnosis.

    Parameters
    ----------
    case : str
        Name of the case.
    zones : int
        Of the building.
    days, step : float
        Of the telemetry [d] and [s].
    rounds : int
        Of the search.
    first : str
        Likeliest effect.
    before, after : float
        Held-out mean absolute error of the calibrated model without and with what was accepted [K].
    cpu, wall : float
        Of the process from its start to its end [s].
    """

    case: str
    zones: int
    days: float
    step: float
    rounds: int
    first: str
    before: float
    after: float
    cpu: float
    wall: float

    def row(self) -> list[str]:
        """Lay out its row of the table."""
        return [
            self.case, str(self.zones), f"{self.days:.0f}", f"{self.step / 60.0:.0f}", str(self.rounds), self.first,
            f"{self.before:.3f} → {self.after:.3f}", f"{self.cpu:.0f}", f"{self.wall:.0f}",
        ]  # fmt: skip


def measure(path: Path, out: Path) -> Timing:
    """Diagnose a case by the command.

    Parameters
    ----------
    path : Path
        Case folder.
    out : Path
        Where the page goes.
    """
    quiet = {name: "1" for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")}
    command = [str(Path(sys.executable).with_name("buildingmpc")), "diagnose", str(path), "--out", str(out), "--force"]
    began = time.perf_counter()
    with subprocess.Popen(command, env={**os.environ, **quiet}, stdout=subprocess.DEVNULL) as process:
        _, status, used = os.wait4(process.pid, 0)  # this process alone, not those before it
        process.returncode = os.waitstatus_to_exitcode(status)
    wall = time.perf_counter() - began
    if process.returncode:
        raise SystemExit(f"{path}: expected a diagnosis, the command ended with {process.returncode}")
    answer, case = json.loads((out / "diagnosis.json").read_text(encoding="utf-8")), load_case(path)
    stamps = case.telemetry.frame.index
    step = (stamps[1] - stamps[0]).total_seconds()
    steps = answer["how_far"]
    return Timing(
        path.name, len(case.building.zone_names), len(stamps) * step / 86400.0, step, len(answer["rounds"]),
        answer["which"][0]["effect"], answer["gap"]["mae"],
        steps[-1]["held_out_mae_after"] if steps else answer["gap"]["mae"],
        used.ru_utime + used.ru_stime, wall,
    )  # fmt: skip


def main() -> int:
    """Run the command."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--case", type=Path, action="append", default=[], help="case folder; may be given repeatedly")
    parser.add_argument("--out", type=Path, required=True, help="folder of cases, pages and the table")
    parser.add_argument("--no-pilot", action="store_true", help="leave out the pilot building, which takes minutes")
    parser.add_argument("--publish", action="store_true", help="replace the table between its marks")
    options = parser.parse_args()
    paths = list(options.case)
    options.out.mkdir(parents=True, exist_ok=True)
    if not options.no_pilot:
        paths.append(options.out / "pilot")
        print(f"making {paths[-1]}", flush=True)
        effects = chosen(dict.fromkeys(EFFECTS, ()))
        settings = PlantSettings(dx=0.5, noise=SensorNoise(), effects=effects, parameters=STRENGTHS, seed=3)
        save_pilot(paths[-1], settings=settings, start="2023-04-03", days=21, overwrite=True)
    found = []
    for path in paths:
        print(f"diagnosing {path}", flush=True)
        found.append(measure(path, options.out / f"diagnosis_{path.name}"))
    note = f"Method {code()}. {platform.machine()}, {os.cpu_count()} cores, load average {os.getloadavg()[0]:.1f}.\n"
    table = f"{markdown(_COLUMNS, [f.row() for f in found])}\n{note}"
    write(options.out, NAME, table, [asdict(f) for f in found], options.publish)
    print(table)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
