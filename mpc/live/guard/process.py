"""The guard's process: looks, decides, writes the decision down, and only then writes to the building."""

from __future__ import annotations

import asyncio
import contextlib
import fcntl
import json
import os
from collections.abc import Mapping
from concurrent.futures import Future
from threading import Thread
from typing import Any

from mpc.errors import LiveError
from mpc.live.audit import AuditLog, code_version, log_files, log_lines
from mpc.live.clock import Clock
from mpc.live.guard.decide import Guard
from mpc.live.guard.rules import rules_of
from mpc.live.guard.socket import Mailbox, serve_socket
from mpc.live.links.link import Link
from mpc.live.links.make import make_links
from mpc.live.notify import Notifier
from mpc.live.operators import operator_key
from mpc.live.pace import Pace
from mpc.live.site import Site

#: Ticks that the end of the guard takes at most, so that releases are seen to have been done.
_LAST_TICKS = 5

#: How long a line of the log may take, as a share of the control step: everything is given back within one step.
_PATIENCE = 0.5

#: Answers to requests of operators that the status keeps: more than are asked for while somebody waits.
_ANSWERS = 50


class GuardProcess:
    """Runs a site's guard.

    Parameters
    ----------
    site : Site
        As read.
    clock : Clock, optional
        The site's by default.

    Raises
    ------
    LiveError
        When another guard of the site runs.
    """

    def __init__(self, site: Site, clock: Clock | None = None) -> None:
        self.site, self.clock = site, clock or site.clock()
        self.rules = rules_of(site)
        self._lock = os.open(site.folder / "guard.lock", os.O_CREAT | os.O_RDWR, 0o600)
        try:
            fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            raise LiveError("guard", "one guard a site", "another that runs", "end it first") from error
        self._links: dict[str, Link] = make_links(site)
        modes, held = left_before(site)
        self.guard = Guard(self.rules, modes, held)
        self.log = AuditLog(site.folder, "guard", self._turned)
        self.log.append("start", self._begin(modes, held))
        self.mailbox = Mailbox(operator_key(site.folder), self.clock.mono)
        self._results: dict[str, str] = {}
        self._ordered: float | None = None
        self._pace = Pace(self.clock)
        self._notifier = Notifier(site.file.notify, site.file.name)
        self._status: dict[str, Any] = {}
        self._answers: dict[str, str] = {}

    def _begin(self, modes: Mapping[str, str], held: Mapping[str, float]) -> dict[str, Any]:
        """Give what a file of the log says first: what the decisions after it follow from."""
        return {"code": code_version(), "rules": self.rules.to_dict(), "modes": dict(modes), "held_before": dict(held),
                "wall": self.clock.wall(), "mono": self.clock.mono()}  # fmt: skip

    def _turned(self) -> dict[str, Any]:
        state = self.guard.state
        ordered = {name: value for name, value in state.orders.items() if value is not None}
        return self._begin(state.modes, state.held | ordered) | {"state": state.to_dict()}

    async def run(self) -> int:
        """Guard until it is ended; return the exit code.

        Raises
        ------
        LiveError
            When the log takes no more lines: everything was given back.
        """
        self._pace.heed_signals()
        for link in self._links.values():
            await link.open()
        server = await serve_socket(self.site.sockets, self.mailbox, lambda: self._status)
        try:
            return await self._watch()
        except LiveError as error:  # the log cannot be written: nothing may be, but to give everything back
            for _ in range(2):
                await self._order({}, list(self.rules.points))
            self._notifier.tell([f"the guard ends: {error}"], self.clock.wall())
            raise
        finally:
            server.close()
            for link in self._links.values():
                await link.close()
            self.log.close()
            os.close(self._lock)

    async def _watch(self) -> int:
        """Tick until the end, and on until everything is seen to be given back."""
        left = _LAST_TICKS
        while True:
            begin = self.clock.mono()
            stopping = self._pace.ending
            decision = await self.tick(stopping)
            if not stopping:
                await self._pace.rest(begin, self.rules.limits.tick)
                continue
            left -= 1
            if not decision["giving_back"] or not left:
                return 0
            wait = self.clock.real(self.rules.limits.tick - (self.clock.mono() - begin))
            await asyncio.sleep(min(max(wait, 0.0), 0.2))

    async def tick(self, stopping: bool = False) -> dict[str, Any]:
        """Look, decide, write down, order; return the decision.

        Parameters
        ----------
        stopping : bool
            Whether the guard is being ended.
        """
        readings = await self._read()
        tick = {
            "mono": self.clock.mono(), "wall": self.clock.wall(), "beat": self.mailbox.beat, "stopping": stopping,
            "messages": self.mailbox.empty(), "readings": readings, "results": self._results, "ordered": self._ordered,
        }  # fmt: skip
        tick = json.loads(json.dumps(tick, sort_keys=True))  # what is decided on is what the log will say
        decision = self.guard.decide(tick)
        digest = await self._note("tick", {"tick": tick, "decision": decision})
        self._results = await self._order(decision["writes"], decision["releases"])
        self._ordered = self.clock.mono()
        plan = self.guard.state.plan
        known = decision["answers"] | self._answers  # a request that is repeated does not change its first answer
        self._answers = dict(list((self._answers | known).items())[-_ANSWERS:])
        self._status = {
            "site": self.site.file.name, "wall": tick["wall"], "configuration": self.rules.configuration,
            "decision": decision, "readings": readings, "plan": plan, "log": digest, "code": code_version(),
            "dropped": self.mailbox.dropped, "answers": self._answers, "orders": self._results,
            "overridden": sorted(self.guard.state.overridden), "taken": dict(self.guard.state.taken),
        }  # fmt: skip
        self._notifier.tell(decision["doubts"], tick["wall"])
        return decision

    async def _note(self, kind: str, content: Mapping[str, Any]) -> str:
        """Add an event to the log; a disk that takes longer than a share of the step is one that takes nothing."""
        written: Future[str] = Future()

        def write() -> None:
            try:
                written.set_result(self.log.append(kind, content))
            except Exception as error:
                written.set_exception(error)

        Thread(target=write, daemon=True).start()  # of its own: nothing may wait for it, not even the end
        patience = _PATIENCE * self.rules.limits.step
        try:
            return await asyncio.wait_for(asyncio.wrap_future(written), self.clock.real(patience))
        except TimeoutError as error:
            raise LiveError("audit log", "a disk that takes a line", f"none within {patience:g} s") from error

    async def _read(self) -> dict[str, dict[str, Any]]:
        """Read what may be written, of all connections at a time."""

        async def of(name: str) -> dict[str, dict[str, Any]]:
            points = [p for p in self.rules.points if self.site.file.points[p].connection == name]
            return await self._links[name].read(points, slots=True) if points else {}

        found = await asyncio.gather(*(of(name) for name in self._links))
        return {point: reading for part in found for point, reading in part.items()}

    async def _order(self, writes: Mapping[str, float], releases: list[str]) -> dict[str, str]:
        """Write and give back; say by point what became of it."""

        async def one(point: str, value: float | None) -> str:
            rule = self.rules.points[point]
            given = rule.release if value is None and isinstance(rule.release, float) else value
            link = self._links[self.site.file.points[point].connection]
            try:
                return await link.write(point, given)
            except Exception as error:  # whatever a library does, the other points are still to be given back
                return f"{type(error).__name__}: {error}"[:120]

        orders = {**dict.fromkeys(releases), **writes}
        errors = await asyncio.gather(*(one(point, value) for point, value in orders.items()))
        return dict(zip(orders, errors, strict=True))


def left_before(site: Site) -> tuple[dict[str, str], dict[str, float]]:
    """Find what an earlier guard left: modes that operators chose, and what it may have left in force.

    Modes hold on for the same configuration only: who edits the site decides anew.

    Parameters
    ----------
    site : Site
        As read.
    """
    for path in reversed(log_files(site.folder, "guard")):
        start, last = None, None
        try:
            lines = log_lines(path)
        except LiveError:
            continue
        for line in lines:
            with contextlib.suppress(ValueError, TypeError, KeyError):
                entry = json.loads(line)
                if entry["kind"] in ("start", "turned"):
                    start = entry["content"]
                else:
                    last = entry["content"]["decision"]
        if start is None:
            continue
        held: dict[str, float] = dict(start["held_before"]) if last is None else {}
        modes: dict[str, str] = start["modes"] if last is None else last["modes"]
        if last is not None:
            held = {**last["held"], **last["writes"]}
        known = {name: float(value) for name, value in held.items() if name in site.writable}
        if start["rules"]["configuration"] != site.hash:
            modes = {}
        return {name: mode for name, mode in modes.items() if name in site.writable}, known
    return {}, {}


def run_guard(site: Site, clock: Clock | None = None) -> int:
    """Guard a site until the process is ended; return the exit code.

    Parameters
    ----------
    site : Site
        As read.
    clock : Clock, optional
        The site's by default.
    """

    async def main() -> int:
        return await GuardProcess(site, clock).run()

    return asyncio.run(main())
