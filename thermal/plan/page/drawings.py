"""Uploaded drawings, and the floors that are read from them."""

import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import TracebackType
from typing import Self

import numpy as np
from numpy.typing import NDArray

from thermal.case.building import OUTSIDE, PLAN_TOKENS, FloorPlans
from thermal.case.plan import facade_areas
from thermal.errors import OversizedFileError, PlanError
from thermal.plan.assemble import align_floors, assemble_plans
from thermal.plan.cells import ZonedFloor, distinct_names, draw_cells
from thermal.plan.drawing import RASTER_KINDS, read_drawing
from thermal.plan.folder import png_of
from thermal.plan.guard import MOST_BYTES, checked_file, inside_folder
from thermal.plan.list import FloorEntry, read_floor
from thermal.plan.page.draft import Draft, DraftFloor, Picture, encode_floor, zones_of
from thermal.plan.page.jobs import Progress
from thermal.plan.page.store import write_whole
from thermal.plan.survey import CODE_KINDS, OUTSIDE_LABEL, WALL_LABEL, FloorSurvey, read_codes
from thermal.plan.vector import VECTOR_KINDS
from thermal.plan.windows import clipped_glazing
from thermal.plan.words import can_read_pictures

DRAWING_KINDS = (*RASTER_KINDS, *VECTOR_KINDS, *CODE_KINDS)
DEVICE_KINDS = (".csv", ".ttl", ".json", ".zinc")

#: Longer side of what lies under the plan [px].
WIDEST_PICTURE = 3000
_TRIAL_CELL = 0.5  # m: codes are read once at any size to see that they are codes


@dataclass(frozen=True)
class _Sheet:
    """A drawing that was taken in.

    Parameters
    ----------
    file : str
        Its name in the folder of drawings.
    kind : str
        ``raster``, ``vector`` or ``codes``.
    width, height : float
        Of a raster drawing [px]; else 0.
    dots_per_inch : float or None
        Of a page of a PDF [1/inch].
    read_text : bool or None
        Whether names of rooms can be read from a picture here; None of a drawing that is none.
    """

    file: str
    kind: str
    width: float = 0.0
    height: float = 0.0
    dots_per_inch: float | None = None
    read_text: bool | None = None


def checked_name(name: str, kinds: tuple[str, ...]) -> str:
    """Refuse the name of an upload that is more than a name, or of another kind.

    Parameters
    ----------
    name : str
        As the browser sent it.
    kinds : tuple of str
        Suffixes that will do.

    Returns
    -------
    str
        The same.

    Raises
    ------
    PlanError
        It leads elsewhere.
    PlanError
        It has another suffix, or is none.
    """
    if any(sign in name for sign in "/\\\0") or name.startswith(".") or not name.isprintable() or len(name) > 150:
        raise PlanError("upload", "the plain name of a file", repr(name[:200]), "rename the file")
    suffix = Path(name).suffix.lower()
    advice = "unpack it first" if suffix == ".zip" else "export it as one of these"
    PlanError.unless(suffix in kinds, name, f"a file that ends in {', '.join(kinds)}", repr(suffix or name), advice)
    return name


class Upload:
    """A file on its way in, to be kept only when it is what its name says.

    Parameters
    ----------
    folder : Path
        Folder of the page's own, in which it is looked at.
    name : str
        As the browser sent it.
    kinds : tuple of str
        Suffixes that will do.

    Raises
    ------
    PlanError
        The name leads elsewhere.
    PlanError
        It has another suffix, or is none.
    """

    def __init__(self, folder: Path, name: str, kinds: tuple[str, ...]) -> None:
        self._target = inside_folder(folder, checked_name(name, kinds), "upload")
        self._place = tempfile.TemporaryDirectory(prefix=".upload-", dir=folder)
        self.path = Path(self._place.name) / name
        self._size = 0
        self._stream = self.path.open("wb")

    def __enter__(self) -> Self:
        return self

    def write(self, chunk: bytes) -> None:
        """Take a part of it, and stop when it is more than any real plan.

        Parameters
        ----------
        chunk : bytes
            What was given.

        Raises
        ------
        OversizedFileError
            It is more than `MOST_BYTES` by now.
        """
        self._size += len(chunk)
        expected, where = f"at most {MOST_BYTES / 1e6:.0f} MB", self.path.name
        OversizedFileError.unless(self._size <= MOST_BYTES, where, expected, "more", "export it anew, or crop it")
        self._stream.write(chunk)

    def close(self) -> Path:
        """Finish writing.

        Returns
        -------
        Path
            The file, until the end of the block.
        """
        self._stream.close()
        return self.path

    def keep_drawing(self) -> _Sheet:
        """Look at it, and keep it; it replaces one of the same name.

        Returns
        -------
        _Sheet
            The drawing.

        Raises
        ------
        PlanError
            One of its family, by what is wrong; nothing is kept then.
        """
        sheet = look_at(self.close())
        self.keep()
        return sheet

    def keep(self) -> Path:
        """Keep it as it is, in place of one of the same name.

        Returns
        -------
        Path
            Where it is now.
        """
        self.path.replace(self._target)
        return self._target

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._stream.close()
        self._place.cleanup()


def look_at(path: Path, page: int = 1, dots_per_inch: float = 150.0) -> _Sheet:
    """Look at a drawing: all of an image, the first bytes of others.

    Parameters
    ----------
    path : Path
        Drawing.
    page : int
        Of a PDF, from 1 [-].
    dots_per_inch : float
        Of a PDF's page [1/inch].

    Returns
    -------
    _Sheet
        What it is.

    Raises
    ------
    PlanError
        One of its family, by what is wrong.
    """
    file = checked_file(path, DRAWING_KINDS)
    kind = file.suffix.lower()
    if kind in RASTER_KINDS:
        drawing = read_drawing(file, page=page, dots_per_inch=dots_per_inch)
        height, width = drawing.grey.shape
        return _Sheet(file.name, "raster", width, height, drawing.dots_per_inch, can_read_pictures())
    if kind in CODE_KINDS:
        read_codes(file, _TRIAL_CELL)
        return _Sheet(file.name, "codes")
    return _Sheet(file.name, "vector")


_INK, _WALL, _PAPER = 90, 150, 255  # greys of the picture of a drawing that is no image


@dataclass(frozen=True)
class _NewFloors:
    """Floors with those that were made of drawings.

    Parameters
    ----------
    floors : tuple of DraftFloor
        All of one shape, lowest first; the new ones last.
    cell_size : float
        Side of a cell [m].
    shift : tuple of int
        Columns and rows by which what was there has moved [cells].
    orientation : float or None
        To add to the draft's, when these are its first floors [deg].
    remarks : tuple of str
        What a look at the page should confirm.
    glazing : mapping
        Windows that the new drawings show: area by zone and facade [m2].
    """

    floors: tuple[DraftFloor, ...]
    cell_size: float
    shift: tuple[int, int] = (0, 0)
    orientation: float | None = None
    remarks: tuple[str, ...] = ()
    glazing: Mapping[str, Mapping[str, float]] = field(default_factory=dict)


def add_floors(
    draft: Draft, entries: Sequence[FloorEntry], own: Path, cell_size: float | None, progress: Progress
) -> _NewFloors:
    """Make floors of drawings, beside those that a draft has.

    Parameters
    ----------
    draft : Draft
        What is on the page; its floors are kept as they are, on the same grid.
    entries : sequence of FloorEntry
        Drawings, lowest first.
    own : Path
        The page's own folder, with the drawings.
    cell_size : float or None
        Side of a cell [m] for the first floors; None chooses it by the areas of the rooms.
    progress : callable
        Told stage, steps done and all steps.

    Returns
    -------
    _NewFloors
        All floors.

    Raises
    ------
    PlanError
        One of its family, for the first thing that does not fit.
    """
    taken = {floor.name for floor in draft.floors}
    for entry in entries:
        if entry.name in taken:
            raise PlanError("floors: name", "a name of its own", repr(entry.name), "choose another")
        taken.add(entry.name)
    zoned = []
    for number, entry in enumerate(entries):
        progress(f"finding rooms of {entry.name}", number, len(entries) + 1)
        zoned.append(read_floor(entry, own / "drawings"))
    progress("drawing walls on the grid", len(entries), len(entries) + 1)
    if draft.floors:
        return _beside(draft, entries, zoned, own)
    found = assemble_plans(zoned, cell_size=cell_size)
    floors = [
        encode_floor(
            plan.name, plan.height, plan.tokens, entry, _picture(entry, floor, found.corner, found.plans.cell_size, own)
        )
        for plan, entry, floor in zip(found.plans.floors, entries, found.floors, strict=True)
    ]
    turned, glazing = found.floors[0].survey.turned, found.plans.glazing
    return _NewFloors(tuple(floors), found.plans.cell_size, orientation=turned, remarks=found.remarks, glazing=glazing)


def _beside(draft: Draft, entries: Sequence[FloorEntry], zoned: Sequence[ZonedFloor], own: Path) -> _NewFloors:
    """Draw new floors on the grid of those that are there; these are moved at most, never drawn again."""
    size = draft.cell_size
    base = _as_surveyed(draft.floors[0], size)
    placed = align_floors((base, *distinct_names(zoned, zones_of(draft.floors))))[1:]
    left, top = (min(floor.offset[axis] for floor in placed) for axis in (0, 1))
    phase = ((-left / size) % 1.0, (-top / size) % 1.0)
    plans, corner = draw_cells(placed, size, phase)
    column, row = round(corner[0] / size), round(corner[1] / size)
    shift = (max(0, -column), max(0, -row))
    rows = max(shift[1] + draft.floors[0].rows, shift[1] + row + plans[0].tokens.shape[0])
    columns = max(shift[0] + draft.floors[0].columns, shift[0] + column + plans[0].tokens.shape[1])
    kept = [_moved(floor, shift, (rows, columns)) for floor in draft.floors]
    origin = (-shift[0] * size, -shift[1] * size)
    new = [
        encode_floor(
            plan.name,
            plan.height,
            _framed(plan.tokens, (shift[0] + column, shift[1] + row), (rows, columns)),
            entry,
            _picture(entry, floor, origin, size, own),
        )
        for plan, entry, floor in zip(plans, entries, placed, strict=True)
    ]
    remarks = tuple(f"floor {f.name!r}: {remark}" for f in placed for remark in f.survey.remarks)
    drawn = {zone: sides for floor in placed for zone, sides in floor.glazing.items()}
    glazing = clipped_glazing(drawn, facade_areas(FloorPlans(size, tuple(plans)))) if drawn else {}
    return _NewFloors((*kept, *new), size, shift, remarks=remarks, glazing=glazing)


def _as_surveyed(floor: DraftFloor, cell_size: float) -> ZonedFloor:
    """See a plan of cells as a drawing of one element a cell, to bring others above it."""
    zones = np.where(np.isin(floor.tokens, PLAN_TOKENS[:2]), 0, 1).astype(np.int32)
    labels = np.where(floor.tokens == OUTSIDE, OUTSIDE_LABEL, zones).astype(np.int32)
    return ZonedFloor(floor.name, floor.height, FloorSurvey(floor.name, labels, cell_size, ()), zones, ("all",))


def _framed(tokens: NDArray[np.str_], corner: tuple[int, int], shape: tuple[int, int]) -> NDArray[np.str_]:
    """Put a plan into a larger one."""
    framed = np.full(shape, OUTSIDE, dtype=tokens.dtype)
    framed[corner[1] : corner[1] + tokens.shape[0], corner[0] : corner[0] + tokens.shape[1]] = tokens
    return framed


def _moved(floor: DraftFloor, shift: tuple[int, int], shape: tuple[int, int]) -> DraftFloor:
    picture = floor.picture
    if picture is not None:
        a, b, c, d, e, f = picture.matrix
        picture = picture.model_copy(update={"matrix": (a, b, c, d, e + shift[0], f + shift[1])})
    return encode_floor(floor.name, floor.height, _framed(floor.tokens, shift, shape), floor.drawing, picture)


def _picture(entry: FloorEntry, floor: ZonedFloor, corner: tuple[float, float], cell_size: float, own: Path) -> Picture:
    """Save what lies under the plan: the image as it is, or what was understood of lines and codes."""
    survey, file = floor.survey, own / "drawings" / entry.file
    pixel = np.array([[survey.pixel, 0.0, floor.offset[0]], [0.0, survey.pixel, floor.offset[1]], [0.0, 0.0, 1.0]])
    to_cells = np.array([[1.0, 0.0, -corner[0]], [0.0, 1.0, -corner[1]], [0.0, 0.0, cell_size]]) / cell_size
    matrix = to_cells @ pixel
    if file.suffix.lower() in RASTER_KINDS:
        grey = read_drawing(file, page=entry.page, dots_per_inch=entry.dots_per_inch).grey
        # A pixel's number is that of its middle, which lies half a pixel from the picture's edge.
        half = np.array([[1.0, 0.0, 0.5], [0.0, 1.0, 0.5], [0.0, 0.0, 1.0]])
        placement = np.eye(3) if survey.placement is None else survey.placement
        matrix = matrix @ half @ placement @ np.linalg.inv(half)
    else:
        grey = np.where(survey.labels == WALL_LABEL, _WALL, _PAPER).astype(np.uint8)
        if survey.ink is not None:
            grey[survey.ink] = _INK
    name = f"{Path(entry.file).stem}_{entry.page}.png"
    write_whole(own / "pictures" / name, png_of(grey, WIDEST_PICTURE))
    height, width = grey.shape
    a, c, e, b, d, f = (float(x) for x in matrix[:2].ravel())
    return Picture(file=name, width=width, height=height, matrix=(a, b, c, d, e, f))
