"""BACnet/IP by bacpypes3: many properties a request or told when they change, writes at a priority of one's own."""

from __future__ import annotations

import asyncio
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from mpc.errors import LiveError
from mpc.live.links.changes import Subscriptions
from mpc.live.links.link import reading
from mpc.live.site_file import BacnetLink
from mpc.loop.conversion import Conversion
from thermal.plan.guard import extra

#: Points a request: with priority arrays an answer stays within 1,476 bytes, the largest of BACnet/IP that is not cut.
_PLAIN, _WITH_SLOTS = 40, 12


class BacnetConnection:
    """A device.

    Parameters
    ----------
    link : BacnetLink
        Where it is.
    points : mapping of str to tuple of str and Conversion
        Object, such as ``analog-value,3``, and unit of each point.
    """

    def __init__(self, link: BacnetLink, points: Mapping[str, tuple[str, Conversion]]) -> None:
        self.link, self.points = link, points
        self._app: Any = None
        self._changes: Subscriptions | None = None
        self._device = extra("bacpypes3.local.device", "live", "BACnet")
        self._application = extra("bacpypes3.ipv4.app", "live", "BACnet")
        self._pdu = extra("bacpypes3.pdu", "live", "BACnet")
        self._raised = extra("bacpypes3.apdu", "live", "BACnet").ErrorRejectAbortNack
        primitives = extra("bacpypes3.primitivedata", "live", "BACnet")
        self._null, self._identifier = primitives.Null, primitives.ObjectIdentifier

    async def open(self) -> None:
        """Begin."""
        try:
            own = self._device.DeviceObject(
                objectIdentifier=("device", 4194302), objectName="buildingmpc", vendorIdentifier=999,
                apduTimeout=max(round(1000 * self.link.timeout / 2), 1), numberOfApduRetries=1,
            )  # fmt: skip
            self._app = self._application.NormalApplication(own, self._pdu.IPv4Address(self.link.local))
            self._address = self._pdu.Address(self.link.address)
        except (ValueError, TypeError, OSError) as error:
            found = f"{self.link.local} and {self.link.address}: {error}"
            raise LiveError("connection of bacnet", "addresses on this machine and of the device", found) from error
        await asyncio.sleep(0)

    async def read(self, names: Iterable[str], slots: bool) -> dict[str, dict[str, Any]]:
        """Read points.

        Parameters
        ----------
        names, slots
            As of `Link`.
        """
        wanted = list(names)
        if slots or self.link.cov is None:
            return await self._polled(wanted, slots)
        if self._changes is None:
            objects = {name: self._identifier(self.points[name][0]) for name in wanted}
            self._changes = Subscriptions(self._app, self._address, objects, self.link.cov, (self._raised, OSError))
        known = {name: self._reading(name, [value]) for name, value in self._changes.values.items() if name in wanted}
        # one that is known is asked for, too: of a device that tells nothing it is not clear whether it is there
        found = await self._polled([name for name in wanted if name not in known] + list(known)[:1], slots)
        if known and all(one["error"] for one in found.values()):
            self._changes.forget()
            return await self._polled(wanted, slots)
        return known | found

    async def _polled(self, wanted: Sequence[str], slots: bool) -> dict[str, dict[str, Any]]:
        """Ask for points."""
        most = _WITH_SLOTS if slots else _PLAIN
        found: dict[str, dict[str, Any]] = {}
        for begin in range(0, len(wanted), most):
            some = wanted[begin : begin + most]
            answered = await self._many(some, slots)
            found |= answered
            if all(one["error"] for one in answered.values()) and len(wanted) > most:
                # a device that is gone is not asked for the rest: that would take longer than a step
                return {name: reading(None, None, answered[some[0]]["error"]) for name in wanted} | found
        return found

    async def _many(self, names: Sequence[str], slots: bool) -> dict[str, dict[str, Any]]:
        properties = ["present-value", "priority-array"] if slots else ["present-value"]
        asked: list[Any] = []
        for name in names:
            asked += [self.points[name][0], properties]
        try:
            rows = await asyncio.wait_for(
                self._app.read_property_multiple(self._address, asked), self.link.timeout + 0.5
            )
        except (TimeoutError, self._raised, ValueError, TypeError, AttributeError, OSError) as error:
            return {name: reading(None, None, _told(error)) for name in names}
        if not isinstance(rows, list) or len(rows) != len(names) * len(properties):
            return {name: reading(None, None, f"an answer of another form: {rows!r}"[:120]) for name in names}
        found = {}
        for k, name in enumerate(names):
            parts = [row[3] for row in rows[k * len(properties) : (k + 1) * len(properties)]]
            found[name] = self._reading(name, parts)
        return found

    def _reading(self, name: str, parts: Sequence[Any]) -> dict[str, Any]:
        """Bring one point's properties into the library's unit."""
        line = self.points[name][1]
        try:
            value = line.into(float(parts[0]))
            if len(parts) == 1:
                return reading(value)
            slots = {}
            for number, slot in enumerate(parts[1], 1):
                if slot._choice != "null":
                    slots[str(number)] = line.into(float(getattr(slot, slot._choice)))
            return reading(value, slots)
        except (TypeError, ValueError) as error:
            return reading(None, None, f"{_told(parts[0])} ({error})"[:120])

    async def write(self, name: str, value: float | None) -> str:
        """Write at the connection's priority, or relinquish.

        Parameters
        ----------
        name, value
            As of `Link` [library's unit].
        """
        at, line = self.points[name]
        given: Any = self._null(()) if value is None else line.out(value)
        if value is not None and at.startswith("binary"):
            given = round(given)
        try:
            await asyncio.wait_for(
                self._app.write_property(
                    self._address, at, "present-value", given, priority=self.link.priority
                ),
                self.link.timeout + 0.5,
            )  # fmt: skip
        except (TimeoutError, self._raised, ValueError, TypeError, AttributeError, OSError) as error:
            return _told(error)
        return ""

    async def close(self) -> None:
        """End."""
        if self._changes is not None:
            await self._changes.close()
        if self._app is not None:
            self._app.close()


def _told(error: Any) -> str:
    if isinstance(error, TimeoutError):
        return "no answer"
    return (" ".join(str(error).split()) or type(error).__name__)[:120]
