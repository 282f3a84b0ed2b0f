"""One EnergyPlus run in a process of its own: ``python worker.py JOB.json``.

EnergyPlus' state is global to a process and leaks between runs, so nothing else runs here, and nothing of the library
is imported. A thread holds EnergyPlus, whose callbacks wait at a queue; the main thread reads commands, one line of
JSON each, from standard input. When that ends the parent is gone or done: EnergyPlus is stopped and the process leaves.
"""

import json
import os
import queue
import shutil
import sys
import threading
from pathlib import Path
from typing import Any

_STACK = 256 * 1024 * 1024  # B: EnergyPlus' main loop was not written for the small stacks of threads
_PATIENCE = 20.0  # s, for EnergyPlus to stop when the parent is gone
_RUN_PERIOD = 3  # kind of simulation: a run period of a weather file
_NO_HANDLES, _BROKEN = 3, 4  # exit codes


class _Run:
    """A run: actions before each step, means over it after.

    Parameters
    ----------
    job : dict
        ``model``, ``weather``, ``out``: paths; ``options`` of the command line; ``stepped``: whether it waits at
        each step; ``variables``: name and key each; ``products``: pairs of
        variables whose product is averaged too; ``meters``: names; ``actuators``: component type, control type and
        key each.
    channel : file
        Where messages go, one line of JSON each.
    """

    def __init__(self, job: dict[str, Any], channel: Any) -> None:
        from pyenergyplus.api import EnergyPlusAPI

        self.job, self.channel = job, channel
        self.commands: queue.Queue[dict[str, Any] | None] = queue.Queue()
        self.api = EnergyPlusAPI()
        self.state = self.api.state_manager.new_state()
        self.exchange = self.api.exchange
        self.handles: dict[str, list[int]] = {}
        self.left, self.stopped, self.pending = 0, False, False
        self.taken: dict[str, list[list[float]]] = {"rows": [], "ends": [], "energy": []}
        self.sums: list[float] = []
        self.last: list[float] = []
        self.hours = 0.0

    def send(self, message: dict[str, Any]) -> None:
        """Send a message to the parent."""
        self.channel.write(json.dumps(message) + "\n")
        self.channel.flush()

    def run(self) -> None:
        """Run EnergyPlus to its end; called in a thread."""
        job, runtime = self.job, self.api.runtime
        for name, key in job["variables"]:
            self.exchange.request_variable(self.state, name, key)
        runtime.set_console_output_status(self.state, False)
        if job["stepped"]:
            runtime.callback_begin_zone_timestep_before_set_current_weather(self.state, self.guarded(self.begin))
            runtime.callback_end_system_timestep_after_hvac_reporting(self.state, self.guarded(self.add))
            runtime.callback_end_zone_timestep_after_zone_reporting(self.state, self.guarded(self.end))
        arguments = ["-w", job["weather"], "-d", job["out"], *job["options"], job["model"]]
        code = int(runtime.run_energyplus(self.state, arguments))
        self.send({"done": code})

    def guarded(self, call: Any) -> Any:
        """Let an exception end the process: it would not leave EnergyPlus' callback."""

        def called(state: Any) -> None:
            try:
                call()
            except BaseException as error:
                self.send({"broken": f"{type(error).__name__}: {error}"})
                os._exit(_BROKEN)

        return called

    @property
    def counts(self) -> bool:
        """Whether the step is one of the run period, its warm-up over."""
        x, s = self.exchange, self.state
        if self.stopped or not x.api_data_fully_ready(s) or x.warmup_flag(s) or x.kind_of_sim(s) != _RUN_PERIOD:
            return False
        if not self.handles:
            self.find()
        return True

    def find(self) -> None:
        """Get all handles; -1 is no handle, and what is read through it is 0."""
        x, job = self.exchange, self.job
        gets = {"variables": x.get_variable_handle, "meters": x.get_meter_handle, "actuators": x.get_actuator_handle}
        missing: dict[str, list[Any]] = {}
        for kind, get in gets.items():
            named = [[what] if isinstance(what, str) else what for what in job[kind]]
            self.handles[kind] = [get(self.state, *what) for what in named]
            lost = [what for what, handle in zip(job[kind], self.handles[kind], strict=True) if handle < 0]
            missing |= {kind: lost} if lost else {}
        if missing:
            self.send({"missing": missing})
            os._exit(_NO_HANDLES)
        self.clear()

    def begin(self) -> None:
        """Wait for a command where the last is used up, before a step."""
        if not self.counts:
            return
        if self.left == 0:
            command = self.commands.get()
            if command is None or not command["steps"]:
                self.stopped = True
                self.api.runtime.stop_simulation(self.state)
                return
            self.left = int(command["steps"])
            for handle, value in zip(self.handles["actuators"], command["values"], strict=True):
                if value is None:
                    self.exchange.reset_actuator(self.state, handle)
                else:
                    self.exchange.set_actuator_value(self.state, handle, value)
        self.pending = True

    def add(self) -> None:
        """Add a system step, of which a step may have several, to the sums."""
        if not self.pending or not self.counts:
            return
        hours = float(self.exchange.system_time_step(self.state))
        self.last = [self.exchange.get_variable_value(self.state, handle) for handle in self.handles["variables"]]
        values = self.last + [self.last[i] * self.last[j] for i, j in self.job["products"]]
        self.sums = [total + hours * value for total, value in zip(self.sums, values, strict=True)]
        self.hours += hours

    def end(self) -> None:
        """Keep a step that has ended; send what was asked for when it is complete."""
        if not self.pending or not self.counts:
            return
        self.pending = False
        energy = [self.exchange.get_meter_value(self.state, handle) for handle in self.handles["meters"]]
        step = ([total / self.hours for total in self.sums], self.last, energy)
        for kept, values in zip(self.taken.values(), step, strict=True):
            kept.append(values)
        self.clear()
        self.left -= 1
        if self.left == 0:
            self.send(self.taken)
            self.taken = {kind: [] for kind in self.taken}

    def clear(self) -> None:
        """Start the sums of a step."""
        self.sums, self.hours = [0.0] * (len(self.job["variables"]) + len(self.job["products"])), 0.0


def _main() -> None:
    """Run the job of the command line until it ends, or the parent does."""
    channel = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)  # whatever EnergyPlus prints goes to the log
    path = Path(sys.argv[1])
    run = _Run(json.loads(path.read_text(encoding="utf-8")), channel)
    threading.stack_size(_STACK)
    thread = threading.Thread(target=run.run, daemon=True)
    thread.start()
    for line in sys.stdin:
        run.commands.put(json.loads(line))
    run.commands.put(None)
    thread.join(_PATIENCE)
    shutil.rmtree(path.parent, ignore_errors=True)  # the parent's to remove, but it may be gone
    os._exit(0)


if __name__ == "__main__":
    _main()
