"""A server that runs: uvicorn on a socket of its own, in the foreground or in a thread."""

from __future__ import annotations

import logging
import socket
import threading
from collections.abc import Iterable, Sequence
from types import TracebackType

from mpc.adapters.boptest.case import BoptestCase
from mpc.adapters.boptest.guard import Guard, check_host
from mpc.adapters.boptest.registry import HeldTests
from mpc.errors import BoptestError
from thermal.errors import describe

_KEEP_ALIVE = 75  # s: a controller that thinks for a while finds its connection open
_MOST_CONNECTIONS = 512
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

            from mpc.adapters.boptest.app import create_app
        except ModuleNotFoundError as error:
            raise BoptestError(f'a server needs {error.name}: pip install "buildingmpc[pages]"') from error
        self.tests = HeldTests(cases, most, idle_seconds)
        app = Guard(create_app(self.tests), allow_remote, names)
        config = uvicorn.Config(
            app, log_config=None, log_level=logging.WARNING, access_log=False, lifespan="on", server_header=False,
            timeout_keep_alive=_KEEP_ALIVE, limit_concurrency=_MOST_CONNECTIONS,
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

    def __enter__(self) -> BoptestServer:
        self._thread = threading.Thread(target=self.run, name="boptest", daemon=True)
        self._thread.start()
        waited = threading.Event()
        for _ in range(round(_START / 0.01)):
            if self._server.started:
                return self
            if not self._thread.is_alive():
                break
            waited.wait(0.01)
        raise BoptestError(describe("server", f"a start within {_START:g} s", "none"))

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._server.should_exit = True
        if self._thread is not None:
            self._thread.join(_STOP)
            self._thread = None


def _listen(host: str, port: int) -> socket.socket:
    if not 0 <= port <= 65535:
        raise BoptestError(describe("port", "a number from 0 to 65535", repr(port)))
    try:
        family, kind, protocol, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
        listening = socket.socket(family, kind, protocol)
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
