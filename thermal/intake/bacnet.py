"""Discovery of a BACnet/IP network: its devices, and name, description and unit of their objects."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Sequence
from typing import Any

from thermal.errors import PlanError
from thermal.plan.discovery import NetworkPoint
from thermal.plan.guard import extra

#: How long devices have to answer [s]: as bacpypes3 waits.
ANSWERS = 3.0

#: Objects a request: with their descriptions an answer stays within the largest of BACnet/IP that is not cut.
_AT_ONCE = 10

#: Kinds of objects that are points.
KINDS = ("analog-input", "analog-output", "analog-value", "binary-input", "binary-output", "binary-value",
         "multi-state-input", "multi-state-output", "multi-state-value")  # fmt: skip

_WANTED = ("object-name", "description", "units")

Progress = Callable[[str, int, int], None]


def discover(
    local: str, devices: Sequence[str] = (), wait: float = ANSWERS, progress: Progress | None = None
) -> tuple[NetworkPoint, ...]:
    """List the points of all devices of a network.

    Parameters
    ----------
    local : str
        Address of this machine there, ``10.0.0.5/24`` or ``10.0.0.5/24:0``; port 0 takes a free one.
    devices : sequence of str
        Addresses of devices that are asked one by one; default: all that answer a broadcast.
    wait : float
        How long they have to answer [s].
    progress : callable, optional
        Told stage, devices done and all devices.

    Returns
    -------
    tuple of NetworkPoint
        In the order of devices and their objects. Nothing is written to any device.

    Raises
    ------
    PlanError
        The address is none of this machine, no device answers, or one that was asked does not.
    MissingExtraError
        Without the extra ``live``.
    """
    return asyncio.run(_discover(local, devices, wait, progress))


async def _discover(
    local: str, devices: Sequence[str], wait: float, progress: Progress | None
) -> tuple[NetworkPoint, ...]:
    own = extra("bacpypes3.local.device", of="live", needed_by="discovery")
    application = extra("bacpypes3.ipv4.app", of="live", needed_by="discovery")
    pdu = extra("bacpypes3.pdu", of="live", needed_by="discovery")
    try:
        device = own.DeviceObject(objectIdentifier=("device", 4194302), objectName="buildingmpc", vendorIdentifier=999)
        app = application.NormalApplication(device, pdu.IPv4Address(local))
        targets = [pdu.Address(address) for address in devices]
    except (ValueError, TypeError, OSError, RuntimeError) as error:  # what bacpypes3 cannot resolve is the last
        advice = "such as 10.0.0.5/24, the address of this machine with its network"
        raise PlanError("discovery", "addresses on this machine and of devices", f"{local}: {error}", advice) from error
    try:
        await asyncio.sleep(0.1)  # until the socket is open
        heard: list[Any] = []
        for target in targets or [None]:
            answers = await app.who_is(address=target, timeout=wait)
            found, expected = f"none within {wait:g} s", f"an answer of {target or 'any device'}"
            PlanError.unless(answers, "discovery", expected, found, "look at address, port and firewall")
            heard += answers
        points: list[NetworkPoint] = []
        for number, answer in enumerate(heard):
            if progress is not None:
                progress("reading devices", number, len(heard))
            points += await _points(app, answer)
        return tuple(points)
    finally:
        app.close()


async def _points(app: Any, answer: Any) -> list[NetworkPoint]:
    """Points of a device."""
    address, identifier = answer.pduSource, answer.iAmDeviceIdentifier
    name = await _read(app, address, identifier, "object-name")
    listed = await _read(app, address, identifier, "object-list")
    expected, advice = "its list of objects", "it may be one that only gives the list part by part"
    PlanError.unless(listed is not None, f"device {identifier} at {address}", expected, "no answer", advice)
    objects = [item for item in listed if str(item[0]) in KINDS]
    points = []
    for begin in range(0, len(objects), _AT_ONCE):
        some = objects[begin : begin + _AT_ONCE]
        for item, told in zip(some, await _properties(app, address, some), strict=True):
            at = f"{item[0]},{item[1]}"
            name_of = told.get("object-name") or at
            points.append(
                NetworkPoint(
                    f"{address} {at}", name_of, told.get("description", ""), str(name or ""), told.get("units", "")
                )
            )
    return points


async def _properties(app: Any, address: Any, objects: Sequence[Any]) -> list[dict[str, str]]:
    """Names, descriptions and units of objects: in one request, else one by one."""
    asked: list[Any] = []
    for item in objects:
        asked += [item, list(_WANTED)]
    try:
        rows = await app.read_property_multiple(address, asked)
    except (
        Exception
    ):  # a device that refuses this service, in any of bacpypes3's ways, may still give single properties
        rows = None
    if isinstance(rows, list) and len(rows) == len(objects) * len(_WANTED):
        flat = [_text(row[3]) for row in rows]
        return [dict(zip(_WANTED, flat[i : i + len(_WANTED)], strict=True)) for i in range(0, len(flat), len(_WANTED))]
    return [{p: _text(await _read(app, address, item, p)) for p in _WANTED} for item in objects]


async def _read(app: Any, address: Any, identifier: Any, what: str) -> Any:
    """Value of a property; None where the device has it not."""
    raised = extra("bacpypes3.apdu", of="live", needed_by="discovery").ErrorRejectAbortNack
    try:
        return await app.read_property(address, identifier, what)
    except (raised, ValueError, TypeError, AttributeError, TimeoutError):
        return None


def _text(value: Any) -> str:
    """Text of a property; empty for errors, which stand in the place of what a device has not."""
    return "" if value is None or type(value).__name__ in ("ErrorType", "Error") else str(value)
