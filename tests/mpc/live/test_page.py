"""The page and the guard's socket: who is let in, what is handed on, what rubbish does."""

from __future__ import annotations

import asyncio
import json
import re
import socket
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import yaml

from mpc.live.guard.socket import GuardClient, Mailbox, serve_socket
from mpc.live.operators import operator_key
from mpc.live.page import app, serve
from mpc.live.page.access import page_tokens
from mpc.live.site import Site

SET = "north/zone_air_heating_temperature_setpoint"


@pytest.fixture
def site(tmp_path: Path) -> Site:
    plant = {
        "format": 1, "name": "hall", "plant": {"kind": "site"}, "control_step": 900.0,
        "location": {"latitude": 50.8, "longitude": 4.35, "elevation": 100.0, "timezone": "Europe/Brussels"},
        "period": {"start": "2026-01-12 00:00", "days": 1}, "zones": {"north": {"temperature": "x", "floor_area": 60.0}},
        "actuators": {SET: {"signal": "y", "range": ["16 degC", "26 degC"]}},
    }  # fmt: skip
    entry = {
        "format": 1, "name": "hall", "plant": "plant.yaml", "controller": "full_speed",
        "database": {"address": "x"}, "connections": {"hall": {"kind": "bacnet", "address": "127.0.0.1:47809"}},
        "points": {"north/zone_air_temperature_sensor": {"connection": "hall", "at": "analog-input,1"}},
    }  # fmt: skip
    (tmp_path / "plant.yaml").write_text(yaml.safe_dump(plant))
    (tmp_path / "site.yaml").write_text(yaml.safe_dump(entry))
    return Site(tmp_path / "site.yaml")


@pytest.fixture
def box(site: Site) -> Iterator[Mailbox]:
    """A guard's mailbox that listens, with a status as the guard's."""
    mailbox, ended, ready = Mailbox(operator_key(site.folder), lambda: 1.0), threading.Event(), threading.Event()
    decision = {"doubts": [], "refused": [], "held": {SET: 293.15}, "modes": {SET: 'a"ct\n'}, "why": {}}
    status = {"decision": decision, "wall": 1000.0, "plan": {"number": 7, "made": 900.0, "values": {}}, "dropped": 0}

    async def main() -> None:
        server = await serve_socket(site.sockets, mailbox, lambda: status)
        ready.set()
        while not ended.is_set():
            await asyncio.sleep(0.01)
        server.close()

    thread = threading.Thread(target=lambda: asyncio.run(main()))
    thread.start()
    ready.wait()
    yield mailbox
    ended.set()
    thread.join()


def client(site: Site) -> Any:
    pytest.importorskip("prometheus_client", reason="needs the extra [live]")
    testing = pytest.importorskip("fastapi.testclient", reason="needs the extra [live]")
    from mpc.live.page.app import make_app

    return testing.TestClient(make_app(site), base_url="http://127.0.0.1:8080")


def test_requests_of_operators_reach_the_guard_signed(site: Site, box: Mailbox) -> None:
    page, tokens = client(site), page_tokens(site.folder)
    body = {"mode": "shadow", "points": [SET]}
    assert page.post("/mode", json=body).status_code == 401
    for token, status in ((tokens["viewer"], 403), ("x", 401), (tokens["operator"], 202)):
        assert page.post("/mode", json=body, headers={"Authorization": f"Bearer {token}"}).status_code == status
    (message,) = box.empty()
    assert message["invalid"] == "" and message["points"] == [SET] and abs(message["expires"] - time.time() - 180.0) < 20.0  # two ticks of the guard are 120 s
    operator = {"Authorization": f"Bearer {tokens['operator']}"}
    for bad in ({"mode": 1, "points": []}, {"mode": "act"}, [], {"mode": "act", "points": [], "by": "root"},
                {"mode": "act", "points": [1]}):  # fmt: skip
        assert page.post("/mode", json=bad, headers=operator).status_code == 422
    for raw in (b"{", b"\xff", b"[" * 100_000, b"x" * 200_000):
        assert page.post("/approve", content=raw, headers=operator).status_code == 422
    assert box.empty() == []
    assert page.post("/approve", json={"plan": 7, "points": [SET]}, headers=operator).status_code == 202
    assert box.empty()[0]["plan"] == 7


def test_the_page_is_shown_to_its_own_machine_alone(site: Site, box: Mailbox) -> None:
    page = client(site)
    assert page.get("/status").json()["guard"] == "up" and "Operation" in page.get("/").text
    assert page.get("/status", headers={"Host": "evil.example"}).status_code == 403
    text = page.get("/metrics").text
    assert "buildingmpc_guard_up 1.0" in text and 'mode="a\\"ct\\n"' in text and f'held{{point="{SET}"}} 293.15' in text
    assert page.get("/health").status_code == 503  # nothing has been collected
    time.sleep(0.6)  # a status is shown again for half a second
    (site.folder / "collector.json").write_text(json.dumps({"where": "committed", "samples": 1, "lost": 0,
                                                            "waiting": False, "missing": 0}))  # fmt: skip
    assert page.get("/health").json() == {"fine": True, "guard": "up"}
    assert page.get("/docs").status_code == page.get("/openapi.json").status_code == 404


def test_the_page_has_the_units_that_it_can_turn_to(site: Site) -> None:
    found = re.search(r"const inchPound = (\{.*?\}\});", client(site).get("/").text)
    assert found is not None
    units = json.loads(found[1])
    assert units == {"°C": {"scale": 1.8, "offset": 32.0, "unit": "°F"}, "K": {"scale": 1.8, "offset": 0.0, "unit": "°F"}}


def test_without_a_guard_nothing_is_claimed(site: Site) -> None:
    page = client(site)
    assert "does not answer" in page.get("/status").json()["guard"] and page.get("/health").status_code == 503
    operator = {"Authorization": f"Bearer {page_tokens(site.folder)['operator']}"}
    assert page.post("/mode", json={"mode": "act", "points": []}, headers=operator).status_code == 503
    assert "buildingmpc_guard_up 0.0" in page.get("/metrics").text


def test_the_socket_is_for_its_user_and_survives_rubbish(site: Site, box: Mailbox) -> None:
    assert not site.sockets.stat().st_mode & 0o077
    for line in (b"\xff" * 100 + b"\n", b"{}\n", b"A" * 3_000_000):
        with socket.socket(socket.AF_UNIX) as raw:
            raw.connect(str(site.sockets))
            try:
                raw.sendall(line)
            except OSError:
                pass
    guard = GuardClient(site.sockets)
    assert guard.ask({"kind": "status"})["wall"] == 1000.0 and guard.ask({"kind": "beat"}) == {"error": ""}
    guard.close()
    assert box.beat == 1.0 and box.empty() == []
    beyond = b'{"kind": "plan", "plan": {"made": 1' + b"0" * 400 + b"}}"  # no float has it, so that no age can be told
    assert box.take(beyond) == "no message of the format" and box.empty() == []


def test_floods_do_not_reach_the_guard_and_pass(site: Site, box: Mailbox, monkeypatch: pytest.MonkeyPatch) -> None:
    uvicorn = pytest.importorskip("uvicorn", reason="needs the extra [live]")
    pytest.importorskip("fastapi", reason="needs the extra [live]")
    monkeypatch.setattr(serve, "_PATIENCE", 0.3)
    monkeypatch.setattr(app, "MOST_STREAMS", 2)
    config = uvicorn.Config(app.make_app(site), port=0, log_level="critical", limit_concurrency=20, http=serve.protocol(),
                            timeout_graceful_shutdown=1)  # fmt: skip
    server = uvicorn.Server(config)
    thread = threading.Thread(target=server.run)
    thread.start()
    while not server.started:
        time.sleep(0.01)
    address = server.servers[0].sockets[0].getsockname()

    def ask(path: str) -> socket.socket:
        one = socket.create_connection(address, 5.0)
        one.sendall(f"GET {path} HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n".encode())
        return one

    def told(path: str) -> bytes:
        with ask(path) as one:
            return one.recv(12)[9:]

    try:
        idle = [socket.create_connection(address, 5.0) for _ in range(30)]
        [one.sendall(b"GET / HT") for one in idle]
        end = time.monotonic() + 10.0
        while (found := told("/status")) != b"200" and time.monotonic() < end:
            time.sleep(0.05)
        assert found == b"200" and all(one.recv(200) == b"" for one in idle)
        streams = [ask("/events") for _ in range(5)]
        time.sleep(0.5)
        fed = [one for one in streams if b"data: " in one.recv(100_000)]
        assert 1 <= len(fed) <= 2
        [one.close() for one in [*streams, *idle]]
        assert box.empty() == [] and box.dropped == 0
    finally:
        server.should_exit = True
        thread.join(20.0)
