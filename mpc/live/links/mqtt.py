"""MQTT by paho: values are what was last published while it listened, as plain numbers or JSON with ``value``."""

from __future__ import annotations

import asyncio
import json
import math
import threading
import time
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from mpc.errors import LiveError
from mpc.live.links.link import reading
from mpc.live.site import MqttLink
from mpc.loop.conversion import Conversion
from thermal.plan.guard import extra

#: Longest payload that is looked at [bytes].
_MOST = 1000


class MqttConnection:
    """A broker.

    Parameters
    ----------
    link : MqttLink
        Where it is.
    points : mapping of str to tuple of str and Conversion
        Topics, ``read`` or ``read write``, and unit of each point.
    folder : Path
        That the password's file is relative to.
    """

    def __init__(self, link: MqttLink, points: Mapping[str, tuple[str, Conversion]], folder: Path) -> None:
        self.link, self.points, self._folder = link, points, folder
        self._seen: dict[str, tuple[float, float]] = {}  # by topic: machine's monotonic time, value
        self._lock = threading.Lock()
        self._client: Any = None

    async def open(self) -> None:
        """Begin; a broker that is not there yet is tried again and again."""
        paho = extra("paho.mqtt.client", "live", "MQTT")
        client = paho.Client(paho.CallbackAPIVersion.VERSION2)
        if self.link.user is not None:
            file = self._folder / (self.link.password_file or "")
            LiveError.unless(
                self.link.password_file is None or file.is_file(), "connection of mqtt", "a file with the password",
                str(self.link.password_file),
            )  # fmt: skip
            password = None
            if self.link.password_file is not None:
                password = file.read_text(encoding="utf-8").splitlines()[0]
            client.username_pw_set(self.link.user, password)
        if self.link.tls:
            client.tls_set()
        client.on_connect = lambda one, *_: one.subscribe([(at.split()[0], 1) for at, _ in self.points.values()])
        client.on_message = lambda _, __, message: self._take(message.topic, message.payload, message.retain)
        client.reconnect_delay_set(1, 10)
        client.connect_async(self.link.host, self.link.port)
        client.loop_start()
        self._client = client

    def _take(self, topic: str, payload: bytes, retained: bool) -> None:
        """Keep a value; what is no number counts as one that is missing, what was retained has no known age."""
        if retained:
            return
        value = parse_payload(payload)
        with self._lock:
            self._seen[topic] = (time.monotonic(), value)

    async def read(self, names: Iterable[str], slots: bool) -> dict[str, dict[str, Any]]:
        """Read what was last published.

        Parameters
        ----------
        names, slots
            As of `Link`; there are no priorities.
        """
        found, up = {}, self._client is not None and self._client.is_connected()
        with self._lock:
            seen = dict(self._seen)
        for name in names:
            at, line = self.points[name]
            when, value = seen.get(at.split()[0], (-1e18, math.nan))
            old = time.monotonic() - when > self.link.timeout
            error = "no broker" if not up else "nothing was published lately" if old else ""
            found[name] = reading(line.into(value), None, error)
        return found

    async def write(self, name: str, value: float | None) -> str:
        """Publish a value.

        Parameters
        ----------
        name, value
            As of `Link` [library's unit]; None is refused, for there is nothing to relinquish.
        """
        at, line = self.points[name]
        read, _, write = at.partition(" ")
        if value is None:
            return "MQTT knows no relinquish: give a release value"
        if self._client is None or not self._client.is_connected():
            return "no broker"
        told = self._client.publish(write.strip() or read, repr(line.out(value)), qos=1)
        for _ in range(100):
            if told.is_published():
                return ""
            await asyncio.sleep(0.01)
        return "the broker did not confirm"

    async def close(self) -> None:
        """End."""
        if self._client is not None:
            self._client.disconnect()
            self._client.loop_stop()


def parse_payload(payload: bytes) -> float:
    """Read a number of a message; NaN where it is none.

    Parameters
    ----------
    payload : bytes
        ``21.5``, or JSON with ``value``.

    Examples
    --------
    >>> parse_payload(b'{"value": 21.5}'), parse_payload(b"21.5"), parse_payload(b"[]")
    (21.5, 21.5, nan)
    """
    if len(payload) > _MOST:
        return math.nan
    try:
        content = json.loads(payload)
        if isinstance(content, dict):
            content = content.get("value")
        return math.nan if isinstance(content, bool) or not isinstance(content, int | float) else float(content)
    except (ValueError, OverflowError, RecursionError):
        return math.nan
