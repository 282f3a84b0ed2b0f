"""Values that a BACnet device tells when they change (SubscribeCOV of ASHRAE Standard 135), a subscription a point."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Mapping
from typing import Any

#: Subscriptions that are asked for at the same time: a device answers one request after the other.
_AT_ONCE = 8


class Subscriptions:
    """Keeps subscriptions of points, and the last value told of each.

    A subscription is made anew at half of its lifetime, as a device that was started anew has forgotten it; until a
    value is told then, none is known. A point whose subscription is refused stays unknown, and is asked for again at
    the same intervals.

    Parameters
    ----------
    app : object
        Application of bacpypes3.
    address : object
        Of the device.
    objects : mapping of str to object
        Object identifier of each point.
    lifetime : float
        Of a subscription [s].
    refusals : tuple of type
        What is raised where a device does not answer, or refuses.
    """

    def __init__(
        self, app: Any, address: Any, objects: Mapping[str, Any], lifetime: float, refusals: tuple[type[Exception], ...]
    ) -> None:
        self._app, self._address, self._lifetime, self._refusals = app, address, round(lifetime), refusals
        self._asking = asyncio.Semaphore(_AT_ONCE)
        self.values: dict[str, Any] = {}
        self._tasks = [asyncio.create_task(self._follow(name, at)) for name, at in objects.items()]

    async def _follow(self, name: str, at: Any) -> None:
        """Take what is told of a point, subscription after subscription."""
        loop = asyncio.get_running_loop()
        while True:
            end = loop.time() + 0.5 * self._lifetime
            subscription = self._app.change_of_value(self._address, at, lifetime=self._lifetime)
            try:
                async with contextlib.AsyncExitStack() as ends:
                    async with self._asking:
                        await ends.enter_async_context(subscription)
                    with contextlib.suppress(TimeoutError):
                        async with asyncio.timeout_at(end):
                            while True:
                                told, value = await subscription.get_value()
                                if str(told) == "present-value":
                                    self.values[name] = value
                    # what is told between two subscriptions is lost: nothing is known until the next tells it
                    self.values.pop(name, None)
            except self._refusals:
                self.values.pop(name, None)
                await asyncio.sleep(max(end - loop.time(), 1.0))

    def forget(self) -> None:
        """Take no value for known, as the device may have been started anew."""
        self.values.clear()

    async def close(self) -> None:
        """End; the device is not told, and drops subscriptions when their lifetime is over."""
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)
