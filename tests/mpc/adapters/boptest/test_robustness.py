"""What a server must survive: nonsense, crowds, clients that vanish, and strangers."""

from __future__ import annotations

import dataclasses
import json
import os
import socket
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import httpx
import pytest

from mpc.adapters.boptest.app import HeldTests
from mpc.adapters.boptest.case import BoptestCase
from mpc.adapters.boptest.server import BoptestServer
from mpc.errors import BoptestError

DAY = 86_400.0
MORNING = 4 * DAY + 7 * 3600.0  # of a Thursday
DEEP = "[" * 100_000 + "]" * 100_000

MALFORMED: dict[str, bytes] = {
    "no JSON": b"{start_time: 5",
    "not UTF-8": b'{"start_time": "\xff"}',
    "a list": b"[1, 2]",
    "a number": b"5",
    "null": b"null",
    "brackets without end": DEEP.encode(),
    "a number without end": b'{"start_time": ' + b"9" * 10_000 + b', "warmup_period": 0}',
    "NaN": b'{"start_time": NaN, "warmup_period": 0}',
    "infinity": b'{"start_time": 1e999, "warmup_period": 0}',
    "huge": b'{"start_time": 1e300, "warmup_period": 0}',
    "negative": b'{"start_time": -5, "warmup_period": 0}',
    "text": b'{"start_time": "soon", "warmup_period": 0}',
    "an object": b'{"start_time": {"a": 1}, "warmup_period": 0}',
    "a missing argument": b'{"start_time": 432000}',
    "an unknown argument": b'{"start_time": 432000, "warmup_period": 0, "__class__": 1}',
    "nothing": b"",
}


@pytest.mark.parametrize("body", MALFORMED.values(), ids=MALFORMED.keys())
def test_a_malformed_body_is_refused_and_the_test_lives_on(http: httpx.Client, testid: str, body: bytes) -> None:
    for path, method in (("initialize", "PUT"), ("forecast", "PUT"), ("results", "PUT"), ("step", "PUT")):
        response = http.request(method, f"/{path}/{testid}", content=body, headers={"content-type": "application/json"})
        assert response.status_code == 400, response.text
        assert response.json()["payload"] is None and len(response.text) < 2000
    assert http.get(f"/name/{testid}").status_code == 200


WRONG: tuple[tuple[str, str, dict[str, Any]], ...] = (
    ("POST", "advance", {"no_such_u": 1}),
    ("POST", "advance", {"BOILER_supply_water_temperature_setpoint_u": "hot"}),
    ("POST", "advance", {"BOILER_supply_water_temperature_setpoint_u": [1]}),
    (
        "POST",
        "advance",
        {"BOILER_supply_water_temperature_setpoint_u": 330, "BOILER_supply_water_temperature_setpoint_activate": 2},
    ),
    ("POST", "advance", {"BOILER_supply_water_temperature_setpoint_activate": 1}),
    ("PUT", "step", {"step": 0}),
    ("PUT", "step", {"step": 100}),
    ("PUT", "step", {"step": 1e18}),
    ("PUT", "scenario", {"time_period": "../../etc/passwd"}),
    ("PUT", "scenario", {"time_period": ["peak_heat_day"]}),
    ("PUT", "scenario", {"electricity_price": "free"}),
    ("PUT", "scenario", {"seed": -1}),
    ("PUT", "scenario", {"temperature_uncertainty": 3}),
    ("PUT", "forecast", {"point_names": ["TDryBul"], "horizon": 1e9, "interval": 1e-3}),
    ("PUT", "forecast", {"point_names": ["TDryBul"], "horizon": 60, "interval": 0}),
    ("PUT", "forecast", {"point_names": "TDryBulb", "horizon": 60, "interval": 60}),
    ("PUT", "forecast", {"point_names": [1], "horizon": 60, "interval": 60}),
    ("PUT", "results", {"point_names": ["x" * 5000], "start_time": 0, "final_time": 1}),
    ("PUT", "initialize", {"start_time": 300 * DAY, "warmup_period": 0}),
)


@pytest.mark.parametrize(("method", "path", "body"), WRONG, ids=[f"{p} {json.dumps(b)[:40]}" for _, p, b in WRONG])
def test_wrong_values_are_refused_with_a_reason(
    http: httpx.Client, testid: str, method: str, path: str, body: dict[str, Any]
) -> None:
    response = http.request(method, f"/{path}/{testid}", json=body)
    assert response.status_code == 400 and response.json()["payload"] is None
    assert 20 < len(response.json()["message"]) < 800


def test_unknown_paths_methods_and_tests(http: httpx.Client) -> None:
    assert http.post("/testcases/none/select").status_code == 404
    assert http.get("/testcases/../../etc/passwd").status_code in (404, 405)
    assert http.get("/docs").status_code == 404 and http.get("/openapi.json").status_code == 404
    assert http.delete("/name/x").status_code == 405
    for method, path in (
        ("POST", "advance"),
        ("PUT", "initialize"),
        ("PUT", "stop"),
        ("GET", "status"),
        ("POST", "submit"),
    ):
        assert http.request(method, f"/{path}/none", json={}).status_code == 400


def test_a_body_too_long_is_refused(http: httpx.Client, testid: str) -> None:
    for _ in range(10):  # the answer gets there although the connection is closed on what is still being sent
        assert http.get("/version").status_code == 200
        response = http.put(f"/step/{testid}", content=b"x" * 1_000_001)
        assert response.status_code == 413

    def pieces() -> Any:  # without a length in the header
        for _ in range(30):
            yield b"x" * 100_000

    try:
        assert http.put(f"/step/{testid}", content=pieces()).status_code in (400, 413)
    except httpx.HTTPError:
        pass  # hung up on
    assert http.get(f"/step/{testid}").status_code == 200


@pytest.mark.parametrize(
    ("headers", "status"),
    [
        ({"host": "evil.example"}, 403),
        ({"host": "evil.example:80"}, 403),
        ({"host": "127.0.0.1.evil.example"}, 403),
        ({"host": "192.168.1.9"}, 403),
        ({"host": "["}, 403),
        ({"host": "localhost:1"}, 200),
        ({"host": "[::1]:80"}, 200),
        ({"origin": "http://evil.example"}, 403),
        ({"origin": "null"}, 403),
        ({"origin": "http://[::1"}, 403),
        ({"origin": "http://evil.com@127.0.0.1"}, 403),
        ({"origin": "http://evil.com@localhost:3000"}, 403),
        ({"host": "evil.com@127.0.0.1"}, 403),
        ({"origin": "http://localhost:3000"}, 200),
        ({"sec-fetch-site": "cross-site"}, 403),
        ({"sec-fetch-site": "same-origin"}, 200),
    ],
)
def test_other_names_and_pages_of_other_sites_are_refused(
    http: httpx.Client, headers: dict[str, str], status: int
) -> None:
    assert http.get("/version", headers=headers).status_code == status


def test_a_form_from_another_site_begins_no_test(http: httpx.Client, server: BoptestServer) -> None:
    before = len(server.tests)
    response = http.post("/testcases/small/select", headers={"origin": "https://evil.example"}, data={"a": "1"})
    assert response.status_code == 403 and len(server.tests) == before


def test_only_the_own_machine_unless_told_otherwise(served: BoptestCase) -> None:
    for host in ("0.0.0.0", "::", "192.0.2.1", "example.org"):
        with pytest.raises(BoptestError, match="--allow-remote"):
            BoptestServer([served], host)
    with BoptestServer([served], "0.0.0.0", allow_remote=True, names=("lab.example",)) as server:
        url = server.url.replace("0.0.0.0", "127.0.0.1")
        hosts = {"192.168.1.9": 200, "lab.example": 200, "evil.example": 403}
        for host, status in hosts.items():
            assert (
                httpx.get(f"{url}/version", headers={"host": host}, timeout=60.0, trust_env=False).status_code == status
            )


def test_a_taken_port_is_named(served: BoptestCase, server: BoptestServer) -> None:
    port = int(server.url.rpartition(":")[2])
    with pytest.raises(BoptestError, match=f"port {port} of 127.0.0.1"):
        BoptestServer([served], port=port)
    with pytest.raises(BoptestError, match="0 to 65535"):
        BoptestServer([served], port=99_999)


@pytest.mark.long
def test_fifty_clients_at_once_each_have_a_plant_of_their_own(server: BoptestServer, http: httpx.Client) -> None:
    """Each with another setpoint: what it reads is what a lone client reads."""
    name, air = "AHU_F1_supply_air_temperature_setpoint", "AHU_F1_supply_air_temperature_sensor"

    def run(number: int) -> list[float]:
        body = {f"{name}_u": 285.0 + 0.3 * number, f"{name}_activate": 1}
        with httpx.Client(base_url=server.url, timeout=120.0, trust_env=False, verify=False) as client:
            testid = client.post("/testcases/small/select").json()["testid"]
            client.put(f"/initialize/{testid}", json={"start_time": MORNING, "warmup_period": DAY})
            seen = [client.post(f"/advance/{testid}", json=body).json()["payload"][f"{air}_y"] for _ in range(3)]
            client.put(f"/stop/{testid}")
        return seen

    with ThreadPoolExecutor(50) as pool:
        found = list(pool.map(run, range(50)))
    assert len({tuple(seen) for seen in found}) == 50
    for number in (0, 23, 49):
        assert run(number) == found[number]


def test_parallel_steps_of_one_test_are_taken_one_after_the_other(http: httpx.Client, testid: str) -> None:
    http.put(f"/initialize/{testid}", json={"start_time": 5 * DAY, "warmup_period": 0})
    with ThreadPoolExecutor(20) as pool:
        answers = list(pool.map(lambda _: http.post(f"/advance/{testid}", json={}).json(), range(40)))
    assert sorted(a["payload"]["time"] for a in answers) == [5 * DAY + 300.0 * k for k in range(1, 41)]


def test_a_client_that_hangs_up_in_the_middle_harms_nobody(
    server: BoptestServer, http: httpx.Client, testid: str
) -> None:
    host, _, port = server.url.removeprefix("http://").rpartition(":")
    http.put(f"/initialize/{testid}", json={"start_time": 5 * DAY, "warmup_period": 0})
    for sent in (
        f"POST /advance/{testid} HTTP/1.1\r\nhost: 127.0.0.1\r\ncontent-length: 2\r\n\r\n{{}}",  # goes before the answer
        f"POST /advance/{testid} HTTP/1.1\r\nhost: 127.0.0.1\r\ncontent-length: 900\r\n\r\n{{",  # within the body
        "POST /adv",  # within the first line
        "\x00\xff nonsense\r\n\r\n",
    ):
        with socket.create_connection((host, int(port))) as line:
            line.sendall(sent.encode("latin-1"))
    # the first request was whole: it is done, once, sooner or later
    for own in range(1, 200):
        seconds = http.post(f"/advance/{testid}", json={}).json()["payload"]["time"] - 5 * DAY
        if seconds > 300.0 * own:
            break
        time.sleep(0.02)
    assert seconds == 300.0 * (own + 1)


def test_a_test_that_nobody_comes_back_to_makes_room(served: BoptestCase) -> None:
    now = [0.0]
    tests = HeldTests([served], most=2, idle_seconds=900.0, clock=lambda: now[0])
    lost, kept = tests.select("small"), tests.select("small")
    assert lost and kept and tests.select("small") is None
    for now[0] in (500.0, 899.0):
        assert tests.find(kept) is not None
    now[0] = 901.0
    assert tests.free_idle() == 1 and tests.find(lost) is None and tests.find(kept) is not None
    busy = tests.find(kept)
    assert busy is not None
    busy.waiting, now[0] = 1, 5000.0  # a warm-up that takes long is no idleness
    assert tests.free_idle() == 0
    busy.waiting = 0
    assert tests.select("small") is not None and len(tests) == 1


def test_a_client_that_disappears_is_forgotten_without_any_request(served: BoptestCase) -> None:
    with BoptestServer([served], most=1, idle_seconds=0.4) as server:
        with httpx.Client(base_url=server.url, timeout=60.0, trust_env=False) as http:
            lost = http.post("/testcases/small/select").json()["testid"]
            full = http.post("/testcases/small/select")
            assert "testid" in full.json() or "All 1 tests are in use" in full.json()["message"]
            deadline = time.monotonic() + 30.0
            while len(server.tests) and time.monotonic() < deadline:
                time.sleep(0.05)
            assert len(server.tests) == 0
            assert http.get(f"/status/{lost}").status_code == 400
            assert "testid" in http.post("/testcases/small/select").json()


def test_nothing_is_written_or_executed(http: httpx.Client, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """No file is opened for writing and no process begun while requests are answered, by the interpreter's own audit."""
    monkeypatch.chdir(tmp_path)
    done: list[str] = []
    watching = [True]

    def audit(event: str, arguments: tuple[Any, ...]) -> None:
        if not watching[0]:
            return
        if event == "open" and isinstance(arguments[0], str) and "__pycache__" not in arguments[0]:
            if (arguments[2] or 0) & (os.O_WRONLY | os.O_RDWR | os.O_CREAT):
                done.append(f"{event} {arguments[0]}")
        elif event.startswith(("subprocess", "os.system", "os.exec", "os.posix_spawn", "os.fork", "os.remove")):
            done.append(event)

    sys.addaudithook(audit)  # stays for good, so that it is switched off instead
    testid = http.post("/testcases/small/select", json={"name": "../../x", "direct_step": True}).json()["testid"]
    http.put(f"/scenario/{testid}", json={"time_period": "mix_day"})
    http.put(f"/step/{testid}", json={"step": 3600})
    http.post(f"/advance/{testid}", json={"__import__('os').system('touch x')": 1})
    http.post(f"/advance/{testid}", json={})
    http.get(f"/kpi/{testid}")
    http.put(f"/stop/{testid}")
    (tmp_path / "seen").write_text("by the audit")
    watching[0] = False
    assert done == [f"open {tmp_path / 'seen'}"] and [path.name for path in tmp_path.iterdir()] == ["seen"]


def test_what_breaks_inside_is_an_answer_of_500(served: BoptestCase, caplog: pytest.LogCaptureFixture) -> None:
    def broken() -> Any:
        raise ZeroDivisionError("secret")

    case = dataclasses.replace(served, name="broken", make_model=broken)
    with (
        BoptestServer([served, case]) as server,
        httpx.Client(base_url=server.url, timeout=60.0, trust_env=False) as http,
    ):
        testid = http.post("/testcases/broken/select")
        assert testid.status_code == 200
        answer = http.get(f"/inputs/{testid.json()['testid']}")
        assert answer.status_code == 500 and answer.json()["status"] == 500
        assert "ZeroDivisionError" in answer.json()["message"] and "secret" not in answer.text
        assert http.get("/inputs").status_code == 200  # of the common test, of the first case
    assert "secret" in caplog.text


def test_the_common_test_is_never_freed_by_time(served: BoptestCase) -> None:
    with (
        BoptestServer([served], most=1, idle_seconds=0.2) as server,
        httpx.Client(base_url=server.url, timeout=60.0, trust_env=False) as http,
    ):
        http.put("/step", json={"step": 900})
        time.sleep(0.5)
        assert http.get("/step").json()["payload"] == 900
        assert http.post("/testcases/small/select").status_code == 503
        http.put("/stop")
        assert "testid" in http.post("/testcases/small/select").json()
        assert http.get("/step").status_code == 503


def test_a_server_ends_cleanly_and_its_port_is_free(served: BoptestCase) -> None:
    with BoptestServer([served]) as server:
        port = int(server.url.rpartition(":")[2])
        assert httpx.get(f"{server.url}/testcases", timeout=60.0, trust_env=False).json() == [{"testcaseid": "small"}]
    assert not [t for t in threading.enumerate() if t.name == "boptest" and not t.daemon]
    with BoptestServer([served], port=port) as again:
        assert again.url.endswith(f":{port}")
