"""What a collector writes through: the database, or the spool while there is none."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from typing import Literal

from mpc.errors import HistorianError
from mpc.live.historian.samples import Samples
from mpc.live.historian.spool import Spool
from mpc.live.historian.store import Historian


class Recorder:
    """Takes samples, and acknowledges each once it is on disk somewhere.

    Parameters
    ----------
    historian : Historian
        Database.
    spool : Spool
        Where samples wait for it.
    units : mapping of str to str, optional
        Of points.
    retry : float
        Time between two looks whether the database is back [s].
    now : callable
        Monotonic clock [s].

    Attributes
    ----------
    trouble : str
        What the database said last; empty while it takes samples.
    """

    def __init__(
        self,
        historian: Historian,
        spool: Spool,
        units: Mapping[str, str] | None = None,
        retry: float = 10.0,
        now: Callable[[], float] = time.monotonic,
    ) -> None:
        self.historian, self.spool, self.units, self.retry, self._now = historian, spool, units or {}, retry, now
        self.trouble, self._next, self._ready = "", -float("inf"), False

    def record(self, samples: Samples) -> Literal["committed", "spooled"]:
        """Take samples; where they are is what it returns.

        Parameters
        ----------
        samples : Samples
            To be kept.

        Raises
        ------
        HistorianError
            When neither takes them: they are not acknowledged.
        """
        if self.trouble and self._now() < self._next:
            self.spool.append(samples)
            return "spooled"
        try:
            if not self._ready:
                self.historian.migrate()
                self._ready = True
            self.spool.drain(self._write)
            self._write(samples)
        except HistorianError as error:
            self.trouble, self._next, self._ready = str(error), self._now() + self.retry, False
            self.spool.append(samples)
            return "spooled"
        self.trouble = ""
        return "committed"

    def _write(self, samples: Samples) -> None:
        self.historian.write(samples, self.units)
