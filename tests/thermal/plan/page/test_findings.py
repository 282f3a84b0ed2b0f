"""Findings: each fault of the library's own checks, beside the object that it is about."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from thermal.case.building import Airflow
from thermal.plan.page.draft import Draft, DraftDevice, Site
from thermal.plan.page.findings import find_faults, zone_facts

Make = Callable[..., Draft]
VAV = DraftDevice(name="VAV_A", type="vav", zone="A")


def errors(draft: Draft, columns: tuple[str, ...] = ()) -> set[tuple[str, str]]:
    """Kind and name of what is wrong."""
    return {(f.kind, f.name) for f in find_faults(draft, columns) if f.level == "error"}


def test_a_finished_draft_has_no_fault(draft_with: Make) -> None:
    assert find_faults(draft_with(glazing_ratio={"": {"": 0.3}})) == ()


def test_a_building_without_windows_is_told(draft_with: Make) -> None:
    (found,) = find_faults(draft_with())
    assert (found.level, found.kind) == ("remark", "case") and "the building has no windows" in found.message
    for given in ({"glazing": {"A": {"west": 1.0}}}, {"glazing_ratio": {"F1": {"west": 0.2}}}):
        assert find_faults(draft_with(**given)) == ()
    assert len(find_faults(draft_with(glazing_ratio={"": {"": 0.0}}))) == 1


def test_each_faulty_zone_is_told_apart_with_its_place(draft_with: Make) -> None:
    draft = draft_with("......", ".####.", ".#A+B.", ".#A+B.", ".####.", ".#C+A.", ".####.")
    found = {f.name: f.message for f in find_faults(draft) if f.kind == "zone" and f.level == "error"}
    assert "row 3, column 5 (zone 'B')" in found["B"] and "a wall to the right" in found["B"]
    assert set(found) == {"A", "B"}  # C stands well, A has two parts


def test_places_are_counted_from_the_first_cell_of_the_plan(draft_with: Make) -> None:
    draft = draft_with(
        *("." * 9,) * 5, "....###..", "....#A#..", "....###..", "....#A#..", "....###..", "." * 9, devices=()
    )
    (message,) = [f.message for f in find_faults(draft) if f.level == "error"]
    assert "row 7, column 6 and row 9, column 6" in message


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({"site": Site()}, {("site", k) for k in ("latitude", "longitude", "elevation", "timezone")}),
        ({"site": Site(latitude=91.0, longitude=0.0, elevation=0.0, timezone="Europe/Berlin")}, {("site", "latitude")}),
        ({"site": Site(latitude=1.0, longitude=0.0, elevation=0.0, timezone="Mars/City")}, {("site", "timezone")}),
        ({"name": " "}, {("site", "name")}),
        ({"orientation": 400.0}, {("site", "orientation")}),
        ({"floors": ()}, {("floor", ""), ("device", "VAV_A"), ("device", "VAV_B")}),
        ({"devices": (VAV, VAV)}, {("device", "VAV_A")}),
        ({"devices": (VAV.model_copy(update={"zone": "C"}),)}, {("device", "VAV_A")}),
        ({"devices": (VAV.model_copy(update={"type": ""}),)}, {("device", "VAV_A")}),
        ({"devices": (VAV.model_copy(update={"name": "weather_station"}),)}, {("device", "weather_station")}),
        ({"weather_station": "A"}, {("zone", "A")}),
        ({"glazing": {"A": {"west": 7.0}}}, {("zone", "A")}),
        ({"glazing": {"A": {"up": 1.0}}}, {("zone", "A")}),
        ({"glazing": {"C": {"west": 1.0}}}, {("case", "C")}),
        ({"glazing_ratio": {"": {"west": 1.5}, "F1": {"": -0.1}}}, {("case", ""), ("case", "F1")}),
        ({"airflows": (Airflow(source="A", target="B", device="spam", fraction=0.5),)}, {("case", "two rooms")}),
    ],
)  # fmt: skip
def test_a_fault_is_told_beside_its_object(draft_with: Make, changes: dict[str, Any], expected: set[Any]) -> None:
    assert errors(draft_with(**changes)) == expected


def test_telemetry_of_something_renamed_is_told(draft_with: Make) -> None:
    assert errors(draft_with(), ("VAV_A/zone_air_temperature_sensor",)) == set()
    assert errors(draft_with(), ("VAV_X/zone_air_temperature_sensor",)) == {("case", "two rooms")}


def test_what_is_worth_a_look_is_no_error(draft_with: Make) -> None:
    devices = (VAV.model_copy(update={"zone": None}), DraftDevice(name="X", type="lamp", zone="B"))
    found = {(f.kind, f.name, f.level) for f in find_faults(draft_with(devices=devices))}
    told = {("zone", "A", "remark"), ("device", "VAV_A", "remark"), ("device", "X", "remark")}
    assert found == told | {("case", "two rooms", "remark")}


def test_two_floors_must_differ(draft_with: Make) -> None:
    floor = draft_with().floors[0]
    found = errors(draft_with(floors=(floor, floor)))
    assert ("floor", "F1") in found and ("zone", "A") in found


def test_facts_are_those_of_the_case(draft_with: Make) -> None:
    facts = zone_facts(draft_with())
    assert facts["A"]["area"] == pytest.approx(3.0)  # two cells and half of two cells of wall
    assert facts["A"]["facades"]["west"] == pytest.approx(6.0)
