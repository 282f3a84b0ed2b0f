"""Windows of a vector drawing: width, facade and room of each, by layer and by block; inside ones are none."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import ezdxf
import pytest

from thermal.case.validation import has_windows
from thermal.plan.assemble import assemble_plans
from thermal.plan.cells import propose_zones
from thermal.plan.folder import building_of
from thermal.plan.list import FloorEntry, read_floor
from thermal.plan.vector import read_dxf
from thermal.plan.windows import clipped_glazing

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
    floor = propose_zones(read_dxf(file), "F1", 3.0, window_height=1.0)
    return {(zone, side): area for zone, sides in floor.glazing.items() for side, area in sides.items()}


def test_windows_on_a_layer_belong_to_the_rooms_behind_them(tmp_path: Path) -> None:
    found = widths(house(tmp_path, by_layer))
    assert found == {("west", "north"): pytest.approx(2.0, abs=0.1), ("west", "west"): pytest.approx(1.0, abs=0.1)}


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
