"""A simulated site of two zones behind a BACnet/IP device of the Rust stack rusty-bacnet, and the wire to it."""

from __future__ import annotations

import asyncio
import math
import random
import struct
import threading
import time
from dataclasses import dataclass, field
from typing import Any

ZONES = ("north", "south")

#: J/K and W/K of a zone, W of its heater, and W/K of its thermostat: a room of 60 m2 with a heavy floor.
CAPACITY, LOSS, HEATER, GAIN = 6e6, 90.0, 4000.0, 3000.0

#: What the device's own control holds [degC], and the outdoor air [degC].
OWN, OUTDOOR = 20.0, 2.0

#: Time between two looks at the device's priority arrays [s]: what is there for as long is seen.
LOOK = 0.02

_BACNET_IP, _CONFIRMED, _WRITE_PROPERTY, _WRITE_MULTIPLE = 0x81, 0x00, 15, 16


@dataclass(frozen=True)
class Write:
    """A WriteProperty request on the wire."""

    time: float
    object: tuple[int, int]
    property: int
    priority: int | None
    value: float | None
    answered: bool


def decode_write(data: bytes) -> tuple[int, tuple[int, int], int, int | None, float | None] | None:
    """Read a WriteProperty request of BACnet/IP: invoke id, object, property, priority and value; None is another.

    Of ASHRAE Standard 135, annex J and clause 20; not the client's code, so that what it sends is seen by another.
    """
    if len(data) < 10 or data[0] != _BACNET_IP or data[1] not in (0x0A, 0x0B):
        return None
    apdu = data[6:]  # annex J: 4 bytes; version and control of the network layer: 2, for neighbours
    if data[5] & 0x28 or apdu[0] >> 4 != 0 or len(apdu) < 12 or apdu[3] not in (_WRITE_PROPERTY, _WRITE_MULTIPLE):
        return None
    invoke, body = apdu[2], apdu[4:]
    if apdu[3] == _WRITE_MULTIPLE:
        return invoke, (-1, -1), -1, None, None
    number = struct.unpack(">I", body[1:5])[0]
    at, prop = 5, body[6]
    at = 7
    if body[at] != 0x3E:  # an index
        at += 1 + (body[at] & 7)
    at += 1
    tag = body[at]
    value = struct.unpack(">f", body[at + 1 : at + 5])[0] if tag == 0x44 else None
    at = body.index(0x3F, at + (5 if tag == 0x44 else 1)) + 1
    priority = body[at + 1] if at + 1 < len(body) and body[at] == 0x49 else None
    return invoke, (number >> 22, number & 0x3FFFFF), prop, priority, value


class Wire(asyncio.DatagramProtocol):
    """Stands between clients and the device: keeps a journal of writes, and can be cut, refuse or spoil."""

    def __init__(self, device: tuple[str, int]) -> None:
        self.device, self.journal = device, list[Write]()
        self.cut = self.refuse_values = self.refuse_all = False
        self.replace: dict[bytes, bytes] = {}
        self._ways: dict[Any, Any] = {}

    def connection_made(self, transport: Any) -> None:
        self._transport = transport

    def datagram_received(self, data: bytes, address: Any) -> None:
        found = decode_write(data)
        if found is not None:
            refused = self.refuse_all or (self.refuse_values and found[4] is not None)
            passed = not (self.cut or refused)
            self.journal.append(Write(time.monotonic(), found[1], found[2], found[3], found[4], passed))
            if refused and not self.cut:  # error of class property (2), code write-access-denied (40)
                answer = bytes([0x50, found[0], 15, 0x91, 2, 0x91, 40])
                self._transport.sendto(bytes([0x81, 0x0A, 0, 6 + len(answer), 1, 0]) + answer, address)
                return
        if self.cut:
            return
        if address not in self._ways:
            self._ways[address] = []
            self._opening = asyncio.ensure_future(self._open(address, data))
        elif isinstance(self._ways[address], list):
            self._ways[address].append(data)
        else:
            self._ways[address].sendto(data)

    async def _open(self, address: Any, first: bytes) -> None:
        wire = self

        class Back(asyncio.DatagramProtocol):
            def datagram_received(self, data: bytes, _: Any) -> None:
                for old, new in wire.replace.items():
                    data = data.replace(old, new)
                if not wire.cut:
                    wire._transport.sendto(data, address)

        loop = asyncio.get_running_loop()
        way, _ = await loop.create_datagram_endpoint(Back, remote_addr=self.device)
        waiting, self._ways[address] = self._ways[address], way
        for data in [first, *waiting]:
            way.sendto(data)


@dataclass
class Slot:
    """A value of a priority that a point had from a time on; None is empty."""

    time: float
    point: int
    priority: int
    value: float | None


@dataclass
class SimulatedSite:
    """Runs the building and its device in a thread.

    Objects: analog inputs 1 (outdoor air), 2 and 3 (zones) [degC], 4 and 5 (heat) [W]; analog values 1 and 2 (heating
    setpoints of the zones) [degC], 3 (a setpoint that nobody may touch). All are commandable with 16 priorities.
    """

    rate: float
    seed: int = 0
    frozen: bool = False
    absurd: float | None = None
    outdoor: float | None = None
    heat: float | None = None
    slots: list[Slot] = field(default_factory=list)
    now: dict[tuple[int, int], float] = field(default_factory=dict)
    temperatures: dict[str, float] = field(default_factory=dict)
    commands: dict[tuple[int, int], float] = field(default_factory=dict)

    def start(self) -> str:
        """Begin; return the address that clients use, that of the wire."""
        self._ready, self._ended = threading.Event(), threading.Event()
        self._thread = threading.Thread(target=lambda: asyncio.run(self._run()), daemon=True)
        self._thread.start()
        if not self._ready.wait(20.0):
            raise RuntimeError("the simulated site did not begin")
        return f"127.0.0.1:{self.port}"

    def stop(self) -> None:
        """End."""
        self._ended.set()
        self._thread.join(10.0)

    def operate(self, point: int, value: float | None, priority: int = 8) -> None:
        """Command a setpoint as an operator does, on the device itself; None takes it back."""
        asyncio.run_coroutine_threadsafe(self._command(point, value, priority), self._loop).result(5.0)
        if value is None:
            self.commands.pop((point, priority), None)
        else:
            self.commands[point, priority] = value

    def held(self, priority: int) -> dict[int, float]:
        """Values of a priority now, by number of the point."""
        return {point: value for (point, slot), value in list(self.now.items()) if slot == priority}

    async def _command(self, point: int, value: float | None, priority: int) -> None:
        given = self._rb.PropertyValue.null() if value is None else self._rb.PropertyValue.real(value)
        await self._server.write_property_local(
            self._object(2, point), self._rb.PropertyIdentifier.PRESENT_VALUE, given, priority, source_object=None
        )

    def _object(self, kind: int, number: int) -> Any:
        kinds = self._rb.ObjectType
        return self._rb.ObjectIdentifier(kinds.ANALOG_INPUT if kind == 0 else kinds.ANALOG_VALUE, number)

    async def _run(self) -> None:
        import rusty_bacnet

        self._rb, self._loop = rusty_bacnet, asyncio.get_running_loop()
        server = self._server = rusty_bacnet.BACnetServer(
            device_instance=1001, device_name="hall", interface="127.0.0.1", port=0, broadcast_address="127.255.255.255"
        )
        for number, name in enumerate(("outdoor", *ZONES, *(f"heat {z}" for z in ZONES)), 1):
            server.add_analog_input(number, name, present_value=OWN if number in (2, 3) else 0.0)
        for number in (1, 2, 3):
            server.add_analog_value(number, f"setpoint {number}")
        await server.start()
        for number in (1, 2, 3):
            await server.write_property_local(
                self._object(2, number), rusty_bacnet.PropertyIdentifier.RELINQUISH_DEFAULT,
                rusty_bacnet.PropertyValue.real(OWN), source_object=None,
            )  # fmt: skip
        host, port = (await server.local_address()).split(":")
        self.wire = Wire((host, int(port)))
        transport, _ = await self._loop.create_datagram_endpoint(lambda: self.wire, local_addr=("127.0.0.1", 0))
        self.port = transport.get_extra_info("sockname")[1]
        rng = random.Random(self.seed)
        self.temperatures = dict.fromkeys(ZONES, OWN)
        last = time.monotonic()
        await self._step(0.0, rng)
        self._ready.set()
        while not self._ended.is_set():
            await asyncio.sleep(LOOK)
            await self._look()
            passed = (time.monotonic() - last) * self.rate
            if passed >= 30.0:  # a time constant of the thermostat is CAPACITY / GAIN, half an hour
                last = time.monotonic()
                await self._step(passed, rng)
        await server.stop()
        for way in [transport, *self.wire._ways.values()]:
            way.close()
        await asyncio.sleep(0)

    async def _look(self) -> None:
        """Note what has changed in the priority arrays."""
        for point in (1, 2, 3):
            array = await self._server.read_property(
                self._object(2, point), self._rb.PropertyIdentifier.PRIORITY_ARRAY
            )
            when = time.monotonic()
            for priority, item in enumerate(array.value, 1):
                value = getattr(item, "value", item)
                key = (point, priority)
                if value is None and key in self.now:
                    del self.now[key]
                    self.slots.append(Slot(when, point, priority, None))
                elif value is not None and self.now.get(key) != value:
                    self.now[key] = float(value)
                    self.slots.append(Slot(when, point, priority, float(value)))

    async def _step(self, passed: float, rng: random.Random) -> None:
        """Let the building go on, exactly over the step, and tell the inputs."""
        shown: dict[int, float] = {1: OUTDOOR if self.outdoor is None else self.outdoor}
        for k, zone in enumerate(ZONES):
            told = await self._server.read_property(
                self._object(2, k + 1), self._rb.PropertyIdentifier.PRESENT_VALUE
            )
            temperature = self.temperatures[zone]
            heat = min(max(GAIN * (float(told.value) - temperature), 0.0), HEATER)
            rest = OUTDOOR + heat / LOSS
            self.temperatures[zone] = rest + (temperature - rest) * math.exp(-passed * LOSS / CAPACITY)
            shown[k + 2] = self.temperatures[zone] + rng.gauss(0.0, 0.01)
            shown[k + 4] = heat if self.heat is None else self.heat
        if self.absurd is not None:
            shown[2] = self.absurd
        if self.frozen:
            return
        for number, value in shown.items():
            given = struct.unpack(">f", struct.pack(">f", value))[0]
            await self._server.set_present_value_local(self._object(0, number), self._rb.PropertyValue.real(given))
