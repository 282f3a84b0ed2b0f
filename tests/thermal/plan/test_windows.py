"""Windows of a drawing: width, facade and room of each, by layer and block or as a picture; inside ones are none."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import ezdxf
import pytest
from PIL import Image, ImageDraw

from thermal.case.validation import has_windows
from thermal.plan.assemble import assemble_plans
from thermal.plan.cells import propose_zones
from thermal.plan.drawing import read_drawing
from thermal.plan.folder import building_of
from thermal.plan.list import FloorEntry, read_floor
from thermal.plan.rooms import find_rooms
from thermal.plan.vector import read_dxf
from thermal.plan.windows import LOOK, NONE_SEEN, NOT_CALLED, UNTOLD, clipped_glazing

WALL = 0.3  # m


def box(space: Any, left: float, top: float, right: float, bottom: float, layer: str = "A-WALL") -> None:
    """Draw a rectangle."""
    points = [(left, top), (right, top), (right, bottom), (left, bottom)]
    space.add_lwpolyline(points, close=True, dxfattribs={"layer": layer})


def house(folder: Path, windows: Callable[[Any, Any], None], turn: float = 0.0) -> Path:
    """Draw two rooms of 5 m x 4 m side by side, the one named west to the left, and windows."""
    document = ezdxf.new()
    document.units = ezdxf.units.M
    space = document.modelspace()
    box(space, -WALL, -WALL, 10.2 + WALL, 4 + WALL)
    box(space, 0, 0, 5, 4)
    box(space, 5.2, 0, 10.2, 4)
    windows(document, space)
    for name, x in (("west", 2.5), ("east", 7.7)):
        space.add_text(name, dxfattribs={"insert": (x, 2), "layer": "A-TEXT"})
    if turn:
        for entity in space:
            entity.rotate_z(turn)
    file = folder / "house.dxf"
    document.saveas(file)
    return file


def by_layer(document: Any, space: Any) -> None:
    """Windows on a layer of theirs: 2 m to the north of the left room, 1 m to its west, and one inside."""
    for y in (4, 4 + WALL / 2, 4 + WALL):
        space.add_line((1, y), (3, y), dxfattribs={"layer": "A-GLAZ"})
    box(space, -WALL, 1, 0, 2, "A-GLAZ")
    box(space, 5, 1, 5.2, 2, "A-GLAZ")


def by_block(document: Any, space: Any) -> None:
    """Take blocks called windows, drawn on layer 0: one of 1.2 m in the south of the right room, one over both."""
    block = document.blocks.new("Fenster_120")
    for y in (0, WALL):
        block.add_line((0, y), (1.2, y), dxfattribs={"layer": "0"})
    space.add_blockref("Fenster_120", (7, -WALL))
    long = document.blocks.new("WINDOW_RIBBON")
    for y in (0, WALL):
        long.add_line((0, y), (6.2, y), dxfattribs={"layer": "0"})
    space.add_blockref("WINDOW_RIBBON", (2, 4))


def widths(file: Path) -> dict[tuple[str, str], float]:
    """Width of the windows by zone and facade."""
    survey = read_dxf(file)
    assert NOT_CALLED not in survey.remarks
    floor = propose_zones(survey, "F1", 3.0, window_height=1.0)
    return {(zone, side): area for zone, sides in floor.glazing.items() for side, area in sides.items()}


def test_windows_on_a_layer_belong_to_the_rooms_behind_them(tmp_path: Path) -> None:
    found = widths(house(tmp_path, by_layer))
    assert found == {("west", "north"): pytest.approx(2.0, abs=0.1), ("west", "west"): pytest.approx(1.0, abs=0.1)}


def test_a_drawing_without_layers_or_blocks_of_windows_is_said_to_have_none(tmp_path: Path) -> None:
    assert NOT_CALLED in read_dxf(house(tmp_path, lambda document, space: None)).remarks


def test_windows_are_found_in_a_drawing_that_is_turned(tmp_path: Path) -> None:
    import math

    found = widths(house(tmp_path, by_layer, math.radians(12.0)))
    assert found == {("west", "north"): pytest.approx(2.0, abs=0.1), ("west", "west"): pytest.approx(1.0, abs=0.1)}


def test_blocks_called_windows_count_and_a_ribbon_is_shared(tmp_path: Path) -> None:
    found = widths(house(tmp_path, by_block))
    assert found == {
        ("east", "south"): pytest.approx(1.2, abs=0.1), ("west", "north"): pytest.approx(3.0, abs=0.15),
        ("east", "north"): pytest.approx(3.0, abs=0.15),
    }  # fmt: skip


def test_windows_become_the_glazing_of_the_building_and_a_remark(tmp_path: Path) -> None:
    house(tmp_path, by_layer)
    floor = read_floor(FloorEntry(name="F1", file="house.dxf", window_height=1.4), tmp_path)
    found = assemble_plans([floor])
    assert found.plans.glazing["west"] == {"north": pytest.approx(2.8, abs=0.2), "west": pytest.approx(1.4, abs=0.2)}
    assert any("m of windows are drawn, taken as 1.4 m high" in remark for remark in found.remarks)
    from thermal.case.building import Location

    place = Location(latitude=48.0, longitude=12.0, elevation=500.0, timezone="Europe/Berlin")
    assert has_windows(building_of(found, "house", place))


def test_glass_is_no_larger_than_its_facade() -> None:
    drawn = {"A": {"north": 20.0, "east": 1.0}, "B": {"south": 2.0}}
    assert clipped_glazing(drawn, {"A": {"north": 12.0}, "B": {"south": 9.0}}) == {
        "A": {"north": 12.0}, "B": {"south": 2.0},
    }  # fmt: skip


PIXEL = 0.02  # m of a picture
PANES = {
    "north": (2.0, 3.2),
    "east": (1.0, 2.5),
    "south": (6.0, 9.0),
    "west": (0.5, 1.3),
}  # from, to along the facade [m]


def picture(folder: Path, walls: str, panes: int) -> Path:
    """Draw the same two rooms as a picture, with a window in each facade and an exterior door to the north.

    Walls are solid, lined (two lines), hatched, or of three layers; a window has its two faces and further lines between them.
    """
    width, depth, paper = 10.2, 4.0, 1.5
    image = Image.new(
        "L", (round((width + 2 * WALL + 2 * paper) / PIXEL), round((depth + 2 * WALL + 2 * paper) / PIXEL)), 255
    )
    pen = ImageDraw.Draw(image)

    def area(left: float, top: float, right: float, bottom: float, **shade: int) -> None:
        shift = WALL + paper
        pen.rectangle([round((x + shift) / PIXEL) - (n > 1) for n, x in enumerate((left, top, right, bottom))], **shade)

    rooms = ((0, 0, 5, depth), (5.2, 0, width, depth))
    outer = (-WALL, -WALL, width + WALL, depth + WALL)
    area(*outer, **({"fill": 0} if walls == "solid" else {"outline": 0}))
    if walls == "hatched":
        for shift in range(-400, 1000, 7):
            pen.line([(shift, 400), (shift + 400, 0)], fill=0)
        pen.rectangle([0, 0, image.width, round(paper / PIXEL) - 1], fill=255)
        pen.rectangle([0, image.height - round(paper / PIXEL), image.width, image.height], fill=255)
        pen.rectangle([0, 0, round(paper / PIXEL) - 1, image.height], fill=255)
        pen.rectangle([image.width - round(paper / PIXEL), 0, image.width, image.height], fill=255)
    if walls == "layers":
        for face in (0.1, 0.2):
            area(*(sign * face + x for sign, x in zip((1, 1, -1, -1), outer, strict=True)), outline=0)
    for room in rooms:
        area(*room, fill=255, **({} if walls == "solid" else {"outline": 0}))
    for facade, (first, last) in PANES.items():
        faces = {
            "north": (-WALL, 0.0),
            "west": (-WALL, 0.0),
            "south": (depth, depth + WALL),
            "east": (width, width + WALL),
        }
        near, far = faces[facade]
        lies = facade in ("north", "south")
        area(*((first, near, last, far) if lies else (near, first, far, last)), fill=255, outline=0)
        for pane in range(panes):
            line = near + WALL * (pane + 1) / (panes + 1)
            area(
                *((first, line, last, line + 1.1 * PIXEL) if lies else (line, first, line + 1.1 * PIXEL, last)), fill=0
            )
    area(7.0, -WALL, 7.9, 0.0, fill=255)  # the door, a gap between jambs
    for jamb in (7.0, 7.9):
        area(jamb, -WALL, jamb + 1.1 * PIXEL, 0.0, fill=0)
    file = folder / f"{walls}.png"
    image.save(file)
    return file


@pytest.mark.parametrize(("walls", "panes"), [("solid", 1), ("solid", 0), ("lined", 1), ("lined", 2), ("hatched", 2)])
def test_windows_of_a_picture_are_told_from_the_wall_however_it_is_drawn(
    tmp_path: Path, walls: str, panes: int
) -> None:
    survey = find_rooms(read_drawing(picture(tmp_path, walls, panes)), PIXEL)
    floor = propose_zones(survey, "F1", 3.0, window_height=1.0)
    left, right = sorted(floor.names, key=lambda name: survey.rooms[floor.names.index(name)].centre)
    off = 0.15 if walls == "hatched" else 0.05  # m: hatching makes the drawing seem to stand askew by 0.2 degrees
    assert floor.glazing == {
        left: {"north": pytest.approx(1.2, abs=off), "west": pytest.approx(0.8, abs=off)},
        right: {"east": pytest.approx(1.5, abs=off), "south": pytest.approx(3.0, abs=off)},
    }
    assert LOOK in survey.remarks


def test_windows_of_a_scan_that_stands_askew(tmp_path: Path, office: Callable[..., Any]) -> None:
    sheet = office(40.0, turn=3.0)
    sheet.image.save(tmp_path / "scan.png")
    survey = find_rooms(read_drawing(tmp_path / "scan.png"), sheet.metres_per_pixel)
    assert [(w.facade, w.width) for w in survey.windows] == [("north", pytest.approx(2.0, abs=0.05))] * 4


@pytest.mark.parametrize(("walls", "panes", "said"), [("lined", 0, NONE_SEEN), ("layers", 2, UNTOLD)])
def test_where_windows_look_like_wall_the_survey_says_so(tmp_path: Path, walls: str, panes: int, said: str) -> None:
    survey = find_rooms(read_drawing(picture(tmp_path, walls, panes)), PIXEL)
    assert survey.windows == () and said in survey.remarks
