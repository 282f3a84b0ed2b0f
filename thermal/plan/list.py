"""A list of drawings: one YAML file that says which drawing is which floor, and at which scale."""

from dataclasses import fields
from os import PathLike
from pathlib import Path
from typing import Annotated, Any, Literal

import yaml
from pydantic import Field, ValidationError

from thermal.case.building import Entry, Location
from thermal.errors import PlanError
from thermal.plan.assemble import PlanImport, Progress, assemble_plans
from thermal.plan.cells import ZonedFloor, propose_zones
from thermal.plan.drawing import DOTS_PER_INCH, RASTER_KINDS, DrawingScale, Finite, Point, read_drawing
from thermal.plan.guard import checked_file, first_fault, inside_folder, reading
from thermal.plan.rooms import find_rooms
from thermal.plan.survey import CODE_KINDS, FloorSurvey, PlanSettings, read_codes
from thermal.plan.vector import VECTOR_KINDS, read_dxf
from thermal.plan.windows import WINDOW_HEIGHT
from thermal.plan.words import TextLine, name_rooms, pdf_lines, picture_lines

_MOST_YAML = 1_000_000  # bytes: a list of a hundred floors with the names of all rooms has a tenth of that


class FloorEntry(Entry):
    """A floor in a list of drawings.

    Parameters
    ----------
    name
        Of the floor.
    file
        Drawing, in the folder of the list: PNG, JPEG, PDF, DXF; CSV, ``.npy`` or ``.npz`` of codes.
    height
        Clear height [m].
    scale
        Of a PNG, JPEG or PDF.
    page
        Of a PDF, from 1.
    dots_per_inch
        At which the page is drawn [1/inch].
    crop
        Left, top, right, bottom of the part to look at [px].
    cell_size
        Side of a cell of codes [m].
    unit
        Metres in a unit of a DXF [m].
    wall_layers, room_layers
        Regular expressions for layers of a DXF.
    straighten
        Whether to turn the drawing upright.
    anchor
        A spot that all floors share [px of the drawing].
    names
        A point in a room [px of the drawing] by name of the zone.
    widest_door, thickest_wall, thinnest_wall
        As in `PlanSettings` [m].
    smallest_room, smallest_zone
        As in `PlanSettings` [m2].
    read_text
        Whether texts in rooms become their names. Default: of a DXF and a PDF; true: of a picture, too, by OCR.
    window_height
        Of windows that a DXF shows [m].
    """

    name: Annotated[str, Field(min_length=1)]
    file: Annotated[str, Field(min_length=1)]
    height: Finite = 3.0
    scale: DrawingScale | None = None
    page: int = 1
    dots_per_inch: Finite = DOTS_PER_INCH
    crop: tuple[int, int, int, int] | None = None
    cell_size: Finite | None = None
    unit: Finite | None = None
    wall_layers: str | None = None
    room_layers: str | None = None
    straighten: bool = True
    anchor: Point | None = None
    names: dict[str, Point] = Field(default_factory=dict)
    widest_door: Finite = PlanSettings.widest_door
    thickest_wall: Finite = PlanSettings.thickest_wall
    thinnest_wall: Finite = PlanSettings.thinnest_wall
    smallest_room: Finite = PlanSettings.smallest_room
    smallest_zone: Finite = PlanSettings.smallest_zone
    read_text: bool | None = None
    window_height: Finite = WINDOW_HEIGHT


class DrawingList(Entry):
    """A list of drawings.

    Parameters
    ----------
    format
        Version of the list.
    name
        Of the building.
    location
        Where it stands.
    orientation
        Clockwise from true north to "up" on the drawing of the lowest floor [deg].
    cell_size
        Side of the plans' cells [m]; default: as large as the areas of the rooms allow.
    floors
        Lowest first.
    """

    format: Literal[1] = 1
    name: Annotated[str, Field(min_length=1)]
    location: Location
    orientation: Annotated[Finite, Field(ge=-360, le=360)] = 0.0
    cell_size: Finite | None = None
    floors: Annotated[tuple[FloorEntry, ...], Field(min_length=1, max_length=200)]


def read_drawing_list(path: str | PathLike[str]) -> DrawingList:
    """Read a list of drawings.

    Parameters
    ----------
    path : str or path
        YAML.

    Returns
    -------
    DrawingList
        What it says; the drawings are not read.

    Raises
    ------
    PlanError
        The file is missing or no YAML.
    PlanError
        A key or value does not fit; the message names it.
    """
    file = checked_file(Path(path), (".yaml", ".yml"))
    if file.stat().st_size > _MOST_YAML:
        raise PlanError(file.name, f"at most {_MOST_YAML} bytes", f"{file.stat().st_size}")
    with reading(file, "YAML in UTF-8", yaml.YAMLError, RecursionError):
        text = file.read_text(encoding="utf-8-sig")
        if any(isinstance(event, yaml.AliasEvent) for event in yaml.parse(text, Loader=yaml.SafeLoader)):
            raise PlanError(file.name, "YAML without aliases ('*')", "one", "write it out")
        content: Any = yaml.safe_load(text)
    try:
        return DrawingList.model_validate(content)
    except ValidationError as error:
        raise PlanError(*first_fault(error, file.name)) from error


def import_drawings(path: str | PathLike[str], *, progress: Progress | None = None) -> PlanImport:
    """Make plans of all drawings of a list.

    Parameters
    ----------
    path : str or path
        YAML file of a `DrawingList`; drawings lie in its folder.
    progress : callable, optional
        Told stage, steps done and all steps.

    Returns
    -------
    PlanImport
        Plans of the building.

    Raises
    ------
    PlanError
        One of its family, for the first thing that does not fit.
    """
    listed = read_drawing_list(path)
    folder = Path(path).absolute().parent
    floors = []
    for number, entry in enumerate(listed.floors):
        if progress is not None:
            progress(f"floor {entry.name}", number, len(listed.floors))
        floors.append(read_floor(entry, folder))
    anchors = {entry.name: entry.anchor for entry in listed.floors if entry.anchor is not None}
    return assemble_plans(floors, cell_size=listed.cell_size, anchors=anchors, progress=progress)


def read_floor(entry: FloorEntry, folder: Path) -> ZonedFloor:
    """Read the drawing of one floor and propose its zones.

    Parameters
    ----------
    entry : FloorEntry
        What the list says of it.
    folder : Path
        Folder of the list.

    Returns
    -------
    ZonedFloor
        Zones of the floor.

    Raises
    ------
    PlanError
        One of its family, for the first thing that does not fit.
    """
    survey = _survey(entry, inside_folder(folder, entry.file, f"floors: {entry.name}: file"))
    numbers = {"smallest_zone": entry.smallest_zone, "window_height": entry.window_height}
    return propose_zones(survey, entry.name, entry.height, names=entry.names, **numbers)


def _survey(entry: FloorEntry, file: Path) -> FloorSurvey:
    settings = PlanSettings(**{field.name: getattr(entry, field.name) for field in fields(PlanSettings)})
    kind = file.suffix.lower()
    if kind in CODE_KINDS:
        if entry.cell_size is None:
            raise PlanError(f"{file.name}: cell_size", "the side of a cell in metres", "none")
        return read_codes(file, entry.cell_size)
    if kind in VECTOR_KINDS:
        layers = {"wall_layers": entry.wall_layers, "room_layers": entry.room_layers}
        survey = read_dxf(file, unit=entry.unit, **layers, settings=settings, straighten=entry.straighten)
        return name_rooms(survey, ()) if entry.read_text is False else survey
    if kind not in RASTER_KINDS:
        raise PlanError(file.name, f"a drawing: {', '.join((*RASTER_KINDS, *VECTOR_KINDS, *CODE_KINDS))}", repr(kind))
    drawing = read_drawing(file, page=entry.page, dots_per_inch=entry.dots_per_inch, crop=entry.crop)
    if entry.scale is None:
        advice = "give two points of the drawing and their distance"
        raise PlanError(f"{file.name}: scale", "the scale of the drawing", "none", advice)
    survey = find_rooms(drawing, entry.scale.of(drawing), settings=settings, straighten=entry.straighten)
    lines: tuple[TextLine, ...] = ()
    if kind == ".pdf" and entry.read_text is not False:
        lines = pdf_lines(file.absolute(), entry.page, entry.dots_per_inch)
    if entry.read_text and not lines:
        lines = picture_lines(drawing)
    return name_rooms(survey, lines)
