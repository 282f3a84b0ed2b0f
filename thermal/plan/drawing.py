"""Drawings as grey pixels, and their scale."""

import math
import re
import tempfile
import warnings
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from thermal.case.building import Entry
from thermal.errors import OversizedFileError, PlanError
from thermal.plan.guard import check_pixels, checked_file, checked_number, extra, run_program

Finite = Annotated[float, Field(allow_inf_nan=False)]
Point = tuple[Finite, Finite]

#: Range of scales that are believed [m/px]: a detail at 1:20 and 600 dots per inch, walls of one pixel.
FINEST, COARSEST = 5e-4, 0.5


def scale_from_points(first: Point, second: Point, distance: float) -> float:
    """Scale of a drawing from two points of it, two clicks, and how far apart they are in the building.

    Parameters
    ----------
    first, second : tuple of float
        Column and row of each [px].
    distance : float
        Between them [m].

    Returns
    -------
    float
        [m/px].

    Raises
    ------
    PlanError
        The points coincide, the distance is not positive, or no building is drawn at that scale.

    Examples
    --------
    >>> scale_from_points((100, 50), (500, 50), 8.0)
    0.02
    """
    numbers = (*first, *second, distance)
    if not all(math.isfinite(x) for x in numbers):
        raise PlanError("scale", "two points and a distance, finite", repr(numbers))
    return scale_from_length(math.dist(first, second), distance)


def scale_from_length(pixels: float, length: float) -> float:
    """Scale of a drawing from a length on it that is known, such as a dimension line's.

    Parameters
    ----------
    pixels : float
        Length on the drawing [px].
    length : float
        The same in the building [m].

    Returns
    -------
    float
        [m/px].

    Raises
    ------
    PlanError
        One is not positive, or no building is drawn at that scale.

    Examples
    --------
    >>> scale_from_length(500.0, 12.5)
    0.025
    """
    if not (pixels > 0 and length > 0):
        raise PlanError("scale", "a positive length in px and in m", f"{pixels} px and {length} m")
    return checked_scale(length / pixels)


def scale_from_paper(ratio: float, dots_per_inch: float) -> float:
    """Scale of a page that was printed to scale.

    Parameters
    ----------
    ratio : float
        100 for 1:100 [-].
    dots_per_inch : float
        Resolution of the drawing [1/inch].

    Returns
    -------
    float
        [m/px].

    Raises
    ------
    PlanError
        One is not positive, or no building is drawn at that scale.

    Examples
    --------
    >>> round(scale_from_paper(100, 150), 5)
    0.01693
    """
    return scale_from_length(dots_per_inch, 0.0254 * ratio)


def checked_scale(metres_per_pixel: float) -> float:
    """Refuse a scale at which no building is drawn.

    Parameters
    ----------
    metres_per_pixel : float
        Scale [m/px].

    Returns
    -------
    float
        The same [m/px].

    Raises
    ------
    PlanError
        It is out of the range of plans.
    """
    advice, expected = "are points in pixels and distances in metres?", f"{FINEST:g} to {COARSEST:g} m for a pixel"
    PlanError.unless(FINEST <= metres_per_pixel <= COARSEST, "scale", expected, f"{metres_per_pixel:g} m", advice)
    return metres_per_pixel


RASTER_KINDS = (".png", ".jpg", ".jpeg", ".pdf")

#: Resolution at which pages of a PDF are drawn unless told otherwise [dots per inch]: 1 px is 1.7 cm at 1:100.
DOTS_PER_INCH = 150.0


@dataclass(frozen=True, eq=False)
class Drawing:
    """A raster drawing.

    Parameters
    ----------
    grey : ndarray of uint8, shape (n_row, n_col)
        0 black, 255 white; transparent is white.
    source : str
        File and page, for messages and pictures.
    dots_per_inch : float or None
        Resolution of a PDF's page [1/inch]; None for images, whose notes on it are seldom right.
    corner : tuple of float
        Column and row of the whole drawing at which this part of it begins [px].
    """

    grey: NDArray[np.uint8]
    source: str
    dots_per_inch: float | None = None
    corner: tuple[float, float] = (0.0, 0.0)


def read_drawing(
    path: str | PathLike[str],
    *,
    page: int = 1,
    dots_per_inch: float = DOTS_PER_INCH,
    crop: tuple[int, int, int, int] | None = None,
) -> Drawing:
    """Read a raster drawing.

    Parameters
    ----------
    path : str or path
        PNG, JPEG or PDF; pages of a PDF are drawn by ``pdftoppm`` (Debian's poppler-utils).
    page : int
        Page of a PDF, from 1.
    dots_per_inch : float
        Resolution of a PDF's page [1/inch], 20 to 600.
    crop : tuple of int, optional
        Left, top, right, bottom [px] of the part that is one floor's plan, without frame and title block.

    Returns
    -------
    Drawing
        In grey.

    Raises
    ------
    PlanError
        The file is not what its name says, or damaged, or has no such page.
    OversizedFileError
        It has, or unpacks to, more than any real plan.
    MissingExtraError
        Pillow or ``pdftoppm`` is not installed.
    PlanError
        `page`, `dots_per_inch` or `crop` does not fit.
    """
    file = checked_file(Path(path), RASTER_KINDS)
    if isinstance(page, bool) or not isinstance(page, int) or page < 1:
        raise PlanError("page", "a number from 1", repr(page))
    if file.suffix.lower() == ".pdf":
        dpi: float | None = checked_number(dots_per_inch, "dots_per_inch", 20.0, 600.0, "1/inch")
        grey, source = _pdf_page(file, page, dots_per_inch), f"{file.name} page {page}"
    else:
        dpi, grey, source = None, _image(file), file.name
    if crop is None:
        return Drawing(grey, source, dpi)
    left, top, right, bottom = _checked_crop(crop, grey.shape)
    return Drawing(grey[top:bottom, left:right], source, dpi, (float(left), float(top)))


def _image(file: Path) -> NDArray[np.uint8]:
    """Decode an image, after a look at its size."""
    image_of = extra("PIL.Image")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # Pillow warns of a bomb at a size of its own; ours is checked below
        try:
            with image_of.open(file, formats=("PNG", "JPEG")) as image:
                check_pixels(image.width, image.height, file.name)
                if image.mode in ("RGBA", "LA", "PA") or "transparency" in image.info:
                    image = image.convert("RGBA")
                    white = image_of.new("RGBA", image.size, "white")
                    image = image_of.alpha_composite(white, image)
                elif image.mode.startswith(("I", "F")):  # 16 bits: Pillow would clip, not scale, them
                    image = image.point(lambda value: value / 256.0).convert("L")
                return np.asarray(image.convert("L"), dtype=np.uint8)
        except (image_of.DecompressionBombError, MemoryError) as error:
            raise OversizedFileError(file.name, "an image of a plan", str(error), "export it anew") from error
        except (OSError, SyntaxError, ValueError, TypeError) as error:  # Pillow has all of them for damaged files
            found = " ".join(str(error).replace(str(file), file.name).split())
            raise PlanError(file.name, f"a whole {file.suffix[1:].upper()} image", found) from error


def _pdf_page(file: Path, page: int, dpi: float) -> NDArray[np.uint8]:
    """Draw a page of a PDF in grey, after a look at its size."""
    report = _poppler(["pdfinfo", "-f", str(page), "-l", str(page), str(file)], file)
    size = re.search(r"^Page\s+\d+ size:\s+([\d.e+]+) x ([\d.e+]+) pts", report, re.MULTILINE)
    pages = re.search(r"^Pages:\s+(\d+)", report, re.MULTILINE)
    if size is None or pages is None or int(pages[1]) < page:
        raise PlanError(file.name, f"a page {page}", f"{pages[1]} pages" if pages else "none")
    check_pixels(float(size[1]) * dpi / 72.0, float(size[2]) * dpi / 72.0, f"{file.name} page {page}")
    with tempfile.TemporaryDirectory() as folder:
        target = Path(folder) / "page"
        pages_wanted = ["-f", str(page), "-l", str(page), "-singlefile"]
        _poppler(["pdftoppm", "-r", f"{dpi:g}", *pages_wanted, "-gray", "-png", str(file), str(target)], file)
        drawn = target.with_suffix(".png")
        PlanError.unless(drawn.is_file(), file.name, f"a page {page} that can be drawn", "nothing drawn")
        return _image(drawn)


def _poppler(command: list[str], file: Path) -> str:
    return run_program(command, file, "a whole PDF file with that page", "poppler-utils")


def _checked_crop(crop: tuple[int, int, int, int], shape: tuple[int, ...]) -> tuple[int, int, int, int]:
    """Refuse a crop that is no part of the drawing."""
    whole = len(crop) == 4 and all(isinstance(x, int) and not isinstance(x, bool) for x in crop)
    if not whole or not (0 <= crop[0] < crop[2] <= shape[1] and 0 <= crop[1] < crop[3] <= shape[0]):
        raise PlanError("crop", f"left, top, right, bottom within {shape[1]} x {shape[0]} px", repr(tuple(crop)))
    return crop


class DrawingScale(Entry):
    """Scale of a raster drawing, in one of four ways.

    Parameters
    ----------
    points
        Two points of the drawing [px]; with `distance`.
    distance
        Between them [m].
    pixels
        A length on the drawing [px]; with `length`.
    length
        The same in the building [m].
    paper
        100 for a page of a PDF at 1:100 [-].
    metres_per_pixel
        [m/px].
    """

    points: tuple[Point, Point] | None = None
    distance: Finite | None = None
    pixels: Finite | None = None
    length: Finite | None = None
    paper: Finite | None = None
    metres_per_pixel: Finite | None = None

    def of(self, drawing: Drawing) -> float:
        """Scale of a drawing.

        Parameters
        ----------
        drawing
            The drawing; its resolution counts for `paper`.

        Returns
        -------
        float
            [m/px].

        Raises
        ------
        PlanError
            There is none, or there are several, or it makes no building of the drawing.
        """
        given = [key for key, value in self if value is not None]
        if given == ["points", "distance"] and self.points is not None and self.distance is not None:
            return scale_from_points(*self.points, self.distance)
        if given == ["pixels", "length"] and self.pixels is not None and self.length is not None:
            return scale_from_length(self.pixels, self.length)
        if given == ["metres_per_pixel"] and self.metres_per_pixel is not None:
            return scale_from_length(1.0, self.metres_per_pixel)
        if given == ["paper"] and self.paper is not None:
            if drawing.dots_per_inch is None:
                raise PlanError(f"{drawing.source}: scale", "a page of a PDF for 'paper'", "an image")
            return scale_from_paper(self.paper, drawing.dots_per_inch)
        expected = "points and distance, or pixels and length, or paper, or metres_per_pixel"
        raise PlanError(f"{drawing.source}: scale", expected, ", ".join(given) or "none")
