"""Parts of a site in drills: as in operation, but for a controller that fails on inputs of one's choice.

This program has their modules loaded and forks itself for each part that is to start, since loading takes longer than a
drill. A part is a process with a session, sockets and memory of its own, whatever becomes of the others.
"""

from __future__ import annotations

import json
import math
import os
import random
import signal
import sys
import time
import traceback
from collections.abc import Callable, Mapping
from pathlib import Path

from mpc.errors import ControlError
from mpc.live.collector import run_collector
from mpc.live.controller import ControlProcess
from mpc.live.guard.process import run_guard
from mpc.live.site import Site
from mpc.loop.plant import Measurements
from mpc.scenario.forecast import Forecast

SETPOINTS = ("north/zone_air_heating_temperature_setpoint", "south/zone_air_heating_temperature_setpoint")
OUTDOOR = "weather_station/outside_air_temperature_sensor"

#: File in a site's folder while which is there the disk of the guard's log hangs.
HANGS = "disk_hangs"

HEAT = "north/heating_power_sensor"

#: Means over a step below or above which the controller fails: outdoor air at which it raises, or gives NaN [K], and
#: heat at which it asks for what is out of range [W]; in between the building stays by itself.
RAISES, NO_NUMBER, OUT_OF_RANGE = 268.15, 293.15, 10_000.0


class DrillController:
    """Chooses setpoints at random, by the time of the step: the same again when a log is repeated."""

    def step(self, measurements: Measurements, forecast: Forecast | None) -> Mapping[str, float]:
        """Choose, or fail as the outdoor air says."""
        outdoor, rng = measurements[OUTDOOR], random.Random(measurements.seconds)
        if outdoor < RAISES:
            raise ControlError("mpc", "a plan", "none: the solver did not converge")
        chosen = {name: round(rng.uniform(291.2, 296.1), 2) for name in SETPOINTS}
        if measurements[HEAT] > OUT_OF_RANGE:
            return chosen | {SETPOINTS[0]: 400.0}
        return dict.fromkeys(chosen, math.nan) if outdoor > NO_NUMBER else chosen


def _hangs(while_there: Path, fsync: Callable[[int], None]) -> Callable[[int], None]:
    """Have a disk that takes nothing, and does not say so, while a file is there."""

    def hanging(handle: int) -> None:
        while while_there.exists():
            time.sleep(0.02)
        fsync(handle)

    return hanging


def run_part(part: str, path: Path) -> int:
    """Run a part until it is ended; return the exit code."""
    site = Site(path)
    if part == "guard":
        os.fsync = _hangs(site.folder / HANGS, os.fsync)
        return run_guard(site)
    if part == "collector":
        return run_collector(site)
    return ControlProcess(site, controller=DrillController()).run()


def fork_part(part: str, path: Path, output: Path) -> int:
    """Fork a part whose output goes to a file; return its process' number."""
    child = os.fork()
    if child:
        return child
    code = 1
    try:
        os.setsid()
        signal.signal(signal.SIGCHLD, signal.SIG_DFL)
        nothing, told = os.open(os.devnull, os.O_RDONLY), os.open(output, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o644)
        for old, new in ((nothing, 0), (told, 1), (told, 2)):
            os.dup2(old, new)
        code = run_part(part, path)
    except BaseException:
        traceback.print_exc()
    finally:
        sys.stderr.flush()
        os._exit(code)


def _reap(*_: object) -> None:
    try:
        while os.waitpid(-1, os.WNOHANG)[0]:
            pass
    except ChildProcessError:
        return


def main() -> None:
    """Fork what each line of the input names, and answer with its number."""
    signal.signal(signal.SIGCHLD, _reap)
    for line in sys.stdin:
        part, path, output = json.loads(line)
        print(fork_part(part, Path(path), Path(output)), flush=True)


if __name__ == "__main__":
    main()
