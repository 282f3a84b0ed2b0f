"""Connections to real parts: a BACnet/IP device of another stack, a broker of Debian's; skipped by name without."""

from __future__ import annotations

import asyncio
import math
import shutil
import socket
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from mpc.live.links.bacnet import BacnetConnection
from mpc.live.links.mqtt import MqttConnection, parse_payload
from mpc.live.site_file import BacnetLink, MqttLink
from mpc.loop.conversion import conversion

CELSIUS = conversion("zone_air_temperature_sensor", "x", "degC")
POINTS = {"zone": ("analog-input,2", CELSIUS), "set": ("analog-value,1", CELSIUS), "none": ("analog-value,99", CELSIUS)}


@pytest.fixture(scope="module")
def device(script: Any) -> Iterator[Any]:
    pytest.importorskip("rusty_bacnet", reason="needs a BACnet device of another stack: pip install rusty-bacnet")
    pytest.importorskip("bacpypes3", reason="needs the extra [live]")
    script("_bacnet_device")
    site = script("_bacnet_site").SimulatedSite(100.0)
    site.address = site.start()
    yield site
    site.stop()


def test_a_device_is_read_written_and_given_back(device: Any) -> None:
    async def work() -> None:
        link = BacnetConnection(BacnetLink(kind="bacnet", address=device.address, timeout=1.0), POINTS)
        await link.open()
        try:
            seen = await link.read(["zone", "set"], slots=True)
            assert seen["zone"]["value"] is None and seen["zone"]["error"]  # inputs have no priorities
            assert seen["set"] == {"value": 293.15, "slots": {}, "error": ""}
            plain = await link.read(["zone"], slots=False)
            assert 290.0 < plain["zone"]["value"] < 295.0 and plain["zone"]["slots"] is None
            assert await link.write("set", 295.15) == ""
            device.operate(1, 18.0, 8)
            seen = await link.read(["set"], slots=True)
            assert seen["set"]["value"] == pytest.approx(291.15)
            assert seen["set"]["slots"] == {"8": pytest.approx(291.15), "13": pytest.approx(295.15)}
            assert await link.write("set", None) == ""
            device.operate(1, None, 8)
            assert (await link.read(["set"], slots=True))["set"] == {"value": 293.15, "slots": {}, "error": ""}
            assert "denied" in await link.write("zone", 295.0) and "unknown-object" in await link.write("none", 295.0)
            assert (await link.read(["none"], slots=True))["none"]["error"]
            device.wire.cut = True
            begin = time.monotonic()
            assert (await link.read(["set"], slots=True))["set"]["error"] and await link.write("set", 295.0)
            assert time.monotonic() - begin < 5.0
        finally:
            device.wire.cut = False
            await link.close()

    asyncio.run(work())


def test_a_device_tells_what_changes(device: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """Points are asked for until they are told; then one is, so that a device that is gone is seen."""
    told = {"set": POINTS["set"], "other": ("analog-value,2", CELSIUS), "none": POINTS["none"]}
    names, asked = list(told), list[set[str]]()
    many = BacnetConnection._many

    async def seen(self: Any, some: Any, slots: bool) -> Any:
        asked.append(set(some))
        return await many(self, some, slots)

    monkeypatch.setattr(BacnetConnection, "_many", seen)

    async def read_until(link: BacnetConnection, condition: Any) -> dict[str, Any]:
        end = time.monotonic() + 20.0
        while not condition(found := await link.read(names, slots=False)):
            assert time.monotonic() < end, (found, asked[-3:])
            await asyncio.sleep(0.05)
        return found

    async def work() -> None:
        link = BacnetConnection(BacnetLink(kind="bacnet", address=device.address, timeout=0.5, cov=10.0), told)
        await link.open()
        try:
            first = await link.read(names, slots=False)
            assert asked == [set(names)] and first["none"]["error"]
            assert first["set"]["value"] == first["other"]["value"] == pytest.approx(293.15)
            # told: the first of them is asked for, and the one that no subscription is to be had of
            await read_until(link, lambda _: asked[-1] in ({"set", "none"}, {"other", "none"}))
            for number, value in ((1, 18.0), (2, 22.0)):
                device.operate(number, value, 8)
            given = await read_until(link, lambda f: [f[n]["value"] for n in ("set", "other")] == pytest.approx([291.15, 295.15]))
            assert given["none"]["error"] and len(asked[-1]) == 2
            device.wire.cut = True
            gone = await link.read(names, slots=False)
            assert all(one["error"] and one["value"] is None for one in gone.values())
            device.wire.cut = False
            for number in (1, 2):
                device.operate(number, None, 8)
            await read_until(link, lambda f: [f[n]["value"] for n in ("set", "other")] == pytest.approx([293.15] * 2))
            # what has changed since is told again
            await read_until(link, lambda _: len(asked[-1]) == 2)
        finally:
            device.wire.cut = False
            begin = time.monotonic()
            await link.close()
            assert time.monotonic() - begin < 1.0

    asyncio.run(work())


def test_writes_on_the_wire_are_seen_by_other_code_than_the_clients(device: Any) -> None:
    written = [w for w in device.wire.journal if w.object == (2, 1)]
    assert [(w.property, w.priority) for w in written] == [(85, 13)] * len(written)
    assert [w.value for w in written[:2]] == [22.0, None]


@pytest.fixture(scope="module")
def broker(tmp_path_factory: pytest.TempPathFactory) -> Iterator[int]:
    pytest.importorskip("paho.mqtt.client", reason="needs the extra [live]")
    program = shutil.which("mosquitto") or shutil.which("/usr/sbin/mosquitto")
    if program is None:
        pytest.skip("needs a broker (Debian: apt install mosquitto)")
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    folder = tmp_path_factory.mktemp("mosquitto")
    (folder / "m.conf").write_text(f"listener {port} 127.0.0.1\nallow_anonymous true\n")
    process = subprocess.Popen([program, "-c", str(folder / "m.conf")], stderr=subprocess.DEVNULL)
    for _ in range(100):
        with socket.socket() as probe:
            if probe.connect_ex(("127.0.0.1", port)) == 0:
                break
        time.sleep(0.05)
    yield port
    process.terminate()
    process.wait()


def test_a_broker_is_read_and_written(broker: int) -> None:
    points = {"zone": ("hall/t", CELSIUS), "set": ("hall/set hall/set/cmd", CELSIUS), "other": ("hall/x", CELSIUS)}

    async def work() -> None:
        link = MqttConnection(MqttLink(kind="mqtt", host="127.0.0.1", port=broker), points, Path())
        await link.open()
        device = MqttConnection(
            MqttLink(kind="mqtt", host="127.0.0.1", port=broker), {"cmd": ("hall/set/cmd", CELSIUS),
            "t": ("hall/t", CELSIUS)}, Path(),
        )  # fmt: skip
        await device.open()
        try:
            for _ in range(100):
                await device.write("t", 294.15)
                if (await link.read(["zone"], False))["zone"]["value"] is not None:
                    break
                await asyncio.sleep(0.05)
            seen = await link.read(points, True)
            assert seen["zone"] == {"value": pytest.approx(294.15), "slots": None, "error": ""}
            assert seen["other"]["error"] == "nothing was published lately"
            assert await link.write("set", 295.15) == "" and "relinquish" in await link.write("set", None)
            for _ in range(100):
                told = (await device.read(["cmd"], False))["cmd"]["value"]
                if told is not None:
                    break
                await asyncio.sleep(0.05)
            assert told == pytest.approx(295.15)
        finally:
            await link.close()
            await device.close()

    asyncio.run(work())


def test_what_strangers_publish_does_no_more_than_be_read(broker: int) -> None:
    """Rubbish is a missing value, a retained value is none, what is not asked for is not heard, a flood delays nobody."""
    paho = pytest.importorskip("paho.mqtt.client")
    stranger = paho.Client(paho.CallbackAPIVersion.VERSION2)
    stranger.connect("127.0.0.1", broker)
    stranger.loop_start()

    def publish(topic: str, payload: bytes, **more: Any) -> None:
        stranger.publish(topic, payload, **more).wait_for_publish(5.0)

    async def work() -> None:
        points = {"zone": ("own/t", CELSIUS), "set": ("own/set own/cmd", CELSIUS)}
        publish("own/t", b"21.0", qos=1, retain=True)
        link = MqttConnection(MqttLink(kind="mqtt", host="127.0.0.1", port=broker), points, Path())
        await link.open()
        try:
            for _ in range(200):
                publish("own/set", b"20", qos=1)
                if not (await link.read(["set"], True))["set"]["error"]:
                    break
                await asyncio.sleep(0.02)
            assert (await link.read(["zone"], True))["zone"]["error"] == "nothing was published lately"
            for payload in (b"NaN", b"1e999", b'{"value": 1e400}', b"[" * 900, b"9" * 900, b"\xff" * 10, b"x" * 2000):
                publish("own/t", payload, qos=1)
                publish("own/t/x", b"21", qos=1)
            await asyncio.sleep(0.1)
            assert (await link.read(["zone"], True))["zone"] == {"value": None, "slots": None, "error": ""}
            for _ in range(3000):
                stranger.publish("own/t", b"21.0")
            begin = time.monotonic()
            assert await link.write("set", 293.15) == ""
            await link.read(points, True)
            assert time.monotonic() - begin < 1.0
            assert set(link._seen) <= {"own/t", "own/set"}
        finally:
            await link.close()
            publish("own/t", b"", retain=True)
            stranger.disconnect()
            stranger.loop_stop()

    asyncio.run(work())


def test_a_broker_that_is_not_there_is_an_answer() -> None:
    pytest.importorskip("paho.mqtt.client", reason="needs the extra [live]")

    async def work() -> None:
        link = MqttConnection(MqttLink(kind="mqtt", host="127.0.0.1", port=9), {"set": ("x", CELSIUS)}, Path())
        await link.open()
        assert (await link.read(["set"], True))["set"]["error"] == "no broker"
        assert await link.write("set", 1.0) == "no broker"
        await link.close()

    asyncio.run(work())


@pytest.mark.parametrize(
    "payload", [b"", b"x", b"[]", b"true", b"null", b'"1"', b'{"value": "1"}', b"{}", b"1" * 2000, b"\xff", b"[" * 900]
)
def test_a_payload_that_is_no_number_is_a_missing_value(payload: bytes) -> None:
    assert math.isnan(parse_payload(payload))
