"""Words of drawings: names of rooms from a DXF's texts, a PDF's, and a picture's, and what is no name."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure
from PIL import Image, ImageDraw, ImageFont

from thermal.errors import MissingExtraError
from thermal.plan import guard, words
from thermal.plan.assemble import assemble_plans
from thermal.plan.list import FloorEntry, read_floor
from thermal.plan.survey import FloorSurvey, survey_codes
from thermal.plan.words import TextLine, name_rooms

SCALE = {"metres_per_pixel": 0.02}


def two_rooms() -> FloorSurvey:
    """Two rooms of 6 x 4 cells beside each other, at one pixel of the drawing a cell."""
    codes = np.full((8, 17), 2)
    codes[1:7, 1:16] = 1
    codes[2:6, 2:8] = codes[2:6, 9:15] = 0
    return survey_codes(codes, 0.5)


def names_of(*lines: tuple[str, float, float]) -> list[str]:
    """Names that texts at places give the two rooms."""
    return [room.name for room in name_rooms(two_rooms(), [TextLine(*line) for line in lines]).rooms]


def test_the_topmost_line_of_a_room_is_its_name() -> None:
    assert names_of(("2.14", 4, 5), ("Kitchen", 4, 3), ("Lab", 11, 3)) == ["Kitchen", "Lab"]


@pytest.mark.parametrize(
    "measure", ["12.5", "12,5 m²", "18 m2", "H = 2.80", "2.80", "1:100", "±0.00", "9'", "240 sq ft", "3.20 m"]
)
def test_a_measure_is_no_name(measure: str) -> None:
    assert names_of((measure, 4, 2), ("214", 4, 4)) == ["214", ""]


def test_rooms_of_one_name_are_told_apart_by_what_stands_below_it() -> None:
    assert names_of(("Office", 4, 3), ("1.01", 4, 2), ("101", 4, 4), ("Office", 11, 3), ("102", 11, 4)) == [
        "Office 101", "Office 102",
    ]  # fmt: skip


def test_texts_on_walls_outside_and_of_the_plan_itself_are_nobodys() -> None:
    assert names_of(("Street", 0, 0), ("wall", 8, 3), ("+", 4, 3), ("  ", 11, 3)) == ["", ""]


def drawn(folder: Path, *texts: tuple[str, int, int]) -> Path:
    """Draw two rooms of 8 m x 9 m with words in them, 2 cm a pixel."""
    image = Image.new("L", (1000, 700), 255)
    draw = ImageDraw.Draw(image)
    draw.rectangle((100, 100, 900, 600), fill=0)
    for left in (115, 510):
        draw.rectangle((left, 115, left + 375, 585), fill=255)
    for text, x, y in texts:
        draw.text((x, y), text, fill=0, font=ImageFont.load_default(30))
    file = folder / "floor.png"
    image.save(file)
    return file


def test_a_picture_names_its_rooms_where_that_is_asked_for(tmp_path: Path) -> None:
    if shutil.which("tesseract") is None:
        pytest.skip("needs tesseract: apt install tesseract-ocr")
    file = drawn(tmp_path, ("Kitchen", 220, 300), ("12.5 m2", 220, 350), ("Room 214", 620, 300))
    entry = FloorEntry(name="F1", file=file.name, scale=SCALE)
    assert read_floor(entry, tmp_path).names == ("F1_R01", "F1_R02")
    assert read_floor(entry.model_copy(update={"read_text": True}), tmp_path).names == ("Kitchen", "Room 214")


def test_ocr_that_is_not_installed_says_how_to_get_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(words, "_PROGRAM", "no-such-program")
    assert not words.can_read_pictures()
    entry = FloorEntry(name="F1", file=drawn(tmp_path).name, scale=SCALE, read_text=True)
    with pytest.raises(MissingExtraError, match="apt install tesseract-ocr"):
        read_floor(entry, tmp_path)


def test_the_words_of_a_pdf_lie_where_they_are_drawn(monkeypatch: pytest.MonkeyPatch) -> None:
    told = (
        '<page width="595" height="842"><block><line xMin="10.0" yMin="20.0" xMax="50.0" yMax="40.0">'
        '<word xMin="10">R&amp;D</word> <word xMin="30">lab</word></line></block></page>'
    )
    monkeypatch.setattr(words, "run_program", lambda *_: told)
    assert words.pdf_lines(Path("a.pdf"), 1, 144.0) == (TextLine("R&D lab", 60.0, 60.0),)


def test_the_text_of_a_page_of_a_pdf_is_read(tmp_path: Path) -> None:
    if shutil.which("pdftotext") is None:
        pytest.skip("needs poppler-utils: apt install poppler-utils")
    figure = Figure(figsize=(4.0, 2.0))
    figure.text(0.5, 0.75, "Room 214", ha="center", va="center")
    figure.savefig(tmp_path / "a.pdf")
    (line,) = words.pdf_lines(tmp_path / "a.pdf", 1, 150.0)
    assert line.text == "Room 214" and (line.x, line.y) == pytest.approx((300.0, 75.0), abs=10.0)  # a line is 20 px high


def test_rooms_of_one_name_on_two_floors_are_told_apart() -> None:
    from thermal.plan.cells import propose_zones

    floors = [propose_zones(name_rooms(two_rooms(), [TextLine("Kitchen", 4, 3)]), name, 3.0) for name in ("F1", "F2")]
    found = assemble_plans(floors, cell_size=0.5)
    zones = [zone for floor in found.plans.floors for zone in floor.zone_names]
    assert sorted(zones) == ["F1 Kitchen", "F1_R02", "F2 Kitchen", "F2_R02"]


def test_a_program_that_fails_or_hangs_is_an_error_of_the_family(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from thermal.errors import OversizedFileError, PlanError

    file: Any = tmp_path / "a.pdf"
    with pytest.raises(PlanError, match=r"a\.pdf: expected a page"):
        guard.run_program(["false"], file, "a page", "coreutils")
    monkeypatch.setattr(guard, "_PATIENCE", 0.05)
    with pytest.raises(OversizedFileError):
        guard.run_program(["sleep", "5"], file, "a page", "coreutils")
