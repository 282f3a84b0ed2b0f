"""The server beside the published description of BOPTEST's API.

The tables are facts of two public documents of ibpsa/project1-boptest: the OpenAPI description
``service/web/server/docs/openapi.yaml`` (version 1.0.0-dev, commit 0247840d) and the table of requests in ``README.md``
(commit 018b5b51); the form of a refused test number is that of ``service/web/server/src/routes`` (express-validator).
"""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

import httpx
import pytest
import requests

from mpc.adapters.boptest.server import BoptestServer

DAY = 86_400.0
HEX = r"[0-9a-f]"
UUID = re.compile(f"{HEX}{{8}}-{HEX}{{4}}-{HEX}{{4}}-{HEX}{{4}}-{HEX}{{12}}")
Shape = Callable[[Any], bool]


def is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def bounded(payload: Any) -> bool:
    """`BoundedSignalMetaResponse`: by signal its description, unit, minimum and maximum, the last three nullable."""
    keys = {"Description", "Unit", "Minimum", "Maximum"}
    rows = payload.values()
    limits = all(row[k] is None or is_number(row[k]) for row in rows for k in ("Minimum", "Maximum"))
    texts = all(isinstance(row["Description"], str) and isinstance(row["Unit"], str | None) for row in rows)
    return bool(payload) and limits and texts and all(set(row) == keys for row in rows)


def signals(payload: Any) -> bool:
    """`SignalMetaResponse`: by signal its description and unit."""
    return bool(payload) and all(set(row) == {"Description", "Unit"} for row in payload.values())


def state(payload: Any) -> bool:
    """Payload of `SimResponse`: a number by signal, ``time`` among them."""
    return "time" in payload and all(is_number(value) for value in payload.values())


def series(payload: Any) -> bool:
    """`TimeSeries`: lists of numbers by signal, ``time`` among them, of one length."""
    lengths = {len(values) for values in payload.values()}
    return "time" in payload and len(lengths) == 1 and all(is_number(v) for values in payload.values() for v in values)


def kpis(payload: Any) -> bool:
    """`KPIResponse`: nine indicators; the release notes of 0.5.0 say which are null without data."""
    names = "ener_tot cost_tot emis_tot pele_tot pgas_tot pdih_tot tdis_tot idis_tot time_rat"
    return set(payload) == set(names.split()) and all(v is None or is_number(v) for v in payload.values())


# Method, path, arguments, and the form of the payload, in the order of a session.
TABLE: tuple[tuple[str, str, dict[str, Any] | None, Shape], ...] = (
    ("GET", "name", None, lambda p: p["name"] == "small"),
    ("GET", "inputs", None, bounded),
    ("GET", "measurements", None, bounded),
    ("GET", "forecast_points", None, signals),
    ("GET", "step", None, is_number),
    ("PUT", "step", {"step": 900}, lambda p: p == {"step": 900}),
    ("GET", "scenario", None, lambda p: p["electricity_price"] == "constant" and "time_period" in p),
    ("PUT", "scenario", {"electricity_price": "dynamic"}, lambda p: p["electricity_price"] == "dynamic"),
    ("PUT", "initialize", {"start_time": 5 * DAY, "warmup_period": 3600}, lambda p: state(p) and p["time"] == 5 * DAY),
    ("POST", "advance", {}, lambda p: state(p) and p["time"] == 5 * DAY + 900),
    (
        "PUT",
        "forecast",
        {"point_names": ["TDryBul", "HGloHor"], "horizon": 7200, "interval": 3600},
        lambda p: series(p) and p["time"] == [5 * DAY + 900 + 3600 * k for k in range(3)] and "HGloHor" in p,
    ),
    (
        "PUT",
        "results",
        {"point_names": ["reaPEle_y"], "start_time": 5 * DAY, "final_time": 6 * DAY},
        lambda p: series(p) and p["time"][0] == 5 * DAY and p["time"][-1] == 5 * DAY + 900,
    ),
    ("GET", "kpi", None, kpis),
    ("PUT", "scenario", {"time_period": "peak_heat_day"}, lambda p: state(p["time_period"])),
)


def test_every_described_request_has_the_described_answer(http: httpx.Client, testid: str) -> None:
    for method, path, body, fits in TABLE:
        response = http.request(method, f"/{path}/{testid}", json=body)
        answer = response.json()
        where = f"{method} /{path}: {response.text[:300]}"
        assert response.status_code == 200 and set(answer) == {"status", "message", "payload"}, where
        assert answer["status"] == 200 and isinstance(answer["message"], str), where
        assert fits(answer["payload"]), where


def test_management_requests(http: httpx.Client) -> None:
    assert http.get("/testcases").json() == [{"testcaseid": "small"}]
    version = http.get("/version").json()
    assert version["status"] == 200 and re.fullmatch(r"\d+\.\d+\.\d+", version["payload"]["version"])
    chosen = http.post("/testcases/small/select").json()
    assert set(chosen) == {"testid"} and UUID.fullmatch(chosen["testid"])
    assert http.get(f"/status/{chosen['testid']}").json() == "Running"
    submitted = http.post(f"/submit/{chosen['testid']}", json={"api_key": "none"})
    assert submitted.status_code == 400 and "sends nothing" in submitted.json()["message"]
    stopped = http.put(f"/stop/{chosen['testid']}")
    assert (stopped.status_code, stopped.text) == (200, "OK")
    assert http.get(f"/status/{chosen['testid']}").status_code == 400


def test_an_unknown_test_is_refused_as_by_boptest(http: httpx.Client) -> None:
    response = http.get("/kpi/none-such")
    assert response.status_code == 400
    (error,) = response.json()["errors"]
    assert error == {"value": "none-such", "msg": "Invalid testid: none-such", "param": "testid", "location": "params"}


def test_names_and_units_follow_the_conventions(http: httpx.Client, testid: str) -> None:
    inputs, outputs, points = (
        http.get(f"/{what}/{testid}").json()["payload"] for what in ("inputs", "measurements", "forecast_points")
    )
    values = [name for name in inputs if name.endswith("_u")]
    assert {f"{name[:-2]}_activate" for name in values} | set(values) == set(inputs)
    assert all(inputs[name]["Minimum"] < inputs[name]["Maximum"] and inputs[name]["Unit"] for name in values)
    assert all(re.fullmatch(r"\w+_y", name) for name in outputs)
    assert {row["Unit"] for row in outputs.values()} <= {"K", "W", "kg/s", "1", "m/s", "deg", "W/m2"}
    weather = {"TDryBul": "K", "HGloHor": "W/m2", "HDirNor": "W/m2", "HDifHor": "W/m2", "HHorIR": "W/m2",
               "winSpe": "m/s", "winDir": "rad"}  # fmt: skip
    assert {name: points[name]["Unit"] for name in weather} == weather
    for kind in ("Constant", "Dynamic", "HighlyDynamic"):
        assert points[f"PriceElectricPower{kind}"]["Unit"] == "USD/kWh"
    zones = {name.partition("[")[2] for name in points if name.startswith("LowerSetp[")}
    assert len(zones) == 6 and all(f"{kind}[{zone}" in points for zone in zones for kind in ("UpperSetp", "Occupancy"))


def test_inputs_out_of_range_are_clipped_with_a_warning_and_success(http: httpx.Client, testid: str) -> None:
    http.put(f"/initialize/{testid}", json={"start_time": 5 * DAY, "warmup_period": 0})
    name = "BOILER_supply_water_temperature_setpoint"
    answer = http.post(f"/advance/{testid}", json={f"{name}_u": 400.0, f"{name}_activate": 1})
    assert answer.status_code == 200
    assert "above maximum of 355.0" in answer.json()["message"]
    assert answer.json()["payload"][f"{name}_u"] == 355.0 and answer.json()["payload"][f"{name}_activate"] == 1.0
    answer = http.post(f"/advance/{testid}", json={f"{name}_u": 312.0, f"{name}_activate": 0}).json()
    assert answer["payload"][f"{name}_u"] == 333.15  # the building's own
    assert "successfully" in answer["message"]


def test_beyond_the_end_the_payload_is_empty(http: httpx.Client, testid: str) -> None:
    http.put(f"/scenario/{testid}", json={"time_period": "peak_heat_day"})
    http.put(f"/step/{testid}", json={"step": 7 * DAY})
    times = []
    while payload := http.post(f"/advance/{testid}", json={}).json()["payload"]:
        times.append(payload["time"])
    assert times == [8 * DAY, 11 * DAY]  # the last step is cut at the end of the period of ten days
    last = http.post(f"/advance/{testid}", json={}).json()
    assert last == {"status": 200, "message": "End of test case scenario time period reached.", "payload": {}}


def heating_controller(measured: dict[str, float]) -> dict[str, float]:
    """A supervisory controller as a beginner of BOPTEST writes it."""
    cold = measured["reaTZon_F1_W01_y"] < 273.15 + 21.0
    name = "BOILER_supply_water_temperature_setpoint"
    return {f"{name}_u": 350.0 if cold else 320.0, f"{name}_activate": 1}


@pytest.mark.parametrize("form", ["json", "data"])
@pytest.mark.parametrize("numbered", [True, False])
def test_a_client_written_as_boptests_examples_do(server: BoptestServer, form: str, numbered: bool) -> None:
    """Plain `requests`, nothing of ours: with a test number as since 0.7, and without as before; JSON and forms."""
    url = server.url
    session = requests.Session()
    testid = session.post(f"{url}/testcases/small/select").json()["testid"] if numbered else ""
    at = f"/{testid}" if numbered else ""

    def check(response: requests.Response) -> Any:
        answer = response.json()
        assert answer["status"] == 200, answer["message"]
        return answer["payload"]

    def send(put: Any, what: str, arguments: dict[str, Any]) -> Any:
        return check(put(f"{url}/{what}{at}", **{form: arguments}))

    assert check(session.get(f"{url}/name{at}"))["name"] == "small"
    measurements = check(session.get(f"{url}/measurements{at}"))
    morning = 4 * DAY + 6 * 3600
    res = send(session.put, "initialize", {"start_time": morning, "warmup_period": DAY})
    start_time = res["time"]
    assert start_time == morning
    send(session.put, "step", {"step": 3600})
    u: dict[str, float] = {}
    for _ in range(6):
        y = send(session.post, "advance", u)
        if not y:
            break
        u = heating_controller(y)
    assert y["time"] == morning + 6 * 3600
    kpi = check(session.get(f"{url}/kpi{at}"))
    assert kpi["tdis_tot"] >= 0.0 and kpi["ener_tot"] > 0.0
    points = list(measurements)[:2]
    arguments = {"point_names": points, "start_time": start_time, "final_time": float("inf") if form == "data" else 1e9}
    res = send(session.put, "results", arguments)
    assert len(res["time"]) == 73 and all(len(res[point]) == 73 for point in points)
    one = send(session.put, "forecast", {"point_names": ["TDryBul"], "horizon": 3600, "interval": 1800})
    assert len(one["TDryBul"]) == 3
    if numbered:
        assert session.put(f"{url}/stop/{testid}").text == "OK"
    session.close()
