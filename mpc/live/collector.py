"""The collector's process: reads every point, and has the historian keep it."""

from __future__ import annotations

import asyncio
import contextlib
import math
from typing import Any

import numpy as np
import pandas as pd

from mpc.errors import HistorianError
from mpc.live.audit import AuditLog, code_version
from mpc.live.clock import Clock
from mpc.live.historian.recorder import Recorder
from mpc.live.historian.samples import Samples
from mpc.live.historian.spool import Spool
from mpc.live.historian.store import Historian
from mpc.live.links.link import Link
from mpc.live.links.make import make_links
from mpc.live.pace import Pace
from mpc.live.site import Site
from mpc.live.state import write_state
from mpc.loop.conversion import SIGNAL_UNITS
from thermal.case.points import POINT_TYPES

#: Time between two deletions of what is older than the retention [s].
_TRIM_EVERY = 3600.0


class Collector:
    """Runs a site's collector.

    Parameters
    ----------
    site : Site
        As read.
    clock : Clock, optional
        The site's by default.
    """

    def __init__(self, site: Site, clock: Clock | None = None) -> None:
        self.site, self.clock = site, clock or site.clock()
        database = site.file.database
        kinds = {name: POINT_TYPES.get(name.rpartition("/")[2]) for name in site.file.points}
        units = {name: SIGNAL_UNITS[kind.quantity] for name, kind in kinds.items() if kind is not None}
        self.recorder = Recorder(
            Historian(database.address, database.schema_name), Spool(site.folder / "spool", database.spool * 10**6),
            units, retry=self.clock.real(10.0),
        )  # fmt: skip
        begin = {"code": code_version(), "configuration": site.hash, "wall": self.clock.wall()}
        self.log = AuditLog(site.folder, "collector", lambda: begin)
        self.log.append("start", begin)
        self._pace = Pace(self.clock)
        self._trimmed = -math.inf
        self.lost = 0

    async def run(self) -> int:
        """Collect until it is ended; return the exit code."""
        self._pace.heed_signals()
        links = make_links(self.site)
        for link in links.values():
            await link.open()
        try:
            while not self._pace.ending:
                begin = self.clock.mono()
                await self.collect(links)
                await self._pace.rest(begin, self.site.file.collect)
            return 0
        finally:
            for link in links.values():
                await link.close()
            self.recorder.historian.close()
            self.log.close()

    async def collect(self, links: dict[str, Link]) -> None:
        """Read all points once, have them kept, and write down where they are.

        Parameters
        ----------
        links : dict of str to Link
            Open connections.
        """
        points = self.site.file.points
        readings: dict[str, dict[str, Any]] = {}
        parts = await asyncio.gather(
            *(link.read([p for p in points if points[p].connection == name], slots=False)
              for name, link in links.items())
        )  # fmt: skip
        for part in parts:
            readings |= part
        wall = self.clock.wall()
        told = [(name, reading["value"]) for name, reading in readings.items() if not reading["error"]]
        values = np.array([math.nan if value is None else value for _, value in told])
        samples = Samples([name for name, _ in told], np.full(len(told), wall), values)
        errors = sorted({reading["error"] for reading in readings.values() if reading["error"]})
        where: str = "nothing"
        try:
            if len(samples):
                where = self.recorder.record(samples)
        except HistorianError as error:
            where, self.lost = "refused", self.lost + len(samples)
            errors.append(str(error))
        content = {"time": wall, "samples": len(samples), "where": where, "errors": errors[:5]}
        self.log.append("read", content)
        self._trim(wall)
        write_state(self.site.folder / "collector.json", content | {
            "missing": len(points) - len(told), "trouble": self.recorder.trouble, "lost": self.lost,
            "waiting": not self.recorder.spool.empty,
        })  # fmt: skip

    def _trim(self, wall: float) -> None:
        """Delete what is older than the retention, now and then."""
        kept = self.site.file.database.retention
        if kept is None or self.recorder.trouble or wall - self._trimmed < _TRIM_EVERY:
            return
        self._trimmed = wall
        with contextlib.suppress(HistorianError):  # the next batch tells what is wrong
            self.recorder.historian.trim(pd.Timestamp(wall - 86_400.0 * kept, unit="s", tz="UTC"))


def run_collector(site: Site, clock: Clock | None = None) -> int:
    """Collect a site's samples until the process is ended; return the exit code.

    Parameters
    ----------
    site : Site
        As read.
    clock : Clock, optional
        The site's by default.
    """

    async def main() -> int:
        return await Collector(site, clock).run()

    return asyncio.run(main())
