"""Clients that only hold connections: they are closed, and shut nobody out."""

from __future__ import annotations

import asyncio
import contextlib
import socket
import threading
import time
from collections.abc import Iterator
from types import SimpleNamespace

import httpx
import pytest

uvicorn = pytest.importorskip("uvicorn", reason="needs the extra [pages]")

from thermal.plan.page import connections  # noqa: E402


async def app(scope, receive, send) -> None:
    """Read a body, answer with its length."""
    size, more = 0, True
    while more:
        message = await receive()
        if message["type"] == "http.disconnect":
            return
        size, more = size + len(message["body"]), message.get("more_body", False)
    await send({"type": "http.response.start", "status": 200, "headers": []})
    await send({"type": "http.response.body", "body": str(size).encode()})


@contextlib.contextmanager
def served(answer=app) -> Iterator[tuple[str, int]]:
    listener = socket.create_server(("127.0.0.1", 0), backlog=1024)
    settings = connections.connection_settings()
    server = uvicorn.Server(uvicorn.Config(answer, log_level="critical", lifespan="off", **settings))
    thread = threading.Thread(target=server.run, kwargs={"sockets": [listener]}, daemon=True)
    thread.start()
    try:
        yield listener.getsockname()
    finally:
        server.should_exit = True
        thread.join(10.0)
        listener.close()


def ask(at: tuple[str, int]) -> str:
    return httpx.post(f"http://{at[0]}:{at[1]}/", content=b"abc", timeout=30.0, trust_env=False).text


def is_closed(line: socket.socket, seconds: float) -> bool:
    line.settimeout(seconds)
    try:
        return line.recv(1) == b""
    except TimeoutError:
        return False
    except ConnectionError:
        return True


def test_many_idle_connections_shut_nobody_out(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(connections, "MOST_CONNECTIONS", 100)
    with served() as at, contextlib.ExitStack() as held:
        lines = [held.enter_context(socket.create_connection(at)) for _ in range(150)]
        assert ask(at) == "3"
        assert is_closed(lines[0], 10.0) and not is_closed(lines[-1], 0.1)


@pytest.mark.parametrize(
    "sent", [b"", b"GET / HTTP/1.1\r\nHost: a\r\n", b"POST / HTTP/1.1\r\nHost: a\r\nContent-Length: 9\r\n\r\nab"]
)
def test_a_client_that_does_not_go_on_is_closed(monkeypatch: pytest.MonkeyPatch, sent: bytes) -> None:
    monkeypatch.setattr(connections, "PATIENCE", 0.5)
    with served() as at, socket.create_connection(at) as line:
        begin = time.monotonic()
        line.sendall(sent)
        assert is_closed(line, 20.0) and time.monotonic() - begin > 0.3
        assert ask(at) == "3"


def test_an_answer_may_take_longer_than_a_client_may(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(connections, "PATIENCE", 0.2)

    async def slow(scope, receive, send) -> None:
        body = await receive()
        await asyncio.sleep(0.8)
        again = iter([body])
        await app(scope, lambda: asyncio.sleep(0, next(again)), send)

    with served(slow) as at:
        assert ask(at) == "3"


def test_the_client_that_has_the_most_loses_one() -> None:
    closed = []

    def held(client: str, since: float, waiting: bool = True) -> SimpleNamespace:
        made = SimpleNamespace(client=(client, 1), since=since, waiting=waiting, aborted=False)
        made.abort = lambda: closed.append(made)
        return made

    greedy, other = [held("b", 5.0 + k) for k in range(3)], held("a", 1.0)
    busy, newest = held("b", 0.0, waiting=False), held("a", 9.0)
    connections.close_one([other, busy, *greedy, newest], newest)
    assert closed == [greedy[0]]
    connections.close_one([busy, newest], newest)
    assert closed[1:] == [newest]


LARGE = b"x" * 8_000_000  # more than the buffers of a socket take


async def large(scope, receive, send) -> None:
    """Answer at length to ``/large``."""
    if scope["path"] != "/large":
        return await app(scope, receive, send)
    await send({"type": "http.response.start", "status": 200, "headers": [(b"content-length", b"%d" % len(LARGE))]})
    await send({"type": "http.response.body", "body": LARGE})


def asking(at: tuple[str, int], request: bytes) -> socket.socket:
    """A connection over which something was asked for and nothing read, which takes little at once."""
    line = socket.socket()
    line.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    line.connect(at)
    line.sendall(request)
    return line


GET = b"GET /large HTTP/1.1\r\nHost: a\r\n\r\n"


@pytest.mark.parametrize("request_", [GET, 2 * GET, GET.replace(b"a\r\n", b"a\r\nConnection: close\r\n")])
def test_clients_that_read_nothing_shut_nobody_out(monkeypatch: pytest.MonkeyPatch, request_: bytes) -> None:
    """However many they are, an honest client is served at once."""
    monkeypatch.setattr(connections, "MOST_CONNECTIONS", 4)
    with served(large) as at, contextlib.ExitStack() as held:
        for _ in range(6):
            held.enter_context(asking(at, request_))
        time.sleep(0.1)
        assert [ask(at) for _ in range(3)] == ["3"] * 3


def test_a_client_that_reads_nothing_is_let_go(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(connections, "PATIENCE", 0.1)
    with served(large) as at, asking(at, 2 * GET) as line:
        time.sleep(0.4)
        line.settimeout(5.0)
        with contextlib.suppress(ConnectionError):
            assert sum(iter(lambda: len(line.recv(1 << 20)), 0)) < len(LARGE)


def test_a_client_that_reads_slowly_gets_all(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(connections, "PATIENCE", 0.6)
    with served(large) as at, asking(at, GET) as line:
        size, begin = 0, time.monotonic()
        while size < len(LARGE):
            size += len(found := line.recv(1 << 19))
            assert found, "closed before its end"
            time.sleep(1.5 * len(found) / len(LARGE))
        assert time.monotonic() - begin > 1.2
