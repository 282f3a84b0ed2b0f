"""How the guard is talked to on its machine: lines of JSON over a Unix socket that only its user may open."""

from __future__ import annotations

import asyncio
import json
import os
import socket
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from mpc.errors import LiveError
from mpc.live.audit import canonical
from mpc.live.operators import checked_request

#: Longest message [bytes]: a plan of 1,000 points with its inputs has 100,000. Most that wait for a tick.
MOST_BYTES, MOST_WAITING = 2_000_000, 200


class Mailbox:
    """What was sent since the last tick.

    Parameters
    ----------
    key : bytes
        That operators sign by.
    mono : callable
        Monotonic clock [s].

    Attributes
    ----------
    beat : float or None
        When the controller was last heard of [s].
    dropped : int
        Messages that were malformed or too many.
    """

    def __init__(self, key: bytes, mono: Callable[[], float]) -> None:
        self._key, self._mono = key, mono
        self._waiting: list[dict[str, Any]] = []
        self.beat: float | None = None
        self.dropped = 0

    def take(self, line: bytes) -> str:
        """Take a line; answer with what is wrong with it, or nothing.

        Parameters
        ----------
        line : bytes
            JSON.
        """
        try:
            message = json.loads(line, parse_int=_integer)
            canonical(message)  # refuses what is not finite, 1e999 too
            kind = message["kind"]
        except (ValueError, KeyError, TypeError, RecursionError):
            self.dropped += 1
            return "no message of the format"
        if kind == "beat":
            self.beat = self._mono()
            return ""
        if len(self._waiting) >= MOST_WAITING:
            self.dropped += 1
            return "too many messages"
        if kind == "plan" and isinstance(message.get("plan"), dict):
            self._waiting.append({"kind": "plan", "plan": message["plan"]})
        elif kind in ("mode", "approve"):
            self._waiting.append(checked_request(message, self._key))
        else:
            self.dropped += 1
            return "no message of the format"
        return ""

    def empty(self) -> list[dict[str, Any]]:
        """Hand over what waits."""
        found, self._waiting = self._waiting, []
        return found


def _integer(text: str) -> int:
    """Read a whole number that a float has without a loss: arithmetic with others may not be possible."""
    value = int(text)
    if abs(value) > 2**53:
        raise ValueError(f"expected a number up to 2^53, found one of {len(text)} digits")
    return value


async def serve_socket(path: Path, mailbox: Mailbox, status: Callable[[], Mapping[str, Any]]) -> asyncio.Server:
    """Listen, for this user alone.

    Parameters
    ----------
    path : Path
        Of the socket; one that an earlier guard left is replaced.
    mailbox : Mailbox
        Takes messages.
    status : callable
        Answers ``{"kind": "status"}``.
    """

    async def talk(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        try:
            while line := await reader.readline():
                if line.strip() == b'{"kind": "status"}':
                    answer: Mapping[str, Any] = status()
                else:
                    answer = {"error": mailbox.take(line)}
                writer.write((canonical(answer) + "\n").encode())
                await writer.drain()
        except (ValueError, ConnectionError):  # a line that is too long, a peer that has gone
            mailbox.dropped += 1
        except asyncio.CancelledError:  # the guard ends while somebody is connected
            return
        finally:
            writer.close()

    path.unlink(missing_ok=True)
    before = os.umask(0o177)
    try:
        return await asyncio.start_unix_server(talk, _short(path), limit=MOST_BYTES)
    finally:
        os.umask(before)


class GuardClient:
    """Talks to the guard; a guard that is not there is an answer, not an error.

    Parameters
    ----------
    path : Path
        Of the socket.
    patience : float
        Longest wait [s].
    """

    def __init__(self, path: Path, patience: float = 2.0) -> None:
        self.path, self.patience = path, patience
        self._socket: socket.socket | None = None
        self._rest = b""

    def ask(self, message: Mapping[str, Any]) -> dict[str, Any]:
        """Send a message, and give the answer; ``error`` says why there is none.

        Parameters
        ----------
        message : mapping
            Plain types.
        """
        try:
            if self._socket is None:
                self._socket, self._rest = socket.socket(socket.AF_UNIX), b""
                self._socket.settimeout(self.patience)
                self._socket.connect(_short(self.path))
            self._socket.sendall((json.dumps(message) + "\n").encode())
            while b"\n" not in self._rest:
                more = self._socket.recv(1 << 16)
                if not more:
                    raise ConnectionError("it closed the connection")
                self._rest += more
            line, _, self._rest = self._rest.partition(b"\n")
            return dict(json.loads(line))
        except (OSError, ValueError) as error:
            self.close()
            return {"error": f"the guard does not answer: {error}"}

    def close(self) -> None:
        """End."""
        if self._socket is not None:
            self._socket.close()
        self._socket = None


def _short(path: Path) -> str:
    """Spell a socket's path within the 107 bytes that the system takes, relative where that helps."""
    choices = (str(path), os.path.relpath(path))
    fitting = [choice for choice in choices if len(choice.encode()) < 108]
    LiveError.unless(fitting, "guard", "a path of its socket below 108 bytes", str(path), "choose a shorter `folder`")
    return fitting[0]
