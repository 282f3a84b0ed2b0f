"""A server that runs: uvicorn on a socket of its own, in the foreground or in a thread."""

import ipaddress
import logging
import socket
import threading
import time
from collections.abc import Iterable, Sequence
from typing import Self

from mpc.adapters.boptest.case import BoptestCase
from mpc.errors import BoptestError
from thermal.plan.page.connections import connection_settings

_START, _STOP = 30.0, 10.0  # s


class BoptestServer:
    """Plants behind BOPTEST's REST API, state in memory.

    Parameters
    ----------
    cases : sequence of BoptestCase
        What is served; requests without a test go to the first.
    host : str
        Address to listen on.
    port : int
        Port; 0 takes a free one.
    allow_remote : bool
        Whether `host` may be one that other machines reach. There are no passwords: whoever reaches it may use it.
    names : iterable of str
        Names by which clients may call the server, beside ``localhost`` and addresses.
    most : int
        How many tests run at once.
    idle_seconds : float
        A test that nobody asks for this long is freed [s].

    Raises
    ------
    BoptestError
        When the host is not this machine's own and that was not allowed, or the port cannot be had.

    Examples
    --------
    >>> with BoptestServer([case]) as server:  # doctest: +SKIP
    ...     plant = BoptestPlant(server.url, case.name, control_step=900.0)
    """

    def __init__(
        self,
        cases: Sequence[BoptestCase],
        host: str = "127.0.0.1",
        port: int = 0,
        *,
        allow_remote: bool = False,
        names: Iterable[str] = (),
        most: int = 64,
        idle_seconds: float = 900.0,
    ) -> None:
        check_host(host, allow_remote)
        try:
            import uvicorn

            from mpc.adapters.boptest.app import Guard, HeldTests, create_app
        except ModuleNotFoundError as error:
            raise BoptestError(f'a server needs {error.name}: pip install "buildingmpc[pages]"') from error
        self.tests = HeldTests(cases, most, idle_seconds)
        app = Guard(create_app(self.tests), allow_remote, names)
        config = uvicorn.Config(
            app, log_config=None, log_level=logging.WARNING, access_log=False, lifespan="on", server_header=False,
            **connection_settings(),
        )  # fmt: skip
        self._server = uvicorn.Server(config)
        self._socket = _listen(host, port)
        self._thread: threading.Thread | None = None

    @property
    def url(self) -> str:
        """Where it listens."""
        host, port = self._socket.getsockname()[:2]
        return f"http://[{host}]:{port}" if ":" in host else f"http://{host}:{port}"

    def run(self) -> None:
        """Serve until the process is told to stop."""
        try:
            self._server.run(sockets=[self._socket])
        finally:
            self._socket.close()

    def __enter__(self) -> Self:
        self._thread = threading.Thread(target=self.run, name="boptest", daemon=True)
        self._thread.start()
        deadline = time.monotonic() + _START
        while self._thread.is_alive() and time.monotonic() < deadline:
            if self._server.started:
                return self
            time.sleep(0.01)
        raise BoptestError("server", f"a start within {_START:g} s", "none")

    def __exit__(self, *error: object) -> None:
        self._server.should_exit = True
        if self._thread is not None:
            self._thread.join(_STOP)
            self._thread = None


def _listen(host: str, port: int) -> socket.socket:
    BoptestError.unless(0 <= port <= 65535, "port", "a number from 0 to 65535", repr(port))
    try:
        family, kind, protocol, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
        listening = socket.socket(family, kind, protocol)  # TCP by name: asyncio then sends without delay
    except OSError as error:
        raise BoptestError(f"host {host!r}: {error.strerror or error}") from error
    try:
        listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listening.bind(address)
        listening.listen(1024)
    except OSError as error:
        listening.close()
        raise BoptestError(f"port {port} of {host}: {error.strerror or error}; choose another") from error
    return listening


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
    try:
        own = ipaddress.ip_address(host.strip("[]")).is_loopback
    except ValueError:
        own = host.lower() == "localhost"
    if not (allow_remote or own):
        advice = "whoever reaches the server may use it: to let other machines in, say --allow-remote"
        raise BoptestError("host", "an address of this machine's own, such as 127.0.0.1", repr(host), advice)
