"""Operation under faults: what the guard writes, gives back and loses, over real BACnet/IP to a simulated site.

The site is a building of two zones behind a BACnet/IP device of the stack rusty-bacnet (`_bacnet_site.py`), which the
collector, controller and guard, each a process, reach by bacpypes3 through a wire that keeps a journal of every write;
PostgreSQL is the historian. A clock runs 200 times faster than real time: a control step of 5 minutes takes 1.5 s. A
drill waits until both setpoints are ours, makes a fault of its seed, counts, heals it, and waits until they are ours
again. What is counted comes from the device and the wire, not from the guard:

- writes outside of the white list, of the priority, or of range and rate;
- operators' commands that were changed, or not left alone within a control step;
- points not given back within a control step: of the fault, or, where nobody can give anything back before (guard
  killed, network cut, releases refused), of its end; of a sensor that stands still, of the time at which it counts as
  failed;
- lines of the guard's and the controller's logs that do not replay, and samples that were acknowledged, committed or
  spooled, and are not in the database at the end.

Drills come in pieces of at most 50, each a seed and a site of its own; sites run side by side as drills mostly
wait: one takes about 3.5 s and one second of CPU. A run that is interrupted goes on with what is not there.

Run: ``python benchmarks/live_drills.py --drills 1000 --sites 3 --out results/drills --publish``.
Writes ``live_drills.json`` and ``.md``. Needs the extra ``[live]``, PostgreSQL, and ``pip install rusty-bacnet``.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import random
import shutil
import signal
import tempfile
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import pandas as pd
from _bacnet_device import LOOK, Write
from _bacnet_site import OWN
from _drill_faults import FAULTS, Fault
from _drill_process import DrillController
from _drill_stack import HIGH, LOW, RATE, RATES, STEP, TICK, Stack
from _table import markdown, write

from mpc.live.audit import log_files, read_log
from mpc.live.historian.store import Historian
from mpc.live.planner import Planner
from mpc.live.replay import replay_logs
from mpc.live.site import Site

#: Control steps within which a healed site must act again, a part that starts among them; else it counts as not back.
BACK = 60.0

#: Drills of a piece, at most.
PIECE = 50

#: Differences that clocks of two processes and single precision explain: of a rate's time [s], and of a value [K].
LATE, ROUND = 30.0, 1e-3


@dataclass
class Drill:
    """What came of one."""

    number: int
    fault: str
    bad_writes: list[str] = field(default_factory=list)
    overridden: list[str] = field(default_factory=list)
    late: list[str] = field(default_factory=list)
    needless: list[str] = field(default_factory=list)
    not_back: bool = False
    steps: float | None = None
    begin: float = 0.0


def bad_writes(journal: list[Write]) -> list[tuple[float, str]]:
    """Say which writes on the wire are outside of what the site allows, and when."""
    found, last = list[tuple[float, str]](), dict[int, tuple[float, float]]()
    for one in journal:
        kind, number = one.object
        if (kind, one.property, one.priority) != (2, 85, 13) or number not in (1, 2):
            found.append((one.time, f"object {one.object}, property {one.property}, priority {one.priority}"))
            continue
        if one.value is None:
            last.pop(number, None)
            continue
        if not LOW - ROUND <= one.value <= HIGH + ROUND:
            found.append((one.time, f"point {number} at {one.value}"))
        rate = RATES[number - 1]
        when, value = last.get(number, (one.time - TICK / RATE, min(max(OWN, LOW), HIGH)))
        most = rate * (RATE * (one.time - when) + LATE) / 3600.0
        if rate and abs(one.value - value) > most + ROUND:
            told = f"point {number} from {value} to {one.value} in {RATE * (one.time - when):.0f} s"
            found.append((one.time, told))
        if one.answered:
            last[number] = (one.time, one.value)
    return found


def drill(stack: Stack, number: int, name: str, rng: random.Random) -> Drill:
    """Run one."""
    fault, found = FAULTS[name], Drill(number, name)
    if stack.wait(stack.acting, BACK) is None:
        found.not_back = True
        return found
    found.begin = time.monotonic()
    begin = fault.make(stack, rng)
    if fault.released and not fault.healed_first:
        _released(stack, found, begin)
    elif not fault.released:
        _kept(stack, found, fault, begin or time.monotonic())
    commands = {key: value for key, value in stack.building.now.items() if key[1] != 13}
    given = stack.building.commands
    found.overridden += [
        f"point {key[0]} at priority {key[1]}: {given.get(key)} became {commands.get(key)}"
        for key in sorted(set(given) | set(commands))
        if abs(given.get(key, 1e9) - commands.get(key, -1e9)) > ROUND
    ]
    healed = fault.heal(stack, rng)
    if fault.healed_first:
        _released(stack, found, healed)
    found.not_back = stack.wait(stack.acting, BACK) is None
    return found


def _released(stack: Stack, found: Drill, begin: float | None) -> None:
    """See that both points are given back within a control step of a time."""
    start = time.monotonic() if begin is None else begin
    done = stack.wait(lambda: all(_free(stack, point, start) for point in (1, 2)), 4.0)
    if done is None:
        found.late.append(f"points {sorted(stack.building.held(13))} were not given back within four control steps")
        return
    times = [_free(stack, point, start) or start for point in (1, 2)]
    found.steps = max(max(times) - start, 0.0) * RATE / STEP
    if found.steps > 1.0 + 2.0 * LOOK * RATE / STEP:
        found.late.append(f"after {found.steps:.2f} control steps")


def _free(stack: Stack, point: int, start: float) -> float | None:
    """Find when a point was given back first after a time; that time itself where it was not ours then."""
    ours = None
    for slot in list(stack.building.slots):
        if slot.point != point or slot.priority != 13:
            continue
        if slot.time >= start and slot.value is None:
            return slot.time
        if slot.time < start:
            ours = slot.value
    return start if ours is None else None


def _kept(stack: Stack, found: Drill, fault: Fault, begin: float) -> None:
    """See that an operator's point is left alone within a control step, and that the others stay ours."""
    stack.wait(lambda: False, 1.0 - (time.monotonic() - begin) * RATE / STEP)
    commanded = {point for point, priority in stack.building.now if priority != 13}
    fought = set(stack.building.held(13)) & commanded
    found.overridden += [f"point {point} is still ours beside an operator's command" for point in fought]
    lost = {1, 2} - commanded - set(stack.building.held(13))
    found.needless += [f"point {point} was given back without need" for point in sorted(lost)]


def check_logs(stack: Stack) -> tuple[int, int, list[str]]:
    """Repeat all logs of guard and controller; lines, decisions, and what does not repeat."""
    lines, decisions, wrong = 0, 0, list[str]()
    for path, one in replay_logs(log_files(stack.site.folder, "guard")).items():
        lines, decisions = lines + one.lines, decisions + one.decisions
        wrong += [f"{path.name}: {text}" for text in [one.broken, *one.different] if text]
    planner, before = Planner(Site(stack.site_path), DrillController()), None
    for path in log_files(stack.site.folder, "controller"):
        for at, entry in read_log(path, before):
            lines, before = lines + 1, entry["hash"]
            if entry["kind"] != "plan":
                continue
            decisions += 1
            again = planner.plan(entry["content"]["inputs"])
            if any(entry["content"]["plan"][key] != value for key, value in again.items()):
                wrong.append(f"{path.name}: line {at}: another plan")
    return lines, decisions, wrong


def check_samples(stack: Stack) -> tuple[int, int]:
    """Count the samples that the collector acknowledged, and those of them that the database lacks."""
    reads = [e["content"] for e in stack.events("collector") if e["kind"] == "read"]
    reads = [r for r in reads if r["where"] in ("committed", "spooled")]
    names = list(stack.site.file.points)
    stamps = [round(1e6 * r["time"]) for r in reads]
    ends = [pd.Timestamp(t, unit="us", tz="UTC") for t in (min(stamps) - 10**6, max(stamps) + 10**6)]
    with Historian(stack.database.address, patience=60.0) as historian:
        table = historian.read([n for n in names if n in set(historian.points()["name"])], *ends)
    there: dict[int, int] = {}
    for stamp in table.index:
        there[round(stamp.value / 1000)] = there.get(round(stamp.value / 1000), 0) + 1
    lost = sum(r["samples"] for r, stamp in zip(reads, stamps, strict=True) if not there.get(stamp))
    return sum(r["samples"] for r in reads), lost


def run_drills(count: int, seed: int, folder: Path, only: str = "", told: Any = print) -> dict[str, Any]:
    """Run drills of a seed, faults in turn and in an order of the seed."""
    rng, drills = random.Random(seed), list[Drill]()
    names = [name for name in FAULTS if any(part in name for part in only.split(","))]
    order: list[str] = []
    while len(order) < count:
        order += rng.sample(names, len(names))
    used = time.process_time()
    stack = Stack(folder, seed)
    began = time.monotonic()
    try:
        stack.start("guard", "collector", "controller")
        for number, name in enumerate(order[:count]):
            drills.append(drill(stack, number, name, random.Random(f"{seed} {number}")))
            one = drills[-1]
            problems = one.overridden + one.late + one.needless + ["not back"] * one.not_back
            told(f"{number:4d} {name}: {'-' if one.steps is None else f'{one.steps:.2f} steps'} {problems or ''}")
            if one.not_back:
                break
        stack.wait(lambda: False, 3.0)
        for part in ("controller", "guard", "collector"):
            stack.signal(part, signal.SIGTERM)
        samples, lost = check_samples(stack)
        wall = time.monotonic() - began
    finally:
        stack.close()
    for when, told_of in bad_writes(stack.building.wire.journal):
        last = max((one for one in drills if one.begin <= when), key=lambda one: one.begin, default=drills[0])
        last.bad_writes.append(told_of)
    lines, decisions, wrong = check_logs(stack)
    return {
        "seed": seed, "drills": [asdict(one) for one in drills], "samples": samples, "lost": lost, "lines": lines,
        "decisions": decisions, "not_replayed": wrong, "wall": wall, "cpu": stack.cpu + time.process_time() - used,
        "writes": sum(w.answered for w in stack.building.wire.journal),
    }  # fmt: skip


def run_piece(piece: tuple[int, int, Path, str, bool]) -> None:
    """Run the drills of a seed, and write down what came of them."""
    seed, count, path, only, keep = piece
    top = Path(tempfile.mkdtemp(prefix="drills"))
    top.chmod(0o755)  # the user of the database must get there
    found = run_drills(count, seed, top / "site", only, lambda text: print(f"{seed}: {text}", flush=True))
    fresh = path.with_suffix(".part")
    fresh.write_text(json.dumps(found), encoding="utf-8")
    fresh.replace(path)
    if keep:
        print(top)
    else:
        shutil.rmtree(top, ignore_errors=True)


def run_pieces(count: int, seed: int, out: Path, only: str = "", sites: int = 1, keep: bool = False) -> dict[str, Any]:
    """Run what is not there yet of so many drills, and put all together."""
    folder = out / "pieces"
    folder.mkdir(parents=True, exist_ok=True)
    most = min(PIECE, -(-count // sites))
    sizes = [min(most, count - begin) for begin in range(0, count, most)]
    pieces = [(seed + k, size, folder / f"{seed + k}_{size}.json", only, keep) for k, size in enumerate(sizes)]
    with ProcessPoolExecutor(sites, max_tasks_per_child=1) as pool:
        list(pool.map(run_piece, [piece for piece in pieces if not piece[2].exists()]))
    return together([json.loads(piece[2].read_text(encoding="utf-8")) for piece in pieces], sites)


def together(parts: list[dict[str, Any]], sites: int) -> dict[str, Any]:
    """Put pieces together."""
    found = {key: sum(part[key] for part in parts) for key in ("samples", "lost", "lines", "decisions", "wall", "cpu",
                                                              "writes")}  # fmt: skip
    drills = [one | {"seed": part["seed"]} for part in parts for one in part["drills"]]
    wrong = [f"seed {part['seed']}: {text}" for part in parts for text in part["not_replayed"]]
    return found | {"seeds": [part["seed"] for part in parts], "drills": drills, "not_replayed": wrong, "sites": sites}


def report(found: dict[str, Any]) -> str:
    """Write the table by fault, each failure, and what is counted over all."""
    drills, rows = found["drills"], []
    counted = ("bad_writes", "overridden", "late", "needless")
    for name in FAULTS:
        mine = [one for one in drills if one["fault"] == name]
        if not mine:
            continue
        steps = [one["steps"] for one in mine if one["steps"] is not None]
        numbers = [sum(bool(one[key]) for one in mine) for key in counted]
        told = f"{sorted(steps)[len(steps) // 2]:.2f}, {max(steps):.2f}" if steps else "-"
        rows.append((name, len(mine), *numbers, sum(one["not_back"] for one in mine), told))
    totals = [sum(row[k] for row in rows) for k in range(1, 7)]
    rows.append(("all", *totals, ""))
    columns = ("fault", "drills", "writes outside list, range or rate", "operator overridden",
               "not given back within a step", "given back without need", "did not act again",
               "given back after: median, most [control steps]")  # fmt: skip
    text = markdown(columns, rows)
    seconds, cpu = (found[key] / len(drills) for key in ("wall", "cpu"))
    text += (
        f"\n{found['writes']:,} writes; {found['samples']:,} samples acknowledged, {found['lost']} of them lost; "
        f"{found['decisions']:,} decisions and plans on {found['lines']:,} lines of logs repeated, "
        f"{len(found['not_replayed'])} differ. Seeds {found['seeds'][0]} to {found['seeds'][-1]}, clock {RATE:g} times "
        f"real time, {found['sites']} sites at a time; a drill took {seconds:.1f} s and {cpu:.1f} s of CPU. "
        f"{platform.machine()}, {os.cpu_count()} cores, load average {os.getloadavg()[0]:.1f}.\n"
    )
    failures = [
        f"- seed {one['seed']}, drill {one['number']}, {one['fault']}: {text}" for one in drills
        for text in sum((one[key] for key in counted), ["did not act again"] * one["not_back"])
    ]  # fmt: skip
    failures += [f"- {text}" for text in found["not_replayed"][:20]]
    return text + ("\nEach failure:\n\n" + "\n".join(failures) + "\n" if failures else "")


def main() -> None:
    """Run the drills and write the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, required=True, help="folder of the results")
    parser.add_argument("--drills", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", default="", help="faults whose names hold one of these, between commas")
    parser.add_argument("--sites", type=int, default=2, help="how many at the same time")
    parser.add_argument("--keep", action="store_true", help="keep logs and outputs of the parts")
    parser.add_argument("--publish", action="store_true")
    options = parser.parse_args()
    found = run_pieces(options.drills, options.seed, options.out, options.only, options.sites, options.keep)
    text = report(found)
    write(options.out, "live_drills", text, found, options.publish)
    print(text)


if __name__ == "__main__":
    main()
