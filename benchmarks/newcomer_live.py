"""A newcomer to operation: a wheel in a fresh environment, PostgreSQL, a simulated site, and a page with live plans.

What `docs/operate.md` tells a newcomer to do, step by step and with a clock: PostgreSQL is of Debian's packages, which
are there already (``apt install postgresql`` is not timed), with a server of its own in a folder. At the end each
process' CPU and memory are read for a minute at real time.

Run: ``python benchmarks/newcomer_live.py --out results/newcomer_live --publish``; it downloads packages.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import socket
import subprocess
import sys
import tempfile
import time
import urllib.request
from contextlib import suppress
from pathlib import Path
from typing import Any

from _postgres import PostgresServer
from _table import markdown, write

from mpc.live.page.metrics import process_use

ROOT = Path(__file__).parents[1]

#: Longest wait for the first plan on the page, and time over which processes are watched [s].
PATIENCE, WATCHED = 300.0, 60.0


def free_port() -> int:
    """Find a port that nobody listens at."""
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return int(one.getsockname()[1])


def shown(port: int) -> dict[str, Any] | None:
    """Ask for what the page tells, once it has a plan that the guard has taken."""
    with suppress(OSError, ValueError):
        with urllib.request.urlopen(f"http://127.0.0.1:{port}/", timeout=5) as page:
            whole = b"Setpoints" in page.read()
        with urllib.request.urlopen(f"http://127.0.0.1:{port}/status", timeout=5) as answer:
            told: dict[str, Any] = json.loads(answer.read())
        if whole and told["status"].get("plan") and told["controller"].get("status") == "planned":
            return told
    return None


def main() -> None:
    """Do it all."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("results/newcomer_live"))
    parser.add_argument("--publish", action="store_true")
    options = parser.parse_args()
    top = Path(tempfile.mkdtemp(prefix="newcomer"))
    top.chmod(0o755)
    steps, ends, began = list[tuple[str, float]](), [], time.monotonic()
    clean = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}

    def run(name: str, *command: str) -> None:
        begin = time.monotonic()
        subprocess.run(command, check=True, capture_output=True, env=clean, cwd=top)
        steps.append((name, time.monotonic() - begin))

    try:
        python = str(top / "venv" / "bin" / "python")
        run("wheel", sys.executable, "-m", "pip", "wheel", "--no-deps", "-w", str(top / "wheel"), str(ROOT))
        wheel = str(next((top / "wheel").glob("*.whl")))
        run("environment", sys.executable, "-m", "venv", str(top / "venv"))
        run("pip install buildingmpc[live]", python, "-m", "pip", "install", "-q", f"{wheel}[live]", "rusty-bacnet")
        begin = time.monotonic()
        (top / "pg").mkdir()
        server = PostgresServer(top / "pg")
        server.start()
        ends.append(server.stop)
        steps.append(("PostgreSQL", time.monotonic() - begin))
        begin, port = time.monotonic(), free_port()
        script = [python, str(ROOT / "benchmarks" / "simulated_site.py"), str(top / "hall"), "--port", str(port)]
        building = subprocess.Popen(
            [*script, "--database", server.address], stdout=subprocess.PIPE, text=True, env=clean, cwd=top
        )
        ends.append(building.terminate)
        site = (building.stdout.readline() if building.stdout else "").strip()
        steps.append(("simulated site", time.monotonic() - begin))
        command = str(top / "venv" / "bin" / "buildingmpc")
        run("operate --check", command, "operate", site, "--check")
        begin = time.monotonic()
        operate = subprocess.Popen([command, "operate", site], stdout=subprocess.DEVNULL, env=clean, cwd=top)
        ends.append(lambda: (operate.terminate(), operate.wait(60.0)))
        while (told := shown(port)) is None and time.monotonic() - begin < PATIENCE:
            time.sleep(0.5)
        if told is None:
            raise SystemExit(f"no plan on the page within {PATIENCE:.0f} s")
        steps.append(("first plan on the page", time.monotonic() - begin))
        total = time.monotonic() - began
        use = _watched(top / "hall" / "live" / "parts.json")
    finally:
        for end in reversed(ends):
            end()
        shutil.rmtree(top, ignore_errors=True)
    table = markdown(("step", "s"), [*((name, f"{s:.0f}") for name, s in steps), ("all", f"{total:.0f}")])
    table += "\n" + markdown(("process", "CPU [% of a core]", "memory [MB]"), use)
    table += f"\nLoad average {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores.\n"
    write(options.out, "newcomer_live", table, {"steps": steps, "total": total, "use": use}, options.publish)
    print(table)


def _watched(parts: Path) -> list[tuple[str, str, str]]:
    """CPU and memory of each process."""
    ids = json.loads(parts.read_text(encoding="utf-8"))
    before = {part: process_use(pid) for part, pid in ids.items()}
    time.sleep(WATCHED)
    rows = []
    for part, pid in ids.items():
        first, last = before[part], process_use(pid)
        if first is not None and last is not None:
            rows.append((part, f"{100.0 * (last[0] - first[0]) / WATCHED:.1f}", f"{last[1] / 1e6:.0f}"))
    return rows


if __name__ == "__main__":
    main()
