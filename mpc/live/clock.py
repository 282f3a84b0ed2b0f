"""Clocks: one that only runs forward, and the wall's; both faster than real time where a site is simulated."""

from __future__ import annotations

import json
import os
import time
from pathlib import Path

from mpc.errors import LiveError


class Clock:
    """Monotonic and wall clock of the machine.

    Attributes
    ----------
    rate : float
        How many times faster than real time both run [-].
    """

    rate = 1.0

    def mono(self) -> float:
        """Time that has passed since some moment [s]."""
        return time.monotonic() * self.rate

    def wall(self) -> float:
        """Time since 1970 in UTC [s]; where it is set, it jumps."""
        return time.time()

    def real(self, seconds: float) -> float:
        """Tell how long a time of this clock takes [s].

        Parameters
        ----------
        seconds : float
            On this clock [s].
        """
        return seconds / self.rate


class SimulatedClock(Clock):
    """Clock that runs faster, the same one for all processes of a site; who writes its file sets it.

    Parameters
    ----------
    path : Path
        File with ``origin``, a reading of the machine's monotonic clock, and ``begin``, the wall clock then [s]; made
        where it is not there, to begin now.
    rate : float
        How many times faster than real time it runs [-].
    """

    def __init__(self, path: Path, rate: float) -> None:
        self.rate, self._path = rate, path
        if not path.exists():
            set_clock(path, time.time())
        self._read: tuple[int, float, float] = (-1, 0.0, 0.0)
        self.wall()

    def wall(self) -> float:
        """Time since 1970 in UTC [s]."""
        try:
            stamp = os.stat(self._path).st_mtime_ns
            if stamp != self._read[0]:
                content = json.loads(self._path.read_text(encoding="utf-8"))
                self._read = (stamp, float(content["origin"]), float(content["begin"]))
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise LiveError(self._path.name, "origin and begin of a simulated clock", str(error)) from error
        return self._read[2] + (time.monotonic() - self._read[1]) * self.rate


def set_clock(path: Path, wall: float) -> None:
    """Set a simulated clock.

    Parameters
    ----------
    path : Path
        Its file.
    wall : float
        What it shows now, since 1970 in UTC [s].
    """
    fresh = path.with_suffix(f".{os.getpid()}.tmp")
    fresh.write_text(json.dumps({"origin": time.monotonic(), "begin": wall}), encoding="utf-8")
    fresh.replace(path)
