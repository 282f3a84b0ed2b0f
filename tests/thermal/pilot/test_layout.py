"""Generated offices, against a checker of plans that shares nothing with the generator."""

from __future__ import annotations

from collections import Counter
from typing import Any

import numpy as np
import pytest
from hypothesis import given, reject, settings
from hypothesis import strategies as st

from thermal.case.building import FloorPlan, FloorPlans
from thermal.case.plan import zone_floor_areas
from thermal.errors import ThermalError
from thermal.pilot.building import devices, generate_office

WALLS = {".", "#", "+"}
NEIGHBOURS = [(-1, 0), (0, 1), (1, 0), (0, -1), (-1, -1), (-1, 1), (1, 1), (1, -1)]
FACADES = {"north": (-1, 0), "east": (0, 1), "south": (1, 0), "west": (0, -1)}


def flood(cells: set[tuple[int, int]], start: tuple[int, int], steps: list[tuple[int, int]]) -> set[tuple[int, int]]:
    """Cells that can be reached from one of them."""
    seen, front = {start}, [start]
    while front:
        row, column = front.pop()
        for down, right in steps:
            cell = (row + down, column + right)
            if cell in cells and cell not in seen:
                seen.add(cell)
                front.append(cell)
    return seen


def check_floor(floor: FloorPlan, cell_size: float, min_zone_area: float) -> None:
    """Fail when a plan is not closed, a zone is split, touches another or is tiny, or a wall is not one cell thick."""
    n_row, n_column = floor.tokens.shape
    token: dict[tuple[int, int], str] = {
        (row, column): str(floor.tokens[row, column]) if 0 <= row < n_row and 0 <= column < n_column else "."
        for row in range(-1, n_row + 1)
        for column in range(-1, n_column + 1)
    }
    open_cells = {cell for cell, value in token.items() if value != "#"}
    outside = flood(open_cells, (-1, -1), NEIGHBOURS)
    assert {token[cell] for cell in outside} == {"."}, "the ring has a hole"
    assert all(token[cell] != "." for cell in open_cells - outside), "there is outside inside the ring"
    zones: dict[str, set[tuple[int, int]]] = {}
    for cell, value in token.items():
        around = [token.get((cell[0] + down, cell[1] + right), ".") for down, right in NEIGHBOURS]
        if value == "#":
            assert "." in around, f"exterior wall thicker than a cell at {cell}"
            assert any(other not in {".", "#"} for other in around), f"exterior wall around nothing at {cell}"
        elif value == "+":
            assert len(set(around) - WALLS) >= 2, f"wall that parts nothing at {cell}"
            block = [token[cell[0] + down, cell[1] + right] for down, right in ((0, 1), (1, 0), (1, 1))]
            assert block != ["+"] * 3, f"interior wall thicker than a cell at {cell}"
        elif value != ".":
            zones.setdefault(value, set()).add(cell)
            assert set(around) <= {value, "+", "#"}, f"{value} touches another zone or the outside at {cell}"
    for name, cells in zones.items():
        assert flood(cells, next(iter(cells)), NEIGHBOURS[:4]) == cells, f"{name} is split"
        assert len(cells) * cell_size**2 >= min_zone_area, f"{name} is tiny"


def check_glazing(plans: FloorPlans, smallest: float, largest: float) -> None:
    """Fail when a window is where no facade is, or a facade is without its share of glass."""
    facade: Counter[tuple[str, str]] = Counter()
    for floor in plans.floors:
        for (row, column), zone in np.ndenumerate(floor.tokens):
            if zone in WALLS:
                continue
            for side, (down, right) in FACADES.items():
                if floor.tokens[row + down, column + right] == "#":
                    facade[str(zone), side] += plans.cell_size * floor.height
    glass = {(zone, side): area for zone, sides in plans.glazing.items() for side, area in sides.items()}
    assert set(glass) == set(facade)
    for key, area in glass.items():
        assert smallest * facade[key] - 0.005 <= area <= largest * facade[key] + 0.005, key


def check(plans: FloorPlans, floor_area: float, zones: int, floors: int) -> None:
    """Fail when an office breaks any promise of its generator."""
    assert len(plans.floors) == floors
    counts = [len(floor.zone_names) for floor in plans.floors]
    assert sum(counts) == zones
    assert max(counts) - min(counts) <= 1
    assert len({zone for floor in plans.floors for zone in floor.zone_names}) == zones
    inside = sum(int(np.isin(floor.tokens, [".", "#"], invert=True).sum()) for floor in plans.floors)
    assert inside * plans.cell_size**2 == pytest.approx(floor_area, rel=0.005)
    for floor in plans.floors:
        for wall in (".", "#"):
            assert np.array_equal(floor.tokens == wall, plans.floors[0].tokens == wall), "outlines differ"
        check_floor(floor, plans.cell_size, 8.0)
    check_glazing(plans, 0.2, 0.5)


@pytest.fixture(scope="module")
def pilot() -> FloorPlans:
    return generate_office()


def test_the_pilot_has_the_papers_size(pilot: FloorPlans) -> None:
    check(pilot, 6317.0, 123, 2)
    assert [len(floor.zone_names) for floor in pilot.floors] == [62, 61]
    assert [floor.name for floor in pilot.floors] == ["F1", "F2"]


def test_the_pilot_has_127_devices(pilot: FloorPlans) -> None:
    listed = devices(pilot)
    assert Counter(device.type for device in listed) == {"vav": 123, "ahu": 2, "boiler": 1, "chiller": 1}
    assert len({device.name for device in listed}) == 127
    served = [device.zone for device in listed if device.type == "vav"]
    assert served == [zone for floor in pilot.floors for zone in floor.zone_names]
    assert all(device.zone is None for device in listed if device.type != "vav")


@pytest.mark.parametrize("seed", range(1, 9))
def test_pilots_of_other_seeds_keep_every_promise(seed: int) -> None:
    check(generate_office(seed), 6317.0, 123, 2)


@pytest.mark.long
@settings(max_examples=40, deadline=None, derandomize=True)
@given(
    seed=st.integers(0, 2**32 - 1),
    floors=st.integers(1, 3),
    zones_a_floor=st.integers(4, 40),
    zone_area=st.floats(35.0, 110.0),
    cell_size=st.sampled_from([0.4, 0.5, 0.5, 1.0]),
)
def test_other_sizes_keep_every_promise(
    seed: int, floors: int, zones_a_floor: int, zone_area: float, cell_size: float
) -> None:
    zones = floors * zones_a_floor + seed % floors
    floor_area = max(zones * zone_area, 240.0 * floors)
    try:
        plans = generate_office(seed, floor_area=floor_area, zones=zones, floors=floors, cell_size=cell_size)
    except ThermalError as error:
        assert cell_size == 1.0, "only whole metres may miss an area"
        assert "smaller cell_size" in str(error)
        reject()
    check(plans, floor_area, zones, floors)


@pytest.mark.parametrize("floors", [1, 2, 3])
@pytest.mark.parametrize("seed", range(5))
def test_a_small_office(seed: int, floors: int) -> None:
    plans = generate_office(seed, floor_area=600.0, zones=12, floors=floors)
    check(plans, 600.0, 12, floors)
    kinds = {zone.split("_")[1][0] for zone in plans.floors[0].zone_names}
    assert kinds & set("NESW"), "rooms at the facade"
    assert "H" in kinds, "a corridor"


def test_one_zone_is_the_whole_floor() -> None:
    plans = generate_office(3, floor_area=100.0, zones=1, floors=1)
    check(plans, 100.0, 1, 1)
    assert "+" not in plans.floors[0].tokens
    assert set(plans.glazing["F1_C01"]) == {"north", "east", "south", "west"}


def test_same_seed_same_office_other_seed_another(pilot: FloorPlans) -> None:
    again, other = generate_office(0), generate_office(1)
    assert all(np.array_equal(a.tokens, b.tokens) for a, b in zip(pilot.floors, again.floors, strict=True))
    assert pilot.glazing == again.glazing
    assert not np.array_equal(pilot.floors[0].tokens, other.floors[0].tokens)
    assert not np.array_equal(pilot.floors[0].tokens, pilot.floors[1].tokens)


def test_outlines_vary() -> None:
    corners = set()
    for seed in range(12):
        plan = generate_office(seed, floor_area=3158.5, zones=24, floors=1).floors[0]
        inside = np.isin(plan.tokens, [".", "#"], invert=True).astype(int)
        corners.add(int(np.abs(np.diff(np.diff(inside, axis=0), axis=1)).sum()))
    assert {4, 6, 8} <= corners, "rectangle, L, and an outline with two notches or a recess"


@pytest.mark.parametrize("cell_size", [0.25, 1.0])
def test_the_pilot_at_other_cell_sizes(cell_size: float) -> None:
    check(generate_office(cell_size=cell_size), 6317.0, 123, 2)


def test_the_pilot_is_an_office(pilot: FloorPlans) -> None:
    areas = zone_floor_areas(pilot)
    place = {zone: zone.split("_")[1][0] for zone in areas}
    share = {kind: sum(area for zone, area in areas.items() if place[zone] in kind) for kind in ("NESW", "H", "C")}
    total = sum(areas.values())
    assert 0.25 < share["NESW"] / total < 0.7
    assert 0.05 < share["H"] / total < 0.3
    assert share["C"] / total > 0.1
    assert {zone for zone in pilot.glazing} >= {zone for zone, kind in place.items() if kind in "NESW"}


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        ({"floor_area": -1.0}, "floor_area"),
        ({"floor_area": float("nan")}, "floor_area"),
        ({"cell_size": 0.0}, "cell_size"),
        ({"height": 0.0}, "height"),
        ({"floors": 0}, "zones"),
        ({"zones": 1}, "zones"),
        ({"zones": 2000}, "at most 315"),
        ({"zones": 7, "floors": 1, "floor_area": 240.0, "min_zone_area": 13.5, "cell_size": 4.0}, "fewer zones"),
        ({"window_to_wall_ratio": (0.5, 0.2)}, "window_to_wall_ratio"),
        ({"floor_area": 10.0, "zones": 2, "min_zone_area": 1.0, "cell_size": 3.0}, "smaller cell_size"),
        ({"seed": -1}, "seed"),
    ],
)
def test_impossible_offices_are_refused(arguments: dict[str, Any], named: str) -> None:
    with pytest.raises(ThermalError, match=named):
        generate_office(**arguments)
