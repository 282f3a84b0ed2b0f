"""The nightly evaluation: what the historian kept is held against the model, and what has changed is named."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping
from typing import Any

import pandas as pd

from calibration.monitoring.monitor import Monitoring, MonitorSettings, monitor
from mpc.errors import LiveError
from mpc.live.audit import AuditLog, code_version
from mpc.live.clock import Clock
from mpc.live.notify import Notifier
from mpc.live.pace import Pace
from mpc.live.site import Site
from mpc.live.site_file import NightlyEntry
from mpc.live.state import read_state, write_state
from mpc.reports.monitoring import event_rows, monitoring_verdict, write_monitoring
from thermal.case.building import Building
from thermal.case.case import Case
from thermal.case.load import load_building
from thermal.intake.historian import historian_telemetry

#: Longest sleep between two looks at the wall clock, which may be set meanwhile [s].
_SLEEP = 60.0


class Nightly:
    """Evaluates a site's building.

    Parameters
    ----------
    site : Site
        As read, with `nightly`.

    Raises
    ------
    LiveError
        When the site's file has no section `nightly`.
    """

    def __init__(self, site: Site) -> None:
        expected = "a section `nightly` of the site's file"
        LiveError.unless(site.file.nightly is not None, f"{site.path.name}: nightly", expected, "none")
        self.site, self.entry = site, site.file.nightly or NightlyEntry()
        self.building: Building = load_building(site.path.parent / self.entry.building)
        self.zone = self.building.location.timezone
        self.state_path = site.folder / "nightly.json"

    def due(self, now: float) -> float:
        """Tell when the next evaluation is due, since 1970 in UTC [s]: at once where there was none.

        Parameters
        ----------
        now : float
            Wall clock, since 1970 in UTC [s].
        """
        last = read_state(self.state_path).get("time")
        if last is None or last > now:
            return now
        hour, _, minute = self.entry.at.partition(":")
        when = self._local(last).normalize() + pd.DateOffset(hours=int(hour), minutes=int(minute))
        if when.timestamp() <= last:
            when += pd.DateOffset(days=1)
        return float(when.timestamp())

    def _local(self, time: float) -> pd.Timestamp:
        return pd.Timestamp(time, unit="s", tz="UTC").tz_convert(self.zone)

    def evaluate(self, now: float) -> dict[str, Any]:
        """Evaluate all whole days until now; write the report and the state, and return the latter.

        Parameters
        ----------
        now : float
            Wall clock, since 1970 in UTC [s].

        Returns
        -------
        dict
            ``time`` [s]; ``begin``, ``end`` of the days; ``sentence``; ``events``: of each change ``effect``, ``what``,
            ``where``, ``since``, ``until``, ``sure``, ``size``, ``noticed``, ``others``; ``weekly``: mean absolute
            error of the model by week [K]; ``trouble``: why there is no verdict of this night, beside which the last
            one stands.
        """
        begin, end = pd.Timestamp(self.entry.begin).tz_localize(self.zone), self._local(now).normalize()
        last = read_state(self.state_path)
        state = {"sentence": "", "events": [], "weekly": [], "begin": str(begin.date()), **last, "time": now}
        try:
            found = self.watch(begin, end)
            write_monitoring(found, self.site.folder / "nightly", force=True)
            state |= told(found) | {"end": str(end.date()), "trouble": ""}
        except Exception as error:  # a night without a verdict is told, and the next one tries again
            state["trouble"] = " ".join(str(error).split())[:300] or type(error).__name__
        write_state(self.state_path, state)
        return state

    def watch(self, begin: pd.Timestamp, end: pd.Timestamp) -> Monitoring:
        """Read the historian, and go through it day by day.

        Parameters
        ----------
        begin, end : Timestamp
            Local midnights.
        """
        entry, database = self.entry, self.site.file.database
        found = historian_telemetry(
            self.building, database.address, (begin, end), entry.step, schema=database.schema_name
        )  # fmt: skip
        parameters = None if entry.parameters is None else self.site.path.parent / entry.parameters
        settings = MonitorSettings(reference_days=entry.reference_days)
        return monitor(Case(self.building, found.telemetry), parameters, settings)


def told(found: Monitoring) -> dict[str, Any]:
    """Say in plain types what a monitoring found.

    Parameters
    ----------
    found : Monitoring
        Of all days.
    """
    keys = ("what", "where", "since", "until", "sure", "size", "noticed", "others")
    events = [
        {"effect": event.effect, **{key: str(row[key]) for key in keys}}
        for event, row in zip(found.events, event_rows(found), strict=True)
    ]  # fmt: skip
    weekly = [None if v != v else round(float(v), 3) for v in found.weekly()["mae"]]
    return {"sentence": monitoring_verdict(found), "events": events, "weekly": weekly}


def fresh(before: Mapping[str, Any], after: Mapping[str, Any]) -> list[str]:
    """List the changes that last and were not told before.

    Parameters
    ----------
    before, after : mapping
        States of `Nightly.evaluate`.
    """
    known = {(one["what"], one["where"]) for one in before.get("events", []) if one["until"] == "lasts"}
    lasting = [one for one in after["events"] if one["until"] == "lasts"]
    return [f"since {one['since']}: {one['what']} {one['where']} ({one['sure']})" for one in lasting
            if (one["what"], one["where"]) not in known]  # fmt: skip


def run_nightly(site: Site, clock: Clock | None = None) -> int:
    """Wait for the next evaluation, do it, and end, so that its memory is free until the next; return the exit code.

    Parameters
    ----------
    site : Site
        As read.
    clock : Clock, optional
        The site's by default.
    """
    clock, nightly = clock or site.clock(), Nightly(site)

    async def waited() -> bool:
        pace = Pace(clock)
        pace.heed_signals()
        while not pace.ending and (left := nightly.due(clock.wall()) - clock.wall()) > 0.0:
            await pace.rest(clock.mono(), min(left, _SLEEP))
        return not pace.ending

    if not asyncio.run(waited()):
        return 0
    before, now = read_state(nightly.state_path), clock.wall()
    begin = {"code": code_version(), "configuration": site.hash, "wall": now}
    log = AuditLog(site.folder, "nightly", lambda: begin)
    log.append("start", begin)
    state = nightly.evaluate(now)
    log.append("night", {key: value for key, value in state.items() if key != "weekly"})
    log.close()
    alarms = fresh(before, state)
    if alarms:
        Notifier(site.file.notify, site.file.name).send(alarms, now)
    return 0
