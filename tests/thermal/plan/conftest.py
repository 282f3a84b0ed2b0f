"""An office whose rooms are known, drawn as an image, as a page of a PDF and as a DXF."""

from __future__ import annotations

import math
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest

pytest.importorskip("skimage", reason="needs the extra [plan]")
pytest.importorskip("shapely", reason="needs the extra [plan]")
pytest.importorskip("ezdxf", reason="needs the extra [plan]")

from PIL import Image, ImageDraw

Box = tuple[float, float, float, float]  # left, top, right, bottom [m]

MARGIN = 1.5  # m of paper around the building
THIN = 0.02  # m, width of the lines of doors' leaves, windows and furniture
INNER: Box = (0.0, 0.0, 18.0, 11.0)  # the inner face of the exterior wall
OUTER: Box = (-0.3, -0.3, 18.3, 11.3)
PARTITIONS: tuple[Box, ...] = (
    (0.0, 4.9, 18.0, 5.0), (0.0, 6.6, 18.0, 6.7), (4.0, 0.0, 4.1, 4.9), (8.4, 0.0, 8.5, 4.9), (13.0, 0.0, 13.1, 4.9),
    (6.0, 6.7, 6.1, 11.0), (12.0, 6.7, 12.1, 11.0), (16.1, 6.7, 16.2, 8.8), (16.1, 8.7, 18.0, 8.8),
)  # fmt: skip
DOORS: tuple[Box, ...] = (
    *((x, 4.9, x + 0.9, 5.0) for x in (1.0, 6.0, 10.0, 14.0)),
    *((x, 6.6, x + 0.9, 6.7) for x in (3.0, 8.0, 13.0)),
    (16.6, 8.7, 17.4, 8.8),
    (-0.3, 5.4, 0.0, 6.4),
)
WINDOWS: tuple[Box, ...] = tuple((x, -0.3, x + 2.0, 0.0) for x in (1.0, 5.0, 9.5, 14.5))

#: Clear area of each room [m2], row by row.
CLEAR = (4.0 * 4.9, 4.3 * 4.9, 4.5 * 4.9, 4.9 * 4.9, 18.0 * 1.6, 6.0 * 4.3, 5.9 * 4.3, 5.9 * 4.3 - 1.9 * 2.1, 1.8 * 2.0)

#: Area of each zone with half of its partitions [m2], row by row; the closet is part of the last.
GROSS = (4.05 * 4.95, 4.4 * 4.95, 4.6 * 4.95, 4.95 * 4.95, 18.0 * 1.7, 6.05 * 4.35, 6.0 * 4.35, 5.95 * 4.35)


@dataclass(frozen=True)
class Sheet:
    """An image of the office, and where two points of it are."""

    image: Image.Image
    metres_per_pixel: float
    points: tuple[tuple[float, float], tuple[float, float]]
    distance: float


def draw(pixels_per_metre: float, turn: float = 0.0, fine: int = 4) -> Sheet:
    """Draw the office as an anti-aliased image, turned counterclockwise."""
    scale = pixels_per_metre * fine
    size = [round(scale * (OUTER[i + 2] - OUTER[i] + 2 * MARGIN) / fine) * fine for i in (0, 1)]
    image = Image.new("L", size, 255)
    pen = ImageDraw.Draw(image)

    def at(x: float, y: float) -> tuple[float, float]:
        return scale * (x - OUTER[0] + MARGIN), scale * (y - OUTER[1] + MARGIN)

    def box(b: Box, shade: int) -> None:
        (left, top), (right, bottom) = at(b[0], b[1]), at(b[2], b[3])
        pen.rectangle([round(left), round(top), round(right) - 1, round(bottom) - 1], fill=shade)

    box(OUTER, 0)
    box(INNER, 255)
    for wall in PARTITIONS:
        box(wall, 0)
    width = max(1, round(THIN * scale))
    for door in DOORS:
        box(door, 255)
        if door[3] - door[1] < 0.2:
            hinge, length = (door[0], door[1]), door[2] - door[0]
            pen.line([at(*hinge), at(hinge[0], hinge[1] - length)], fill=0, width=width)
            corners = [*at(hinge[0] - length, hinge[1] - length), *at(hinge[0] + length, hinge[1] + length)]
            pen.arc(corners, 270, 360, fill=0, width=width)
    for window in WINDOWS:
        box(window, 255)
        for y in (-0.3, -0.15, -THIN):
            box((window[0], y, window[2], y + THIN), 0)
    pen.text(at(1.0, 2.0), "OFFICE 1.01", fill=0, font_size=0.35 * scale)
    pen.rectangle([*at(9.0, 8.0), *at(10.6, 8.8)], outline=0, width=width)  # a table
    pen.rectangle([*at(3.0, 9.0), *at(3.4, 9.4)], fill=0)  # a column
    image = image.resize((size[0] // fine, size[1] // fine), Image.Resampling.BOX)
    points = [tuple(c / fine for c in at(*p)) for p in ((0.0, 0.0), (18.0, 0.0))]
    if turn:
        middle = (image.width / 2, image.height / 2)
        image = image.rotate(turn, Image.Resampling.BICUBIC, expand=True, fillcolor=255)
        cosine, sine = math.cos(math.radians(turn)), math.sin(math.radians(turn))
        points = [
            (
                image.width / 2 + cosine * (x - middle[0]) + sine * (y - middle[1]),
                image.height / 2 - sine * (x - middle[0]) + cosine * (y - middle[1]),
            )
            for x, y in points
        ]
    return Sheet(image, 1.0 / pixels_per_metre, (points[0], points[1]), 18.0)  # type: ignore[arg-type]


@pytest.fixture(scope="session")
def office() -> Callable[..., Sheet]:
    """Draw the office as an image."""
    return draw


@pytest.fixture(scope="session")
def office_pdf(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Draw the office as vectors on the second page of a PDF, at 1:100."""
    if shutil.which("pdftoppm") is None:
        pytest.skip("needs pdftoppm (Debian's poppler-utils)")
    from matplotlib.backends.backend_pdf import PdfPages
    from matplotlib.figure import Figure
    from matplotlib.patches import Rectangle

    path = tmp_path_factory.mktemp("pdf") / "office.pdf"
    size = [(OUTER[i + 2] - OUTER[i] + 2 * MARGIN) / 100 / 0.0254 for i in (0, 1)]
    with PdfPages(path) as pages:
        cover = Figure(figsize=(4, 3))
        cover.text(0.1, 0.5, "Cover sheet")
        pages.savefig(cover)
        figure = Figure(figsize=size)
        axes = figure.add_axes((0, 0, 1, 1))
        axes.set_xlim(OUTER[0] - MARGIN, OUTER[2] + MARGIN)
        axes.set_ylim(OUTER[3] + MARGIN, OUTER[1] - MARGIN)
        axes.axis("off")
        for b, shade in [(OUTER, "k"), (INNER, "w"), *((w, "k") for w in PARTITIONS), *((d, "w") for d in DOORS)]:
            axes.add_patch(Rectangle((b[0], b[1]), b[2] - b[0], b[3] - b[1], facecolor=shade, edgecolor="none"))
        axes.text(1.0, 2.0, "Office 1.01", fontsize=8)
        pages.savefig(figure)
    return path


@pytest.fixture(scope="session")
def office_dxf(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., Path]:
    """Write the office as a DXF: faces of walls as lines, doors as blocks, names as texts."""
    import ezdxf
    import shapely
    from ezdxf import units

    def write(unit: str = "MM", turn: float = 0.0) -> Path:
        metres = {"MM": 0.001, "IN": 0.0254, "M": 1.0}[unit]
        document = ezdxf.new()
        document.units = getattr(units, unit)
        space = document.modelspace()
        leaf = document.blocks.new("DOOR")
        leaf.add_line((0, 0), (0, 1), dxfattribs={"layer": "A-DOOR"})
        leaf.add_arc((0, 0), 1, 0, 90, dxfattribs={"layer": "A-DOOR"})
        solid = shapely.box(*OUTER) - shapely.box(*INNER)
        solid = shapely.unary_union([solid, *(shapely.box(*wall) for wall in PARTITIONS)])
        solid -= shapely.unary_union([shapely.box(*door) for door in DOORS])
        solid = shapely.affinity.rotate(shapely.affinity.scale(solid, 1, -1, origin=(0, 0)), turn, origin=(0, 0))
        for part in getattr(solid, "geoms", [solid]):
            for ring in (part.exterior, *part.interiors):
                points = [(x / metres, y / metres) for x, y in ring.coords[:-1]]
                space.add_lwpolyline(points, close=True, dxfattribs={"layer": "A-WALL"})
        cosine, sine = math.cos(math.radians(turn)), math.sin(math.radians(turn))

        def at(x: float, y: float) -> tuple[float, float]:
            return (cosine * x + sine * y) / metres, (sine * x - cosine * y) / metres

        for door in DOORS[:8]:
            size = (door[2] - door[0]) / metres
            attributes = {"xscale": size, "yscale": size, "zscale": 1, "rotation": turn}
            space.add_blockref("DOOR", at(door[0], door[1]), dxfattribs=attributes)
        names = ("A", "B", "C", "D", "corridor", "E", "F", "G")
        places = ((2, 2), (6, 2), (10, 2), (15, 2), (9, 5.8), (2, 9), (9, 9), (13.5, 10))
        for name, place in zip(names, places, strict=True):
            space.add_text(name, height=0.3 / metres, dxfattribs={"insert": at(*place), "layer": "A-TEXT"})
        path = tmp_path_factory.mktemp("dxf") / "office.dxf"
        document.saveas(path)
        return path

    return write


@dataclass(frozen=True)
class Truth:
    """What the office is, whatever it is drawn with."""

    clear: tuple[float, ...] = CLEAR
    gross: tuple[float, ...] = GROSS
    doors: tuple[Box, ...] = DOORS


@pytest.fixture(scope="session")
def truth() -> Truth:
    """Areas and doors of the office."""
    return Truth()
