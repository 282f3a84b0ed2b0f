"""Buildings behind BOPTEST's API: how long a step takes by HTTP, and what fifty clients at once get.

``buildingmpc serve --boptest --pilot`` runs as a process of its own: the bundled case (5 zones), the generated pilot
with 12 zones and with its 123. A client advances a test by steps of 5 minutes on one kept connection and reads all its
signals. Then fifty clients in fifty threads each begin a test of the same day, run its warm-up and take their steps.
CPU times are the server's (user and system), from the kernel's accounts; wall times are those of the clients, which
share the machine with the server.

Run: ``python benchmarks/boptest_server.py --out results/boptest``; two minutes. Writes ``boptest_server.json`` and
``.md``.
"""

from __future__ import annotations

import argparse
import http.client
import json
import os
import platform
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import numpy as np
from _table import markdown, write

DAY = 86_400.0
CLIENTS, STEPS = 50, 100


class Line:
    """A kept connection to a server."""

    def __init__(self, url: str) -> None:
        self._http = http.client.HTTPConnection(urlsplit(url).netloc, timeout=600)

    def send(self, method: str, path: str, body: dict[str, Any] | None = None) -> tuple[Any, int]:
        """Send a request; its JSON and its length [bytes]."""
        self._http.request(method, path, json.dumps(body or {}), {"content-type": "application/json"})
        response = self._http.getresponse()
        text = response.read()
        if response.status != 200:
            raise RuntimeError(f"{method} {path}: status {response.status}: {text[:200]!r}")
        return (json.loads(text) if text.startswith((b"{", b"[")) else text), len(text)

    def begin(self, name: str, period: str) -> str:
        """Begin a test at the start of a period, a day of warm-up before it."""
        testid = self.send("POST", f"/testcases/{name}/select")[0]["testid"]
        at = self.send("PUT", f"/scenario/{testid}", {"time_period": period})[0]["payload"]["time_period"]["time"]
        self.send("PUT", f"/initialize/{testid}", {"start_time": at + 8 * 3600.0, "warmup_period": DAY})
        return str(testid)

    def close(self) -> None:
        """Hang up."""
        self._http.close()


def cpu_seconds(process: int) -> float:
    """User and system time of a process so far [s]; NaN where the kernel does not say."""
    try:
        fields = Path(f"/proc/{process}/stat").read_text(encoding="utf-8").rpartition(")")[2].split()
    except OSError:
        return float("nan")
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def one_client(url: str, process: int, name: str, steps: int) -> dict[str, float]:
    """Take the steps of one client, one after the other."""
    line = Line(url)
    testid = line.begin(name, "mix_day")
    waits, size, before = [], 0, cpu_seconds(process)
    for _ in range(steps):
        begin = time.perf_counter()
        answer, size = line.send("POST", f"/advance/{testid}")
        waits.append(time.perf_counter() - begin)
    used = (cpu_seconds(process) - before) / steps
    line.send("PUT", f"/stop/{testid}")
    line.close()
    return {"signals": len(answer["payload"]), "kilobytes": size / 1000.0, "median": float(np.median(waits)),
            "least": float(np.min(waits)), "cpu": used}  # fmt: skip


def many_clients(url: str, process: int, name: str, clients: int, steps: int) -> dict[str, float]:
    """Take the steps of many clients at once, each with a test of its own."""

    def run(number: int) -> list[float]:
        line, waits = Line(url), []
        testid = line.begin(name, "mix_day")
        for _ in range(steps):
            begin = time.perf_counter()
            line.send("POST", f"/advance/{testid}")
            waits.append(time.perf_counter() - begin)
        line.send("PUT", f"/stop/{testid}")
        line.close()
        return waits

    before, begin = cpu_seconds(process), time.perf_counter()
    with ThreadPoolExecutor(clients) as pool:
        waits = np.array(list(pool.map(run, range(clients))))
    wall = time.perf_counter() - begin
    used = cpu_seconds(process) - before
    median, p95, most = np.quantile(waits, (0.5, 0.95, 1.0)).tolist()
    return {"clients": clients, "steps": waits.size, "wall": wall, "rate": waits.size / wall, "cpu": used / waits.size,
            "median": median, "p95": p95, "most": most}  # fmt: skip


def measure(url: str, process: int, names: list[str], clients: int = CLIENTS, steps: int = STEPS) -> dict[str, Any]:
    """Measure each test case."""
    found = {}
    for name in names:
        one = one_client(url, process, name, 2 * steps)
        found[name] = {"one": one, "many": many_clients(url, process, name, clients, max(steps // 5, 1))}
    return found


def report(found: dict[str, Any]) -> str:
    """Lay out the table."""
    rows = []
    for name, both in found.items():
        one, many = both["one"], both["many"]
        rows.append([
            name, one["signals"], f"{one['kilobytes']:.1f}", f"{1e3 * one['cpu']:.2f}",
            f"{1e3 * one['median']:.1f} ({1e3 * one['least']:.1f})", f"{many['rate']:.0f}", f"{1e3 * many['cpu']:.2f}",
            f"{1e3 * many['median']:.0f}, {1e3 * many['p95']:.0f}, {1e3 * many['most']:.0f}",
        ])  # fmt: skip
    clients = next(iter(found.values()))["many"]["clients"]
    columns = [
        "test case", "signals", "answer [kB]", "one client: CPU of a step [ms]", "its wall, median (least) [ms]",
        f"{clients} clients: steps a second", "CPU of a step, warm-up shared out [ms]", "wait: median, 95 %, most [ms]",
    ]  # fmt: skip
    note = f"{platform.machine()}, {os.cpu_count()} cores, load average {os.getloadavg()[0]:.1f}. No request failed.\n"
    return markdown(columns, rows) + "\n" + note


def main() -> None:
    """Measure and write the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, required=True, help="folder of the results")
    options = parser.parse_args()
    command = [sys.executable, "-m", "mpc.cli", "serve", "--boptest", "--pilot", "--port", "0", "--json"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as server:
        try:
            lines = []
            for line in server.stdout or ():
                lines.append(line)
                if line == "}\n":
                    break
            said = json.loads("".join(lines))
            found = measure(said["url"], server.pid, ["bundled_case", "pilot_12", "pilot"])
        finally:
            server.terminate()
    text = report(found)
    write(options.out, "boptest_server", text, found, False)
    print(text)


if __name__ == "__main__":
    main()
