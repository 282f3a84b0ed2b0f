"""Serving of the labelling page on this machine, behind a token."""

from __future__ import annotations

import hmac
import json
import secrets
import socket
import threading
import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from thermal.errors import LabelError, describe
from thermal.plan.guard import extra
from thermal.plan.page.connections import connection_settings
from thermal.plan.page.desk import LabelDesk

if TYPE_CHECKING:
    from starlette.types import ASGIApp, Message, Receive, Scope, Send

_HOSTS = ("127.0.0.1", "localhost", "[::1]")
_READING = ("GET", "HEAD")

#: What the page may load: its own files and pictures, nothing from elsewhere.
PAGE_POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; connect-src 'self'; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)

_HEADERS = {
    "content-security-policy": PAGE_POLICY,
    "referrer-policy": "no-referrer",
    "x-content-type-options": "nosniff",
    "x-frame-options": "DENY",
    "cross-origin-opener-policy": "same-origin",
    "cross-origin-resource-policy": "same-origin",
    "cache-control": "no-store",
}


class Gate:
    """Lets through what comes with the token, from this machine, from the page itself.

    The token is the first part of every path, so that it needs no cookie, and no other page can make the browser send
    it. The host is checked against pages that have their name point at this machine (DNS rebinding).

    Parameters
    ----------
    inner : callable
        The application behind the gate.
    token : str
        First part of every path.
    """

    def __init__(self, inner: ASGIApp, token: str) -> None:
        self._inner = inner
        self._token = token.encode("ascii")

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request, or pass it on without the token."""
        if scope["type"] == "lifespan":
            await self._inner(scope, receive, send)
            return
        if scope["type"] != "http":
            return
        headers = {key.decode("latin-1").lower(): value.decode("latin-1") for key, value in scope["headers"]}
        trouble = self._trouble(scope, headers)
        if trouble is not None:
            await _refuse(send, *trouble)
            return
        first, _, rest = scope["path"].lstrip("/").partition("/")
        inner = {**scope, "path": f"/{rest}", "raw_path": f"/{rest}".encode(), "token": first}

        async def guarded(message: Message) -> None:
            if message["type"] == "http.response.start":
                given = {key.lower() for key, _ in message.get("headers", ())}
                extra = [(k.encode(), v.encode()) for k, v in _HEADERS.items() if k.encode() not in given]
                message = {**message, "headers": [*message.get("headers", ()), *extra]}
            await send(message)

        await self._inner(inner, receive, guarded)

    def _trouble(self, scope: Scope, headers: dict[str, str]) -> tuple[int, str] | None:
        """Status and message of a request that is not let through."""
        host = headers.get("host", "")
        if host.rpartition(":")[0] not in _HOSTS and host not in _HOSTS:
            return 403, describe("host", "this machine, 127.0.0.1", repr(host[:80]))
        first = scope["path"].lstrip("/").partition("/")[0]
        if not hmac.compare_digest(first.encode("utf-8", "replace"), self._token):
            return 404, describe("address", "the one that buildingmpc label wrote, with its token", "another")
        origin, site = headers.get("origin"), headers.get("sec-fetch-site", "none")
        if origin not in (None, f"http://{host}"):
            return 403, describe("origin", f"the page itself, http://{host}", repr(str(origin)[:80]))
        opened = scope["method"] in _READING and headers.get("sec-fetch-mode", "navigate") == "navigate"
        if not opened and site not in ("same-origin", "none"):
            return 403, describe("request", "one that the page itself makes", f"one that is {site[:20]}")
        return None


async def _refuse(send: Send, status: int, message: str) -> None:
    body = json.dumps({"error": LabelError.__name__, "message": message}).encode("utf-8")
    headers = [(b"content-type", b"application/json"), *((k.encode(), v.encode()) for k, v in _HEADERS.items())]
    await send({"type": "http.response.start", "status": status, "headers": headers})
    await send({"type": "http.response.body", "body": body})


HOST = "127.0.0.1"


def serve_page(desk: LabelDesk, *, port: int = 0, ready: Callable[[str], None] | None = None) -> None:
    """Serve the labelling page of a case until Ctrl-C.

    Parameters
    ----------
    desk : LabelDesk
        What it works on; ended when the server ends.
    port : int
        On this machine's own address, 127.0.0.1; 0 takes any that is free.
    ready : callable, optional
        Told the address, with its token, as soon as the page can be opened.

    Raises
    ------
    LabelError
        The port is taken.
    MissingExtraError
        The extra ``[pages]`` is not installed.
    """
    uvicorn = extra("uvicorn", "pages,plan", "labelling page")
    token = secrets.token_urlsafe(24)
    try:
        app = create_app(desk, token)
        listener = _listen(port)
        address = f"http://{HOST}:{listener.getsockname()[1]}/{token}/"
        quiet: dict[str, Any] = {"log_level": "critical", "access_log": False, "lifespan": "off"}
        server = uvicorn.Server(uvicorn.Config(app, timeout_graceful_shutdown=2, **quiet, **connection_settings()))
        if ready is not None:
            threading.Thread(target=_when_ready, args=(server, ready, address), daemon=True).start()
        server.run(sockets=[listener])
    except KeyboardInterrupt:  # raised again by the server after it has ended in order
        pass
    finally:
        desk.end()


def create_app(desk: LabelDesk, token: str) -> ASGIApp:
    """Make the server of a labelling page.

    Parameters
    ----------
    desk : LabelDesk
        What it works on.
    token : str
        First part of every address; without it nothing is answered.

    Returns
    -------
    callable
        ASGI application.

    Raises
    ------
    MissingExtraError
        The extra ``[pages]`` is not installed.
    """
    extra("fastapi", "pages,plan", "labelling page")
    from thermal.plan.page.routes import routes_of

    return Gate(routes_of(desk), token)


def _listen(port: int) -> socket.socket:
    try:
        return socket.create_server((HOST, port))
    except (OSError, OverflowError) as error:
        raise LabelError("port", "a free one on this machine", f"{port}: {error}", "choose another") from error


def _when_ready(server: object, ready: Callable[[str], None], address: str) -> None:
    for _ in range(600):
        if getattr(server, "started", False):
            ready(address)
            return
        time.sleep(0.05)
