"""Who may talk to a server: its own machine, and no page of a browser that was led there by another name."""

from __future__ import annotations

import ipaddress
import json
from collections.abc import Iterable
from typing import TYPE_CHECKING
from urllib.parse import urlsplit

from mpc.adapters.boptest.body import LONGEST_BODY
from mpc.errors import BoptestError
from thermal.errors import describe

if TYPE_CHECKING:
    from starlette.types import ASGIApp, Message, Receive, Scope, Send

_NAMES = ("localhost",)


def _is_loopback(host: str) -> bool:
    """Whether a host to listen on is reached from this machine alone.

    Parameters
    ----------
    host : str
        Name or address.
    """
    try:
        return ipaddress.ip_address(host.strip("[]")).is_loopback
    except ValueError:
        return host.lower() in _NAMES


def check_host(host: str, allow_remote: bool) -> None:
    """Refuse to listen for other machines unless told to.

    Parameters
    ----------
    host : str
        Name or address to listen on.
    allow_remote : bool
        Whether other machines may come.

    Raises
    ------
    BoptestError
        When they could, and may not.
    """
    if not (allow_remote or _is_loopback(host)):
        advice = "whoever reaches the server may use it: to let other machines in, say --allow-remote"
        raise BoptestError(describe("host", "an address of this machine's own, such as 127.0.0.1", repr(host), advice))


class Guard:
    """Refuses requests that came by a name the server does not have, from pages of other sites, or that are too long.

    A page of a browser can be led to a server on the same machine by a name that first meant another address (DNS
    rebinding); its requests then carry that name as their host. Addresses carry no name, so they are safe from it.

    Parameters
    ----------
    app : ASGI application
        What is guarded.
    allow_remote : bool
        Whether hosts may be addresses other than this machine's own.
    names : iterable of str
        Names that the server has beside ``localhost``.
    """

    def __init__(self, app: ASGIApp, allow_remote: bool = False, names: Iterable[str] = ()) -> None:
        self._app, self._remote = app, allow_remote
        self._names = {name.lower() for name in (*_NAMES, *names)}

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request, or hand it on.

        Parameters
        ----------
        scope, receive, send
            Of ASGI.
        """
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        headers = {key.decode("latin-1").lower(): value.decode("latin-1") for key, value in scope["headers"]}
        origin, length = headers.get("origin"), headers.get("content-length", "0")
        if not self.knows(headers.get("host", "")):
            await _refuse(send, 403, "The Host header names no address of this server; serve with --name to allow it.")
        elif origin is not None and not self.knows(urlsplit(origin).netloc):
            await _refuse(send, 403, "Pages of other sites may not use this server.")
        elif not length.isdecimal() or int(length) > LONGEST_BODY:
            await _refuse(send, 413, f"The body is longer than {LONGEST_BODY} bytes.")
        else:
            await self._app(scope, _counted(receive), send)

    def knows(self, host: str) -> bool:
        """Whether a host, with or without a port, is this server's.

        Parameters
        ----------
        host : str
            As a header has it.
        """
        try:
            name = urlsplit(f"//{host}").hostname or ""
        except ValueError:
            return False
        try:
            return ipaddress.ip_address(name).is_loopback or self._remote
        except ValueError:
            return name in self._names


def _counted(receive: Receive) -> Receive:
    """Receive a body up to its largest size; a client that sends more in pieces is taken for gone."""
    total = 0

    async def receive_some() -> Message:
        nonlocal total
        message = await receive()
        total += len(message.get("body", b""))
        return message if total <= LONGEST_BODY else {"type": "http.disconnect"}

    return receive_some


async def _refuse(send: Send, status: int, message: str) -> None:
    body = json.dumps({"status": status, "message": message, "payload": None}).encode()
    headers = [(b"content-type", b"application/json"), (b"content-length", str(len(body)).encode())]
    await send({"type": "http.response.start", "status": status, "headers": [*headers, (b"connection", b"close")]})
    await send({"type": "http.response.body", "body": body})
