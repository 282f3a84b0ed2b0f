"""The pace of a process that looks at a building again and again until it is told to end."""

from __future__ import annotations

import asyncio
import contextlib
import signal

from mpc.live.clock import Clock


class Pace:
    """Waits between looks, and knows when there is to be no further one.

    Parameters
    ----------
    clock : Clock
        Of the site.
    """

    def __init__(self, clock: Clock) -> None:
        self._clock, self._end = clock, asyncio.Event()

    def heed_signals(self) -> None:
        """End on SIGTERM and SIGINT; called within the loop of events."""
        for number in (signal.SIGTERM, signal.SIGINT):
            asyncio.get_running_loop().add_signal_handler(number, self._end.set)

    @property
    def ending(self) -> bool:
        """Whether the process was told to end."""
        return self._end.is_set()

    async def rest(self, begin: float, period: float) -> None:
        """Wait for the next look, or the end.

        Parameters
        ----------
        begin : float
            Monotonic clock at the beginning of this look [s].
        period : float
            From one to the next [s].
        """
        left = self._clock.real(period - (self._clock.mono() - begin))
        with contextlib.suppress(TimeoutError):
            await asyncio.wait_for(self._end.wait(), max(left, 0.0))
