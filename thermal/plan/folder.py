"""Case folder of an import, what a folder holds that must not be lost, and pictures of what was understood."""

import base64
import colorsys
import io
import json
import shutil
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import replace
from html import escape
from importlib.resources import files
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy import ndimage

from thermal.case.building import Building, Device, FloorPlans, Location
from thermal.case.case import Case
from thermal.case.load import NAME, load_case
from thermal.case.points import OUTDOOR_TEMPERATURE
from thermal.case.save import save_case
from thermal.case.telemetry import INDEX, Telemetry
from thermal.errors import CaseError, PlanError
from thermal.plan.assemble import AREA_TOLERANCE, PlanImport
from thermal.plan.cells import ZonedFloor, split_walls
from thermal.plan.devices import DeviceImport
from thermal.plan.guard import extra
from thermal.plan.survey import OUTSIDE_LABEL, WALL_LABEL, innermost


def building_of(
    found: PlanImport, name: str, location: Location, *, orientation: float = 0.0, devices: Sequence[Device] = ()
) -> Building:
    """Describe a building by its imported plans.

    Parameters
    ----------
    found : PlanImport
        Plans of the building.
    name : str
        Of the case.
    location : Location
        Where it stands.
    orientation : float
        Clockwise from true north to "up" on the drawing of the lowest floor [deg]; the angle by which that drawing was
        turned upright is added.
    devices : sequence of Device
        What serves it.

    Returns
    -------
    Building
        For a case.
    """
    turned = orientation + found.floors[0].survey.turned
    upright = (turned + 180.0) % 360.0 - 180.0
    return Building(name, location, round(upright, 2), found.plans, tuple(devices))


def save_plan_case(building: Building, path: str | PathLike[str], *, overwrite: bool = False) -> Path:
    """Save a building as a case folder that has no telemetry yet.

    Parameters
    ----------
    building : Building
        With plans and devices.
    path : str or path
        Folder to make.
    overwrite : bool
        Whether a case that is there already is replaced. Default: refuse.

    Returns
    -------
    Path
        The folder. It holds a telemetry file of two stamps without a value, which is there to be replaced.

    Raises
    ------
    CaseError
        One of its family: the building does not fit together, or the folder holds something.
    """
    stamps = pd.date_range("2000-01-01", periods=2, freq="5min", tz=building.location.timezone, name=INDEX)
    column = f"{building.weather_station}/{OUTDOOR_TEMPERATURE}"
    telemetry = Telemetry.from_frame(pd.DataFrame({column: [np.nan, np.nan]}, index=stamps))
    return save_case(Case(building=building, telemetry=telemetry, path=Path(path)), path, overwrite=overwrite)


def with_devices(path: str | PathLike[str], devices: Sequence[Device]) -> Case:
    """Load a case and give it other devices.

    Parameters
    ----------
    path : str or path
        Case folder.
    devices : sequence of Device
        All devices it is to have.

    Returns
    -------
    Case
        Not saved yet.

    Raises
    ------
    CaseError
        One of its family: the case does not load.
    """
    case = load_case(path)
    return replace(case, building=replace(case.building, devices=tuple(devices)))


#: Folder inside a case that holds what is the labelling page's own: draft, drawings, pictures, reports.
OWN_FOLDER = "labelling"

#: The page's own file in that folder.
DRAFT = "labelling.json"


def save_with_labels(case: Case, source: str | PathLike[str], path: str | PathLike[str], *, overwrite: bool) -> Path:
    """Save a case that was made of another, with what the labelling page keeps in that one.

    Parameters
    ----------
    case : Case
        To save.
    source : str or path
        Case folder that it was made of.
    path : str or path
        Folder to make; may be `source`.
    overwrite : bool
        Whether a case that is there already is replaced.

    Returns
    -------
    Path
        The folder.

    Raises
    ------
    CaseError
        One of its family: the folder holds something, or the case does not fit together.
    """
    own = Path(source) / OWN_FOLDER
    with tempfile.TemporaryDirectory() as work:
        kept = Path(work) / OWN_FOLDER
        if own.is_dir() and not own.is_symlink():
            shutil.copytree(own, kept, symlinks=True)
        folder = save_case(case, path, overwrite=overwrite)
        if kept.is_dir():
            shutil.copytree(kept, folder / OWN_FOLDER, symlinks=True)
    return folder


def held_work(path: str | PathLike[str]) -> tuple[str, ...]:
    """Say what a folder holds that a case made of drawings would not.

    Parameters
    ----------
    path : str or path
        Case folder, or one that is to become one.

    Returns
    -------
    tuple of str
        In words: work on the labelling page, devices, glazing, airflows, telemetry. Empty where nothing is there.
    """
    folder, found = Path(path), []
    draft = folder / OWN_FOLDER / DRAFT
    try:
        content = json.loads(draft.read_text(encoding="utf-8"))
        placed = sum(device.get("x") is not None for device in content["devices"])
        minutes = float(content["seconds"]) / 60.0
        found.append(
            f"{minutes:.0f} minutes of work on the labelling page (corrected walls and zones of "
            f"{len(content['floors'])} floors, {placed} devices put in their places)"
        )
    except FileNotFoundError:
        pass
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        found.append(f"a draft of the labelling page that cannot be read ({OWN_FOLDER}/{DRAFT})")
    if not (folder / NAME).is_file():
        return tuple(found)
    try:
        case = load_case(folder)
    except CaseError as error:
        return (*found, f"a case that does not load ({error})")
    building = case.building
    glazing = building.geometry.glazing if isinstance(building.geometry, FloorPlans) else {}
    counts = {"devices": len(building.devices), "zones with glazing": len(glazing), "airflows": len(building.airflows)}
    found += [f"{number} {what}" for what, number in counts.items() if number]
    values = int(case.telemetry.frame.notna().to_numpy().sum())
    return (*found, f"telemetry of {case.telemetry.frame.shape[1]} columns") if values else tuple(found)


def check_nothing_lost(path: str | PathLike[str]) -> None:
    """Refuse a folder whose case holds what a case made of drawings anew would not.

    Parameters
    ----------
    path : str or path
        Case folder, or one that is to become one.

    Raises
    ------
    PlanError
        It does; the message names all of it.
    """
    held = held_work(path)
    advice = "choose another folder, or correct the case with buildingmpc label; --force replaces all of it"
    PlanError.unless(not held, str(path), "nothing that would be lost", "; ".join(held), advice)


_WIDEST = 1600  # px of the picture's ground; text and marks are drawn as vectors
_EXTERIOR, _INTERIOR, _INK, _PAPER = (38, 43, 51), (110, 118, 130), (176, 184, 194), (255, 255, 255)
_GOLDEN = 0.381966  # -, of the circle of hues: neighbours in number are far apart in colour


def draw_floor(floor: ZonedFloor, devices: Sequence[Device] = ()) -> str:
    """Draw what was understood of a floor.

    Parameters
    ----------
    floor : ZonedFloor
        A floor.
    devices : sequence of Device
        Those of its zones are named in them.

    Returns
    -------
    str
        SVG: zones in colour with name and area, exterior walls dark, interior walls grey, doors circled in orange, what
        is drawn and no wall in light grey.
    """
    rows, columns = _built(floor)
    survey, pixel = floor.survey, floor.survey.pixel
    width, height = (s.stop - s.start for s in (columns, rows))
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" role="img" font-family="sans-serif">',
        f"<title>Floor {escape(floor.name)}: {len(floor.names)} zones</title>",
        f'<image width="{width}" height="{height}" href="{_ground(floor, rows, columns)}"/>',
    ]
    for door in survey.doors:
        x, y = door.centre[0] - columns.start, door.centre[1] - rows.start
        label = f"door, {door.width:.2f} m"
        parts.append(
            f'<circle cx="{x:.0f}" cy="{y:.0f}" r="{door.width / 2 / pixel:.0f}" fill="none" stroke="#e8710a" '
            f'stroke-width="{0.07 / pixel:.1f}"><title>{label}</title></circle>'
        )
    by_zone: dict[str, list[str]] = {}
    for device in devices:
        by_zone.setdefault(device.zone or "", []).append(device.name)
    for number, (name, area) in enumerate(floor.areas.items(), start=1):
        where = ndimage.find_objects((floor.zones == number).astype(np.int8))[0]
        x, y, half = innermost(floor.zones[where] == number, where)
        lines = [name, f"{area:.1f} m²", *by_zone.get(name, ())[:2]]
        size = min(0.5 / pixel, 3.0 * half / max(len(line) for line in lines), 1.8 * half / len(lines))
        for k, line in enumerate(lines):
            down = y - rows.start + (k - (len(lines) - 2) / 2) * 1.15 * size - 0.2 * size
            style = ' font-weight="bold"' if k == 0 else ""
            parts.append(
                f'<text x="{x - columns.start:.0f}" y="{down:.0f}" font-size="{size:.1f}" text-anchor="middle"{style}>'
                f"{escape(line)}</text>"
            )
    parts.append(_scale_bar(width, height, pixel))
    return "".join([*parts, "</svg>"])


def import_page(found: PlanImport, name: str, devices: DeviceImport | None = None) -> str:
    """Write a page of what was understood of a building.

    Parameters
    ----------
    found : PlanImport
        Plans of the building.
    name : str
        Of the building.
    devices : DeviceImport, optional
        Its devices.

    Returns
    -------
    str
        HTML in one file, without scripts: a picture a floor, zones with their areas, what needs a look.
    """
    import jinja2

    listed = devices.devices if devices is not None else ()
    template = files("thermal.plan").joinpath("templates/import.html").read_text(encoding="utf-8")
    environment = jinja2.Environment(autoescape=True, undefined=jinja2.StrictUndefined)
    floors: list[Mapping[str, Any]] = []
    for floor in found.floors:
        zones = [
            {"name": zone, "area": area, "error": 100.0 * found.area_errors[zone]} for zone, area in floor.areas.items()
        ]
        floors.append({"name": floor.name, "floor": floor, "picture": draw_floor(floor, listed), "zones": zones})
    return environment.from_string(template).render(
        name=name, found=found, floors=floors, devices=devices, tolerance=100.0 * AREA_TOLERANCE
    )


def _built(floor: ZonedFloor) -> tuple[slice, slice]:
    """Rows and columns of what is built, with a metre around it."""
    built = floor.survey.labels != OUTSIDE_LABEL
    margin = round(1.0 / floor.survey.pixel)
    found = []
    for axis, most in zip((1, 0), built.shape, strict=True):
        index = np.flatnonzero(built.any(axis=axis))
        found.append(slice(max(0, int(index[0]) - margin), min(most, int(index[-1]) + margin + 1)))
    return found[0], found[1]


def _ground(floor: ZonedFloor, rows: slice, columns: slice) -> str:
    """Colour what was understood; a PNG as the address of an image."""
    labels = floor.survey.labels
    _, exterior = split_walls(floor.survey)
    colours = np.array([_PAPER, *(_pastel(number) for number in range(len(floor.names)))], dtype=np.uint8)
    picture = colours[floor.zones]
    if floor.survey.ink is not None:
        picture[floor.survey.ink & (labels != WALL_LABEL)] = _INK
    picture[(labels == WALL_LABEL) & ~exterior] = _INTERIOR
    picture[exterior] = _EXTERIOR
    picture = picture[rows, columns]
    return "data:image/png;base64," + base64.b64encode(png_of(picture, _WIDEST, colours=256)).decode("ascii")


def png_of(picture: NDArray[np.uint8], widest: int, colours: int | None = None) -> bytes:
    """Write a picture as PNG, made smaller where it is too wide.

    Parameters
    ----------
    picture : ndarray of uint8, shape (n_row, n_col) or (n_row, n_col, 3)
        In grey or in colour.
    widest : int
        Longer side that is kept [px].
    colours : int, optional
        Number of colours that it is brought to.

    Returns
    -------
    bytes
        PNG.
    """
    step = max(1, -(-max(picture.shape[:2]) // widest))
    image = extra("PIL.Image").fromarray(np.ascontiguousarray(picture))
    if step > 1:
        image = image.reduce(step)
    if colours is not None:
        image = image.quantize(colors=colours)
    stream = io.BytesIO()
    image.save(stream, format="PNG", optimize=colours is not None)
    return stream.getvalue()


def _pastel(number: int) -> tuple[int, int, int]:
    red, green, blue = colorsys.hls_to_rgb((0.55 + _GOLDEN * number) % 1.0, 0.87, 0.55)
    return round(255 * red), round(255 * green), round(255 * blue)


def _scale_bar(width: int, height: int, pixel: float) -> str:
    length = next((m for m in (20, 10, 5, 2, 1) if m / pixel < width / 3), 1)
    x, y, size = 0.3 / pixel, height - 0.35 / pixel, 0.4 / pixel
    return (
        f'<path d="M{x:.0f} {y:.0f}h{length / pixel:.0f}" stroke="#262b33" stroke-width="{0.08 / pixel:.1f}"/>'
        f'<text x="{x:.0f}" y="{y - 0.12 / pixel:.0f}" font-size="{size:.1f}" fill="#262b33">{length} m</text>'
    )
