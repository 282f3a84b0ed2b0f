"""BOPTEST's REST API over the tests that a server holds."""

from __future__ import annotations

import asyncio
import json
import logging
import math
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from importlib import metadata
from typing import Any

import anyio
from fastapi import FastAPI, Request
from starlette.requests import ClientDisconnect
from starlette.responses import Response

from mpc.adapters.boptest.body import read_body
from mpc.adapters.boptest.registry import DEFAULT_TEST, HeldTest, HeldTests
from mpc.adapters.boptest.test import Answer, BoptestTest
from mpc.errors import BoptestRequestError, MpcError

#: Version of BOPTEST whose API this is.
API_VERSION = "1.0.0"

#: Most requests that wait for one test.
MOST_WAITING = 64

_log = logging.getLogger(__name__)

_WORKERS = 4  # threads that simulate; Python lets one of them compute at a time
_SWEEP = 5.0  # s between looks for idle tests

Handler = Callable[[Request], Awaitable[Response]]
Question = Callable[[BoptestTest], Answer]
Command = Callable[[BoptestTest, dict[str, Any]], Answer]

_QUESTIONS: dict[str, Question] = {
    "name": BoptestTest.get_name,
    "inputs": BoptestTest.get_inputs,
    "measurements": BoptestTest.get_measurements,
    "forecast_points": BoptestTest.get_forecast_points,
    "step": BoptestTest.get_step,
    "scenario": BoptestTest.get_scenario,
    "kpi": BoptestTest.kpis,
}
_COMMANDS: dict[tuple[str, str], Command] = {
    ("PUT", "initialize"): BoptestTest.initialize,
    ("PUT", "step"): BoptestTest.set_step,
    ("PUT", "scenario"): BoptestTest.set_scenario,
    ("PUT", "forecast"): BoptestTest.forecast,
    ("PUT", "results"): BoptestTest.results,
    ("POST", "advance"): BoptestTest.advance,
}


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

    async def status(request: Request) -> Response:
        testid = request.path_params.get("testid", DEFAULT_TEST)
        return _unknown(testid) if tests.find(testid) is None else _respond(200, "Running")

    async def stop(request: Request) -> Response:
        testid = request.path_params.get("testid", DEFAULT_TEST)
        return Response("OK", media_type="text/plain") if tests.stop(testid) else _unknown(testid)

    async def submit(request: Request) -> Response:
        testid = request.path_params.get("testid", DEFAULT_TEST)
        if tests.find(testid) is None:
            return _unknown(testid)
        return _status(400, "This server is no official instance: it sends nothing to BOPTEST's dashboard.")

    app.add_route("/testcases", cases, ["GET"])
    for path in ("select", "select-async"):
        app.add_route(f"/testcases/{{name}}/{path}", select, ["POST"])
    special: list[tuple[str, str, Handler]] = [("GET", "version", version), ("GET", "status", status)]
    special += [("PUT", "stop", stop), ("POST", "submit", submit)]
    answered: list[tuple[str, str, Handler]] = [
        *(("GET", name, _asking(tests, workers, question)) for name, question in _QUESTIONS.items()),
        *((verb, name, _telling(tests, workers, command)) for (verb, name), command in _COMMANDS.items()),
    ]
    for verb, name, handler in (*special, *answered):
        app.add_route(f"/{name}/{{testid}}", handler, [verb])
        app.add_route(f"/{name}", handler, [verb])
    return app


def _sweeping(tests: HeldTests) -> Callable[[FastAPI], Any]:
    """Free idle tests as long as the application lives."""

    @asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncIterator[None]:
        async def sweep() -> None:
            while True:
                await asyncio.sleep(min(_SWEEP, tests.idle_seconds / 4.0))
                tests.free_idle()

        task = asyncio.create_task(sweep())
        try:
            yield
        finally:
            task.cancel()

    return lifespan


def _asking(tests: HeldTests, workers: anyio.CapacityLimiter, question: Question) -> Handler:
    """Answer requests that have no arguments."""

    async def handle(request: Request) -> Response:
        testid = request.path_params.get("testid", DEFAULT_TEST)
        held = tests.find(testid)
        return _unknown(testid) if held is None else await _in_turn(tests, held, workers, question)

    return handle


def _telling(tests: HeldTests, workers: anyio.CapacityLimiter, command: Command) -> Handler:
    """Answer requests that have arguments."""

    async def handle(request: Request) -> Response:
        testid = request.path_params.get("testid", DEFAULT_TEST)
        held = tests.find(testid)
        if held is None:
            return _unknown(testid)
        try:
            body = read_body(await request.body(), request.headers.get("content-type", ""))
        except ClientDisconnect:
            return Response(status_code=400)  # nobody is there to read it
        except BoptestRequestError as error:
            return _status(400, str(error))
        return await _in_turn(tests, held, workers, lambda test: command(test, body))

    return handle


async def _in_turn(tests: HeldTests, held: HeldTest, workers: anyio.CapacityLimiter, ask: Question) -> Response:
    """Do what is asked of a test once those before are done: its requests never overlap."""
    if held.waiting >= MOST_WAITING:
        return _status(503, f"{MOST_WAITING} requests wait for this test already.")
    held.waiting += 1
    try:
        async with held.turn:
            return await anyio.to_thread.run_sync(_answered, ask, held.test, limiter=workers)
    finally:
        held.waiting -= 1
        tests.touch(held)


def _answered(ask: Question, test: BoptestTest) -> Response:
    """Ask, and write the answer down: both may take a while, and so belong in a thread."""
    try:
        answer = ask(test)
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
        text = json.dumps(_without_nan(content), allow_nan=False)
    return Response(text, status, media_type="application/json")


def _without_nan(content: Any) -> Any:
    if isinstance(content, dict):
        return {key: _without_nan(value) for key, value in content.items()}
    if isinstance(content, list):
        return [_without_nan(value) for value in content]
    return None if isinstance(content, float) and not math.isfinite(content) else content
