"""Connections of a server: one that its client keeps waiting is closed, and nobody can hold all of them."""

from __future__ import annotations

import asyncio
from collections import Counter
from collections.abc import Iterable
from typing import Any

from thermal.plan.guard import extra

#: A connection whose client has sent no whole request, or nothing more of a body, for so long is closed [s]: longer
#: than a controller thinks between two requests.
PATIENCE = 75.0

#: Connections that are held at once; a process may commonly have 1024 files open.
MOST_CONNECTIONS = 500


def connection_settings() -> dict[str, Any]:
    """Give the settings of `uvicorn.Config` by which no client shuts out the others.

    Raises
    ------
    MissingExtraError
        The extra ``[pages]`` is not installed.

    Notes
    -----
    uvicorn's own ``timeout_keep_alive`` counts from an answer only, and its ``limit_concurrency`` refuses whoever comes
    last: idle connections to a port would shut out everybody for ever. So each connection is looked at here from its
    beginning, and where there are too many, the one that waits the longest of the client that has the most is closed.
    A client that reads nothing of its answers keeps the server waiting as well as one that sends nothing: asyncio's
    ``close`` would wait for it, so connections are aborted. One that reads, however slowly, is left its answer.
    """
    extra("uvicorn", "pages", "server")
    from uvicorn.protocols.http.auto import AutoHTTPProtocol

    base: Any = AutoHTTPProtocol

    class Connection(base):  # type: ignore[misc]
        def connection_made(self, transport: asyncio.Transport) -> None:
            super().connection_made(transport)
            self.since, self.unsent, self.aborted = self.loop.time(), 0, False
            self.watch = self.loop.call_later(PATIENCE, self.look)
            if sum(not c.aborted for c in self.connections) > MOST_CONNECTIONS:
                close_one(self.connections, self)

        @property
        def waiting(self) -> bool:
            """Whether the server waits for the client, rather than the client for an answer."""
            answered = self.cycle is None or bool(self.cycle.response_complete)
            return answered or bool(self.cycle.more_body) or bool(self.flow.write_paused)

        def data_received(self, data: bytes) -> None:
            super().data_received(data)
            if self.cycle is not None and not self.cycle.response_complete:  # a header byte a minute does not count
                self.since = self.loop.time()

        def on_response_complete(self) -> None:
            self.since, self.unsent = self.loop.time(), 0  # of another answer than at the last look
            super().on_response_complete()

        def look(self) -> None:
            left, unsent = PATIENCE - (self.loop.time() - self.since), self.transport.get_write_buffer_size()
            if 0 < self.unsent <= unsent or (not unsent and self.waiting and left <= 0.0):
                self.abort()
            else:
                self.unsent = unsent
                self.watch = self.loop.call_later(PATIENCE if unsent or left <= 0.0 else left, self.look)

        def abort(self) -> None:
            """Close without waiting for what the client has not read."""
            self.aborted = True
            self.transport.abort()

        def connection_lost(self, exc: Exception | None) -> None:
            self.watch.cancel()
            super().connection_lost(exc)

    busy = 2 * MOST_CONNECTIONS  # so that uvicorn never refuses for connections that wait
    return {"http": Connection, "timeout_keep_alive": int(PATIENCE), "limit_concurrency": busy}


def close_one(connections: Iterable[Any], newest: Any) -> None:
    """Close the connection that waits the longest of the client that has the most; the newest where none waits.

    Parameters
    ----------
    connections : iterable
        All that are held.
    newest : connection
        The one too many.
    """
    held = [c for c in connections if not c.aborted]
    counts = Counter(_address(c) for c in held)
    waiting = [c for c in held if c.waiting and c is not newest]
    min(waiting, key=lambda c: (-counts[_address(c)], c.since), default=newest).abort()


def _address(connection: Any) -> str:
    return str(connection.client[0]) if connection.client else ""
