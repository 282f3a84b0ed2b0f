"""Points of a network are matched to devices; every doubt is listed, and nothing counts before a person confirms it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import pytest
import yaml

from thermal.case.building import Building, Device, Location, ZoneEntry, ZoneTable
from thermal.errors import PlanError
from thermal.pilot.building import pilot_building
from thermal.plan.discovery import NetworkPoint, points_of_model, propose, read_proposal, write_proposal
from thermal.plan.match import read_matches, write_matches
from thermal.plan.models import read_devices

SITE = Location(latitude=48, longitude=12, elevation=0, timezone="Europe/Berlin")
TABLE = ZoneTable((ZoneEntry(name="hall", volume=50, floor_area=20), ZoneEntry(name="office 2", volume=50, floor_area=20)))  # fmt: skip
HOUSE = Building("house", SITE, 0.0, TABLE, (Device(name="VAV_1", type="vav", zone="hall"), Device(name="AHU_1", type="ahu")))  # fmt: skip


@pytest.mark.parametrize("habit", ["contractor", "integrator", "opaque"])
def test_generated_names_of_three_habits(habit: str, script: Callable[[str], ModuleType]) -> None:
    building, counts = pilot_building(1, floor_area=600.0, zones=12, name="office"), Counter[str]()
    for seed in (30, 31):
        listed = list(script("_network_names").network_points(building, habit, seed))
        truth = {point.address: what for point, what in listed}
        found = propose([point for point, _ in listed], building)
        assert len(found.points) == len(listed)  # none is left out
        for point in found.points:
            entity, kind = truth[point.address]
            right = (point.entity, point.point) == (entity, kind)
            counts[f"{bool(entity)} {point.status} {right}"] += 1
            assert point.remark or point.status == "matched"
    wrong = counts["True matched False"] + counts["False matched False"]
    points = sum(n for name, n in counts.items() if name.startswith("True"))
    assert wrong <= 0.01 * points, counts
    assert counts["True matched True"] >= 0.4 * points, counts
    assert counts["True matched True"] + counts["True doubtful True"] >= 0.7 * points, counts


def test_units_and_objects_say_what_a_point_can_be() -> None:
    points = [
        NetworkPoint("1 analog-input,1", "VAV-1 ZN-T", unit="degrees-fahrenheit"),
        NetworkPoint("1 analog-input,2", "VAV-1 ZN-T", unit="hertz"),
        NetworkPoint("1 analog-value,3", "VAV-1 HTG", "Zone heating temperature setpoint", unit="degrees-celsius"),
        NetworkPoint("1 binary-input,4", "VAV-1 ZN-T"),
        NetworkPoint("1 analog-input,5", "Flow", "VAV 1 supply air flowrate", "MSTP-7", "liters-per-second"),
        NetworkPoint("1 analog-input,6", "something else"),
    ]
    found = {p.address.rpartition(",")[2]: p for p in propose(points, HOUSE).points}
    assert found["1"].status == "matched" and found["1"].unit == "degF" and found["1"].entity == "VAV_1"
    assert found["2"].status == "unmatched" and "hertz measures none" in found["2"].remark
    assert found["3"].point == "zone_air_heating_temperature_setpoint"
    assert found["4"].status == "unmatched" and "binary-input" in found["4"].remark
    assert (found["5"].entity, found["5"].point) == ("VAV_1", "supply_air_flowrate_sensor")
    assert found["6"].status == "unmatched"
    rival = NetworkPoint("1 analog-input,7", "vav1 zone air temperature")
    both = {p.name: p for p in propose([points[0], rival], HOUSE).points}
    assert both[rival.name].status == "matched" and "fits as well or better" in both["VAV-1 ZN-T"].remark


def test_a_person_confirms(tmp_path: Path) -> None:
    points = [NetworkPoint("1 analog-input,1", "VAV-1 zone air temperature"), NetworkPoint("1 analog-input,2", "xyz")]
    file = write_proposal(propose(points, HOUSE), tmp_path / "proposal.yaml")
    assert read_proposal(file, HOUSE).points == ()
    content = yaml.safe_load(file.read_text())
    for point in content["points"]:
        point["confirmed"] = True
        if point["name"] == "xyz":
            point |= {"entity": "AHU_1", "point": "return_air_temperature_sensor"}
    file.write_text(yaml.safe_dump(content))
    assert {p.entity for p in read_proposal(file, HOUSE).points} == {"VAV_1", "AHU_1"}
    for change, text in (
        ({"entity": "AHU_9"}, "AHU_1"), ({"point": "zone_air"}, "a point type"), ({"colour": 1}, "colour"),
        ({"entity": "VAV_1", "point": "zone_air_temperature_sensor"}, "confirm one of them"),
    ):  # fmt: skip
        spoilt = yaml.safe_load(file.read_text())
        at = next(i for i, p in enumerate(spoilt["points"]) if p["name"] == "xyz")
        spoilt["points"][at] |= change
        (tmp_path / "spoilt.yaml").write_text(yaml.safe_dump(spoilt))
        with pytest.raises(PlanError, match=text):
            read_proposal(tmp_path / "spoilt.yaml", HOUSE)


def test_points_for_the_labelling_page(tmp_path: Path) -> None:
    points = [NetworkPoint("1 analog-input,1", "VAV-1 zone air temperature"), NetworkPoint("1 analog-input,2", "xyz")]
    kept = read_matches(write_matches(propose(points, HOUSE).matches(), tmp_path / "points.csv"))
    assert {(m.column, m.entity, bool(m.remark)) for m in kept} == {
        ("VAV-1 zone air temperature", "VAV_1", False), ("xyz", "", True),
    }  # fmt: skip


def test_a_haystack_export_becomes_a_proposal(tmp_path: Path) -> None:
    file = tmp_path / "site.json"
    file.write_text(
        '{"rows": [{"id": "r:v1", "dis": "VAV-1", "equip": "m:", "vav": "m:"},'
        '{"id": "r:p1", "dis": "zt", "point": "m:", "equipRef": "r:v1", "zone": "m:", "air": "m:", "temp": "m:", "sensor": "m:"},'
        '{"id": "r:p2", "dis": "odd", "point": "m:", "equipRef": "r:v1"}]}'
    )
    found = propose(points_of_model(read_devices(file, HOUSE.zone_names)), HOUSE)
    told = {p.address: p for p in found.points}
    assert (told["p1"].entity, told["p1"].point, told["p1"].score) == ("VAV_1", "zone_air_temperature_sensor", 1.0)
    assert told["p2"].status == "unmatched"
