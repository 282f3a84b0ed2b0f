"""Discovery of a BACnet/IP device of another stack, on loopback; skipped where a stack is not installed."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Iterator

import pytest

from thermal.errors import PlanError
from thermal.intake.bacnet import discover

pytest.importorskip("bacpypes3", reason="needs the extra [live]")
rusty_bacnet = pytest.importorskip("rusty_bacnet", reason="needs the BACnet stack rusty-bacnet")

LOCAL = "127.0.0.1/8:0"


@pytest.fixture(scope="module")
def device() -> Iterator[str]:
    """Address of a device with fourteen objects: more than one request holds."""
    ready, ended, found = threading.Event(), threading.Event(), list[str]()

    async def run() -> None:
        server = rusty_bacnet.BACnetServer(
            device_instance=1001,
            device_name="VAV_1",
            interface="127.0.0.1",
            port=0,
            broadcast_address="127.255.255.255",
        )
        for number in range(1, 13):
            server.add_analog_input(number, f"sensor {number}", present_value=20.0)
        server.add_analog_value(1, "heating setpoint")
        server.add_binary_value(1, "fan")
        await server.start()
        found.append(await server.local_address())
        ready.set()
        while not ended.is_set():
            await asyncio.sleep(0.05)
        await server.stop()

    thread = threading.Thread(target=lambda: asyncio.run(run()))
    thread.start()
    assert ready.wait(10.0)
    yield found[0]
    ended.set()
    thread.join(10.0)


def test_objects_of_a_device(device: str) -> None:
    points = discover(LOCAL, [device], wait=1.0)
    assert [p.name for p in points if "analog-input" in p.address] == [f"sensor {n}" for n in range(1, 13)]
    assert {p.device for p in points} == {"VAV_1"} and len(points) == 14
    assert all(p.address.startswith(device) for p in points)


def test_silence_is_told() -> None:
    with pytest.raises(PlanError, match="none within 0.3 s"):
        discover(LOCAL, ["127.0.0.1:9"], wait=0.3)
    with pytest.raises(PlanError, match="addresses on this machine"):
        discover("nowhere")
