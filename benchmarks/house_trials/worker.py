"""One EnergyPlus run in a process of its own: `python worker.py JOB.json`.

The runtime API leaks state between runs, so nothing else runs here. Thermostats live here too: each step they read what
the rooms' sensors show and set the heaters of the next one.
"""

from __future__ import annotations

import json
import math
import os
import sys
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

STEP = 300.0  # [s]


class Heater:
    """A heater and its thermostat.

    Parameters
    ----------
    law : dict
        `power` [W], `lag` [s], `control` (`on_off` or `proportional`), `band` [K], `bias` [K], what its sensor reads
        too much, `limit`, the largest share of its power that it truly gives [-], and `limited`, the first step of that
        and the step after it; all by default.
    """

    def __init__(self, law: dict[str, Any]) -> None:
        self.law, self.on, self.stored = law, False, 0.0
        self.limited = range(*law["limited"]) if "limited" in law else None

    def step(self, air: float, set_point: float, row: int) -> tuple[float, float]:
        """Return the power that is asked for and the mean power given in the next step [W].

        Parameters
        ----------
        air, set_point : float
            [degC]
        row : int
            Number of the step.
        """
        law = self.law
        limit = law["limit"] if self.limited is None or row in self.limited else 1.0
        low = set_point - air - law["bias"]
        if law["control"] == "on_off":
            self.on = low > law["band"] / 2.0 or (self.on and low > -law["band"] / 2.0)
            asked = law["power"] * self.on
        else:
            asked = law["power"] * min(max(low / law["band"] + 0.3, 0.0), 1.0)
        given = min(asked, limit * law["power"])
        if law["lag"] <= 0.0:
            return asked, given
        kept = math.exp(-STEP / law["lag"])
        mean = given + (self.stored - given) * (1.0 - kept) * law["lag"] / STEP
        self.stored = given + (self.stored - given) * kept
        return asked, mean


class Recorder:
    """Drives schedules and heaters, and records variables, step by step."""

    def __init__(self, api: Any, state: Any, job: dict[str, Any]) -> None:
        self.exchange, self.state, self.job = api.exchange, state, job
        series = np.load(job["drive"])
        self.names, self.drive, self.set_points = series["names"].tolist(), series["values"], series["set_points"]
        self.values: NDArray[np.float64] = np.full((job["rows"], len(job["variables"])), np.nan)
        self.heat: NDArray[np.float64] = np.zeros((job["rows"], len(job["heaters"]), 2))
        self.heaters = [Heater(law) for law in job["heaters"]]
        self.last: NDArray[np.float64] | None = None
        self.handles: dict[str, list[int]] = {}
        for _, _, name, key in job["variables"]:
            self.exchange.request_variable(state, name, key)

    def row(self) -> int:
        """Return the number of the present step; the warm-up repeats the first day."""
        x, s = self.exchange, self.state
        day = x.day_of_year(s) - self.job["first_day"]
        return int((day * 24 + x.hour(s)) * 12 + x.zone_time_step_number(s) - 1)

    def ready(self) -> bool:
        """Tell whether handles can be had, and get them once."""
        if not self.exchange.api_data_fully_ready(self.state):
            return False
        if not self.handles:
            x, s = self.exchange, self.state
            schedules = {"drive": self.names, "heater": [law["schedule"] for law in self.job["heaters"]]}
            found = {
                kind: [x.get_actuator_handle(s, "Schedule:Constant", "Schedule Value", name) for name in names]
                for kind, names in schedules.items()
            }
            wanted = [v[2:] for v in self.job["variables"]]
            found["variable"] = [x.get_variable_handle(s, *names) for names in wanted]
            missing = [
                str(what)
                for kind, names in (schedules | {"variable": wanted}).items()
                for handle, what in zip(found[kind], names, strict=True)
                if handle < 0
            ]
            if missing:
                # an exception would not leave EnergyPlus's callback: the process ends here
                print(f"EnergyPlus has no variable or actuator {missing}", file=sys.stderr, flush=True)
                os._exit(3)
            self.handles = found
        return True

    def begin(self, state: Any) -> None:
        """Set schedules and heaters before a step."""
        if not self.ready():
            return
        row, set_value = self.row(), self.exchange.set_actuator_value
        for handle, value in zip(self.handles["drive"], self.drive[row].tolist(), strict=True):
            set_value(state, handle, value)
        for k, (heater, handle) in enumerate(zip(self.heaters, self.handles["heater"], strict=True)):
            law, wanted = heater.law, float(self.set_points[row, k])
            air = wanted if self.last is None else float(self.last[law["column"]])
            asked, given = heater.step(air, wanted, row)
            self.heat[row, k] = asked, given
            switch = 60.0 if asked > 0.0 else -60.0  # [degC], far from any room's temperature: full power or none
            set_value(state, handle, switch if law["floor"] else given / law["power"])

    def end(self, state: Any) -> None:
        """Record after a step."""
        if self.handles:  # the warm-up, which thermostats need, is overwritten by the first day
            get = self.exchange.get_variable_value
            self.last = np.array([get(state, handle) for handle in self.handles["variable"]])
            self.values[self.row()] = self.last


def main() -> int:
    """Run the job of the command line."""
    from pyenergyplus.api import EnergyPlusAPI

    job = json.loads(Path(sys.argv[1]).read_text(encoding="utf-8"))
    api = EnergyPlusAPI()
    state = api.state_manager.new_state()
    api.runtime.set_console_output_status(state, False)
    recorder = Recorder(api, state, job)
    api.runtime.callback_begin_zone_timestep_before_set_current_weather(state, recorder.begin)
    api.runtime.callback_end_zone_timestep_after_zone_reporting(state, recorder.end)
    code = int(api.runtime.run_energyplus(state, ["-w", job["weather"], "-d", job["out"], job["input"]]))
    np.savez(job["result"], values=recorder.values, heat=recorder.heat)
    return code


if __name__ == "__main__":
    sys.exit(main())
