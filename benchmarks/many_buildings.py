"""Calibration of 40 buildings over one and two processes, with and without a killed worker, beside a standard pool.

The cases are generated offices (seeds 0 to 39: one floor of 300 m2, 6 zones, 1 m between volumes, a week at fifteen
minutes, made before the clock starts). Each is calibrated and written by a worker of `calibration.calibrate_many` with
one thread of linear algebra; workers stay alive from case to case. The start of the workers is in the wall time.

In the runs with a kill, a worker in the middle of a case is ended by SIGKILL when half of the cases are done. The same
cases then go over `concurrent.futures.ProcessPoolExecutor`, which breaks as a whole when a worker dies. A case is lost
when the run ends without its results; what differs are held-out errors that are not those of the first run.

The bound of the speed-up is measured beside it: two processes that do nothing but arithmetic, against one. What other
programs took meanwhile (from ``/proc/stat``) is listed: a speed-up means something where that is next to nothing.

Run: ``python benchmarks/many_buildings.py --out results/many [--publish]``; eight minutes on two quiet cores. Writes
``many_buildings.json`` and ``.md``; with ``--publish`` also the table between its marks.
"""

from __future__ import annotations

import argparse
import os
import resource
import signal
import tempfile
import time
from collections.abc import Callable
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import AbstractContextManager, nullcontext
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from _table import markdown, write

from calibration import calibrate_many
from calibration.fleet.outcome import CaseOutcome
from calibration.fleet.run import case_folders
from mpc.reports.calibration import calibration_files
from thermal.pilot.building import PilotSettings, generate_pilot

BUILDINGS = 40
OFFICE: dict[str, Any] = {
    "floor_area": 300.0, "zones": 6, "floors": 1, "cell_size": 1.0, "days": 7.0, "spin_up_days": 1.0,
    "step_seconds": 900.0,
}  # fmt: skip
ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
COLUMNS = (
    "run", "wall [s]", "times as fast", "CPU [s]", "cores taken by others", "finished", "lost", "differ", "begun twice",
)  # fmt: skip


class Kill:
    """A progress that ends one worker in the middle of a case when half of the cases are done."""

    def __init__(self, out: Path) -> None:
        self.out, self.killed = out, 0

    def __call__(self, stage: str, done: int, total: int) -> None:
        """Look after each case."""
        if 2 * done >= total and not self.killed:
            self.killed = self._busy()
            os.kill(self.killed, signal.SIGKILL)

    def _busy(self) -> int:
        """Wait for a worker in the middle of a case: a run notes the host and process of each that begins."""
        while True:
            for starts in self.out.glob(".running/*/*.starts"):
                if not (self.out / starts.stem).exists():
                    return int(starts.read_text(encoding="utf-8").split()[-1])
            time.sleep(0.01)


def arithmetic(count: int) -> int:
    """Keep a core busy, in no need of memory."""
    total = 0
    for number in range(count):
        total += number & 3
    return total


def measure_bound(count: int = 30_000_000) -> float:
    """Measure how many times as much two processes do at once as one does alone."""
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as pool:
        list(pool.map(arithmetic, (1000, 1000)))  # both are there
        alone = wall_of(lambda: pool.submit(arithmetic, count).result())
        both = wall_of(lambda: list(pool.map(arithmetic, (count, count))))
    return 2.0 * alone / both


def wall_of(function: Callable[[], object]) -> float:
    """Wall time of a call [s]."""
    began = time.perf_counter()
    function()
    return time.perf_counter() - began


def measure(
    cases: Path, name: str, workers: int, kill: bool, pool: AbstractContextManager[Executor | None]
) -> dict[str, Any]:
    """Run over all the cases; wall time, CPU time of the workers, and what came of each case."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "results"
        wall, cpu, busy = time.perf_counter(), own_seconds(), machine_seconds()
        with pool as executor:
            outcomes = calibrate_many(
                case_folders(cases), out, files=calibration_files, workers=executor or workers,
                progress=Kill(out) if kill else None,
            )  # fmt: skip
        wall = time.perf_counter() - wall
        cpu, busy = own_seconds() - cpu, machine_seconds() - busy
        kept = {o.case for o in outcomes if (out / o.case / "calibration.json").is_file()}
        others = max(0.0, busy - cpu) / wall
        measured = {"run": name, "workers": workers, "wall": wall, "cpu": cpu, "others": others}
        return measured | summary(outcomes, kept)


def own_seconds() -> float:
    """CPU time of this process and of those of its children that have ended [s]."""
    usages = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(usage.ru_utime + usage.ru_stime for usage in usages)


def machine_seconds() -> float:
    """CPU time of everything on the machine [s]."""
    user, nice, system = Path("/proc/stat").read_text(encoding="ascii").split(maxsplit=4)[1:4]
    return (int(user) + int(nice) + int(system)) / os.sysconf("SC_CLK_TCK")


def summary(outcomes: tuple[CaseOutcome, ...], kept: set[str]) -> dict[str, Any]:
    """Count what came of the cases."""
    return {
        "finished": len(kept),
        "not_converged": sum(o.status == "not_converged" for o in outcomes),
        "lost": len(outcomes) - len(kept),
        "begun_twice": sum(o.attempts > 1 for o in outcomes),
        "seconds": {o.case: o.seconds for o in outcomes},
        "held_out_mae": {o.case: o.held_out_mae_after for o in outcomes if o.case in kept},
    }


def cells(row: dict[str, Any], first: dict[str, Any]) -> list[Any]:
    """Lay out one line of the table; a run that lost cases has no speed."""
    differ = sum(first["held_out_mae"].get(case) != mae for case, mae in row["held_out_mae"].items())
    speed = "–" if row["lost"] else f"{first['wall'] / row['wall']:.2f}"
    return [
        row["run"], f"{row['wall']:.0f}", speed, f"{row['cpu']:.0f}", f"{row['others']:.2f}", row["finished"],
        row["lost"], differ, row["begun_twice"],
    ]  # fmt: skip


def standard_library() -> ProcessPoolExecutor:
    """Make the peer: as many processes, each with one thread of linear algebra from the environment."""
    return ProcessPoolExecutor(2, mp_context=get_context("spawn"))


def main() -> None:
    """Make the cases, measure every run and write the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, required=True, help="folder of the results")
    parser.add_argument("--buildings", type=int, default=BUILDINGS, help="how many")
    parser.add_argument("--publish", action="store_true", help="replace the table between its marks")
    options = parser.parse_args()
    os.environ.update(dict.fromkeys(ONE_THREAD, "1"))  # for the peer's processes
    load = os.getloadavg()[0]
    with tempfile.TemporaryDirectory() as folder:
        cases = Path(folder)
        for seed in range(options.buildings):
            generate_pilot(cases / f"office_{seed:02d}", PilotSettings(name=f"office_{seed:02d}", **OFFICE), seed=seed)
        rows = [
            measure(cases, "1 process", 1, False, nullcontext()),
            measure(cases, "2 processes", 2, False, nullcontext()),
            measure(cases, "2 processes, one killed", 2, True, nullcontext()),
            measure(cases, "2 of `ProcessPoolExecutor`", 2, False, standard_library()),
            measure(cases, "2 of `ProcessPoolExecutor`, one killed", 2, True, standard_library()),
        ]
    bound = measure_bound()
    mean = sum(rows[0]["seconds"].values()) / options.buildings
    table = markdown(COLUMNS, [cells(row, rows[0]) for row in rows])
    note = (
        f"{options.buildings} cases of {mean:.1f} s each in one process. Bound: {bound:.2f} times as fast, from two "
        f"processes of arithmetic alone. {os.cpu_count()} cores, load average {load:.1f} before.\n"
    )
    data = {"office": OFFICE, "bound": bound, "load": load, "cores": os.cpu_count(), "rows": rows}
    write(options.out, "many_buildings", f"{table}\n{note}", data, options.publish)
    print(table, note, sep="\n")


if __name__ == "__main__":
    main()
