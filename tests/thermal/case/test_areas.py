from pathlib import Path

import numpy as np
import pytest

from thermal.case.building import FloorPlan, FloorPlans
from thermal.case.load import load_case
from thermal.case.plan import facade_areas, wall_shares, zone_floor_areas, zone_volumes


def plans(*floors: tuple[str, ...], cell_size: float = 1.0, height: float = 3.0) -> FloorPlans:
    drawn = (np.array([list(row) for row in rows]) for rows in floors)
    return FloorPlans(cell_size, tuple(FloorPlan(f"F{i}", height, tokens) for i, tokens in enumerate(drawn)))


def shares(*rows: str) -> dict[tuple[int, int], tuple[str, ...]]:
    return wall_shares(np.array([list(row) for row in rows]))


def test_straight_wall_counts_half_to_each_side() -> None:
    # 2 x 2 cells each, and a wall of 2 cells between them
    areas = zone_floor_areas(plans(("#######", "#AA+BB#", "#AA+BB#", "#######")))
    assert areas == {"A": 5.0, "B": 5.0}


def test_area_goes_with_the_square_of_the_cell_and_volume_with_the_height() -> None:
    drawn = plans(("#######", "#AA+BB#", "#AA+BB#", "#######"), cell_size=0.5, height=2.8)
    assert zone_floor_areas(drawn) == {"A": 1.25, "B": 1.25}
    assert zone_volumes(drawn) == pytest.approx({"A": 3.5, "B": 3.5})


def test_exterior_walls_and_outside_count_to_nobody() -> None:
    assert zone_floor_areas(plans(("....", "####", "#AA#", "####"))) == {"A": 2.0}


def test_crossing_is_shared_by_the_zones_at_its_corners() -> None:
    rows = ("#####", "#A+B#", "#+++#", "#C+D#", "#####")
    assert shares(*rows)[2, 2] == ("A", "B", "C", "D")
    assert zone_floor_areas(plans(rows)) == {zone: 1.0 + 0.5 + 0.5 + 0.25 for zone in "ABCD"}


def test_junction_goes_to_the_zones_beside_it() -> None:
    rows = ("#####", "#AAA#", "#+++#", "#B+C#", "#####")
    found = shares(*rows)
    assert found[2, 2] == ("A",)
    assert found[2, 1] == ("A", "B")
    assert found[3, 2] == ("B", "C")


def test_stub_inside_a_zone_is_all_that_zones() -> None:
    rows = ("#####", "#AAA#", "#A+A#", "#A+A#", "#####")
    assert zone_floor_areas(plans(rows)) == {"A": 9.0}


def test_thick_walls_go_to_the_nearest_zone_and_ties_are_shared() -> None:
    found = shares("#######", "#A+++B#", "#######")
    assert [found[1, col] for col in (2, 3, 4)] == [("A",), ("A", "B"), ("B",)]
    found = shares("########", "#A++++B#", "########")
    assert [found[1, col] for col in (2, 3, 4, 5)] == [("A",), ("A",), ("B",), ("B",)]


def test_wall_that_no_zone_reaches_counts_to_nobody() -> None:
    rows = ("#####", "#A###", "###+#", "#####", "#####")
    assert shares(*rows)[2, 3] == ()
    assert zone_floor_areas(plans(rows)) == {"A": 1.0}


def test_every_floor_counts_and_zones_keep_their_order() -> None:
    lower, upper = ("####", "#BA#", "####"), ("####", "#CC#", "####")
    assert list(zone_floor_areas(plans(lower, upper)).items()) == [("B", 1.0), ("A", 1.0), ("C", 2.0)]


def test_facades_seen_from_inside() -> None:
    areas = facade_areas(plans(("#######", "#AA+BB#", "#AA+BB#", "#######")))
    # 2 cells and half the wall between, 3 m high
    assert areas["A"] == {"north": 7.5, "east": 0.0, "south": 7.5, "west": 6.0}
    assert areas["B"] == {"north": 7.5, "east": 6.0, "south": 7.5, "west": 0.0}


def test_thick_exterior_wall_is_a_facade_and_a_wall_to_a_neighbour_is_not() -> None:
    areas = facade_areas(plans(("######", "######", "#AA#B#", "######")))
    assert areas["A"] == {"north": 6.0, "east": 0.0, "south": 6.0, "west": 3.0}
    assert areas["B"] == {"north": 3.0, "east": 3.0, "south": 3.0, "west": 0.0}


def test_courtyard_is_outside() -> None:
    rows = ("#######", "#AAAAA#", "#A###A#", "#A#.#A#", "#A###A#", "#AAAAA#", "#######")
    areas = facade_areas(plans(rows))["A"]
    assert areas["south"] == 5 * 3.0 + 3.0  # the last row, and the cell above the courtyard
    assert areas == dict.fromkeys(areas, 18.0)


@pytest.mark.parametrize(("case", "area"), [("practice_none_prbs", 672.0), ("practice_everything", 1152.0)])
def test_zones_of_a_shared_case_fill_it_to_its_exterior_walls(shared_cases: Path, case: str, area: float) -> None:
    geometry = load_case(shared_cases / case).building.geometry
    assert isinstance(geometry, FloorPlans)
    inside = sum(int(np.isin(floor.tokens, ["#", "."], invert=True).sum()) for floor in geometry.floors)
    assert sum(zone_floor_areas(geometry).values()) == pytest.approx(inside * 0.25) == area
