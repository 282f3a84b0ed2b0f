"""One EnergyPlus run in a process of its own: `python worker.py JOB.json`.

The runtime API leaks state between runs, so nothing else runs here. The job names the input, the weather, the series
that drive schedules, the laws of heat that depend on the building's own state, and the variables to record.
"""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path
from typing import Any

import numpy as np
from laws import make_law
from numpy.typing import NDArray


class Recorder:
    """Drives schedules and records variables, step by step."""

    def __init__(self, api: Any, state: Any, job: dict[str, Any]) -> None:
        self.exchange, self.state, self.job = api.exchange, state, job
        series = np.load(job["drive"])
        self.names, self.drive = series["names"].tolist(), series["values"]
        self.values: NDArray[np.float64] = np.full((job["rows"], len(job["variables"])), np.nan)
        self.columns = {tuple(v[:2]): k for k, v in enumerate(job["variables"])}
        self.laws = [make_law(law, self.column) for law in job["laws"]]
        self.variables: list[int] = []
        self.actuators: list[int] = []
        self.equipment: list[int] = []
        for _, _, name, key in job["variables"]:
            self.exchange.request_variable(state, name, key)

    def column(self, entity: str, output: str) -> int:
        """Return the column of an output."""
        return self.columns[entity, output]

    def row(self) -> int:
        """Return the number of the present step; the warm-up repeats the first day."""
        x, s = self.exchange, self.state
        day = x.day_of_year(s) - self.job["first_day"]
        return (day * 24 + x.hour(s)) * 12 + x.zone_time_step_number(s) - 1

    def ready(self) -> bool:
        """Tell whether handles can be had, and get them once."""
        if not self.exchange.api_data_fully_ready(self.state):
            return False
        if not self.variables:
            x, s = self.exchange, self.state
            self.variables = [x.get_variable_handle(s, name, key) for _, _, name, key in self.job["variables"]]
            self.actuators = [x.get_actuator_handle(s, "Schedule:Constant", "Schedule Value", n) for n in self.names]
            self.equipment = [x.get_actuator_handle(s, "OtherEquipment", "Power Level", w.device) for w in self.laws]
            missing = [
                str(what)
                for handles, wanted in (
                    (self.variables, self.job["variables"]),
                    (self.actuators, self.names),
                    (self.equipment, [w.device for w in self.laws]),
                )
                for handle, what in zip(handles, wanted, strict=True)
                if handle < 0
            ]
            if missing:
                # an exception would not leave EnergyPlus's callback: the process ends here
                print(f"EnergyPlus has no variable or actuator {missing}", file=sys.stderr, flush=True)
                os._exit(3)
        return True

    def begin(self, state: Any) -> None:
        """Set schedules and laws before a step."""
        if not self.ready():
            return
        row = self.row()
        for handle, value in zip(self.actuators, self.drive[row].tolist(), strict=True):
            self.exchange.set_actuator_value(state, handle, value)
        for law, handle in zip(self.laws, self.equipment, strict=True):
            watts = (
                law.watts(self.values[row - 1])
                if row > 0 and self.values[row - 1, 0] == self.values[row - 1, 0]
                else 0.0
            )
            self.exchange.set_actuator_value(state, handle, watts)

    def end(self, state: Any) -> None:
        """Record after a step."""
        if self.variables:  # the warm-up, which laws need, is overwritten by the first day
            get = self.exchange.get_variable_value
            self.values[self.row()] = [get(state, handle) for handle in self.variables]


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
    np.save(job["result"], recorder.values)
    return code


if __name__ == "__main__":
    sys.exit(main())
