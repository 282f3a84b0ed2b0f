"""A winter week of the pilot under `buildingmpc operate`: shadow, advise, act, with what is saved and what it takes.

The pilot (123 zones, 890 points) is a plant of ours whose parameters are drawn, with sun and people, stepped each
minute behind a real BACnet/IP device; its own control holds 13 degC of supply air and 75 degC of supply water. The
model is what ``buildingmpc calibrate`` makes of the two weeks before (``--prepare``). From Monday on ``--days`` in
shadow, in advise, where an operator approves all on the first day at 8, 12 and 16 h, and in act; modes and approvals by
the command. The same days under its own control are run beside, so that the saving is known. Days of shadow and advise
are rehearsed from the first on, those of acting with the others as what came before. Where a busy machine takes long to
plan, plans are old by the site's clock: choose a lower rate then.

Run: ``python benchmarks/pilot_week.py --work FOLDER --prepare``, then ``python benchmarks/pilot_week.py --work FOLDER
--rate 80 --out results/pilot_week --publish``; replays and rehearsals take half an hour after the week. Needs
``[live]``, PostgreSQL and ``pip install rusty-bacnet``.
"""

from __future__ import annotations

import argparse
import json
import shutil
import subprocess
import tempfile
import time
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from _pilot_site import CONTROL_STEP, EFFECTS, OWN, RUN_IN, OwnControl
from _plant_site import PlantSite
from _postgres import PostgresServer
from _table import markdown, write
from newcomer_live import free_port

from mpc.live.audit import log_files, read_log
from mpc.live.page.metrics import process_use
from mpc.live.rehearsal import rehearse
from mpc.live.replay import replay_logs
from mpc.live.site import Site
from mpc.loop.make import save_pilot
from thermal.pilot.building import pilot_building

#: Monday of the week; local hours at which the operator approves.
START, APPROVALS = "2023-01-09", (8, 12, 16)

#: Days of telemetry that the model is calibrated on [d].
BEFORE = 14

#: Least cost of a day of which a share is told [USD].
_SOME = 0.05


def prepare(work: Path, seed: int) -> None:
    """Make the case of the two weeks before, and calibrate."""
    start = f"{pd.Timestamp(START) - pd.Timedelta(days=BEFORE):%Y-%m-%d}"
    before = OwnControl(pilot_building(seed), start, BEFORE, seed, step=300.0)
    save_pilot(work / "case", before.building, before.settings, start=start, days=BEFORE, setpoints=OWN, overwrite=True)
    effects = ["--effects", ",".join((*EFFECTS, "internal_gains"))]
    subprocess.run(["buildingmpc", "calibrate", work / "case", *effects, "--out", work / "calibrated"], check=True)


class Week:
    """Runs the week.

    Parameters
    ----------
    work : Path
        With ``case`` and ``calibrated``.
    rate : float
        How many times faster than real time clocks run [-].
    days : tuple of int
        In shadow, advise and act.
    seed : int
        Of building, weather, people and noise.
    """

    def __init__(self, work: Path, rate: float, days: tuple[int, int, int], seed: int) -> None:
        self.work, self.days = work, days
        self.plant = OwnControl(pilot_building(seed), START, sum(days), seed, run_in=RUN_IN)
        file = self.plant.described("pilot", START)
        self.site = PlantSite(file, self.plant, work / "site", rate, CONTROL_STEP)
        self.uses: dict[int, tuple[str, float, float]] = {}
        self.told: list[str] = []

    def run(self) -> dict[str, Any]:
        """Run it; return what came of it."""
        top = Path(tempfile.mkdtemp(prefix="week"))
        top.chmod(0o755)
        (top / "pg").mkdir()
        server = PostgresServer(top / "pg")
        server.start()
        began = time.monotonic()
        try:
            model = {"building": str(self.work / "case"), "parameters": str(self.work / "calibrated/calibration.json"),
                     "own_control": {"air": [OWN_AIR] * 2, "water": [OWN_WATER] * 2}}  # fmt: skip
            path = self.site.begin(server.address, free_port(), more={"controller": "mpc", "model": model})
            operate = subprocess.Popen(["buildingmpc", "operate", str(path)], stdout=subprocess.DEVNULL)
            try:
                self._watch(path)
            finally:
                operate.terminate()
                operate.wait(120.0)
            return self._found(path, server.address) | {"wall": time.monotonic() - began}
        finally:
            self.site.stop()
            server.stop()
            shutil.rmtree(top, ignore_errors=True)

    def _watch(self, path: Path) -> None:
        """Switch modes and approve when it is time, and look at the processes, until the week is over."""
        due = list(self._orders())
        while not self.site.plant.finished:
            if self.site.trouble is not None:
                raise self.site.trouble
            hours = self.site.hours
            while due and hours >= due[0][0]:
                done = subprocess.run(
                    ["buildingmpc", "operate", str(path), *due[0][1]], capture_output=True, text=True, check=False
                )
                self.told.append(f"{hours:.1f} h {' '.join(due[0][1])}: {done.returncode} {done.stderr.strip()[-200:]}")
                print(self.told[-1], flush=True)
                if done.returncode and hours < due[0][0] + 1.0:
                    break  # there is no plan in force now: the operator asks again
                due.pop(0)
            self._look()
            time.sleep(1.0)

    def _orders(self) -> Iterator[tuple[float, list[str]]]:
        """Orders of the operator, by hours since the begin."""
        advised = 24.0 * self.days[0]
        yield advised, ["--mode", "advise"]
        for hour in APPROVALS:
            yield advised + hour + 0.2, ["--approve", "all"]
        yield advised + 24.0 * self.days[1], ["--mode", "act"]

    def _look(self) -> None:
        """Note CPU and memory of each part; one that was started anew counts beside the one before."""
        try:
            parts = json.loads((self.site.folder / "live" / "parts.json").read_text(encoding="utf-8"))
        except (OSError, ValueError):
            return
        for name, pid in parts.items():
            use = process_use(pid)
            if use is not None:
                most = self.uses.get(pid, (name, 0.0, 0.0))[2]
                self.uses[pid] = (name, use[0], max(most, use[1]))

    def _found(self, path: Path, database: str) -> dict[str, Any]:
        """Collect costs, plans, logs, samples and processes."""
        acted, logs = self.plant.bought(), path.parent / "live"
        self.plant.reset()
        while not self.plant.finished:
            self.plant.step({})
        own = self.plant.bought()
        plans = list(_contents(logs, "controller", "plan"))
        replays = list(replay_logs(log_files(logs), path).values())
        seconds, site = sum(self.days) * 86400.0, Site(path)
        begin = pd.Timestamp(self.site.first, unit="s", tz="UTC")
        acting = begin + pd.Timedelta(days=sum(self.days[:2]))
        rehearsed = {"all": rehearse(site, begin), "acting": rehearse(site, acting)}
        by_part: dict[str, list[float]] = {}
        for name, cpu, memory in self.uses.values():
            total = by_part.setdefault(name, [0.0, 0.0, 0])
            by_part[name] = [total[0] + cpu / seconds, max(total[1], memory), total[2] + 1]
        return {
            "acted": acted.reset_index(drop=True).to_dict("list"), "own": own.reset_index(drop=True).to_dict("list"),
            "rehearsed": {name: one.to_dict() for name, one in rehearsed.items()}, "plans": len(plans),
            "planned": sum(p["plan"]["status"] == "planned" for p in plans),
            "troubles": _counted(p["plan"]["status"] for p in plans if p["plan"]["status"] != "planned"),
            "parts": by_part, "lines": sum(r.lines for r in replays), "decisions": sum(r.decisions for r in replays),
            "different": [d for r in replays for d in r.different], "broken": [r.broken for r in replays if r.broken],
            "doubts": _doubts(logs), "orders": self.told, "late": self.site.late, "samples": _samples(logs),
            "days": self.days, "points": len(self.site.columns) + len(self.site.actuators), "rate": self.site.rate,
        }  # fmt: skip


OWN_AIR, OWN_WATER = OWN.values()


def _counted(words: Any) -> dict[str, int]:
    found: dict[str, int] = {}
    for word in words:
        found[word] = found.get(word, 0) + 1
    return found


def _contents(logs: Path, process: str, kind: str) -> Iterator[dict[str, Any]]:
    """Read the events of a kind in a process' logs."""
    for file in log_files(logs, process):
        yield from (entry["content"] for _, entry in read_log(file, None) if entry["kind"] == kind)


def _doubts(logs: Path) -> dict[str, int]:
    """Doubts of the guard by their first words, in ticks."""
    return _counted(
        " ".join(doubt.split()[:4]) for tick in _contents(logs, "guard", "tick") for doubt in tick["decision"]["doubts"]
    )


def _samples(logs: Path) -> dict[str, float]:
    """Count the samples that the collector has read and stored, and the median time between two readings [s]."""
    reads = list(_contents(logs, "collector", "read"))
    return {
        "samples": sum(read["samples"] for read in reads), "readings": len(reads),
        "between": float(np.median(np.diff([read["time"] for read in reads]))),
        "stored": sum(read["samples"] for read in reads if read["where"] == "committed"),
    }  # fmt: skip


def _percent(share: float) -> str:
    return f"{100.0 * share:.1f} %"


def tables(found: Mapping[str, Any]) -> str:
    """Lay out what was found."""
    acted, own, (shadow, advise, _) = found["acted"], found["own"], found["days"]
    rehearsals, rows = found["rehearsed"], []
    ahead = [*rehearsals["all"]["days"][: shadow + advise], *rehearsals["acting"]["days"]]
    for k, told in enumerate(ahead):
        mode = "shadow" if k < shadow else "advise" if k < shadow + advise else "act"
        saved = 1.0 - acted["cost"][k] / own["cost"][k]
        shares = [_percent(share) if own["cost"][k] > _SOME and share is not None else "-"
                  for share in (saved, told["saving"], told["promised"])]  # fmt: skip
        rows.append([
            f"{pd.Timestamp(START) + pd.Timedelta(days=k):%A}", mode, f"{own['cost'][k]:.1f}",
            f"{acted['cost'][k]:.1f}", *shares, f"{own['discomfort'][k]:.1f}, {acted['discomfort'][k]:.1f}",
        ])  # fmt: skip
    heads = ["day", "mode", "own control [USD]", "as operated [USD]", "saved", "rehearsed", "promised by plans",
             "outside the bands, own and operated [K h]"]  # fmt: skip
    rehearsed, acting = found["rehearsed"]["acting"]["saving"], slice(shadow + advise, None)
    realised = 1.0 - sum(acted["cost"][acting]) / sum(own["cost"][acting])
    uses, samples = found["parts"], found["samples"]
    parts = [[name, _percent(cpu), f"{memory / 1e6:.0f}", n] for name, (cpu, memory, n) in uses.items()]
    whole = _percent(sum(cpu for cpu, *_ in uses.values())), f"{sum(m for _, m, _ in uses.values()) / 1e6:.0f}"
    told = (
        f"Days of acting rehearsed {_percent(rehearsed)}, saved {_percent(realised)}. {found['planned']} of "
        f"{found['plans']} plans were made. {found['points']} points, {samples['readings']} readings "
        f"{samples['between']:.0f} s apart (median), {samples['samples']:,.0f} samples, {samples['stored']:,.0f} of "
        f"them committed at once; {found['decisions']:,} decisions and plans on {found['lines']:,} lines of logs "
        f"repeated, {len(found['different'])} differ. Clock {found['rate']:g} times real time.\n"
    )
    heads_of_use = ["process", "CPU at real time, share of a core", "memory, most [MB]", "starts"]
    return f"{markdown(heads, rows)}\n{told}\n{markdown(heads_of_use, [*parts, ['all', *whole, '']])}"


def main() -> None:
    """Prepare, or run and lay out."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--work", type=Path, required=True, help="folder of the case, the model and the site")
    parser.add_argument("--prepare", action="store_true", help="make the case and calibrate")
    parser.add_argument("--rate", type=float, default=80.0)
    parser.add_argument("--days", type=int, nargs=3, default=(2, 1, 4), help="in shadow, advise and act")
    parser.add_argument("--seed", type=int, default=7)
    parser.add_argument("--out", type=Path, default=Path("results/pilot_week"))
    parser.add_argument("--publish", action="store_true")
    options = parser.parse_args()
    work = options.work.resolve()
    if options.prepare:
        prepare(work, options.seed)
        return
    found = Week(work, options.rate, tuple(options.days), options.seed).run()
    write(options.out, "pilot_week", tables(found), found, options.publish)
    print(tables(found))


if __name__ == "__main__":
    main()
