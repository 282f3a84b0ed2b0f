"""Devices of CSV, Brick and Haystack; columns matched to them."""

from __future__ import annotations

import json
from pathlib import Path

import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from thermal.case.building import Device
from thermal.errors import PlanError
from thermal.plan.match import match_points, read_columns, write_matches
from thermal.plan.models import read_devices

ZONES = ["F1_R01", "F1_R02"]

BRICK = """
@prefix brick: <https://brickschema.org/schema/Brick#> .
@prefix ref: <https://brickschema.org/schema/Brick/ref#> .
@prefix rdfs: <http://www.w3.org/2000/01/rdf-schema#> .
@prefix : <urn:b#> .
:VAV_1 a brick:Variable_Air_Volume_Box_With_Reheat ; brick:feeds :Z1 ; brick:hasPoint :T1, :D1 .
:Z1 a brick:HVAC_Zone ; brick:hasPart :R1 .
:R1 a brick:Room ; rdfs:label "F1-R01" .
:T1 a brick:Zone_Air_Temperature_Sensor ; ref:hasExternalReference [ ref:hasTimeseriesId "abc-1" ] .
:D1 a brick:Discharge_Air_Temperature_Sensor .
:AHU a brick:AHU ; brick:feeds :VAV_1 ; brick:hasPoint :S1 .
:S1 a brick:Supply_Air_Temperature_Sensor .
:Far a brick:Fan_Coil_Unit ; brick:feeds :Z9 ; brick:isFedBy :AHU .
:Z9 a brick:HVAC_Zone .
"""

ENTITIES = [
    {"id": "@vav1", "dis": "VAV-1", "equip": "M", "vav": "M", "spaceRef": "@r1"},
    {"id": "@r1", "dis": "F1 R01", "space": "M"},
    {"id": "@p1", "point": "M", "equipRef": "@vav1", "zone": "M", "air": "M", "temp": "M", "sensor": "M"},
    {"id": "@ahu", "dis": "AHU, main", "equip": "M", "ahu": "M", "hotWaterRef": "@b"},
    {"id": "@b", "dis": "B", "equip": "M", "boiler": "M"},
    {"id": "@p2", "point": "M", "equipRef": "@ahu", "discharge": "M", "air": "M", "temp": "M", "sensor": "M"},
]


def haystack(path: Path) -> Path:
    """Write the entities in the form that a file's name says."""
    tags = list(dict.fromkeys(tag for entity in ENTITIES for tag in entity))
    if path.suffix == ".zinc":
        rows = [
            ",".join(f'"{e[t]}"' if t == "dis" and t in e else e.get(t, "") for t in tags).rstrip() for e in ENTITIES
        ]
        path.write_text('ver:"3.0"\n' + ",".join(tags) + "\n" + "\n".join(rows) + "\n", encoding="utf-8")
        return path
    version4 = "4" in path.stem

    def value(text: str) -> object:
        if text == "M":
            return {"_kind": "marker"} if version4 else "m:"
        if text.startswith("@"):
            return {"_kind": "ref", "val": text[1:]} if version4 else f"r:{text[1:]} a name"
        return text

    rows_ = [{tag: value(text) for tag, text in entity.items()} for entity in ENTITIES]
    path.write_text(json.dumps({"meta": {"ver": "3.0"}, "cols": [], "rows": rows_}), encoding="utf-8")
    return path


@pytest.mark.parametrize("sign", [",", ";", "\t"])
def test_a_csv_of_any_sign(tmp_path: Path, sign: str) -> None:
    rows = [["Equipment", "Class", "Room"], ["VAV 1", "VAV w/ reheat", "f1-r1"], ["X", "Flux capacitor", "attic"]]
    rows += [["AHU-1", "", ""]]
    (tmp_path / "d.csv").write_text("\n".join(sign.join(row) for row in rows), encoding="utf-8")
    found = read_devices(tmp_path / "d.csv", ZONES)
    assert found.devices[0] == Device(name="VAV 1", type="vav", zone="F1_R01", fed_by=("AHU-1",))
    assert found.devices[2] == Device(name="AHU-1", type="ahu")
    assert found.unplaced == {"X": "attic"} and found.unknown_types == {"X": "Flux capacitor"}


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "empty"),
        ("foo,bar\n1,2", "column 'name'"),
        ("name\n", "at least one"),
        ("name,type\nA,vav\nA,vav", "'A', which device 1"),
        ("name,type\nA", "row 2"),
        ("name,type\n,vav", "a blank"),
    ],
)
def test_lists_that_are_none_are_refused(tmp_path: Path, text: str, message: str) -> None:
    (tmp_path / "d.csv").write_text(text, encoding="utf-8")
    with pytest.raises((PlanError), match=message):
        read_devices(tmp_path / "d.csv", ZONES)


@pytest.mark.filterwarnings("ignore::DeprecationWarning", "ignore::ResourceWarning")
def test_a_brick_model(tmp_path: Path) -> None:
    pytest.importorskip("brickschema", reason="needs the extra [plan]")
    (tmp_path / "b.ttl").write_text(BRICK, encoding="utf-8")
    found = read_devices(tmp_path / "b.ttl", ZONES)
    assert {d.name: (d.type, d.zone) for d in found.devices} == {
        "VAV_1": ("vav", "F1_R01"),
        "AHU": ("ahu", None),
        "Far": ("fan_coil", None),
    }
    assert {d.name: d.fed_by for d in found.devices} == {"VAV_1": ("AHU",), "AHU": (), "Far": ("AHU",)}
    assert found.unplaced == {"Far": "Z9"}
    points = {p.column: (p.entity, p.point) for p in found.points}
    assert points["abc-1"] == ("VAV_1", "zone_air_temperature_sensor")
    assert points["D1"] == ("VAV_1", "discharge_air_temperature_sensor")
    assert points["S1"] == ("AHU", "supply_air_temperature_sensor")
    (match,) = match_points(["abc-1"], found.devices, ZONES, listed=found.points)
    assert (match.entity, match.confidence, match.remark) == ("VAV_1", 1.0, "")
    (tmp_path / "b.ttl").write_text("<<<", encoding="utf-8")
    with pytest.raises(PlanError, match="Turtle"):
        read_devices(tmp_path / "b.ttl", ZONES)


@pytest.mark.parametrize("name", ["h3.json", "h4.json", "h.zinc"])
def test_a_haystack_export(tmp_path: Path, name: str) -> None:
    found = read_devices(haystack(tmp_path / name), ZONES)
    assert found.devices == (
        Device(name="VAV-1", type="vav", zone="F1_R01", fed_by=("AHU, main",)),
        Device(name="AHU, main", type="ahu", fed_by=("B",)),
        Device(name="B", type="boiler"),
    )
    points = {p.column: (p.entity, p.point) for p in found.points}
    assert points == {
        "p1": ("VAV-1", "zone_air_temperature_sensor"),
        "p2": ("AHU, main", "supply_air_temperature_sensor"),
    }


def test_columns_of_the_trade_are_matched() -> None:
    devices = [Device(name="VAV_1", type="vav"), Device(name="VAV_11", type="vav"), Device(name="AHU_F1", type="ahu")]
    wanted = {
        "vav-01 Zn Temp": "VAV_1/zone_air_temperature_sensor",
        "F1-R02 temp": "F1_R02/zone_air_temperature_sensor",
        "VAV11.DAT": "VAV_11/discharge_air_temperature_sensor",
        "VAV11_airflow": "VAV_11/supply_air_flowrate_sensor",
        "VAV 1 Damper Pos": "VAV_1/supply_air_damper_percentage_command",
        "VAV_1 reheat vlv": "VAV_1/heating_water_valve_percentage_command",
        "VAV_1_ClgSP": "VAV_1/zone_air_cooling_temperature_setpoint",
        "AHU-F1 SAT": "AHU_F1/supply_air_temperature_sensor",
        "OAT": "weather_station/outside_air_temperature_sensor",
    }
    matches = match_points(list(wanted), devices, ZONES)
    assert {m.column: f"{m.entity}/{m.point}" for m in matches} == wanted
    assert not any(m.remark for m in matches)


def test_what_is_not_matched_says_why() -> None:
    devices = [Device(name="VAV_1", type="vav")]
    columns = ["VAV_1 zat", "VAV 01 zone temp", "VAV_2 zat", "VAV_1 xyzzy", "lights"]
    first, second, third, fourth, fifth = match_points(columns, devices)
    assert first.remark == "" and "fits as well" in second.remark
    assert third.remark == fifth.remark == "no device or zone of that name"
    assert fourth.remark == "no point type like that"


@given(st.lists(st.text(max_size=30), max_size=8))
def test_any_names_are_taken(columns: list[str]) -> None:
    matches = match_points(columns, [Device(name="VAV_1", type="vav")], ZONES)
    assert [m.column for m in matches] == columns
    assert all(0.0 <= m.confidence <= 1.0 for m in matches)
    pairs = [(m.entity, m.point) for m in matches if not m.remark]
    assert len(set(pairs)) == len(set(m.column for m in matches if not m.remark))


def test_columns_of_files(tmp_path: Path) -> None:
    frame = pd.DataFrame({"a": [1.0], "b,c": [2.0]}, index=pd.Index(["2023-01-01T00:00Z"], name="timestamp"))
    frame.to_csv(tmp_path / "t.csv")
    frame.to_parquet(tmp_path / "t.parquet")
    assert read_columns(tmp_path / "t.csv") == read_columns(tmp_path / "t.parquet") == ("a", "b,c")
    (tmp_path / "x.parquet").write_bytes(b"nothing")
    with pytest.raises(PlanError):
        read_columns(tmp_path / "x.parquet")
    file = write_matches(match_points(["a", "b,c"], [Device(name="A", type="vav")]), tmp_path / "points.csv")
    assert file.read_text(encoding="utf-8").splitlines()[2].startswith('"b,c",')
