"""A fleet of small buildings calibrated and diagnosed while workers and schedulers are killed and writes fail.

The buildings are generated offices (one floor of 80 m2, 2 zones, 2 m between volumes, a week at half an hour, our own
model as plant) whose true parameters are drawn. The fleet is calibrated and diagnosed twice: by two local processes,
undisturbed; and by two workers of a dask cluster (nanny limit 1.5 GB), of which those that hold a case are killed by
SIGKILL at random moments (at least 30 % of all that ever live), while the scheduler is killed once in the calibrations
and once in the diagnoses, and 5 % of all writes fail half-way. Whatever is gone is started again, as a cluster's
supervisor does; the run is one call of `do_fleet` a job.

A case is lost when the run ends without its results. Work done twice is the time of attempts whose worker died or that
came second, over that of the attempts that gave the results; a restart of the processes is not in it. The tables of
both runs are compared bit by bit, but for `runs`, which holds times.

Run: ``python benchmarks/fleet_chaos.py --out results/chaos [--buildings 1000] [--work FOLDER] [--publish]``. A run that
was interrupted goes on with the same ``--work``. Writes ``fleet_chaos.json`` and ``.md``.
"""

from __future__ import annotations

import argparse
import os
import random
import resource
import shutil
import socket
import tempfile
import time
from pathlib import Path
from typing import Any

import _faulty
import pyarrow.parquet as pq
from _chaos import Cluster, attempts, chaos, environment, read_log
from _fleet import make_office
from _table import markdown, write

from calibration.fleet.cluster import ClusterExecutor
from calibration.fleet.data_set import TABLES
from calibration.fleet.diagnose import diagnosis_job
from calibration.fleet.handling import Handling
from calibration.fleet.job import Job, calibration_job
from calibration.fleet.remote import do_fleet
from calibration.fleet.store import Store

WORKERS = 2
SETTINGS: dict[str, dict[str, Any]] = {"calibrate": {"horizon": "6h"}, "diagnose": {"horizon": "6h"}}
FAILING = 0.05  # share of writes
LEAST_KILLED = 0.3  # share of the workers that ever live
CORE_HOUR = 0.05  # USD, about the list price of an hour of a virtual core on demand; for the last column alone
RETRIES = 6  # of a case whose worker died: these die by no fault of the case
COLUMNS = (
    "run", "buildings", "lost", "workers that lived", "killed", "schedulers killed", "writes failed",
    "work done twice", "tables that differ", "CPU a building [s]", "largest worker [MB]",
)  # fmt: skip


def jobs() -> dict[str, Job]:
    """Jobs in order, with files whose module makes the faulty protocol known to workers."""
    made = {"calibrate": calibration_job(_faulty.calibration_files), "diagnose": diagnosis_job(_faulty.diagnosis_files)}
    return {name: made[name] for name in SETTINGS}


def undisturbed(cases: Path, out: Path) -> dict[str, Any]:
    """Calibrate and diagnose with local processes."""
    lost, cpu = 0, child_seconds()
    for name, job in jobs().items():
        found = do_fleet(job, f"file://{cases}", f"file://{out / name}", SETTINGS[name], Handling(WORKERS))
        lost += len(found.troubled)
    return {"lost": lost, "cpu": child_seconds() - cpu} | peak_memory(out)


def disturbed(cases: Path, out: Path, kills: int, seed: int) -> dict[str, Any]:
    """Calibrate and diagnose with a cluster that is killed again and again."""
    rng, books = random.Random(seed), []
    lost = 0
    for name, job in jobs().items():
        log = out / f"{name}.log"
        log.parent.mkdir(parents=True, exist_ok=True)
        os.environ.update({_faulty.LOG: str(log), _faulty.SHARE: str(FAILING)})  # the driver's own writes fail too
        count = sum(1 for _ in Store(f"file://{cases}").folders())
        there = sum(e.event == "done" for e in read_log(log))
        at = [there + rng.randrange(max(1, count - there)) for _ in range(kills)]
        cluster = Cluster(out, WORKERS, free_port(), environment(log, FAILING))
        with chaos(cluster, log, at, [there + rng.randrange(max(1, count - there))], seed) as thread:
            with ClusterExecutor(cluster.address, timeout=120.0, patience=300.0) as executor:
                urls = f"file://{cases}", f"faulty://{out / name}"
                found = do_fleet(job, *urls, SETTINGS[name], Handling(executor, RETRIES))
        lost += len(found.troubled)
        books.append((read_log(log), thread))
    return {"lost": lost} | peak_memory(out) | summed(books)


def summed(books: list[tuple[Any, Any]]) -> dict[str, Any]:
    """Sum what the logs say."""
    total: dict[str, Any] = dict.fromkeys(("workers", "killed", "schedulers", "failed_writes", "again", "first"), 0)
    for entries, thread in books:
        tried = list(attempts(entries, thread.gone))
        total["workers"] += len({process for process, *_ in tried})
        total["killed"] += len(thread.killed)
        total["schedulers"] += thread.schedulers
        total["failed_writes"] += sum(e.event == "failed" for e in entries)
        total["again"] += sum(span for *_, span, first in tried if not first)
        total["first"] += sum(span for *_, span, first in tried if first)
    return total | {"twice": total["again"] / total["first"]}


def peak_memory(out: Path) -> dict[str, float]:
    """Largest memory of a worker up to the end of one of its cases [MB]."""
    paths = sorted(out.glob(f"*/{TABLES}/runs/*.parquet"))
    return {"memory": max(max(pq.read_table(path)["memory"].to_pylist()) for path in paths)}


def differing(one: Path, other: Path) -> list[str]:
    """Name the parts of the tables that are not the same bit by bit."""
    def parts(out: Path) -> dict[str, bytes]:
        found = (p for p in sorted(out.glob(f"*/{TABLES}/*/*.parquet")) if p.parent.name != "runs")
        return {p.relative_to(out).as_posix(): p.read_bytes() for p in found}

    a, b = parts(one), parts(other)
    return [name for name in sorted(a.keys() | b.keys()) if a.get(name) != b.get(name)]


def child_seconds() -> float:
    """CPU time of processes that this one had and that have ended [s]."""
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def free_port() -> int:
    """Find a port for the scheduler."""
    with socket.socket() as there:
        there.bind(("127.0.0.1", 0))
        return int(there.getsockname()[1])


def make_fleet(folder: Path, count: int) -> None:
    """Make the buildings that are not there yet."""
    for seed in range(count):
        if not (folder / f"office_{seed:05d}").exists():
            make_office(folder / f"office_{seed:05d}", seed)


def measure(work: Path, buildings: int, kills: int, seed: int) -> dict[str, Any]:
    """Make the fleet, run it both ways, and compare."""
    cases = work / "cases"
    make_fleet(cases, buildings)
    began = time.perf_counter()
    calm = undisturbed(cases, work / "undisturbed")
    wall = time.perf_counter() - began
    stormy = disturbed(cases, work / "disturbed", kills, seed)
    differ = differing(work / "undisturbed", work / "disturbed")
    return {"buildings": buildings, "undisturbed": calm, "disturbed": stormy, "differ": differ, "wall": wall}


def rows(found: dict[str, Any]) -> list[list[Any]]:
    """Lay out the table."""
    n, calm, stormy = found["buildings"], found["undisturbed"], found["disturbed"]
    return [
        ["undisturbed", n, calm["lost"], "–", 0, 0, 0, "–", "–", f"{calm['cpu'] / n:.1f}", f"{calm['memory']:.0f}"],
        [
            "disturbed", n, stormy["lost"], stormy["workers"], stormy["killed"], stormy["schedulers"],
            stormy["failed_writes"], f"{100.0 * stormy['twice']:.1f} %", len(found["differ"]), "–",
            f"{stormy['memory']:.0f}",
        ],
    ]  # fmt: skip


def main() -> None:
    """Run and write the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, required=True, help="folder of the results")
    parser.add_argument("--buildings", type=int, default=1000, help="how many")
    parser.add_argument("--kills", type=int, default=0, help="workers killed a job; default: one in a hundred cases")
    parser.add_argument("--work", type=Path, help="folder of cases and answers, to go on with; default: one that goes")
    parser.add_argument("--seed", type=int, default=0, help="of what goes wrong")
    parser.add_argument("--publish", action="store_true", help="replace the table between its marks")
    options = parser.parse_args()
    load = os.getloadavg()[0]
    work = (options.work or Path(tempfile.mkdtemp(prefix="chaos-"))).absolute()
    kills = options.kills or max(2, options.buildings // 100)
    try:
        found = measure(work, options.buildings, kills, options.seed)
    finally:
        if options.work is None:
            shutil.rmtree(work, ignore_errors=True)
    each = found["undisturbed"]["cpu"] / options.buildings
    hours = 1e5 * each / 3600.0
    share = found["disturbed"]["killed"] / found["disturbed"]["workers"]
    note = (
        f"{100 * share:.0f} % of the workers that ever lived were killed (at least {100 * LEAST_KILLED:.0f} % are "
        f"asked for). A building costs {each:.1f} s of CPU, calibrated and diagnosed: 1,000 of them "
        f"{1e3 * each / 3600.0 / WORKERS:.1f} h on two quiet cores, 100,000 of them {hours:.0f} core hours, at "
        f"{CORE_HOUR} USD each {hours * CORE_HOUR:.0f} USD, in {hours / 200.0:.1f} h on 200 cores. Load average "
        f"{load:.1f} before.\n"
    )
    table = markdown(COLUMNS, rows(found))
    write(options.out, "fleet_chaos", f"{table}\n{note}", found | {"load": load}, options.publish)
    print(table, note, sep="\n")


if __name__ == "__main__":
    main()
