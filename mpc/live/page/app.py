"""The page's application: it reads what the parts say of themselves, and hands requests on to the guard, signed."""

from __future__ import annotations

import asyncio
import json
import threading
import time
from collections.abc import AsyncIterator, Callable
from importlib import resources
from typing import Any

from mpc.live.guard.socket import GuardClient
from mpc.live.operators import operator_key, sign
from mpc.live.page.access import Access, Role, page_tokens
from mpc.live.page.metrics import metrics
from mpc.live.site import Site
from mpc.live.state import read_state
from thermal.display_units import inch_pound
from thermal.plan.guard import extra

#: Longest body of a request [bytes], time between two events of the stream [s], and most streams at a time.
MOST_BYTES, EVERY, MOST_STREAMS = 100_000, 1.0, 20

#: Age up to which a status is shown again [s]: half a stream's time.
KEPT = 0.5


def make_app(site: Site) -> Any:
    """Make the application.

    Parameters
    ----------
    site : Site
        As read.

    Returns
    -------
    FastAPI
        With ``/``, ``/health``, ``/metrics``, ``/status``, ``/events``, ``/approve`` and ``/mode``.
    """
    fastapi, replies = extra("fastapi", "live", "the page"), extra("fastapi.responses", "live", "the page")
    access, key = Access(site.file.page.host, page_tokens(site.folder)), operator_key(site.folder)
    style = resources.files("mpc.reports").joinpath("templates/style.css").read_text(encoding="utf-8")
    page = resources.files("mpc.live.page").joinpath("page.html").read_text(encoding="utf-8")
    units = {unit: line._asdict() for unit in ("°C", "K") if (line := inch_pound(unit))}
    page = page.replace("/* style of all reports */", style)
    page = page.replace("{/* inch-pound units */}", json.dumps(units, ensure_ascii=False))
    app = fastapi.FastAPI(docs_url=None, redoc_url=None, openapi_url=None)
    streams, seen = [0], _Fresh(site)

    async def told() -> dict[str, Any]:
        return await asyncio.to_thread(seen.status)

    def checked(role: Role) -> Callable[..., None]:
        def check(request: Any) -> None:
            given = request.headers.get("authorization", "")
            status, words = access.refusal(request.headers.get("host", ""), given, role)
            if status:
                raise fastapi.HTTPException(status, words)

        check.__annotations__["request"] = fastapi.Request  # text of an annotation does not reach this name
        return check

    viewer, operator = ([fastapi.Depends(checked(role))] for role in ("viewer", "operator"))

    async def show() -> Any:
        policy = "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; connect-src 'self'"
        headers = {"Content-Security-Policy": policy, "X-Frame-Options": "DENY", "Referrer-Policy": "no-referrer"}
        return replies.HTMLResponse(page, headers=headers)

    async def health() -> Any:
        status = await told()
        fine = status["guard"] == "up" and status["collector"].get("where") in ("committed", "spooled")
        return replies.JSONResponse({"fine": fine, "guard": status["guard"]}, 200 if fine else 503)

    async def prometheus() -> Any:
        text = await asyncio.to_thread(lambda: metrics(site.folder, seen.status()["status"]))
        return replies.PlainTextResponse(text.decode(), media_type="text/plain; version=0.0.4")

    async def status() -> Any:
        return await told()

    async def events() -> Any:
        if streams[0] >= MOST_STREAMS:
            raise fastapi.HTTPException(429, "too many pages are open")

        async def lines() -> AsyncIterator[str]:
            if streams[0] >= MOST_STREAMS:  # those that asked at the same time
                return
            streams[0] += 1
            number = None
            try:
                while True:
                    status = await told()
                    shown = (status["controller"].get("picture") or {}).get("number")
                    if shown == number:  # a plan is sent once
                        status = status | {"controller": status["controller"] | {"picture": None}}
                    yield f"data: {json.dumps(status)}\n\n"
                    number = shown
                    await asyncio.sleep(EVERY)
            finally:
                streams[0] -= 1

        return replies.StreamingResponse(lines(), media_type="text/event-stream")

    async def ask(request: Any, kind: str, wanted: dict[str, type]) -> Any:
        try:
            length = int(request.headers.get("content-length", MOST_BYTES + 1))
            content = json.loads(await request.body()) if length <= MOST_BYTES else None
        except (ValueError, RecursionError):
            content = None
        if not isinstance(content, dict) or set(content) != set(wanted) or not all(
            type(content[k]) is t for k, t in wanted.items()
        ) or not all(isinstance(point, str) for point in content["points"]):
            raise fastapi.HTTPException(422, f"expected JSON with {', '.join(wanted)}")
        answer = await asyncio.to_thread(_send, site, {"kind": kind, **content}, key)
        return replies.JSONResponse(answer, 503 if answer["error"] else 202)

    async def approve(request: Any) -> Any:
        return await ask(request, "approve", {"plan": int, "points": list})

    async def mode(request: Any) -> Any:
        return await ask(request, "mode", {"mode": str, "points": list})

    for path, shown, needs in (
        ("/", show, []), ("/health", health, []), ("/metrics", prometheus, viewer), ("/status", status, viewer),
        ("/events", events, viewer),
    ):  # fmt: skip
        app.get(path, dependencies=needs)(shown)
    for path, work in (("/approve", approve), ("/mode", mode)):
        work.__annotations__["request"] = fastapi.Request
        app.post(path, dependencies=operator)(work)
    return app


class _Fresh:
    """Status of a site, asked for once in a while: who floods the page does not reach the guard."""

    def __init__(self, site: Site) -> None:
        self._site, self._lock = site, threading.Lock()
        self._until, self._status = 0.0, dict[str, Any]()

    def status(self) -> dict[str, Any]:
        with self._lock:
            if time.monotonic() >= self._until:
                self._status = site_status(self._site)
                self._until = time.monotonic() + KEPT
            return self._status


def site_status(site: Site) -> dict[str, Any]:
    """Collect what the parts say of themselves.

    Parameters
    ----------
    site : Site
        As read.
    """
    guard = _guard_status(site)
    return {
        "site": site.file.name, "guard": "up" if "decision" in guard else guard.get("error", "down"),
        "zone": site.plant.location.timezone, "status": guard,
        "controller": read_state(site.folder / "controller.json"),
        "collector": read_state(site.folder / "collector.json"),
        "nightly": read_state(site.folder / "nightly.json"),
        "units": {name: "degC" for name in site.writable if "temperature" in name},
    }  # fmt: skip


def _guard_status(site: Site) -> dict[str, Any]:
    client = GuardClient(site.sockets)
    try:
        return client.ask({"kind": "status"})
    finally:
        client.close()


def _send(site: Site, request: dict[str, Any], key: bytes) -> dict[str, Any]:
    """Sign a request, and hand it on; its nonce is what the guard's answers name it by."""
    client = GuardClient(site.sockets)
    signed = sign(request, key, site.clock().wall(), "page", float(site.limits()["tick"]))
    try:
        return {"nonce": signed["nonce"]} | client.ask(signed)
    finally:
        client.close()
