"""A unit behind BOPTEST's REST API, as BOPTEST's own test case serves it: inputs keep what they were sent last."""

from __future__ import annotations

import json
import threading
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mpc.adapters.boptest.scenario import DAY, YearClock
from mpc.adapters.described.series import unit_notes, unit_tables
from mpc.adapters.fmu.unit import Unit

STEP = 30.0  # s, of what the server notes down


class ServedUnit:
    """A test case: the payloads of requests."""

    def __init__(self, path: Path) -> None:
        self.path, self.unit, self.step, self.time = path, Unit(path), 3600.0, 0.0
        self.tables = unit_tables(path, YearClock(1970, "UTC"))  # seconds of the year are seconds since 1970
        variables = self.unit.variables
        self.inputs = list(self.unit.inputs)
        echoes = {name.removesuffix("_u") + "_y" for name in self.inputs if name.endswith("_u")}
        self.echoes = {name: name.removesuffix("_u") + "_y" for name in self.inputs if name.endswith("_u")}
        self.outputs = [n for n, v in variables.items() if v.causality == "output" and n not in echoes]
        self.rows: list[dict[str, float]] = []

    def described(self, name: str) -> dict[str, Any]:
        v = self.unit.variables[name]
        low, high = (None if text is None else float(text) for text in (v.min, v.max))
        return {"Unit": v.unit, "Description": "", "Minimum": low, "Maximum": high}

    def state(self) -> dict[str, float]:
        switches = [name for name in self.inputs if name.endswith("_activate")]
        values = self.unit.get([*self.outputs, *self.echoes.values(), *switches])
        return {"time": self.time, **{n: values[self.echoes.get(n, n)] for n in (*self.outputs, *self.inputs)}}

    def run(self, until: float) -> None:
        while self.time < until:
            self.unit.step(self.time, STEP)
            self.time += STEP
            self.rows.append(self.state())

    def begin(self, start: float, warm_up: float) -> dict[str, float]:
        self.time = max(start - warm_up, 0.0)
        self.unit.start(self.time, {})
        self.rows = [self.state()]
        self.run(start)
        return self.state()

    def answer(self, method: str, what: str, body: dict[str, Any]) -> Any:
        if what == "inputs":
            return {name: self.described(name) for name in self.inputs}
        if what == "measurements":
            return {name: self.described(name) for name in self.outputs}
        if what == "forecast_points":
            return {name: {"Unit": "", "Description": ""} for table in self.tables for name in table.values}
        if what == "step":
            self.step = float(body.get("step", self.step))
            return self.step
        if what == "scenario" and method == "PUT" and "time_period" in body:
            day = unit_notes(self.path, "days")[body["time_period"]]
            return {"time_period": self.begin((day - 7) * DAY, 7 * DAY)}
        if what == "initialize":
            return self.begin(body["start_time"], body["warmup_period"])
        if what == "advance":
            self.unit.set({name: float(value) for name, value in body.items()})
            self.run(self.time + self.step)
            return self.state()
        if what == "forecast":
            times = self.time + np.arange(0.0, body["horizon"] + 1.0, body["interval"])
            found: dict[str, list[float]] = {"time": times.tolist()}
            for name in body["point_names"]:
                table = next(t for t in self.tables if name in t.values)
                weather, values = "weather" in table.where, table.values[name]
                last = np.searchsorted(table.seconds, times, side="right") - 1
                found[name] = (np.interp(times, table.seconds, values) if weather else values[last]).tolist()
            return found
        if what == "results":
            rows = [row for row in self.rows if body["start_time"] <= row["time"] <= body["final_time"]]
            return {name: [row[name] for row in rows] for name in (*body["point_names"], "time")}
        return {"version": {"version": "0.7.1"}, "name": {"name": "house"}}.get(what, {})


@pytest.fixture
def boptest_url(make_house: Any, boptest_resources: dict[str, str]) -> Iterator[str]:
    """Address of a server with the house."""
    served, lock = ServedUnit(make_house(kinds=("CoSimulation",), resources=boptest_resources)), threading.Lock()

    class Handler(BaseHTTPRequestHandler):
        def do(self) -> None:
            parts = self.path.strip("/").split("/")
            body = json.loads(self.rfile.read(int(self.headers.get("content-length", 0))) or b"{}")
            with lock:
                payload = None if parts[0] == "testcases" else served.answer(self.command, parts[0], body)
            content = {"status": 200, "message": "fine", "payload": payload}
            data = json.dumps({"testid": "1"} if parts[0] == "testcases" else content).encode()
            self.send_response(200)
            self.send_header("content-length", str(len(data)))
            self.end_headers()
            self.wfile.write(data)

        do_GET = do_PUT = do_POST = do  # noqa: N815

        def log_message(self, *arguments: Any) -> None:
            """Say nothing."""

    server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    server.daemon_threads = True
    thread = threading.Thread(target=server.serve_forever, args=(0.02,), daemon=True)
    thread.start()
    yield f"http://127.0.0.1:{server.server_port}"
    server.shutdown()
    server.server_close()
    thread.join()
    served.unit.close()
