"""Plans of cells keep zones, their areas and the walls between them, and make cases that load."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from thermal.case.building import Location
from thermal.case.check import check_case
from thermal.case.plan import zone_floor_areas
from thermal.errors import LostRoomError, PlanError
from thermal.pilot.building import devices, generate_office
from thermal.plan.assemble import assemble_plans
from thermal.plan.cells import propose_zones
from thermal.plan.folder import building_of, draw_floor, save_plan_case
from thermal.plan.models import read_devices
from thermal.plan.survey import read_codes, survey_codes

SITE = Location(latitude=37.4, longitude=-122.1, elevation=20.0, timezone="America/Los_Angeles")


def codes_of(tokens: np.ndarray) -> np.ndarray:
    """Write a plan of tokens in the codes of the paper's simulator."""
    return np.select([tokens == ".", np.isin(tokens, ["#", "+"])], [2, 1], 0)


def rooms_of(widths: list[int], depth: int, wall: int) -> np.ndarray:
    """A row of rooms, widths and walls in cells."""
    inside = np.ones((depth, wall), dtype=int)
    for width in widths:
        inside = np.hstack([inside, np.zeros((depth, width), dtype=int), np.ones((depth, wall), dtype=int)])
    return np.pad(np.pad(inside, ((wall, wall), (0, 0)), constant_values=1), 1, constant_values=2)


@pytest.mark.long
def test_the_pilot_comes_back_from_its_codes_with_its_127_devices(tmp_path: Path) -> None:
    plans = generate_office(0)
    floors = []
    for floor in plans.floors:
        np.savez(tmp_path / f"{floor.name}.npz", plan=codes_of(floor.tokens))
        survey = read_codes(tmp_path / f"{floor.name}.npz", plans.cell_size)
        names = {}
        for name in floor.zone_names:
            row, column = np.argwhere(floor.tokens == name)[0]
            names[name] = (float(column), float(row))
        floors.append(propose_zones(survey, floor.name, floor.height, names=names))
    found = assemble_plans(floors)
    assert found.plans.cell_size == plans.cell_size
    assert found.largest_error < 0.02
    wanted = zone_floor_areas(plans)
    assert zone_floor_areas(found.plans) == pytest.approx(wanted, rel=0.02)
    lines = ["Device,Type,Zone,Fed by"]
    lines += [
        f"{d.name},{d.type.upper()},{(d.zone or '').replace('_', '-').lower()},{'; '.join(d.fed_by)}"
        for d in devices(plans)
    ]
    (tmp_path / "devices.csv").write_text("\n".join(lines), encoding="utf-8")
    served = read_devices(tmp_path / "devices.csv", list(wanted))
    assert served.devices == devices(plans) and len(served.devices) == 127
    assert not served.unplaced and not served.unknown_types
    folder = save_plan_case(building_of(found, "pilot", SITE, devices=served.devices), tmp_path / "case")
    check = check_case(folder)
    assert len(check.zones) == 123 and check.floor_area == pytest.approx(sum(wanted.values()), rel=1e-3)


@settings(max_examples=25, deadline=None, derandomize=True)
@given(
    st.lists(st.integers(20, 60), min_size=1, max_size=4),
    st.integers(20, 50),
    st.integers(1, 4),
    st.sampled_from([0.25, 0.4, 0.5]),
)
def test_a_wall_thinner_than_a_cell_still_parts_its_rooms(
    widths: list[int], depth: int, wall: int, cell_size: float
) -> None:
    survey = survey_codes(rooms_of(widths, depth, wall), 0.1)
    assert [room.area for room in survey.rooms] == pytest.approx([w * depth * 0.01 for w in widths])
    found = assemble_plans([propose_zones(survey, "F1", 3.0, smallest_zone=0.0)], cell_size=cell_size)
    assert len(found.plans.floors[0].zone_names) == len(widths)  # and check_plan holds, or it would have raised


def test_cells_are_chosen_so_that_areas_are_kept() -> None:
    survey = survey_codes(rooms_of([37, 43, 31], 29, 1), 0.1)
    floor = propose_zones(survey, "F1", 3.0)
    found = assemble_plans([floor])
    assert found.largest_error < 0.02 and found.plans.cell_size >= 0.1
    drawn = zone_floor_areas(found.plans)
    assert drawn == pytest.approx(floor.areas, rel=0.02)
    assert assemble_plans([floor], cell_size=0.5).remarks


def test_floors_are_aligned_by_outline_and_by_anchor() -> None:
    codes = rooms_of([40, 60], 50, 2)
    first = propose_zones(survey_codes(codes, 0.1), "F1", 3.0)
    moved = np.pad(codes, ((7, 0), (13, 5)), constant_values=2)
    second = propose_zones(survey_codes(moved, 0.1), "F2", 3.0)
    for anchors in (None, {"F1": (3.0, 3.0), "F2": (16.0, 10.0)}):
        found = assemble_plans([first, second], anchors=anchors, cell_size=0.1)
        one, two = (np.isin(plan.tokens, ["#", "."]) for plan in found.plans.floors)
        assert (one == two).all()
    with pytest.raises(PlanError, match="anchor"):
        assemble_plans([first, second], anchors={"F1": (0.0, 0.0)})


def test_small_rooms_join_and_names_are_kept() -> None:
    survey = survey_codes(rooms_of([40, 10], 30, 1), 0.1)
    joined = propose_zones(survey, "F1", 3.0)
    assert joined.names == ("F1_R01",) and "1 room under 4 m2 joined the zone" in joined.survey.remarks[-1]
    named = propose_zones(survey, "F1", 3.0, names={"closet": (45.0, 10.0)})
    assert named.names == ("F1_R01", "closet")
    with pytest.raises(PlanError, match="outside"):
        propose_zones(survey, "F1", 3.0, names={"lost": (500.0, 10.0)})
    with pytest.raises(PlanError, match="outdoor"):
        propose_zones(survey, "F1", 3.0, names={"outdoor": (10.0, 10.0)})
    with pytest.raises(PlanError, match="of that name"):
        assemble_plans([named, propose_zones(survey, "F2", 3.0, names={"closet": (45.0, 10.0)})])


def test_a_room_that_cells_cannot_hold_is_named() -> None:
    survey = survey_codes(rooms_of([40, 12], 30, 1), 0.1)
    with pytest.raises(LostRoomError, match="F1_R02"):
        assemble_plans([propose_zones(survey, "F1", 3.0, smallest_zone=0.0)], cell_size=4.0)


@pytest.mark.parametrize(
    ("rows", "error", "message"),
    [
        ("0,1\n1", PlanError, "row 2"),
        ("0,x", PlanError, "could not convert"),
        ("1,1\n1,7", PlanError, "row 2, column 2"),
        ("1,1\n1,2", PlanError, "inside"),
        ("1,1,1\n1,0,2\n1,1,1", PlanError, "a wall"),
        ("", PlanError, "empty"),
    ],
)
def test_codes_that_are_none_are_refused(tmp_path: Path, rows: str, error: type[Exception], message: str) -> None:
    (tmp_path / "plan.csv").write_text(rows, encoding="utf-8")
    with pytest.raises(error, match=message):
        read_codes(tmp_path / "plan.csv", 0.5)


def test_the_picture_names_the_zones_safely() -> None:
    survey = survey_codes(rooms_of([40], 30, 1), 0.1)
    pytest.importorskip("PIL")
    floor = propose_zones(survey, "F<1>", 3.0, names={"<script>": (10.0, 10.0)})
    picture = draw_floor(floor)
    assert "&lt;script&gt;" in picture and "<script>" not in picture and "12." in picture
