"""The controller's process: asks the historian, plans, tells the guard; it writes to no device."""

from __future__ import annotations

import math
import signal
import threading
from types import FrameType
from typing import Any

import numpy as np
import pandas as pd

from mpc.errors import HistorianError, LiveError, MpcError
from mpc.live.audit import AuditLog, code_version
from mpc.live.building import BuildingController
from mpc.live.clock import Clock
from mpc.live.guard.socket import GuardClient
from mpc.live.historian.store import Historian
from mpc.live.outlook import Outlook
from mpc.live.past import recent_past
from mpc.live.picture import DayCost, picture
from mpc.live.planner import Planner, forecast_to_dict, needed_columns, no_plan
from mpc.live.site import Site
from mpc.live.state import read_state, write_state
from mpc.loop.plant import Controller
from thermal.case.points import POINT_TYPES, ZONE_TEMPERATURE

#: Beats within the longest silence that the guard bears: two may be lost.
_BEATS = 4.0

#: Looks at the measurements within a control step, so that a plan is withdrawn well before its step is over.
_LOOKS = 5.0


class ControlProcess:
    """Runs a site's controller.

    Parameters
    ----------
    site : Site
        As read.
    clock : Clock, optional
        The site's by default.
    controller : Controller, optional
        In the place of the site's own.
    """

    def __init__(self, site: Site, clock: Clock | None = None, controller: Controller | None = None) -> None:
        self.site, self.clock = site, clock or site.clock()
        self.planner, self.outlook = Planner(site, controller), Outlook(site.plant_path, site.plant)
        database = site.file.database
        patience = max(self.clock.real(site.step / 3.0), 0.1)
        self.historian = Historian(database.address, database.schema_name, min(patience, 10.0))
        self.columns = needed_columns(site, self.planner.controller)
        self._still: dict[str, tuple[float, float]] = {}
        self.zones = [f"{zone}/{ZONE_TEMPERATURE}" for zone in site.plant.zones]
        begin = {"code": code_version(), "configuration": site.hash, "site": site.path.name,
                 "controller": site.file.controller, "wall": self.clock.wall()}  # fmt: skip
        self.log = AuditLog(site.folder, "controller", lambda: begin)
        self.log.append("start", begin)
        self._day = DayCost(site, read_state(site.folder / "controller.json").get("day"))
        self._stop = threading.Event()

    def run(self) -> int:
        """Control until it is ended; return the exit code."""
        for number in (signal.SIGTERM, signal.SIGINT):
            signal.signal(number, self._end)
        threading.Thread(target=self._beat, daemon=True).start()
        client = GuardClient(self.site.sockets)
        step = self.site.step
        self._start_up(step * (self.clock.wall() // step))
        try:
            while not self._stop.is_set():
                now = self.clock.wall()
                begin = step * (now // step)
                plan, shown = self.plan(begin)
                answer = client.ask({"kind": "plan", "plan": plan})
                write_state(self.site.folder / "controller.json", plan | shown | {"answer": answer, "wall": now})
                self._watch(begin + step, plan, client)
            return 0
        finally:
            client.close()
            self.historian.close()
            self.log.close()

    def _start_up(self, begin: float) -> None:
        """Let the controller know what an earlier process saw, and write down what that was."""
        if isinstance(self.planner.controller, BuildingController):
            past = recent_past(self.site.folder, begin, self.columns)
            self.log.append("start_up", {"past": past, "begin": begin})
            self.planner.start_up(past, begin)

    def _watch(self, end: float, plan: dict[str, Any], client: GuardClient) -> None:
        """Wait for the end of a step, or, without a plan, for a part of it; withdraw the plan when its inputs fail."""
        limits = self.site.limits()
        look = limits["step"] / _LOOKS
        while (left := end - self.clock.wall()) > 0.0 and left <= limits["step"]:
            if self._stop.wait(self.clock.real(min(left, look))) or plan["status"] != "planned":
                return
            trouble = self._trouble(limits["input_age"])
            if trouble:
                made = self.clock.wall()
                plan = plan | no_plan(f"withdrawn: {trouble}") | {"number": int(10.0 * made), "made": made}
                self.log.append("withdraw", {"plan": plan})
                client.ask({"kind": "plan", "plan": plan})

    def _trouble(self, oldest: float) -> str:
        """Say why the measurements of now would not bear a plan."""
        now = self.clock.wall()
        try:
            known = self.historian.latest(self.zones)  # of a clock that was put back, samples of before lie ahead
        except HistorianError as error:
            return f"the historian does not answer: {error}"
        stuck, kind = self.site.limits()["stuck"], POINT_TYPES[ZONE_TEMPERATURE]
        for zone in self.zones:
            time, value = known.get(zone, (now, math.nan))
            if not kind.possible(value):
                return f"{zone} is no number" if value != value else f"{zone} is {kind.told(value)}"
            if time - now > self.site.limits()["clock_jump"]:
                return f"{zone} has a sample {time - now:.0f} s ahead of the clock"
            if now - time > oldest:
                return f"{zone} is {now - time:.0f} s old"
            before, since = self._still.get(zone, (math.nan, time))
            self._still[zone] = (value, since if value == before else time)
            if stuck is not None and now - self._still[zone][1] > stuck:
                return f"{zone} has not moved for {now - self._still[zone][1]:.0f} s"
        return ""

    def _end(self, number: int, frame: FrameType | None) -> None:
        self._stop.set()

    def plan(self, begin: float) -> tuple[dict[str, Any], dict[str, Any]]:
        """Make the plan of a step, and write down of what; and what the page shows of it.

        Parameters
        ----------
        begin : float
            Of the step, since 1970 in UTC [s].
        """
        inputs, latest = self._inputs(begin)
        planned = self.planner.plan(inputs)
        made = self.clock.wall()
        plan = {"number": int(10.0 * made), "made": made, "configuration": self.site.hash, "inputs": latest} | planned
        self.log.append("plan", {"inputs": inputs, "plan": plan})
        return plan, {"picture": picture(self.site, plan, inputs), "day": self._day.add(inputs)}

    def _inputs(self, begin: float) -> tuple[dict[str, Any], dict[str, Any]]:
        """Collect what a plan is made of, and the last value of each measurement with its time."""
        inputs: dict[str, Any] = {"begin": begin, "means": {}, "forecast": None, "trouble": ""}
        latest: dict[str, Any] = {}
        now = self.clock.wall()
        try:
            known = self.historian.latest(list(self.columns))
            asked = [name for name in self.columns if name in known]
            start, end = (pd.Timestamp(t, unit="s", tz="UTC") for t in (now - self.site.step, now + 1e-3))
            inputs["means"] = {k: _mean(k, v) for k, v in self.historian.read(asked, start, end).items()}
            latest = {k: [time, value if value == value else None] for k, (time, value) in known.items()}
            inputs["forecast"] = forecast_to_dict(self.outlook.at(begin))
            inputs["trouble"] = self._trouble(self.site.limits()["input_age"])
        except HistorianError as error:
            inputs["trouble"] = f"the historian does not answer: {error}"
        except (MpcError, OSError) as error:
            inputs["trouble"] = f"no forecast: {error}"
        return inputs, latest

    def _beat(self) -> None:
        """Tell the guard that this process lives, while it plans too."""
        client = GuardClient(self.site.sockets)
        wait = self.clock.real(self.site.limits()["heartbeat"] / _BEATS)
        while not self._stop.wait(wait):
            client.ask({"kind": "beat"})
        client.close()


def _mean(column: Any, series: pd.Series) -> float | None:
    """Mean of what is possible; None where nothing is."""
    values = series.to_numpy(dtype=float)
    kind = POINT_TYPES.get(str(column).rpartition("/")[2])
    good = values[np.isfinite(values)] if kind is None else values[kind.possible(values)]
    return float(good.mean()) if good.size else None


def run_controller_process(site: Site, clock: Clock | None = None) -> int:
    """Control a site until the process is ended; return the exit code.

    Parameters
    ----------
    site : Site
        As read.
    clock : Clock, optional
        The site's by default.
    """
    try:
        return ControlProcess(site, clock).run()
    except LiveError as error:
        write_state(site.folder / "controller.json", {"status": f"ended: {error}"})
        raise
