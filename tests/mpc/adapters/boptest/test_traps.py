"""The client against a server that misbehaves in each of the ways that BOPTEST servers do."""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Callable, Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

import numpy as np
import pytest

from mpc.adapters.boptest.mapping import BoptestSignals
from mpc.adapters.boptest.plant import BoptestPlant, BoptestSettings, BoptestTime
from mpc.errors import BoptestError, BoptestTimeoutError, PlantActionError, PlantError

HOUSE = BoptestSignals(
    {
        "zone/zone_air_temperature_sensor": "reaTZon_y",
        "zone/supply_air_flowrate_sensor": "reaFlo_y",
        "station/wind_direction_sensor": "reaDir_y",
    },
    {"pump/supply_water_temperature_setpoint": "oveTSet_u", "pump/heating_power": "oveHea_u"},
    {"zone": "reaTZon_y"},
    ("reaPPum_y", "reaPFan_y"),
    forecast_zones={"zone": "1"},
)


def entry(unit: str | None, lowest: float | None = None, highest: float | None = None) -> dict[str, Any]:
    return {"Unit": unit, "Description": "of a house", "Minimum": lowest, "Maximum": highest}


class House:
    """A house with one zone that warms by a kelvin an hour, its requests, and how it misbehaves."""

    def __init__(self) -> None:
        self.asked: list[tuple[str, str]] = []
        self.bodies: list[dict[str, Any]] = []
        self.time, self.step, self.version = 0.0, 900.0, "0.8.0"
        self.trap: Callable[[str, str, int, dict[str, Any]], Any] = lambda method, what, count, body: None

    def state(self, body: dict[str, Any]) -> dict[str, Any]:
        used = {name: value for name, value in body.items() if name.endswith("_u")}
        kelvin = 290.0 + self.time / 3600.0
        return {"time": self.time, "reaTZon_y": kelvin, "reaFlo_y": 0.1, "reaDir_y": np.pi, **used}

    def answer(self, method: str, what: str, body: dict[str, Any]) -> Any:
        """Payload of a request."""
        if what == "inputs":
            return {"oveTSet_u": entry("K", 300.0, 340.0), "oveTSet_activate": entry(None), "oveHea_u": entry("W"),
                    "oveHea_activate": entry(None)}  # fmt: skip
        if what == "measurements":
            power = {"reaPPum_y": entry("W"), "reaPFan_y": entry("W")}
            return {"reaTZon_y": entry("K"), "reaFlo_y": entry("kg/s"), "reaDir_y": entry("rad"), **power}
        if what == "forecast_points":
            return {
                name: {"Unit": "", "Description": ""}
                for name in ("TDryBul", "PriceElectricPowerDynamic", "LowerSetp[1]")
            }
        if what == "name":
            return {"name": "house"}
        if what == "version":
            return {"version": self.version}
        if what == "step":
            self.step = float(body.get("step", self.step))
            return self.step
        if what == "scenario":
            if method == "GET":
                return {"electricity_price": "dynamic", "time_period": None}
            if "time_period" not in body:
                return dict.fromkeys(("electricity_price", "time_period"))
            self.time = 1000.0 * 900.0
            return {"electricity_price": "dynamic", "time_period": self.state({})}
        if what == "initialize":
            self.time = float(body["start_time"])
            return self.state({})
        if what == "advance":
            self.time += self.step
            return self.state(body)
        if what == "forecast":
            times = self.time + np.arange(0.0, body["horizon"] + 1.0, body["interval"])
            return {"time": times.tolist(), "TDryBul": (270.0 + times - self.time).tolist(),
                    "PriceElectricPowerDynamic": (times * 0.0 + 0.2).tolist(), "LowerSetp[1]": [294.15] * len(times)}  # fmt: skip
        if what == "results":
            times = np.sort(
                np.append(np.arange(body["start_time"], body["final_time"] + 1.0, 30.0), body["start_time"])
            )
            return {"time": times.tolist(), "reaTZon_y": (290.0 + times / 3600.0).tolist(),
                    "reaPPum_y": (times - body["start_time"]).tolist(), "reaPFan_y": [100.0] * len(times),
                    "reaFlo_y": [0.1] * len(times), "reaDir_y": [np.pi] * len(times)}  # fmt: skip
        return {"cost_tot": 0.5, "emis_tot": 0.1, "ener_tot": 2.0, "idis_tot": None, "pdih_tot": None, "pele_tot": 0.01,
                "pgas_tot": None, "tdis_tot": 3.0, "time_rat": None}  # fmt: skip


class Handler(BaseHTTPRequestHandler):
    house: House

    def do(self) -> None:
        what = self.path.strip("/").split("/")[0]
        body = json.loads(self.rfile.read(int(self.headers.get("content-length", 0))) or b"{}")
        house = self.house
        house.asked.append((self.command, what))
        house.bodies.append(body)
        trapped = house.trap(self.command, what, house.asked.count((self.command, what)), body)
        if trapped == "hang up":
            self.connection.close()
            return
        status, content = 200, {"status": 200, "message": "fine", "payload": None}
        if isinstance(trapped, tuple):
            status, content = trapped
        elif what == "testcases":
            content = {"testid": "one two"}
        else:
            content["payload"] = house.answer(self.command, what, body)
            content |= trapped or {}
        data = content if isinstance(content, bytes) else json.dumps(content).encode()
        self.send_response(status)
        self.send_header("content-length", str(len(data)))
        self.send_header("location", "http://127.0.0.1:9/elsewhere")
        self.end_headers()
        self.wfile.write(data)

    def log_message(self, *arguments: Any) -> None:
        """Say nothing."""


for verb in ("GET", "PUT", "POST"):
    setattr(Handler, f"do_{verb}", Handler.do)


@pytest.fixture
def house(monkeypatch: pytest.MonkeyPatch) -> House:
    monkeypatch.setattr("mpc.adapters.boptest.client._FIRST_WAIT", 0.01)
    return House()


@pytest.fixture
def connect(house: House) -> Iterator[Callable[..., BoptestPlant]]:
    handler = type("HouseHandler", (Handler,), {"house": house})
    server = ThreadingHTTPServer(("127.0.0.1", 0), handler)
    server.daemon_threads = True
    thread = threading.Thread(target=server.serve_forever, args=(0.02,), daemon=True)
    thread.start()
    made: list[BoptestPlant] = []

    def make(period: Any = "peak_heat_day", signals: BoptestSignals | None = HOUSE, **options: Any) -> BoptestPlant:
        url = f"http://127.0.0.1:{server.server_port}"
        settings = BoptestSettings(**{"electricity_price": "dynamic", "timeout": 20.0} | options)
        made.append(BoptestPlant(url, "house", period, 900.0, settings, signals=signals))
        return made[-1]

    yield make
    for plant in made:
        plant.close()
    server.shutdown()
    server.server_close()
    thread.join()


Connect = Callable[..., BoptestPlant]


def trap_on(what: str, effect: Any, times: int = 10**9) -> Callable[..., Any]:
    return lambda method, asked, count, body: effect if asked == what and count <= times else None


def test_a_foreign_test_case_behaves_as_a_plant(house: House, connect: Connect) -> None:
    plant = connect(horizon=3, timezone="Europe/Brussels", year=2024)
    seen = plant.reset()
    assert seen.stamp.isoformat() == "2024-01-11T10:00:00+01:00"
    assert seen["zone/zone_air_temperature_sensor"] == pytest.approx(290.0 + 250.0)
    assert seen["station/wind_direction_sensor"] == pytest.approx(180.0)  # radians at the server
    seen = plant.step({"pump/supply_water_temperature_setpoint": 320.0})
    assert {"oveTSet_u": 320.0, "oveTSet_activate": 1.0} in house.bodies
    # the mean over the quarter of an hour, not the reading at its end
    assert seen["zone/zone_air_temperature_sensor"] == pytest.approx(290.0 + 250.0 + 0.125)
    assert seen.stamp.isoformat() == "2024-01-11T10:15:00+01:00"
    table = plant.forecast().table
    # readings lie on straight lines: the mean of a quarter of an hour is that of its ends; what holds is taken as it is
    assert table["outside_air_temperature_sensor"].tolist() == [270.0 + 450.0, 270.0 + 1350.0, 270.0 + 2250.0]
    assert (
        table["electricity_price"].tolist() == [0.2] * 3 and table["zone/comfort_lower_temperature"].iloc[0] == 294.15
    )
    record = plant.record()
    assert record.step == 30.0 and record.n_steps == 30
    np.testing.assert_allclose(record.electricity, 100.0 + 15.0 + 30.0 * np.arange(30))  # trapezoids, as BOPTEST's
    assert plant.kpis()["idis_tot"] is None and plant.kpis()["cost_tot"] == 0.5
    assert not plant.finished and plant._end == 1000.0 * 900.0 + 14 * 86_400.0


def test_a_time_of_ones_own(house: House, connect: Connect) -> None:
    plant = connect(BoptestTime(864_000.0, 1800.0, 3600.0))
    plant.reset()
    assert ("PUT", "initialize") in house.asked and {"start_time": 864_000.0, "warmup_period": 3600.0} in house.bodies
    plant.step({})
    plant.step({})
    assert plant.finished


def test_what_is_left_out_is_released_once(house: House, connect: Connect) -> None:
    plant, sent = connect(), list[dict[str, Any]]()
    plant.reset()
    house.trap = lambda method, what, count, body: sent.append(body) if what == "advance" else None
    both = {"pump/supply_water_temperature_setpoint": 320.0, "pump/heating_power": 0.0}
    for actions in (both, {"pump/heating_power": 500.0}, {}, {}):
        plant.step(actions)
    first = {"oveTSet_u": 320.0, "oveTSet_activate": 1.0, "oveHea_u": 0.0, "oveHea_activate": 1.0}
    second = {"oveHea_u": 500.0, "oveHea_activate": 1.0, "oveTSet_activate": 0.0}
    assert sent == [first, second, {"oveHea_activate": 0.0}, {}]


def test_an_input_without_a_switch_reaches_nothing(house: House, connect: Connect) -> None:
    known = house.answer("GET", "inputs", {})
    del known["oveHea_activate"]
    house.trap = lambda method, what, count, body: {"payload": known} if what == "inputs" else None
    with pytest.raises(BoptestError, match="expected a switch 'oveHea_activate', .* found the switches oveTSet_activate"):
        connect()


def test_clipped_inputs_with_success(house: House, connect: Connect) -> None:
    plant = connect()
    plant.reset()
    sent = len(house.asked)
    with pytest.raises(
        PlantActionError, match="pump/supply_water_temperature_setpoint: expected a number from 300 to 340 K"
    ):
        plant.step({"pump/supply_water_temperature_setpoint": 341.0})
    with pytest.raises(PlantActionError, match="pump/heating_power"):  # no limits at the server, no number all the same
        plant.step({"pump/heating_power": float("inf")})
    assert len(house.asked) == sent
    # a server whose true limit is tighter than it says
    house.trap = lambda method, what, count, body: (
        {"payload": {**house.state({}), "time": house.time + 900.0, "oveTSet_u": 330.0}} if what == "advance" else None
    )
    with pytest.raises(BoptestError, match="input oveTSet_u: 340 was sent, the server used 330"):
        plant.step({"pump/supply_water_temperature_setpoint": 340.0})
    with pytest.raises(PlantError, match="a reset after a step went wrong"):
        plant.step({})
    house.trap = trap_on("advance", {"message": "WARNING: value of 340 for oveTSet_u is above maximum of 330."})
    plant.reset()
    with pytest.raises(BoptestError, match="the server changed what was sent: WARNING"):
        plant.step({"pump/supply_water_temperature_setpoint": 340.0})


def test_an_empty_payload_is_the_end(house: House, connect: Connect) -> None:
    plant = connect()
    plant.reset()
    house.trap = trap_on("advance", {"message": "End of test case scenario time period reached.", "payload": {}})
    with pytest.raises(BoptestError, match="the test is over at 900000 s of the year: End of test case"):
        plant.step({})
    assert plant.finished
    house.trap = lambda *request: None
    plant.reset()
    assert not plant.finished


def test_advance_is_never_sent_twice_and_a_silent_server_is_an_error(house: House, connect: Connect) -> None:
    plant = connect()
    plant.reset()

    def slow(method: str, what: str, count: int, body: dict[str, Any]) -> None:
        if what == "advance":
            time.sleep(2.0)

    for trap in (slow, trap_on("advance", "hang up")):
        house.trap = trap
        house.asked.clear()
        plant._client._http.timeout = 0.5
        with pytest.raises(BoptestTimeoutError, match=r"whether the step was taken is not known: reset the plant"):
            plant.step({})
        assert house.asked.count(("POST", "advance")) == 1
        with pytest.raises(PlantError, match="a reset after a step went wrong"):
            plant.step({})
        house.trap = lambda *request: None
        plant._client._http.timeout = 20.0
        plant.reset()
        plant.step({})
    house.trap = trap_on("advance", (503, {"status": 503, "message": "busy", "payload": None}))
    house.asked.clear()
    with pytest.raises(BoptestError, match="busy"):
        plant.step({})
    assert house.asked.count(("POST", "advance")) == 1


def test_harmless_requests_are_sent_again(house: House, connect: Connect) -> None:
    plant = connect()
    plant.reset()
    for effect in ("hang up", (502, b"<html>bad gateway</html>")):
        house.asked.clear()
        house.trap = trap_on("kpi", effect, times=2)
        assert plant.kpis()["tdis_tot"] == 3.0
        assert house.asked == [("GET", "kpi")] * 3
    house.asked.clear()
    house.trap = trap_on("kpi", "hang up")
    with pytest.raises(BoptestTimeoutError, match="no answer within 20 s"):
        plant.kpis()
    assert house.asked == [("GET", "kpi")] * 3


def test_select_is_sent_once(house: House, connect: Connect) -> None:
    """A test that was begun twice would block a worker of the server."""
    house.trap = trap_on("testcases", "hang up")
    with pytest.raises(BoptestTimeoutError):
        connect()
    assert house.asked.count(("POST", "testcases")) == 1


@pytest.mark.parametrize("payload", [{"cost_tot": "0.5"}, {"cost_tot": True}, None, [1]])
def test_indicators_that_are_none(house: House, connect: Connect, payload: Any) -> None:
    plant = connect()
    house.trap = trap_on("kpi", {"payload": payload})
    with pytest.raises(BoptestError, match="a number or null"):
        plant.kpis()


def test_a_measurement_of_null_is_missing(house: House, connect: Connect) -> None:
    plant = connect()
    plant.reset()
    house.trap = lambda method, what, count, body: (
        {"payload": {**house.answer(method, what, body), "reaTZon_y": [None] * 32}} if what == "results" else None
    )
    seen = plant.step({})
    assert np.isnan(seen["zone/zone_air_temperature_sensor"]) and seen["zone/supply_air_flowrate_sensor"] == pytest.approx(0.1)


def test_a_clock_that_jumps_is_another_client(house: House, connect: Connect) -> None:
    plant = connect()
    plant.reset()
    house.time += 900.0
    with pytest.raises(BoptestError, match="time of the test: expected 900900 s, found 901800 s; does another use it"):
        plant.step({})


@pytest.mark.parametrize(
    ("effect", "says"),
    [
        ((200, b"<html>"), "expected JSON, found <html>"),
        ((200, [1]), "an object with status, message, payload"),
        ((200, {"status": 200}), "an object with status, message, payload"),
        ((200, {"status": 500, "message": "solver failed", "payload": None}), "refuses with status 500: solver failed"),
        ((400, {"errors": [{"msg": "Invalid testid: x"}]}), "status 400.*Invalid testid"),
        ((302, b""), "status 302"),
        ({"payload": None}, "measurements of a step: expected their time, found None"),
        ({"payload": {"time": "soon"}}, "expected their time"),
        ({"payload": {"time": float("nan")}}, "expected their time"),
    ],
)
def test_answers_that_are_none(house: House, connect: Connect, effect: Any, says: str) -> None:
    plant = connect()
    plant.reset()
    house.trap = trap_on("advance", effect)
    with pytest.raises(BoptestError, match=says):
        plant.step({})


@pytest.mark.parametrize("version", ["0.3.0", "2.0.0", "unknown", None, ""])
def test_a_version_that_speaks_otherwise_is_refused(house: House, connect: Connect, version: str | None) -> None:
    house.version = version
    with pytest.raises(BoptestError, match=r"version 0\.4 or later, below 2"):
        connect()
    assert ("POST", "testcases") not in house.asked


@pytest.mark.parametrize("version", ["0.4.0", "0.8.0-dev", "v1.0.0", "1.2.3"])
def test_versions_that_are_fine(house: House, connect: Connect, version: str) -> None:
    house.version = version
    assert connect().server_version == version


def test_results_and_forecasts_that_lack_something(house: House, connect: Connect) -> None:
    plant = connect()
    plant.reset()
    plant.step({})
    house.trap = trap_on("results", {"payload": {"time": [0.0]}})
    with pytest.raises(BoptestError, match="results: expected two or more values of each point"):
        plant.record()
    house.trap = trap_on("forecast", {"payload": {"time": [0.0], "TDryBul": [0.0]}})
    with pytest.raises(BoptestError, match=r"forecast point TDryBul: expected 25 values, found 1"):
        plant.forecast()


def test_signals_are_checked(house: House, connect: Connect) -> None:
    with pytest.raises(BoptestError, match="say which signals are which"):
        connect(signals=None)
    wrong = BoptestSignals({}, {}, {"zone": "reaTZone_y"})
    with pytest.raises(BoptestError, match="reaTZon_y"):
        connect(signals=wrong)
    with pytest.raises(BoptestError, match="temperature of a zone"):
        BoptestSignals({}, {}, {})
    with pytest.raises(BoptestError, match="the nearest valid one is"):
        BoptestSignals({"zone/temperature": "reaTZon_y"}, {}, {"zone": "reaTZon_y"})
    assert house.asked[-1] == ("PUT", "stop")  # what was begun is freed


def test_no_server_at_all() -> None:
    with pytest.raises(BoptestTimeoutError, match="no server answers"):
        BoptestPlant("http://127.0.0.1:9", "house", "peak_heat_day", 900.0, BoptestSettings(repeats=0))
