"""How long a newcomer takes: from clone to the demo's report, and from PNGs to a diagnosed model of one's own.

Everything is done in a new folder, by the commands that README and documentation say, in a fresh virtual environment:

1. First visit: clone, virtual environment, install, `buildingmpc demo`; the line of the README is taken apart and run.
2. Own building, where node and chromium are installed, on Linux: a scripted person on the labelling page in a real
   browser (`newcomer_person.mjs`), from two PNGs, a list of devices and an export of the automation system to a
   calibrated and diagnosed model. Actions and waits are counted; at human speed an action takes `HUMAN` seconds.
   Without a browser, and beside it, the commands do the same as far as they reach.

The building is the generated pilot, drawn by `tests/browser/pilot.py`; its telemetry is that of `generate_twin`:
the grid model under thermostats with parameters drawn from a seed, unmeasured heat and noise. Making it is not timed:
the newcomer's building stands. As its truth is known, the calibrated one is held against it: areas of zones, the
held-out error beside that at the true parameters, and how many 90 % intervals hold the truth. On the page glazing is
given by facade, as the mean of the building's zones, so that it is true on average only.

Run: ``python benchmarks/newcomer_path.py --out results/newcomer [--publish]``; `--small` is an office of 12 zones,
`--without-visit` leaves out clone, install and demo and uses this environment, `--pictures DIR` keeps what the person
sees. Writes ``newcomer_path.json`` and ``.md``; with ``--publish`` also the table between its marks.
"""

from __future__ import annotations

import argparse
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from _newcomer_building import (
    PILOT,
    SMALL,
    Size,
    Standing,
    browser_programs,
    near,
    raise_building,
    walk_page,
    with_glazing,
)
from _table import ROOT, markdown, write

NAME = "newcomer_path"
FIRST, OWN, ASIDE = "first visit", "own building", "beside it"

#: What an action of a person takes on average, looking and thinking included [s], as the issue of the page sets it.
HUMAN = 8.0


@dataclass(frozen=True)
class Step:
    """A step of a path, and what it took."""

    path: str
    name: str
    command: str
    seconds: float  # wall
    cpu: float  # of its processes


Run = Callable[[Sequence[str], Path], str]


def execute(command: Sequence[str], folder: Path) -> str:
    """Run a command in a folder and give what it wrote; a failure ends the path with what it said."""
    fresh = Path(command[0]) != Path(sys.executable)
    env = environment() if fresh else None  # of this environment, all that it finds its packages by
    done = subprocess.run(list(command), cwd=folder, capture_output=True, text=True, env=env)
    if done.returncode:
        raise SystemExit(
            f"{' '.join(command)}\nended with {done.returncode}\n{done.stdout[-2000:]}{done.stderr[-2000:]}"
        )
    return done.stdout


def environment() -> dict[str, str]:
    """Environment of a newcomer: nothing of this one's Python, one thread of linear algebra as the commands have."""
    kept = {k: v for k, v in os.environ.items() if k not in ("PYTHONPATH", "PYTHONHOME", "VIRTUAL_ENV")}
    return kept | {"PIP_NO_INPUT": "1", "PIP_DISABLE_PIP_VERSION_CHECK": "1"}


class Walk:
    """Steps in the order in which they were done."""

    def __init__(self, run: Run = execute) -> None:
        self.steps: list[Step] = []
        self._run = run

    @contextmanager
    def timed(self, path: str, name: str, command: str) -> Iterator[None]:
        """Time what is done within."""
        began, before = time.perf_counter(), children()
        yield
        self.steps.append(Step(path, name, command, time.perf_counter() - began, children() - before))
        print(f"{path}: {name}: {self.steps[-1].seconds:.1f} s", flush=True)

    def run(self, path: str, name: str, command: Sequence[str], folder: Path) -> str:
        """Run a command as a step."""
        with self.timed(path, name, " ".join(command)):
            return self._run(command, folder)


def children() -> float:
    """CPU time of processes that have ended [s]."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def readme_steps() -> list[str]:
    """Commands of the README's line that sets up and runs the demo."""
    lines = (ROOT / "README.md").read_text(encoding="utf-8").splitlines()
    found = [line for line in lines if line.startswith("python3 -m venv") and " demo " in line]
    if len(found) != 1:
        raise SystemExit(f"README.md: expected one line that sets up and runs the demo, found {len(found)}")
    return found[0].split(" && ")


def visit(path: Walk, home: Path) -> Path:
    """Clone, install and run the demo; gives the clone."""
    clone = home / "buildingmpc"
    path.run(FIRST, "clone", ["git", "clone", "--quiet", str(ROOT), str(clone)], home)
    names = {"venv": "virtual environment", "pip": "install", "buildingmpc": "demo"}
    for line in readme_steps():
        words = line.split()
        name = next(name for key, name in names.items() if any(key in Path(word).name for word in words[:3]))
        path.run(FIRST, name, words, clone)
    page = clone / "demo_results" / "report.html"
    if not page.is_file():
        raise SystemExit(f"{page}: expected the demo's report, found none")
    path.run(OWN, "install the extras", [".venv/bin/pip", "install", "-e", ".[plan,pages]"], clone)
    return clone


def own_building(
    path: Walk, home: Path, tool: list[str], standing: Standing, browser: bool, pictures: Path | None = None
) -> dict[str, Any]:
    """Go from drawings to a calibrated simulator; gives how near to the truth it is."""
    listed = ["import-plan", "drawings/plans.yaml", "--devices", "drawings/devices.csv", "--out", "by_command"]
    path.run(ASIDE if browser else OWN, "drawings to a case, by command", [*tool, *listed], home)
    numbers: dict[str, Any] = {}
    spacing = ["--dx", f"{standing.size.dx:g}"]
    case, results = home / "office", home / "results"
    if browser:
        case, results, spacing = home / "on_page", home / "on_page" / "labelling" / "reports" / "calibrate", []
        with path.timed(OWN, "from drawings to a diagnosis, on the page, by a script", "buildingmpc label on_page"):
            fresh = dict(os.environ) if tool[0] == sys.executable else environment()
            numbers = walk_page([*tool, "label", str(case), "--no-browser"], home, fresh, pictures)
        matched = numbers["matched"]
    else:
        with_glazing(home / "by_command", standing.glazing)
        told = path.run(
            OWN, "telemetry", [*tool, "import-telemetry", "by_command", "export.csv", "--out", "office"], home
        )
        matched = next(line for line in told.splitlines() if "columns matched" in line)
    path.run(OWN, "check", [*tool, "check", case.name, "--out", "check"], home)
    if not browser:
        path.run(OWN, "calibrate", [*tool, "calibrate", "office", "--out", "results", *spacing], home)
    start, end = standing.last_day
    found = results.relative_to(home) / "calibration.json"
    span = ["--start", start, "--end", end, "--parameters", found.as_posix()]
    path.run(OWN, "simulate a day", [*tool, "simulate", case.name, *span, *spacing, "--out", "replay"], home)
    return {"page": numbers, "matched": matched} | near(home, standing, case, results)


def report(steps: Sequence[Step], found: dict[str, Any]) -> str:
    """Lay out the table."""
    rows = [[s.path, s.name, f"`{short(s.command)}`", f"{s.seconds:.0f}", f"{s.cpu:.0f}"] for s in steps]
    for path in (FIRST, OWN):
        mine = [s for s in steps if s.path == path]
        if mine:
            total, cpu = sum(s.seconds for s in mine), sum(s.cpu for s in mine)
            rows.append([path, f"**all, {total / 60:.1f} minutes**", "", f"**{total:.0f}**", f"**{cpu:.0f}**"])
    rows.sort(key=lambda row: (FIRST, OWN, ASIDE).index(row[0]))
    lines = [
        f"{found['zones']} zones, {found['devices']} devices, {found['days']:g} days of telemetry; {found['matched']}. "
        f"Areas of zones within {100 * found['area_error']:.1f} % of the building that the PNGs were drawn from. "
        f"Held-out error six hours ahead {found['mae']['before']:.2f} K before and {found['mae']['after']:.2f} K after "
        f"calibration, {found['mae']['truth']:.2f} K at the true parameters; {found['held']} of {found['parameters']} "
        "intervals of 90 % hold the truth.",
        f"{os.cpu_count()} cores, load average {found['load']:.1f} at the end.",
    ]
    text = markdown(["path", "step", "command", "wall [s]", "CPU [s]"], rows) + "\n"
    if found["page"]:
        text += person(found["page"]["steps"]) + "\n"
    return text + " ".join(lines) + "\n"


def person(steps: Sequence[dict[str, Any]]) -> str:
    """Lay out what the person did and waited for on the page."""
    rows, whole = [], {"clicks": 0, "fields": 0, "waited": 0.0, "computed": 0.0}
    for step in steps:
        rows.append([step["name"], *_counts(step)])
        whole = {key: whole[key] + step[key] for key in whole}
    rows.append(["**all**", *(f"**{cell}**" for cell in _counts(whole))])
    acted, times = f"at {HUMAN:g} s each [min]", ["waiting [min]", "together [min]", "CPU of the server [min]"]
    head = ["on the page", "clicks", "fields", acted, *times]
    return markdown(head, rows)


def _counts(step: dict[str, Any]) -> list[str]:
    acted, waited = HUMAN * (step["clicks"] + step["fields"]) / 60.0, step["waited"] / 60.0
    counts = [f"{step['clicks']}", f"{step['fields']}"]
    return counts + [f"{minutes:.1f}" for minutes in (acted, waited, acted + waited, step["computed"] / 60.0)]


def short(command: str) -> str:
    """Command without the folders that only this run has."""
    words = [Path(word).name if word.startswith("/") else word.removeprefix(".venv/bin/") for word in command.split()]
    return " ".join(words).replace("python -m mpc.cli", "buildingmpc")


def main() -> None:
    """Walk the paths and write the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, required=True, help="folder of the table")
    parser.add_argument("--small", action="store_true", help="an office of 12 zones in place of the pilot")
    parser.add_argument("--without-visit", action="store_true", help="no clone, install and demo: this environment")
    parser.add_argument("--without-browser", action="store_true", help="no page, even where node and chromium are")
    parser.add_argument("--pictures", type=Path, help="folder of pictures of what the person sees")
    parser.add_argument("--publish", action="store_true", help="replace the table between its marks")
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="newcomer-") as folder:
        size = SMALL if asked.small else PILOT
        found = walk(Path(folder), size, asked.without_visit, asked.without_browser, pictures=asked.pictures)
    write(asked.out, NAME, found.pop("table"), found, asked.publish)


def walk(
    home: Path,
    size: Size,
    without_visit: bool,
    without_browser: bool,
    run: Run = execute,
    pictures: Path | None = None,
) -> dict[str, Any]:
    """Walk both paths in a folder."""
    path, tool = Walk(run), [sys.executable, "-m", "mpc.cli"]
    if not without_visit:
        tool = [str(visit(path, home) / ".venv" / "bin" / "buildingmpc")]
    standing = raise_building(home, size)
    browser = not without_browser and browser_programs() is not None
    found = own_building(path, home, tool, standing, browser, pictures)
    found |= {"zones": standing.zones, "devices": standing.devices, "days": size.days, "load": os.getloadavg()[0]}
    return found | {"steps": [asdict(step) for step in path.steps], "table": report(path.steps, found)}


if __name__ == "__main__":
    main()
