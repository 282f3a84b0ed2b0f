"""Clocks: one that only runs forward, and the wall's, both faster than real time where a site is simulated."""

from __future__ import annotations

import time


class Clock:
    """Monotonic and wall clock of a process.

    Both of several processes agree: the monotonic one is the machine's, and the wall's runs from the time that the
    machine had at `origin`.

    Parameters
    ----------
    rate : float
        How many times faster than real time both run [-].
    origin : float, optional
        Reading of the machine's monotonic clock at which the wall's is right [s]; now by default.
    begin : float, optional
        Wall clock at `origin`, since 1970 in UTC [s]; the machine's by default.
    """

    def __init__(self, rate: float = 1.0, origin: float | None = None, begin: float | None = None) -> None:
        self.rate = rate
        self.origin, self.begin = origin, begin
        if rate != 1.0 and (origin is None or begin is None):
            self.origin, self.begin = time.monotonic(), time.time()

    def mono(self) -> float:
        """Time that has passed since some moment [s]."""
        return time.monotonic() * self.rate

    def wall(self) -> float:
        """Time since 1970 in UTC [s]; of a machine whose clock is set, it jumps."""
        if self.origin is None or self.begin is None:
            return time.time()
        return self.begin + (time.monotonic() - self.origin) * self.rate

    def real(self, seconds: float) -> float:
        """Tell how long a time takes on the machine's clock [s].

        Parameters
        ----------
        seconds : float
            On this one [s].
        """
        return seconds / self.rate
