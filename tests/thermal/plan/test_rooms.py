"""Rooms of raster drawings come out as they were drawn, at any resolution and angle."""

from __future__ import annotations

import io
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from thermal.errors import PlanError
from thermal.plan.cells import propose_zones
from thermal.plan.drawing import Drawing, read_drawing, scale_from_paper, scale_from_points
from thermal.plan.rooms import find_rooms
from thermal.plan.survey import PlanSettings

Office = Callable[..., Any]


def grey(image: Image.Image, quality: int | None = None) -> Drawing:
    """Make a drawing of an image, by way of a JPEG where a quality is given."""
    if quality is not None:
        stream = io.BytesIO()
        image.save(stream, "JPEG", quality=quality)
        with Image.open(io.BytesIO(stream.getvalue())) as opened:
            return Drawing(np.asarray(opened.convert("L")), "office.jpg")
    return Drawing(np.asarray(image), "office.png")


def errors(found: list[float], wanted: tuple[float, ...]) -> float:
    """Largest relative error of areas, largest with largest."""
    assert len(found) == len(wanted)
    return max(abs(a / b - 1.0) for a, b in zip(sorted(found), sorted(wanted), strict=True))


@pytest.mark.parametrize(
    ("pixels_per_metre", "turn", "quality"), [(50, 0.0, None), (40, -11.4, 55), (36, 3.2, 80), (100, 0.0, 30)]
)
def test_an_image_gives_its_rooms(
    office: Office, truth: Any, pixels_per_metre: int, turn: float, quality: int | None
) -> None:
    drawn = office(pixels_per_metre, turn)
    scale = scale_from_points(*drawn.points, drawn.distance)
    assert scale == pytest.approx(drawn.metres_per_pixel, rel=2e-3)
    survey = find_rooms(grey(drawn.image, quality), scale)
    assert errors([room.area for room in survey.rooms], truth.clear) < 0.02
    assert survey.turned == pytest.approx(-turn, abs=0.15)
    assert len(survey.doors) == len(truth.doors)
    zones = propose_zones(survey, "F1", 3.0)
    assert errors(list(zones.areas.values()), truth.gross) < 0.02


def test_a_page_of_a_pdf_gives_its_rooms(office_pdf: Path, truth: Any) -> None:
    drawing = read_drawing(office_pdf, page=2)
    assert drawing.dots_per_inch is not None
    survey = find_rooms(drawing, scale_from_paper(100, drawing.dots_per_inch))
    assert errors([room.area for room in survey.rooms], truth.clear) < 0.02
    assert errors(list(propose_zones(survey, "F1", 3.0).areas.values()), truth.gross) < 0.02


def test_white_on_black_is_the_same(office: Office, truth: Any) -> None:
    drawn = office(36)
    survey = find_rooms(Drawing(255 - np.asarray(drawn.image), "negative"), drawn.metres_per_pixel)
    assert errors([room.area for room in survey.rooms], truth.clear) < 0.02


def test_points_of_the_drawing_are_found_again(office: Office) -> None:
    drawn = office(36, 3.2)
    survey = find_rooms(grey(drawn.image), drawn.metres_per_pixel)
    (x0, y0), (x1, y1) = (survey.place(point) for point in drawn.points)
    assert (x1 - x0) * survey.pixel == pytest.approx(18.0, abs=0.1)
    assert y0 == pytest.approx(y1, abs=0.15 / survey.pixel)
    assert survey.label_at((0.0, 0.0)) == -1 == survey.label_at((-50.0, 1e6))


def test_doors_have_their_widths(office: Office, truth: Any) -> None:
    drawn = office(50)
    survey = find_rooms(grey(drawn.image), drawn.metres_per_pixel)
    wanted = sorted(max(door[2] - door[0], door[3] - door[1]) for door in truth.doors)
    assert sorted(door.width for door in survey.doors) == pytest.approx(wanted, abs=0.06)
    assert sum(-1 in door.rooms for door in survey.doors) == 1


def test_a_gap_wider_than_doors_is_remarked(office: Office) -> None:
    pixels = np.array(office(36).image)
    pixels[54 : 54 + 10, 100:190] = 255  # 2.5 m of the exterior wall
    survey = find_rooms(Drawing(pixels, "open"), 1 / 36)
    assert any("open to the outside" in remark for remark in survey.remarks)


def test_a_coarse_drawing_is_remarked(office: Office) -> None:
    drawn = office(20)
    survey = find_rooms(grey(drawn.image), drawn.metres_per_pixel)
    assert any("export it finer" in remark for remark in survey.remarks)


@pytest.mark.parametrize("shade", [0, 128, 255])
def test_a_blank_drawing_has_no_rooms(shade: int) -> None:
    with pytest.raises(PlanError, match="blank"):
        find_rooms(Drawing(np.full((200, 300), shade, dtype=np.uint8), "blank"), 0.02)


def test_noise_has_no_rooms() -> None:
    pixels = np.random.default_rng(0).integers(0, 256, (300, 300), dtype=np.uint8)
    with pytest.raises(PlanError, match="enclose"):
        find_rooms(Drawing(pixels, "noise"), 0.02)


def test_a_scale_that_is_none_is_refused(office: Office) -> None:
    with pytest.raises(PlanError, match="points in pixels"):
        find_rooms(grey(office(36).image), 20.0)
    with pytest.raises(PlanError):
        scale_from_points((1, 1), (1, 1), 5.0)


def test_settings_are_checked() -> None:
    with pytest.raises(PlanError, match="widest_door"):
        PlanSettings(widest_door=float("nan"))
    with pytest.raises(PlanError, match="thinnest_wall"):
        PlanSettings(thinnest_wall=0.3, thickest_wall=0.2)
