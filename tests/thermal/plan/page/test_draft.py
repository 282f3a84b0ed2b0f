"""Drafts: what is on the page survives JSON, and nothing gets in that would break what works on it."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from thermal import Building, ZoneTable
from thermal.case.building import Location, ZoneEntry
from thermal.errors import LabelError
from thermal.plan.page.draft import (
    Draft,
    building_of_draft,
    draft_of,
    encode_floor,
    glazed_areas,
    parse_draft,
    zones_of,
)


@given(
    st.lists(
        st.lists(st.sampled_from([".", "#", "+", "A", "B 1", "ä"]), min_size=4, max_size=4), min_size=1, max_size=6
    )
)
def test_any_plan_survives_its_runs(rows: list[list[str]]) -> None:
    tokens = np.array(rows, dtype=np.str_)
    floor = encode_floor("F1", 3.0, tokens)
    assert (floor.tokens == tokens).all()
    parsed = parse_draft(json.loads(Draft(name="x", floors=(floor,)).model_dump_json(by_alias=True)), "draft")
    assert (parsed.floors[0].tokens == tokens).all()


def test_a_building_survives_its_draft(draft_with: Callable[..., Draft]) -> None:
    draft = draft_with(glazing={"A": {"west": 2.0, "east": 0.0}, "B": {}}, orientation=-20.0)
    building = building_of_draft(draft)
    assert building.zone_names == ("A", "B")
    assert building.geometry.glazing == {"A": {"west": 2.0}}  # type: ignore[union-attr]
    building = replace(building, devices=tuple(d.model_copy(update={"emitter": "floor"}) for d in building.devices))
    again = building_of_draft(draft_of(building))
    assert (again.devices, again.location, again.orientation) == (building.devices, building.location, -20.0)


def test_a_zone_table_is_refused_by_name() -> None:
    site = Location(latitude=48.0, longitude=12.0, elevation=690.0, timezone="Europe/Berlin")
    table = ZoneTable((ZoneEntry(name="A", volume=50.0, floor_area=20.0),))
    with pytest.raises(LabelError, match="floor plans, found a zone table"):
        draft_of(Building("listed", site, 0.0, table))


def spoilt(**floor: Any) -> dict[str, Any]:
    """A draft with something wrong in its floor."""
    whole = {"name": "F1", "height": 3.0, "rows": 1, "columns": 4, "legend": [".", "#", "+", "A"], "runs": [3, 4]}
    return {"name": "x", "floors": [{**whole, **floor}]}


@pytest.mark.parametrize(
    ("content", "told"),
    [
        ([], "content"),
        ({"name": 3}, "name"),
        ({"name": "x", "spam": 1}, "spam"),
        ({"name": "x", "cell_size": float("nan")}, "cell_size"),
        ({"name": "x", "revision": -1}, "revision"),
        (spoilt(runs=[3, 5]), "runs of all cells"),
        (spoilt(runs=[4, 4]), "runs of all cells"),
        (spoilt(runs=[3, 4, 3]), "runs of all cells"),
        (spoilt(runs=[3, -4, 3, 8]), "runs of all cells"),
        (spoilt(runs=[-1, 4]), "runs of all cells"),
        (spoilt(runs=[3, 10**30]), "runs of all cells"),
        (spoilt(legend=["A", "#", "+", "."]), "legend"),
        (spoilt(legend=[".", "#", "+", "A", "A"]), "legend"),
        (spoilt(rows=90_000, columns=90_000, runs=[0, 8_100_000_000]), "at most"),
    ],
)
def test_a_spoilt_draft_is_refused_with_its_place(content: Any, told: str) -> None:
    with pytest.raises(LabelError, match=told):
        parse_draft(content, "draft")


def test_zones_are_those_in_use() -> None:
    first = encode_floor("F1", 3.0, np.array([["A", "+", "B"]]))
    second = encode_floor("F2", 3.0, np.array([["A", ".", "."]]))
    assert zones_of([first, second]) == {"A": ["F1", "F2"], "B": ["F1"]}


@pytest.mark.parametrize(
    ("ratio", "own", "expected"),
    [
        ({"": {"": 0.5}}, {}, {"north": 2.25, "south": 2.25, "west": 3.0}),
        ({"": {"": 0.5, "north": 0.0}}, {}, {"south": 2.25, "west": 3.0}),
        ({"": {"": 0.5, "north": 0.1}, "F1": {"": 0.2}}, {}, {"north": 0.9, "south": 0.9, "west": 1.2}),
        ({"": {"": 0.5}, "F1": {"west": 0.25}}, {}, {"north": 2.25, "south": 2.25, "west": 1.5}),
        ({"": {"": 0.5}, "F9": {"": 1.0}}, {}, {"north": 2.25, "south": 2.25, "west": 3.0}),
        ({"": {"": 0.5}}, {"north": 1.0, "west": 0.0}, {"north": 1.0, "south": 2.25}),
        ({}, {"north": 1.0, "west": 0.0}, {"north": 1.0}),
    ],
)
def test_the_nearest_ratio_counts_and_a_zone_overrides_it(
    draft_with: Callable[..., Draft], ratio: Any, own: Any, expected: dict[str, float]
) -> None:
    """Zone A: 1.5 m of facade to the north and south and 2 m to the west, 3 m high."""
    draft = draft_with(glazing_ratio=ratio, glazing={"A": own} if own else {})
    assert glazed_areas(draft)["A"] == pytest.approx(expected)
    assert building_of_draft(draft).geometry.glazing["A"] == pytest.approx(expected)
