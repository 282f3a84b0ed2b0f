"""Vector drawings: walls, doors, texts and rooms of a DXF file."""

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import islice
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from thermal._types import FloatArray
from thermal.errors import OversizedFileError, PlanError
from thermal.plan.guard import check_pixels, checked_file, checked_number, extra, reading
from thermal.plan.ink import FINE, Ink
from thermal.plan.rooms import survey_ink
from thermal.plan.survey import FloorSurvey, PlanSettings, rooms_of
from thermal.plan.windows import NOT_CALLED, find_windows
from thermal.plan.words import TextLine, name_rooms

VECTOR_KINDS = (".dxf",)

#: Names of layers, in the languages of many offices: English, German, French, Spanish, Italian, Dutch.
WALL_LAYERS = r"wall|wand|w[aä]nde|mauer|\bmur|muro|parete|tabique|partition|a-glaz|window|fenster"
WINDOW_NAMES = r"glaz|window|fenster|fen[eê]tre|ventana|finestra|\braam"  # of layers, and of blocks
ROOM_LAYERS = r"room|raum|space|area|zone|pi[eè]ce|local|stanza"

_MOST_ENTITIES = 400_000  # a floor of a hospital has some 50,000; blocks within blocks can hold any number
_SMALLEST, _LARGEST = 2.0, 2000.0  # m, of a building's longer side
_STROKE = 0.01  # m: half the width of a line, so that it is seen at the resolution of the survey
_SAGITTA = 0.005  # m: how far a chord may lie from its arc
#: Metres in a unit of a DXF ($INSUNITS): inch, foot, mile, mm, cm, m, km, yard, dm.
_UNITS = {1: 0.0254, 2: 0.3048, 3: 1609.344, 4: 0.001, 5: 0.01, 6: 1.0, 7: 1000.0, 10: 0.9144, 14: 0.1}


@dataclass(frozen=True, eq=False)
class _Content:
    """What a drawing holds, in metres with y upwards."""

    lines: list[FloatArray]
    solids: list[FloatArray]
    rooms: list[FloatArray]
    texts: list[TextLine]
    windows: list[FloatArray]


def read_dxf(
    path: str | PathLike[str],
    *,
    unit: float | None = None,
    wall_layers: str | None = None,
    room_layers: str | None = None,
    settings: PlanSettings | None = None,
    straighten: bool = True,
) -> FloorSurvey:
    """Find walls, rooms and doors in a DXF drawing.

    Parameters
    ----------
    path : str or path
        DXF, text or binary; one floor in its model space.
    unit : float, optional
        Metres in one unit of the drawing [m]; default: what the drawing says ($INSUNITS).
    wall_layers : str, optional
        Regular expression for layers of walls and windows, in any case of letters; default: the usual names, and all
        layers when none has one.
    room_layers : str, optional
        The same for layers whose closed polylines are rooms; where there are some, they are taken as they stand.
    settings : PlanSettings, optional
        What counts as a wall, a door and a room; strokes on layers of walls are walls however thin they are.
    straighten : bool
        Whether to turn the drawing so that its walls stand upright; the angle is kept in the result.

    Returns
    -------
    FloorSurvey
        What was understood, with texts in rooms as their names, and windows where layers or blocks are called so.

    Raises
    ------
    PlanError
        The file is no DXF drawing, or has no lines on the layers.
    PlanError
        It has no unit, or one that makes no building of it.
    OversizedFileError
        It has more lines than any plan.
    PlanError
        Its walls enclose nothing.
    """
    file = checked_file(Path(path), VECTOR_KINDS)
    document = _open(file)
    metres = _unit(document, unit, file.name)
    content = _collect(document, metres, wall_layers or WALL_LAYERS, room_layers or ROOM_LAYERS, file.name, wall_layers)
    angle, placement, shape = _upright(content, straighten, metres, file.name)
    settings = settings or PlanSettings()
    survey = _survey(content, placement, shape, angle, settings, file.name)
    own = survey.placement if survey.placement is not None else np.eye(3)
    if content.windows:
        upright = [line @ own[:2, :2].T + own[:2, 2] for line in content.windows]
        survey = replace(survey, windows=find_windows(upright, survey, settings.thickest_wall))
    else:
        survey = replace(survey, remarks=(*survey.remarks, NOT_CALLED))
    named = name_rooms(survey, content.texts)
    return replace(named, placement=own @ np.diag([metres, metres, 1.0]))


def _open(file: Path) -> Any:
    ezdxf = extra("ezdxf")
    with reading(file, "a DXF drawing", ezdxf.DXFError, TypeError, LookupError, StopIteration, RecursionError):
        document = ezdxf.readfile(file)
    return document


def _unit(document: Any, unit: float | None, where: str) -> float:
    if unit is not None:
        return checked_number(unit, "unit", 1e-6, 1e4, "m")
    code = document.header.get("$INSUNITS", 0)
    expected = "a unit of length in $INSUNITS"
    PlanError.unless(code in _UNITS, where, expected, f"code {code}", "pass unit, such as 0.001 for millimetres")
    return _UNITS[code]


def _collect(document: Any, metres: float, walls: str, rooms: str, where: str, wanted: str | None) -> _Content:
    """Sort the entities of the model space by what their layers are for."""
    try:
        is_wall, is_room = re.compile(walls, re.IGNORECASE), re.compile(rooms, re.IGNORECASE)
    except re.error as error:
        raise PlanError(where, "a regular expression for layers", str(error)) from error
    is_window = re.compile(WINDOW_NAMES, re.IGNORECASE)
    found: list[tuple[str, str, Any]] = []
    glass: list[tuple[str, Any]] = []
    texts: list[TextLine] = []
    try:
        for count, (entity, parent) in enumerate(islice(_entities(document), _MOST_ENTITIES + 1)):
            if count == _MOST_ENTITIES:
                expected = f"at most {_MOST_ENTITIES} lines and arcs"
                raise OversizedFileError(where, expected, "more", "explode less, or export one floor")
            kind, layer = entity.dxftype(), str(entity.dxf.layer)
            if kind in ("TEXT", "MTEXT"):
                texts.append(_text(entity, metres))
            elif kind in ("LINE", "LWPOLYLINE", "POLYLINE", "ARC", "HATCH", "SOLID"):
                if is_window.search(layer) or is_window.search(parent):  # a window closes its wall
                    glass.append((kind, entity))
                    layer = layer if is_wall.search(layer) or wanted is not None else "window"
                found.append((kind, layer, entity))
    except RecursionError as error:
        raise OversizedFileError(where, "blocks that end", "blocks within blocks", "explode them") from error
    on_walls = [item for item in found if is_wall.search(item[1])]
    outlines = [item for item in found if is_room.search(item[1]) and not is_wall.search(item[1])]
    if not on_walls and not outlines:
        if wanted is not None or not found:
            layers = ", ".join(sorted({layer for _, layer, _ in found})[:12])
            raise PlanError(where, f"lines on layers like {walls!r}", f"layers {layers or 'without any'}")
        on_walls = found
    drawn = [(kind, line) for kind, _, entity in on_walls for line in _lines(entity, kind, metres) if len(line) > 1]
    lines, solids = ([line for kind, line in drawn if (kind in ("HATCH", "SOLID")) == solid] for solid in (False, True))
    closed = (line for kind, _, entity in outlines for line in _lines(entity, kind, metres) if len(line) > 3)
    windows = [line for kind, entity in glass for line in _lines(entity, kind, metres) if len(line) > 1]
    return _Content(lines, solids, [line for line in closed if np.allclose(line[0], line[-1])], texts, windows)


def _entities(document: Any) -> Iterator[tuple[Any, str]]:
    """Entities of the model space, blocks taken apart, with name and layer of the block that they are from."""
    decompose = extra("ezdxf.disassemble").recursive_decompose
    for top in document.modelspace():
        parent = f"{top.dxf.name} {top.dxf.layer}" if top.dxftype() == "INSERT" else ""
        for entity in decompose([top]):
            yield entity, parent


def _lines(entity: Any, kind: str, metres: float) -> Iterator[FloatArray]:
    """Points of what an entity draws [m], arcs as chords."""
    path = extra("ezdxf.path")
    tolerance = _SAGITTA / metres
    paths = path.from_hatch(entity) if kind == "HATCH" else [path.make_path(entity)]
    for one in paths:
        points = np.array([(p.x, p.y) for p in one.flattening(tolerance)], dtype=float) * metres
        if points.size and np.isfinite(points).all():
            if kind in ("HATCH", "SOLID") or one.is_closed:
                points = np.vstack([points, points[:1]])
            yield points


def _text(entity: Any, metres: float) -> TextLine:
    words = entity.plain_text() if entity.dxftype() == "TEXT" else entity.plain_text(split=False)
    at = entity.dxf.insert
    if entity.dxftype() == "TEXT" and entity.dxf.hasattr("align_point"):
        at = entity.dxf.align_point
    return TextLine(str(words), at.x * metres, at.y * metres)


def _upright(
    content: _Content, straighten: bool, metres: float, where: str
) -> tuple[float, FloatArray, tuple[int, int]]:
    """Angle of the walls clockwise, what takes (x, y, 1) [m] to column and row of the survey, and its shape."""
    lines = content.lines + content.solids or content.rooms
    PlanError.unless(lines, where, "lines", "none that can be drawn")
    angle = _main_angle(lines) if straighten else 0.0
    cosine, sine = math.cos(math.radians(angle)), math.sin(math.radians(angle))
    turn = np.array([[cosine, -sine], [sine, cosine]])
    points = np.vstack([*lines, *content.rooms]) @ turn.T
    size = points.max(axis=0) - points.min(axis=0)
    if not _SMALLEST <= size.max() <= _LARGEST:
        expected = f"a building of {_SMALLEST:g} to {_LARGEST:g} m"
        found = f"{size[0]:.4g} m x {size[1]:.4g} m with {metres:g} m for a unit"
        raise PlanError(where, expected, found, "pass unit, such as 0.001 for millimetres")
    pixel = max(FINE, math.sqrt(size[0] * size[1] / 3e7))
    margin = 0.5
    left, top = points[:, 0].min() - margin, points[:, 1].max() + margin
    shape = tuple(math.ceil((extent + 2 * margin) / pixel) for extent in size[::-1])
    check_pixels(shape[1], shape[0], where)
    placement = np.eye(3)
    placement[0, :2], placement[0, 2] = turn[0] / pixel, -left / pixel - 0.5
    placement[1, :2], placement[1, 2] = -turn[1] / pixel, top / pixel - 0.5
    return angle, placement, (shape[0], shape[1])


def _main_angle(lines: list[FloatArray]) -> float:
    """Angle of the walls, clockwise of upright, weighed by length; ``4 angle = -arg Σ |d| exp(4iφ)`` [deg]."""
    steps = np.vstack([np.diff(line, axis=0) for line in lines])
    direction = steps[:, 0] + 1j * steps[:, 1]
    length = np.abs(direction)
    unit = np.divide(direction, length, out=np.zeros_like(direction), where=length > 0)
    vector = complex((length * unit**4).sum())
    return -math.degrees(np.angle(vector)) / 4.0 if abs(vector) >= 0.3 * length.sum() else 0.0


def _survey(
    content: _Content, placement: FloatArray, shape: tuple[int, int], angle: float, settings: PlanSettings, where: str
) -> FloorSurvey:
    """Draw the walls, or the rooms where the drawing has them, on the survey's grid."""
    pixel = 1.0 / math.hypot(*placement[0, :2])
    if content.rooms:
        return _from_outlines(content.rooms, placement, shape, angle, pixel, where)
    walls = _solid_walls(content, settings.thickest_wall)
    mask = _drawn(walls, placement, shape)
    return survey_ink(Ink(mask, pixel, angle, placement), where, replace(settings, thinnest_wall=0.0))


def _solid_walls(content: _Content, thickest: float) -> Any:
    """Walls as areas: hatches as they are, the space between two faces of a wall, a stroke where there is one line."""
    shapely = extra("shapely")
    solids = [_polygon(points) for points in content.solids if len(points) > 3]
    if not content.lines:
        return shapely.unary_union(solids)
    lines = shapely.unary_union([shapely.LineString(line) for line in content.lines])
    faces = shapely.polygonize([lines]).geoms
    # Faces that nothing is left of when half the thickness of a wall is taken off all around.
    solids += [face for face in faces if face.buffer(-thickest / 2.0 - 1e-6).is_empty]
    walls = shapely.unary_union(solids)
    single = lines.difference(walls.buffer(1e-4))
    return shapely.unary_union([walls, single.buffer(_STROKE, cap_style="square")])


def _from_outlines(
    rooms: list[FloatArray], placement: FloatArray, shape: tuple[int, int], angle: float, pixel: float, where: str
) -> FloorSurvey:
    """Take closed polylines as rooms; what lies between them and is no wider than a wall is wall."""
    shapely = extra("shapely")
    outlines = sorted((_polygon(points) for points in rooms), key=lambda shape: -shape.area)
    labels = np.full(shape, -1, dtype=np.int32)
    footprint = shapely.unary_union(outlines).buffer(0.4, join_style="mitre").buffer(-0.3, join_style="mitre")
    labels[_drawn(footprint, placement, shape)] = 0
    for number, outline in enumerate(outlines, start=1):
        labels[_drawn(outline, placement, shape)] = number
    numbers = np.unique(labels[labels > 0])
    labels[labels > 0] = 1 + np.searchsorted(numbers, labels[labels > 0])
    remarks = ("rooms are closed polylines of the drawing",)
    return FloorSurvey(where, labels, pixel, rooms_of(labels, pixel), (), angle, placement, remarks)


def _polygon(points: FloatArray) -> Any:
    """Make a valid area of an outline; one that crosses itself is taken apart."""
    shapely = extra("shapely")
    return shapely.make_valid(shapely.Polygon(points)).buffer(0)


def _drawn(area: Any, placement: FloatArray, shape: tuple[int, int]) -> NDArray[np.bool_]:
    """Elements of the survey whose middle lies in an area."""
    polygon = extra("skimage.draw").polygon
    mask = np.zeros(shape, dtype=bool)
    for part in getattr(area, "geoms", [area]):
        if part.geom_type != "Polygon" or part.is_empty:
            continue
        filled = np.zeros(shape, dtype=bool)
        for number, ring in enumerate((part.exterior, *part.interiors)):
            columns, rows = (np.asarray(ring.coords)[:, :2] @ placement[:2, :2].T + placement[:2, 2]).T
            filled[polygon(rows, columns, shape)] = number == 0
        mask |= filled
    return mask
