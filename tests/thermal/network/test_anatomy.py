"""What a building's parts are: areas between zones, above and below them, outlooks, glass."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from thermal import Building, Case, FloorPlan, FloorPlans, build_network
from thermal.case.building import Location
from thermal.network.network import ThermalNetwork
from thermal.network.structure import BASELINE
from thermal.network.topology import Anatomy

CaseOf = Callable[[str], Case]
SITE = Location(latitude=48.0, longitude=12.0, elevation=690.0, timezone="Etc/GMT-1")
GROUND = ("########", "#AAA+BB#", "#AAA+BB#", "#AAA+BB#", "########")


def anatomy(
    *floors: tuple[str, ...], orientation: float = 0.0, glazing: dict[str, dict[str, float]] | None = None
) -> Anatomy:
    plans = tuple(FloorPlan(f"F{k}", 3.0, np.array([list(row) for row in rows])) for k, rows in enumerate(floors))
    return build_network(Building("test", SITE, orientation, FloorPlans(1.0, plans, glazing or {}))).anatomy


def test_floors_that_lie_on_each_other() -> None:
    # C over all of A and the partition, D over the first column of B, nothing over the second
    upper = ("#######.", "#CCC+D#.", "#CCC+D#.", "#CCC+D#.", "#######.")
    found = anatomy(GROUND, upper)
    # B has 7.5 m2 with its half of the partition, and only one of its two columns under D; the other under a wall,
    # which belongs to the zones beside it
    assert found.stacked == pytest.approx({("A", "C"): 10.5, ("B", "D"): 7.5})
    assert found.under_roof == pytest.approx({"C": 10.5, "D": 4.5})
    assert found.on_ground == pytest.approx({"A": 10.5, "B": 7.5})


def test_what_juts_out_is_not_on_the_ground() -> None:
    lower = ("#####...", "#AAA#...", "#AAA#...", "#AAA#...", "#####...")
    found = anatomy(lower, ("########", "#CCC+DD#", "#CCC+DD#", "#CCC+DD#", "########"))
    assert found.on_ground == {"A": 9.0}
    assert ("A", "C") in found.stacked
    assert found.under_roof == pytest.approx({"C": 10.5, "D": 7.5})


def test_a_terrace_is_a_roof() -> None:
    found = anatomy(GROUND, ("#####...", "#CCC#...", "#CCC#...", "#CCC#...", "#####..."))
    assert found.under_roof == pytest.approx({"B": 7.5, "C": 9.0})


def test_partitions_and_facades() -> None:
    found = anatomy(GROUND, orientation=-35.0)
    assert found.partitions == {("A", "B"): 9.0}
    assert found.facades == pytest.approx(
        {
            ("A", 325.0): 10.5,
            ("A", 145.0): 10.5,
            ("A", 235.0): 9.0,
            ("B", 325.0): 7.5,
            ("B", 145.0): 7.5,
            ("B", 55.0): 9.0,
        }
    )
    walls = {f.outlook.azimuth: f.area.sum() for f in found.outer if not f.outlook.glass}
    assert set(walls) == {325.0, 55.0, 145.0, 235.0}


def test_glass_looks_where_the_turned_building_does() -> None:
    found = anatomy(GROUND, orientation=20.0, glazing={"A": {"south": 2.0}, "B": {"east": 3.0}})
    assert {(p.zone, p.azimuth): p.area for p in found.panes} == {("A", 200.0): 2.0, ("B", 110.0): 3.0}
    glass = [f for f in found.outer if f.outlook.glass]
    assert {f.outlook.azimuth for f in glass} == {200.0, 110.0}
    assert {f.zone for f in glass} == {"A", "B"}


def test_a_plan_that_knows_of_no_glass_has_half_of_each_facade_glazed() -> None:
    found = anatomy(GROUND)
    assert sum(p.area for p in found.panes) == pytest.approx(0.5 * sum(found.facades.values()))
    assert not [f for f in found.outer if f.outlook.glass]  # no window conducts


def test_rooms_hold_what_is_in_them(lively_case: CaseOf) -> None:
    for kind in ("plan", "table"):
        network: ThermalNetwork = build_network(lively_case(kind).building)
        for k, (name, room) in enumerate(network.anatomy.rooms.items()):
            assert (name, k) == (room.name, room.number)
            assert (network.kind[room.air] == "air").all() and (network.zone[room.air] == k).all()
            assert room.share.sum() == pytest.approx(1.0)
            assert network.kind[room.radiant] == "radiant"
            assert network.kind[room.mean] == ("mixing" if kind == "plan" else "air")
            assert network.kind[room.furniture] == "furniture" or not BASELINE.furniture
            assert len(room.floor) == len(room.ceiling) == (BASELINE.slab_nodes if kind == "plan" else 0)
            assert (network.kind[[*room.floor, *room.ceiling]] == "slab").all()


def test_a_zone_table_is_what_it_lists(lively_case: CaseOf) -> None:
    found = build_network(lively_case("table").building).anatomy
    assert found.facades == {("A", 180.0): 15.0, ("B", 270.0): 9.0}
    assert found.partitions == {("A", "B"): 8.0}
    assert found.airflows == ((0, 1),)
    assert [(p.zone, p.area, p.transmittance) for p in found.panes] == [("A", 3.0, 0.5)]
    assert [(g.zone, g.area) for g in found.ground_faces] == [("B", 16.0)]
    tilts = sorted({f.outlook.tilt for f in found.outer})
    assert tilts == [0.0, 90.0]
