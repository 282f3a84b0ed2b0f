"""The addresses of the labelling page."""

from dataclasses import asdict
from importlib.resources import files
from pathlib import Path
from typing import Annotated, Any, Literal

from fastapi import FastAPI, Query, Request
from fastapi.concurrency import run_in_threadpool
from fastapi.exceptions import RequestValidationError
from fastapi.responses import FileResponse, JSONResponse, Response

from thermal.display_units import inch_pound_lines
from thermal.errors import LabelError, OversizedFileError, PlanError, ReportError, SessionHeldError, ThermalError
from thermal.plan.drawing import DOTS_PER_INCH, RASTER_KINDS, read_drawing
from thermal.plan.folder import png_of
from thermal.plan.guard import inside_folder
from thermal.plan.list import FloorEntry
from thermal.plan.models import read_devices
from thermal.plan.page.bodies import checked, entry, read_json
from thermal.plan.page.desk import LabelDesk
from thermal.plan.page.draft import zones_of
from thermal.plan.page.drawings import DEVICE_KINDS, DRAWING_KINDS, WIDEST_PICTURE, Upload, add_floors, look_at
from thermal.plan.page.jobs import REPORTS, Progress
from thermal.plan.page.telemetry_routes import add_telemetry

#: What a report may do: its own script in a box without access to the page.
_REPORT_POLICY = (
    "sandbox allow-scripts allow-popups; default-src 'none'; script-src 'unsafe-inline' 'unsafe-eval'; "
    "style-src 'unsafe-inline'; img-src data: blob:; font-src data:"
)
_MOST_BODY = 60_000_000  # bytes of JSON: four floors of a million cells
_TYPES = {".html": "text/html", ".js": "text/javascript", ".css": "text/css", ".svg": "image/svg+xml"}
_STATUS: dict[type[ThermalError], int] = {SessionHeldError: 409, OversizedFileError: 413, ReportError: 404}

Window = Annotated[str, Query(max_length=100)]
Units = Literal["si", "ip"]


def routes_of(desk: LabelDesk) -> FastAPI:
    """Make the addresses of a labelling page.

    Parameters
    ----------
    desk : LabelDesk
        What they work on.

    Returns
    -------
    FastAPI
        Without the gate in front of it.
    """
    app = FastAPI(openapi_url=None, docs_url=None, redoc_url=None)
    app.add_exception_handler(ThermalError, _named)
    app.add_exception_handler(RequestValidationError, _malformed)
    _add_page(app)
    _add_draft(app, desk)
    _add_drawings(app, desk)
    _add_jobs(app, desk)
    _add_reports(app, desk)
    add_telemetry(app, desk)
    return app


def _add_page(app: FastAPI) -> None:
    static = files("thermal.plan.page").joinpath("static")
    known = {entry.name: entry for entry in static.iterdir() if entry.is_file()}

    @app.get("/")
    def page() -> Response:
        return Response(known["index.html"].read_bytes(), media_type="text/html; charset=utf-8")

    @app.get("/static/{name}")
    def file(name: str) -> Response:
        ReportError.unless(name in known, "address", "a file of the page", repr(name[:80]))
        kind = _TYPES.get(name[name.rfind(".") :], "application/octet-stream")
        return Response(known[name].read_bytes(), media_type=kind)

    @app.get("/api/units")
    def units() -> dict[str, Any]:
        return {unit: line._asdict() for unit, line in inch_pound_lines().items()}


def _add_draft(app: FastAPI, desk: LabelDesk) -> None:
    @app.get("/api/state")
    def state() -> dict[str, Any]:
        return desk.state()

    @app.put("/api/draft")
    async def save(request: Request, window: Window) -> dict[str, Any]:
        content = await read_json(request, _MOST_BODY)
        return await run_in_threadpool(desk.save, window, content)

    @app.post("/api/session")
    async def open_session(request: Request) -> dict[str, Any]:
        asked = await read_json(request)
        if not isinstance(asked, dict) or not isinstance(asked.get("window"), str) or not asked["window"]:
            raise LabelError("session", "a window's name", repr(asked)[:80])
        previous, take_over = str(asked.get("previous", "")), asked.get("take_over") is True
        return desk.sessions.open(asked["window"], previous=previous, take_over=take_over)

    @app.post("/api/session/beat")
    def beat(window: Window) -> dict[str, Any]:
        desk.sessions.check(window)
        return {}

    @app.post("/api/session/close")
    def close(window: Window) -> dict[str, Any]:
        desk.sessions.close(window)
        return {}


def _add_drawings(app: FastAPI, desk: LabelDesk) -> None:
    own = desk.store.own
    seen: dict[tuple[str, int], dict[str, Any]] = {}

    def drawing_of(name: str) -> Path:
        """Find a drawing by its name alone: no folder, no path, none that is not there."""
        file = inside_folder(own / "drawings", name, "drawing")
        there = file.is_file() and file.parent == (own / "drawings").resolve()
        PlanError.unless(there, "drawing", "the name of one on the page", repr(name[:80]))
        return file

    @app.get("/api/drawings")
    def list_drawings() -> dict[str, Any]:
        files_there = sorted(p for p in (own / "drawings").iterdir() if p.is_file() and p.name[0] != ".")
        for file in files_there:
            key = (file.name, file.stat().st_mtime_ns)
            if key not in seen:
                try:
                    seen[key] = asdict(look_at(file))
                except ThermalError as error:  # somebody else has put it there: say so beside it
                    seen[key] = {"file": file.name, "kind": "unreadable", "message": str(error)}
        return {"drawings": [seen[file.name, file.stat().st_mtime_ns] for file in files_there]}

    @app.delete("/api/drawings/{name}")
    def drop_drawing(name: str, window: Window) -> dict[str, Any]:
        desk.sessions.check(window)
        drawing_of(name).unlink()
        return {}

    @app.post("/api/drawings")
    async def take_drawing(request: Request, name: str, window: Window) -> dict[str, Any]:
        desk.sessions.check(window)
        with Upload(own / "drawings", name, DRAWING_KINDS) as upload:
            async for chunk in request.stream():
                upload.write(chunk)
            return asdict(await run_in_threadpool(upload.keep_drawing))

    @app.get("/api/drawings/{name}")
    def show_drawing(name: str, page: int = 1, dots_per_inch: float = DOTS_PER_INCH) -> Response:
        file = drawing_of(name)
        PlanError.unless(file.suffix.lower() in RASTER_KINDS, file.name, "a raster drawing", repr(file.suffix))
        sheet = look_at(file, page, dots_per_inch)
        picture = png_of(read_drawing(file, page=page, dots_per_inch=dots_per_inch).grey, WIDEST_PICTURE)
        size = {"x-width": f"{sheet.width:.0f}", "x-height": f"{sheet.height:.0f}"}
        return Response(picture, media_type="image/png", headers=size)

    @app.get("/api/pictures/{name}")
    def show_picture(name: str) -> Response:
        file = inside_folder(own / "pictures", name, "picture")
        PlanError.unless(file.is_file() and file.suffix == ".png", name[:80], "a picture of the page", "none")
        return FileResponse(file, media_type="image/png")

    @app.post("/api/floors")
    async def make_floors(request: Request, window: Window) -> dict[str, Any]:
        desk.sessions.check(window)
        entries, size = _floor_request(await read_json(request))
        draft = desk.store.draft

        def work(progress: Progress) -> dict[str, Any]:
            found = add_floors(draft, entries, own, size, progress)
            return asdict(found) | {"floors": [floor.model_dump() for floor in found.floors]}

        return desk.jobs.start("floors", work).to_dict()

    @app.post("/api/devices")
    async def take_devices(request: Request, name: str, window: Window) -> dict[str, Any]:
        desk.sessions.check(window)
        with Upload(own / "drawings", name, DEVICE_KINDS) as upload:
            async for chunk in request.stream():
                upload.write(chunk)
            zones = list(zones_of(desk.store.draft.floors))
            found = await run_in_threadpool(read_devices, upload.close(), zones)
        return {"devices": [d.model_dump() | {"room": found.unplaced.get(d.name, "")} for d in found.devices]}


def _add_jobs(app: FastAPI, desk: LabelDesk) -> None:
    @app.get("/api/jobs/{number}")
    def ask(number: int) -> dict[str, Any]:
        job = desk.jobs.get(number)
        if job is None:
            raise ReportError("job", "one that was started", str(number))
        return job.to_dict()

    @app.post("/api/jobs/{number}/stop")
    def stop(number: int) -> dict[str, Any]:
        job = desk.jobs.get(number)
        if job is not None:
            desk.jobs.stop(job)
        return {}


def _add_reports(app: FastAPI, desk: LabelDesk) -> None:
    @app.get("/api/reports")
    def listed() -> dict[str, Any]:
        running = [job for job in desk.jobs.unfinished() if job["kind"] in desk.reports.kinds]
        return {"reports": [report.to_dict() for report in desk.reports.found()], "running": running}

    @app.post("/api/reports/{kind}")
    def make(kind: str, units: Units = "si") -> dict[str, Any]:
        busy = desk.jobs.busy(desk.reports.checked_kind(kind))
        job = busy or desk.jobs.start(kind, lambda progress: desk.reports.make(kind, progress, units), REPORTS)
        return job.to_dict()

    @app.get("/reports/{key}/{name:path}")
    def show(key: str, name: str) -> Response:
        page = desk.reports.page(key, name)
        return FileResponse(page, media_type="text/html", headers={"content-security-policy": _REPORT_POLICY})


def _floor_request(content: Any) -> tuple[list[FloorEntry], float | None]:
    """Drawings to make floors of, and the size of cells."""
    entries = checked(list[FloorEntry], entry(content, "floors"), "floors")
    LabelError.unless(entries, "floors", "at least one drawing", "none")
    size: float | None = checked(float | None, content.get("cell_size"), "cell_size")  # type: ignore[arg-type]
    return entries, size


async def _named(request: Request, error: Exception) -> Response:
    """Turn an error of the family into an answer that the page shows."""
    status = next((code for kind, code in _STATUS.items() if isinstance(error, kind)), 400)
    return JSONResponse({"error": type(error).__name__, "message": str(error)}, status)


async def _malformed(request: Request, error: Exception) -> Response:
    first = error.errors()[0] if isinstance(error, RequestValidationError) else {}
    where = ".".join(str(part) for part in first.get("loc", ("request",)))
    found = repr(first.get("input"))[:80]
    expected = str(first.get("msg", "a valid value")).removeprefix("Input should be ")
    return await _named(request, LabelError(where, expected, found))
