"""Rooms of DXF drawings come out as they were drawn, in any unit and at any angle."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import ezdxf
import pytest

from thermal.errors import OversizedFileError, PlanError
from thermal.plan.cells import propose_zones
from thermal.plan.vector import read_dxf

NAMES = ("A", "B", "C", "D", "corridor", "E", "F", "G")


@pytest.mark.parametrize(("unit", "turn"), [("MM", 0.0), ("IN", 20.0)])
def test_a_dxf_gives_its_rooms_and_their_names(
    office_dxf: Callable[..., Path], truth: Any, unit: str, turn: float
) -> None:
    survey = read_dxf(office_dxf(unit, turn))
    assert [room.area for room in survey.rooms] == pytest.approx(list(truth.clear), rel=0.005)
    assert survey.turned == pytest.approx(-turn, abs=0.01)
    assert len(survey.doors) == len(truth.doors)
    zones = propose_zones(survey, "F1", 3.0)
    assert zones.names == NAMES
    assert list(zones.areas.values()) == pytest.approx(list(truth.gross), rel=0.01)


def test_closed_polylines_of_rooms_are_taken_as_they_stand(tmp_path: Path) -> None:
    document = ezdxf.new()
    document.units = ezdxf.units.M
    for x0, x1 in ((0, 5), (5.2, 9)):
        points = [(x0, 0), (x1, 0), (x1, 4), (x0, 4)]
        document.modelspace().add_lwpolyline(points, close=True, dxfattribs={"layer": "A-ROOM-BDRY"})
    document.saveas(tmp_path / "rooms.dxf")
    survey = read_dxf(tmp_path / "rooms.dxf")
    assert sorted(room.area for room in survey.rooms) == pytest.approx([15.2, 20.0], rel=0.01)
    zones = propose_zones(survey, "F1", 3.0)
    assert sorted(zones.areas.values()) == pytest.approx([15.6, 20.4], rel=0.01)


def test_absurd_units_are_refused(office_dxf: Callable[..., Path]) -> None:
    with pytest.raises(PlanError, match=r"1\.86e\+04 m.*pass unit"):
        read_dxf(office_dxf("MM"), unit=1.0)
    with pytest.raises(PlanError):
        read_dxf(office_dxf("M"), unit=0.001)
    assert len(read_dxf(office_dxf("M"), unit=1.0).rooms) == 9


def test_a_drawing_without_unit_asks_for_one(tmp_path: Path) -> None:
    document = ezdxf.new()
    document.units = 0
    document.modelspace().add_line((0, 0), (5, 0))
    document.saveas(tmp_path / "unitless.dxf")
    with pytest.raises(PlanError, match=r"INSUNITS.*pass unit"):
        read_dxf(tmp_path / "unitless.dxf")
    with pytest.raises(PlanError):
        read_dxf(tmp_path / "unitless.dxf", unit=1.0)


def test_layers_that_are_not_there_are_named(office_dxf: Callable[..., Path]) -> None:
    with pytest.raises(PlanError, match="A-WALL"):
        read_dxf(office_dxf(), wall_layers="bulkhead")


def test_blocks_within_blocks_end(tmp_path: Path) -> None:
    document = ezdxf.new()
    document.units = ezdxf.units.M
    inner = document.blocks.new("B0")
    for _ in range(10):
        inner.add_line((0, 0), (1, 0))
    for level in range(1, 7):  # 10 ** 7 lines
        block = document.blocks.new(f"B{level}")
        for _ in range(10):
            block.add_blockref(f"B{level - 1}", (0, 0))
    document.modelspace().add_blockref("B6", (0, 0))
    document.saveas(tmp_path / "bomb.dxf")
    import thermal.plan.vector as vector

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(vector, "_MOST_ENTITIES", 2000)  # so that the test is quick
        with pytest.raises(OversizedFileError, match="2000"):
            read_dxf(tmp_path / "bomb.dxf")


@pytest.mark.parametrize("content", [b"", b"0\nSECTION\n", b"no drawing\n" * 50, b"\x00" * 100])
def test_what_is_no_dxf_is_refused(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "x.dxf").write_bytes(content)
    with pytest.raises(PlanError):
        read_dxf(tmp_path / "x.dxf")
