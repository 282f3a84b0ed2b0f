"""A site in full for drills: device, PostgreSQL, collector, controller and guard as processes, on a scaled clock."""

from __future__ import annotations

import contextlib
import json
import os
import resource
import select
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pandas as pd
from _bacnet_site import SimulatedSite
from _drill_process import OUTDOOR, SETPOINTS
from _postgres import PostgresServer

from mpc.live.clock import set_clock
from mpc.live.site import Site

#: How many times faster than real time, control step, tick of the guard, and time between readings of points [s].
RATE, STEP, TICK, COLLECT = 200.0, 300.0, 30.0, 60.0

#: Range [degC] and rate [K/h] of the first setpoint; the second may change at once. A sensor that stands still for two
#: control steps counts as stuck: the simulated ones have noise.
LOW, HIGH, RATES, STUCK = 18.0, 23.0, (60.0, 0.0), 600.0

BEGIN = pd.Timestamp("2026-01-12 08:00", tz="UTC")

#: Room of the database [MB], where the folder may be a file system of its own, so that it can be full.
ROOM = 160

PLANT = """
format: 1
name: drill_hall
location: {latitude: 50.8, longitude: 4.35, elevation: 100.0, timezone: UTC}
plant: {kind: site}
control_step: 300.0
period: {start: 2026-01-12 00:00, days: 1}
zones:
  north: {temperature: analog-input 2, floor_area: 60.0}
  south: {temperature: analog-input 3, floor_area: 60.0}
actuators:
  north/zone_air_heating_temperature_setpoint: {signal: analog-value 1, range: [16 degC, 26 degC]}
  south/zone_air_heating_temperature_setpoint: {signal: analog-value 2, range: [16 degC, 26 degC]}
prices: {electricity: 0.2}
series: [weather.csv]
weather: {outside_air_temperature_sensor: outdoor}
forecast: {hours: 2.0}
"""


def site_text(address: str, device: str) -> str:
    """Write a site.yaml."""
    sensors = {
        OUTDOOR: "analog-input,1", "north/zone_air_temperature_sensor": "analog-input,2",
        "south/zone_air_temperature_sensor": "analog-input,3",
    }  # fmt: skip
    lines = [
        "format: 1", "name: drill_hall", "plant: plant.yaml", "controller: full_speed", f"clock_rate: {RATE}",
        f"collect: {COLLECT}", f"guard: {{tick: {TICK}, heartbeat: 120.0, clock_jump: 60.0, stuck: {STUCK}}}",
        f"database: {{address: '{address}'}}", "connections:",
        f"  hall: {{kind: bacnet, address: '{device}', timeout: 0.2}}", "points:",
        *(f"  {name}: {{connection: hall, at: '{at}', unit: degC}}" for name, at in sensors.items()),
        *(f"  {zone}/heating_power_sensor: {{connection: hall, at: 'analog-input,{k}', unit: W}}"
          for k, zone in ((4, "north"), (5, "south"))),
        *(f"  {name}: {{connection: hall, at: 'analog-value,{k}', unit: degC, mode: act, range: [{LOW} degC, {HIGH} "
          f"degC], rate: {rate}, release: relinquish}}"
          for k, (name, rate) in enumerate(zip(SETPOINTS, RATES, strict=True), 1)),
    ]  # fmt: skip
    return "\n".join(lines) + "\n"


class Part:
    """A process that another program has forked.

    Parameters
    ----------
    pid : int
        Its number.
    """

    def __init__(self, pid: int) -> None:
        self.pid, self._handle = pid, os.pidfd_open(pid)

    def ended(self, patience: float = 0.0) -> bool:
        """Tell whether it has ended, at the latest after a wait [s]."""
        return bool(select.select([self._handle], [], [], patience)[0])

    def send(self, number: int) -> None:
        """Send a signal, unless it has ended."""
        with contextlib.suppress(ProcessLookupError):
            signal.pidfd_send_signal(self._handle, number)


class Stack:
    """The site in a folder.

    Parameters
    ----------
    folder : Path
        Of everything; the server of the database is no root, and reads its part.
    seed : int
        Of the building's noise.
    """

    def __init__(self, folder: Path, seed: int = 0) -> None:
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        self._used = before.ru_utime + before.ru_stime
        folder.mkdir(parents=True, exist_ok=True)
        self.folder, data = folder, folder / "pg"
        data.mkdir()
        self.bounded = os.geteuid() == 0 and not subprocess.run(
            ["mount", "-t", "tmpfs", "-o", f"size={ROOM}m", "tmpfs", str(data)], capture_output=True, check=False
        ).returncode
        self.database = PostgresServer(data, "-c max_wal_size=32MB -c min_wal_size=32MB -c shared_buffers=16MB")
        self.database.start()
        self.building = SimulatedSite(RATE, seed)
        device = self.building.start()
        self.site_path = folder / "site.yaml"
        (folder / "plant.yaml").write_text(PLANT, encoding="utf-8")
        stamps = pd.date_range(BEGIN - pd.Timedelta(days=2), periods=24 * 60, freq="1h").tz_localize(None)
        rows = "".join(f"{stamp:%Y-%m-%d %H:%M},275.15\n" for stamp in stamps)
        (folder / "weather.csv").write_text("timestamp,outdoor\n" + rows, encoding="utf-8")
        self.site_path.write_text(site_text(self.database.address, device), encoding="utf-8")
        self.site = Site(self.site_path)
        set_clock(self.site.folder / "clock.json", BEGIN.timestamp())
        self.clock = self.site.clock()
        root = str(Path(__file__).parents[1])
        self._forks = subprocess.Popen(
            [sys.executable, str(Path(__file__).with_name("_drill_process.py"))], stdin=subprocess.PIPE,
            stdout=subprocess.PIPE, text=True, cwd=folder,
            env=os.environ | {"PYTHONPATH": root + os.pathsep + os.environ.get("PYTHONPATH", "")},
        )  # fmt: skip
        self.processes: dict[str, Part] = {}
        self.cpu = 0.0
        self._events: dict[str, list[dict[str, Any]]] = {}
        self._seen: dict[Path, int] = {}

    def start(self, *parts: str) -> None:
        """Start parts."""
        for part in parts:
            asked = [part, str(self.site_path), str(self.folder / f"{part}.out")]
            print(json.dumps(asked), file=self._forks.stdin, flush=True)
            self.processes[part] = Part(int(next(self._forks.stdout or iter(()))))

    def signal(self, part: str, number: int) -> None:
        """Send a signal; a part that is killed is waited for."""
        process = self.processes[part]
        process.send(number)
        if number in (signal.SIGKILL, signal.SIGTERM) and not process.ended(20.0):
            raise TimeoutError(f"{part} did not end")

    def acting(self) -> bool:
        """Whether both setpoints are ours."""
        return set(self.building.held(13)) == {1, 2}

    def wait(self, condition: Callable[[], Any], steps: float) -> float | None:
        """Wait for a condition at most so many control steps; return the machine's time at which it held."""
        end = time.monotonic() + steps * STEP / RATE
        while time.monotonic() < end:
            if condition():
                return time.monotonic()
            time.sleep(0.005)
        return None

    def events(self, part: str) -> list[dict[str, Any]]:
        """Events of a part's log, without a check of its chain."""
        found = self._events.setdefault(part, [])
        for path in sorted(self.site.folder.glob(f"{part}-[0-9]*.jsonl")):
            with path.open("rb") as file:
                file.seek(self._seen.get(path, 0))
                whole = file.read().rpartition(b"\n")[0]
            if whole:
                self._seen[path] = self._seen.get(path, 0) + len(whole) + 1
                found += [json.loads(line) for line in whole.splitlines()]
        return found

    def close(self) -> None:
        """End everything."""
        for part in ("controller", "guard", "collector"):
            process = self.processes.get(part)
            if process is not None and not process.ended():
                process.send(signal.SIGCONT)
                process.send(signal.SIGTERM)
                if not process.ended(10.0):
                    process.send(signal.SIGKILL)
                    process.ended(10.0)
        self._forks.communicate()
        self.building.stop()
        self.database.stop()
        if self.bounded:
            subprocess.run(["umount", "-l", str(self.folder / "pg")], capture_output=True, check=False)
        used = resource.getrusage(resource.RUSAGE_CHILDREN)
        self.cpu = used.ru_utime + used.ru_stime - self._used

    def remove(self) -> None:
        """Take the folder away."""
        shutil.rmtree(self.folder, ignore_errors=True)
