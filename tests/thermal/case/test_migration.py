"""Formats 1 and 2 become format 3 when read, format 3 comes back as it is, and the page on the format is complete."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pandas as pd
import pytest
import yaml
from pydantic import BaseModel

from thermal.case import building as schema
from thermal.case.load import FORMAT, certain_feeders, load_case, migrate
from thermal.case.points import POINT_TYPES
from thermal.case.save import save_case
from thermal.case.validation import check_building
from thermal.errors import CaseError
from thermal.pilot.building import pilot_building
from thermal.units import QUANTITIES

PAGE = Path(__file__).parents[3] / "docs" / "case-format.md"


@pytest.mark.parametrize("number", [1, 2])
def test_earlier_formats_are_migrated_and_saved_as_format_3(plan_draft: Any, tmp_path: Path, number: int) -> None:
    plan_draft.content["format"] = number
    case = load_case(plan_draft.write())
    assert {d.name: d.fed_by for d in case.building.devices} == {"VAV_A": ("AHU",), "RAD_B": (), "AHU": ()}
    assert case.building.geometry_quality == "approximate"
    folder = save_case(case, tmp_path / "new")
    content = yaml.safe_load((folder / "building.yaml").read_text(encoding="utf-8"))
    assert content["format"] == FORMAT == 3
    assert content["devices"] == [
        {"name": "VAV_A", "type": "vav", "zone": "A", "fed_by": ["AHU"]},
        {"name": "RAD_B", "type": "radiator", "zone": "B"},
        {"name": "AHU", "type": "ahu"},
    ]
    again = load_case(folder)
    assert again.building.devices == case.building.devices
    pd.testing.assert_frame_equal(again.telemetry.frame, case.telemetry.frame, check_freq=False)
    pd.testing.assert_frame_equal(again.zone_heat(), case.zone_heat(), check_freq=False)


@pytest.mark.parametrize("quality", ["surveyed", "approximate", "generic"])
def test_format_3_comes_back_as_it_is(plan_draft: Any, tmp_path: Path, quality: str) -> None:
    plan_draft.content |= {"format": 3, "geometry_quality": quality}
    plan_draft.content["devices"][1]["fed_by"] = ["AHU"]  # as odd as it is: nothing is guessed in format 3
    case = load_case(save_case(load_case(plan_draft.write()), tmp_path / "new"))
    assert [d.fed_by for d in case.building.devices] == [(), ("AHU",), ()]
    assert case.building.geometry_quality == quality


def test_another_quality_is_refused(plan_draft: Any) -> None:
    plan_draft.content |= {"format": 3, "geometry_quality": "survey"}
    with pytest.raises(CaseError, match=r"geometry_quality: .*found 'survey'; the nearest valid one is 'surveyed'"):
        load_case(plan_draft.write())


@pytest.mark.parametrize("number", [1, 2])
def test_a_key_of_format_3_in_an_earlier_one_is_refused(plan_draft: Any, number: int) -> None:
    plan_draft.content["format"] = number
    plan_draft.content["devices"][1]["fed_by"] = ["AHU"]
    with pytest.raises(CaseError, match=r"devices\[1\]\.fed_by: .*found 'fed_by'; write 'format: 3'"):
        load_case(plan_draft.write())
    del plan_draft.content["devices"][1]["fed_by"]
    plan_draft.content["geometry_quality"] = "generic"
    with pytest.raises(CaseError, match="geometry_quality: .*write 'format: 3'"):
        load_case(plan_draft.write())


@pytest.mark.parametrize("devices", [None, "VAV", [1], [{"name": ["A"], "type": "vav"}, {"type": "ahu"}], [{}]])
def test_malformed_devices_are_left_for_the_schema_to_refuse(plan_draft: Any, devices: object) -> None:
    plan_draft.content |= {"format": 2, "devices": devices}
    with pytest.raises(CaseError, match=r"building\.yaml: devices"):
        load_case(plan_draft.write())


def test_only_what_is_certain_is_fed() -> None:
    one = {"V": "vav", "S": "supply_air_terminal", "R": "radiator", "F": "fan_coil", "A": "ahu", "B": "boiler"}
    assert certain_feeders(one) == {"V": ("A",), "S": ("A",), "R": ("B",)}
    assert certain_feeders(one | {"A2": "ahu", "B2": "boiler"}) == {}
    content = {"format": 1, "devices": [{"name": name, "type": kind} for name, kind in one.items()]}
    before = repr(content)
    assert [d.get("fed_by") for d in migrate(content, "f")["devices"]] == [["A"], ["A"], ["B"], None, None, None]
    assert repr(content) == before


def test_the_generated_office_says_what_feeds_what() -> None:
    building = pilot_building(0, floor_area=400.0, zones=8, floors=2)
    check_building(building)
    fed = {device.name: device.fed_by for device in building.devices}
    assert {fed[name] for name in fed if name.startswith("VAV_F2")} == {("AHU_F2", "BOILER")}
    assert fed["AHU_F1"] == ("BOILER", "CHILLER") and fed["BOILER"] == ()


def test_the_page_has_each_key_and_each_point() -> None:
    text = PAGE.read_text(encoding="utf-8")
    shown = {word for quoted in re.findall(r"`([^`\n]+)`", text) for word in re.findall(r"\w+", quoted)}
    models = [m for m in vars(schema).values() if isinstance(m, type) and issubclass(m, BaseModel)]
    keys = {field.alias or name for model in models for name, field in model.model_fields.items()}
    assert {"fed_by", "geometry_quality", "solar_transmittance", "from"} <= keys
    assert not keys - shown, f"docs/case-format.md lacks the keys {sorted(keys - shown)}"
    assert not {*schema.DEVICE_TYPES} - shown
    rows = dict(re.findall(r"^\| `(\w+)` \| (\S+) \| \S+ to \S+ \| ", text, re.MULTILINE))
    assert rows == {name: QUANTITIES[point.quantity].file_unit for name, point in POINT_TYPES.items()}
