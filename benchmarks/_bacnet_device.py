"""A BACnet/IP device of the Rust stack rusty-bacnet in front of whatever is simulated, and the wire to it."""

from __future__ import annotations

import asyncio
import struct
import threading
import time
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

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
    length, value = 1, None
    if tag == 0x44:  # a real
        length, value = 5, struct.unpack(">f", body[at + 1 : at + 5])[0]
    elif tag == 0x91:  # a state, of one byte
        length, value = 2, float(body[at + 1])
    at = body.index(0x3F, at + length) + 1
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


@dataclass(frozen=True)
class Command:
    """An object that may be commanded at 16 priorities: an analog value, or a binary one.

    Parameters
    ----------
    name : str
        Of the object.
    default : float
        What it shows while nobody commands it [unit of the object].
    binary : bool
        Whether it is 0 or 1.
    """

    name: str
    default: float
    binary: bool = False


class BacnetDevice(ABC):
    """Runs a device in a thread: analog inputs from 1 on, and objects that may be commanded, numbered from 1 on too.

    Parameters
    ----------
    name : str
        Of the device.
    inputs : sequence of str
        Names of the analog inputs.
    commands : sequence of Command
        Objects that may be commanded.
    """

    def __init__(self, name: str, inputs: Sequence[str], commands: Sequence[Command]) -> None:
        self.name, self.inputs, self.objects = name, tuple(inputs), tuple(commands)
        self.slots: list[Slot] = []
        self.now: dict[tuple[int, int], float] = {}
        self.commands: dict[tuple[int, int], float] = {}
        self.trouble: BaseException | None = None
        self._ready, self._ended = threading.Event(), threading.Event()

    @abstractmethod
    async def advance(self) -> bool:
        """Let what is simulated go on to now, and show it; tell whether it goes on. Called again and again."""

    def start(self) -> str:
        """Begin; return the address that clients use, that of the wire."""
        self._thread = threading.Thread(target=self._work, daemon=True)
        self._thread.start()
        began = self._ready.wait(20.0)
        if self.trouble is not None:
            raise self.trouble
        if not began:
            raise RuntimeError("the simulated site did not begin")
        return f"127.0.0.1:{self.port}"

    def stop(self) -> None:
        """End."""
        self._ended.set()
        self._thread.join(10.0)

    def wait(self) -> None:
        """Wait until it has ended by itself; raise what ended it, if it was an error."""
        self._thread.join()
        if self.trouble is not None:
            raise self.trouble

    def operate(self, point: int, value: float | None, priority: int = 8) -> None:
        """Command an object as an operator does, on the device itself; None takes it back."""
        asyncio.run_coroutine_threadsafe(self._command(point, value, priority), self._loop).result(5.0)
        if value is None:
            self.commands.pop((point, priority), None)
        else:
            self.commands[point, priority] = value

    def held(self, priority: int) -> dict[int, float]:
        """Values of a priority now, by number of the object."""
        return {point: value for (point, slot), value in list(self.now.items()) if slot == priority}

    def at(self, point: int) -> str:
        """Name an object that may be commanded as a site's file does, such as ``analog-value,1``."""
        return f"{'binary' if self.objects[point - 1].binary else 'analog'}-value,{point}"

    async def show(self, values: Mapping[int, float]) -> None:
        """Set analog inputs by number."""
        for number, value in values.items():
            given = struct.unpack(">f", struct.pack(">f", value))[0]
            await self._server.set_present_value_local(self._input(number), self._rb.PropertyValue.real(given))

    async def commanded(self, point: int) -> float:
        """Give the value that an object has, its default where nobody commands it."""
        told = await self._server.read_property(self._object(point), self._rb.PropertyIdentifier.PRESENT_VALUE)
        return float(told.value)

    async def set_default(self, point: int, value: float) -> None:
        """Say what an object shows while nobody commands it."""
        await self._server.write_property_local(
            self._object(point), self._rb.PropertyIdentifier.RELINQUISH_DEFAULT, self._value(point, value),
            source_object=None,
        )  # fmt: skip

    async def look(self) -> None:
        """Note what has changed in the priority arrays."""
        for point in range(1, len(self.objects) + 1):
            array = await self._server.read_property(self._object(point), self._rb.PropertyIdentifier.PRIORITY_ARRAY)
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

    async def _command(self, point: int, value: float | None, priority: int) -> None:
        given = self._rb.PropertyValue.null() if value is None else self._value(point, value)
        await self._server.write_property_local(
            self._object(point), self._rb.PropertyIdentifier.PRESENT_VALUE, given, priority, source_object=None
        )

    def _value(self, point: int, value: float) -> Any:
        kinds = self._rb.PropertyValue
        return kinds.enumerated(round(value)) if self.objects[point - 1].binary else kinds.real(value)

    def _object(self, point: int) -> Any:
        kinds = self._rb.ObjectType
        binary = self.objects[point - 1].binary
        return self._rb.ObjectIdentifier(kinds.BINARY_VALUE if binary else kinds.ANALOG_VALUE, point)

    def _input(self, number: int) -> Any:
        return self._rb.ObjectIdentifier(self._rb.ObjectType.ANALOG_INPUT, number)

    def _work(self) -> None:
        try:
            asyncio.run(self._run())
        except BaseException as error:  # of a thread: whoever waits for it raises it
            self.trouble = error
            self._ready.set()

    async def _run(self) -> None:
        import rusty_bacnet

        self._rb, self._loop = rusty_bacnet, asyncio.get_running_loop()
        server = self._server = rusty_bacnet.BACnetServer(
            device_instance=1001, device_name=self.name, interface="127.0.0.1", port=0,
            broadcast_address="127.255.255.255",
        )  # fmt: skip
        for number, name in enumerate(self.inputs, 1):
            server.add_analog_input(number, name)
        for number, command in enumerate(self.objects, 1):
            (server.add_binary_value if command.binary else server.add_analog_value)(number, command.name)
        await server.start()
        for number, command in enumerate(self.objects, 1):
            await self.set_default(number, command.default)
        host, port = (await server.local_address()).split(":")
        self.wire = Wire((host, int(port)))
        transport, _ = await self._loop.create_datagram_endpoint(lambda: self.wire, local_addr=("127.0.0.1", 0))
        self.port = transport.get_extra_info("sockname")[1]
        try:
            going = await self.advance()
            self._ready.set()
            while going and not self._ended.is_set():
                await asyncio.sleep(LOOK)
                await self.look()
                going = await self.advance()
        finally:
            await server.stop()
            for way in [transport, *self.wire._ways.values()]:
                way.close()
            await asyncio.sleep(0)
