"""BOPTEST's REST API over the tests that a server holds, and who may use it."""

import asyncio
import ipaddress
import json
import logging
import time
import uuid
from collections.abc import AsyncIterator, Awaitable, Callable, Iterable, Sequence
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from importlib import metadata
from typing import Any
from urllib.parse import urlsplit

import anyio
from fastapi import FastAPI, Request
from starlette.requests import ClientDisconnect
from starlette.responses import Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from mpc.adapters.boptest.case import BoptestCase
from mpc.adapters.boptest.requests import LONGEST_BODY, Answer, read_body
from mpc.adapters.boptest.test import REQUESTS, BoptestTest
from mpc.errors import BoptestError, BoptestRequestError, MpcError

#: Version of BOPTEST whose API this is.
API_VERSION = "1.0.0"

#: Most requests that wait for one test.
MOST_WAITING = 64

#: The test that requests without a number go to, as before BOPTEST 0.7.
DEFAULT_TEST = ""

_log = logging.getLogger(__name__)

_WORKERS = 4  # threads that simulate; Python lets one of them compute at a time
_SWEEP = 5.0  # s between looks for idle tests

Handler = Callable[[Request], Awaitable[Response]]


@dataclass(eq=False)
class HeldTest:
    """A test with what a server needs to know about it.

    Parameters
    ----------
    test : BoptestTest
        Its state.
    last_used : float
        Time when it was last asked for [s].
    waiting : int
        Requests that wait for it.
    turn : Lock
        Held by the request that is being answered.
    """

    test: BoptestTest
    last_used: float
    waiting: int = 0
    turn: asyncio.Lock = field(default_factory=asyncio.Lock)


class HeldTests:
    """Test cases that are served, and the tests of them that run.

    Parameters
    ----------
    cases : sequence of BoptestCase
        At least one, each with a name of its own.
    most : int
        How many tests run at once.
    idle_seconds : float
        A test that nobody asks for this long is freed [s].
    clock : callable
        Time that passes [s].

    Raises
    ------
    BoptestError
        When there is no case, two have one name, or a number is out of range.
    """

    def __init__(
        self,
        cases: Sequence[BoptestCase],
        most: int = 64,
        idle_seconds: float = 900.0,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.cases = {case.name: case for case in cases}
        found, expected = ", ".join(case.name for case in cases) or "none", "one or more, each with a name of its own"
        BoptestError.unless(cases and len(self.cases) >= len(cases), "cases", expected, found)
        fits, found = most >= 1 and idle_seconds > 0, f"{most} and {idle_seconds} s"
        BoptestError.unless(fits, "server", "one test at least, and a positive idle time", found)
        self.most, self.idle_seconds, self.clock = most, idle_seconds, clock
        self._held: dict[str, HeldTest] = {}

    def __len__(self) -> int:
        return len(self._held)

    def select(self, name: str, testid: str | None = None) -> str | None:
        """Begin a test.

        Parameters
        ----------
        name : str
            Of a case that is served.
        testid : str, optional
            Its number; a new random one by default.

        Returns
        -------
        str or None
            Its number; None when as many run as may.
        """
        self.free_idle()
        if len(self._held) >= self.most:
            return None
        chosen = str(uuid.uuid4()) if testid is None else testid
        self._held[chosen] = HeldTest(BoptestTest(self.cases[name]), self.clock())
        return chosen

    def find(self, testid: str) -> HeldTest | None:
        """Look a test up, which counts as use of it.

        Parameters
        ----------
        testid : str
            Its number.
        """
        if testid == DEFAULT_TEST and testid not in self._held:
            self.select(next(iter(self.cases)), DEFAULT_TEST)
        held = self._held.get(testid)
        if held is not None:
            held.last_used = self.clock()
        return held

    def stop(self, testid: str) -> bool:
        """Free a test; whether there was one.

        Parameters
        ----------
        testid : str
            Its number.
        """
        return self._held.pop(testid, None) is not None

    def free_idle(self) -> int:
        """Free the tests that nobody has come back to, and tell how many."""
        limit = self.clock() - self.idle_seconds
        # who has no number would not learn that the common test begins anew: it stays
        held = ((testid, held) for testid, held in self._held.items() if testid != DEFAULT_TEST)
        lost = [testid for testid, test in held if test.last_used < limit and not test.waiting]
        for testid in lost:
            del self._held[testid]
        return len(lost)


def create_app(tests: HeldTests) -> FastAPI:
    """Make the web application that answers BOPTEST's requests.

    Parameters
    ----------
    tests : HeldTests
        What is served.

    Returns
    -------
    FastAPI
        Without pages of its own; put a `Guard` before it.
    """
    app = FastAPI(docs_url=None, redoc_url=None, openapi_url=None, lifespan=_sweeping(tests))
    workers = anyio.CapacityLimiter(_WORKERS)

    async def cases(request: Request) -> Response:
        return _respond(200, [{"testcaseid": name} for name in tests.cases])

    async def select(request: Request) -> Response:
        name = request.path_params["name"]
        if name not in tests.cases:
            return _status(404, f"There is no test case {name[:200]!r}; served are {', '.join(tests.cases)}.")
        testid = tests.select(name)
        if testid is None:
            return _status(503, f"All {tests.most} tests are in use; stop one, or wait until one is idle.")
        return _respond(200, {"testid": testid})

    async def version(request: Request) -> Response:
        served_by = f"buildingmpc {metadata.version('buildingmpc')}"
        payload = {"version": API_VERSION, "service-version": API_VERSION, "server": served_by}
        return _status(200, "Queried the version number successfully.", payload)

    async def stop(request: Request) -> Response:
        testid = request.path_params.get("testid", DEFAULT_TEST)
        return Response("OK", media_type="text/plain") if tests.stop(testid) else _unknown(testid)

    async def status(held: HeldTest, request: Request) -> Response:
        return _respond(200, "Running")

    async def submit(held: HeldTest, request: Request) -> Response:
        return _status(400, "This server is no official instance: it sends nothing to BOPTEST's dashboard.")

    def of_test(answer: Callable[[HeldTest, Request], Awaitable[Response]]) -> Handler:
        """Answer requests of a test that is there."""

        async def handle(request: Request) -> Response:
            testid = request.path_params.get("testid", DEFAULT_TEST)
            held = tests.find(testid)
            return _unknown(testid) if held is None else await answer(held, request)

        return handle

    def asking(verb: str, ask: Callable[..., Answer]) -> Handler:
        """Ask a test once the requests before are done: they never overlap."""

        async def answer(held: HeldTest, request: Request) -> Response:
            kind = request.headers.get("content-type", "")
            try:
                body = [] if verb == "GET" else [read_body(await request.body(), kind)]
            except ClientDisconnect:
                return Response(status_code=400)  # nobody is there to read it
            except BoptestRequestError as error:
                return _status(400, str(error))
            if held.waiting >= MOST_WAITING:
                return _status(503, f"{MOST_WAITING} requests wait for this test already.")
            held.waiting += 1
            try:
                async with held.turn:
                    return await anyio.to_thread.run_sync(_answered, ask, held.test, *body, limiter=workers)
            finally:
                held.waiting -= 1
                held.last_used = tests.clock()

        return of_test(answer)

    app.add_route("/testcases", cases, ["GET"])
    for path in ("select", "select-async"):
        app.add_route(f"/testcases/{{name}}/{path}", select, ["POST"])
    handlers: dict[tuple[str, str], Handler] = {("GET", "version"): version, ("PUT", "stop"): stop}
    handlers |= {("GET", "status"): of_test(status), ("POST", "submit"): of_test(submit)}
    handlers |= {(verb, name): asking(verb, ask) for (verb, name), ask in REQUESTS.items()}
    for (verb, name), handler in handlers.items():
        app.add_route(f"/{name}/{{testid}}", handler, [verb])
        app.add_route(f"/{name}", handler, [verb])
    return app


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
        self._names = {name.lower() for name in ("localhost", *names)}

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
        if not self._knows(f"//{headers.get('host', '')}"):
            refusal = _status(403, "The Host header names no address of this server; serve with --name to allow it.")
        elif (origin is not None and not self._knows(origin)) or headers.get("sec-fetch-site") == "cross-site":
            refusal = _status(403, "Pages of other sites may not use this server.")
        elif not length.isdecimal() or int(length) > LONGEST_BODY:
            refusal = _status(413, f"The body is longer than {LONGEST_BODY} bytes.")
        else:
            await self._app(scope, _counted(receive), send)
            return
        refusal.headers["connection"] = "close"
        await refusal(scope, receive, send)

    def _knows(self, url: str) -> bool:
        """Whether the host of an address, with or without a port, is this server's."""
        name = ""
        try:
            parts = urlsplit(url)
            name = parts.hostname or ""
            if "@" in parts.netloc or parts.path or parts.query or parts.fragment:  # neither header has any
                return False
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


def _sweeping(tests: HeldTests) -> Callable[[FastAPI], Any]:
    """Free idle tests as long as the application lives."""

    async def sweep() -> None:
        while True:
            await asyncio.sleep(min(_SWEEP, tests.idle_seconds / 4.0))
            tests.free_idle()

    @asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncIterator[None]:
        task = asyncio.create_task(sweep())
        yield
        task.cancel()

    return lifespan


def _answered(ask: Callable[..., Answer], test: BoptestTest, *body: dict[str, Any]) -> Response:
    """Ask, and write the answer down: both may take a while, and so belong in a thread."""
    try:
        answer = ask(test, *body)
    except MpcError as error:
        return _status(400, str(error))
    except Exception as error:
        _log.exception("a request failed")
        return _status(500, f"Internal error: {type(error).__name__}; the server's log says more.")
    return _status(200, answer.message, answer.payload)


def _status(status: int, message: str, payload: Any = None) -> Response:
    return _respond(status, {"status": status, "message": message, "payload": payload})


def _unknown(testid: str) -> Response:
    """Refuse a test that is not there, in the form of BOPTEST's web server and in that of its other answers."""
    if testid == DEFAULT_TEST:
        return _status(503, "All tests are in use, and none is the common one of requests without a number.")
    message = f"Invalid testid: {testid[:200]}"
    errors = [{"value": testid[:200], "msg": message, "param": "testid", "location": "params"}]
    return _respond(400, {"errors": errors, "status": 400, "message": message, "payload": None})


def _respond(status: int, content: Any) -> Response:
    try:
        text = json.dumps(content, allow_nan=False)
    except ValueError:  # a sensor that reads nothing
        text = json.dumps(json.loads(json.dumps(content), parse_constant=lambda name: None))
    return Response(text, status, media_type="application/json")
