"""The addresses of telemetry and places on the labelling page."""

from typing import Any

from fastapi import FastAPI, Request
from fastapi.concurrency import run_in_threadpool

from thermal.plan.page.bodies import checked, entry, read_json
from thermal.plan.page.desk import LabelDesk
from thermal.plan.page.drawings import Upload
from thermal.plan.page.jobs import Progress
from thermal.plan.page.places import find_places
from thermal.plan.page.sources import Point, Source
from thermal.plan.page.telemetry import TELEMETRY_KINDS

_MOST_POINTS = 10_000_000  # bytes: what thirty thousand columns are taken for


def add_telemetry(app: FastAPI, desk: LabelDesk) -> None:
    """Add the addresses of telemetry to those of the page.

    Parameters
    ----------
    app : FastAPI
        To add them to.
    desk : LabelDesk
        What they work on.
    """
    telemetry = desk.telemetry

    @app.get("/api/telemetry")
    def show() -> dict[str, Any]:
        return telemetry.state()

    @app.post("/api/telemetry/files")
    async def take_file(request: Request, name: str, window: str) -> dict[str, Any]:
        desk.sessions.check(window)
        with Upload(telemetry.folder, name, TELEMETRY_KINDS) as upload:
            async for chunk in request.stream():
                upload.write(chunk)
            return {"file": await run_in_threadpool(telemetry.keep, upload)}

    @app.post("/api/telemetry/look")
    async def look(request: Request, window: str) -> dict[str, Any]:
        desk.sessions.check(window)
        source = checked(Source, await read_json(request), "source")
        return desk.jobs.start("read telemetry", lambda progress: telemetry.look(source, progress)).to_dict()

    @app.put("/api/telemetry/points")
    async def correct(request: Request, window: str) -> dict[str, Any]:
        desk.sessions.check(window)
        points = checked(list[Point], entry(await read_json(request, _MOST_POINTS), "points"), "points")
        return await run_in_threadpool(telemetry.correct, points)

    @app.post("/api/telemetry/take")
    def take(window: str) -> dict[str, Any]:
        desk.sessions.check(window)
        return desk.jobs.start("take telemetry", lambda progress: desk.take_telemetry(window, progress)).to_dict()

    @app.post("/api/telemetry/check")
    def check() -> dict[str, Any]:
        def work(progress: Progress) -> dict[str, Any]:
            progress("checking", 0, 1)
            return telemetry.check()

        return (desk.jobs.busy("check telemetry") or desk.jobs.start("check telemetry", work)).to_dict()

    @app.get("/api/telemetry/plot")
    def plot(column: str, of: str = "case") -> dict[str, Any]:
        return telemetry.plot(column, of)

    @app.get("/api/places")
    def places(name: str) -> dict[str, Any]:
        return {"places": find_places(name[:200])}
