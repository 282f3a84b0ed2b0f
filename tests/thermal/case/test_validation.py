"""Every way in which the parts of a building can fail to fit together."""

from collections.abc import Callable
from typing import Any

import pytest

from thermal.case.load import load_case
from thermal.case.validation import NO_WINDOWS
from thermal.errors import CaseError

Speller = Callable[..., str]


def refused(draft: Any, kind: type[CaseError], message: str) -> None:
    with pytest.raises(kind, match=message):
        load_case(draft.write())


def surface(draft: Any, index: int, **changes: object) -> None:
    entry = draft.content["surfaces"][index]
    for key, value in changes.items():
        entry.pop(key, None) if value is None else entry.update({key: value})


def test_unknown_zone_of_a_device(plan_draft: Any) -> None:
    plan_draft.content["devices"][0]["zone"] = "a"
    refused(plan_draft, CaseError, r"devices\[0\] \(VAV_A\): zone: .*found 'a'; the nearest valid one is 'A'")


def test_unknown_zone_of_a_device_in_a_zone_table(table_draft: Any) -> None:
    table_draft.content["devices"][0]["zone"] = "rom"
    refused(table_draft, CaseError, "found 'rom'; the nearest valid one is 'room'")


@pytest.mark.parametrize(
    ("fed_by", "message"),
    [
        (
            ["AHUU"],
            r"devices\[0\] \(VAV_A\): fed_by: expected a device of the building, found 'AHUU'; the nearest valid one is 'AHU'",
        ),
        (["AHU", "VAV_A"], r"devices\[0\] \(VAV_A\): fed_by: expected other devices, found 'VAV_A', the device itself"),
        (["AHU", "AHU"], r"devices\[0\] \(VAV_A\): fed_by: expected each feeder once, found AHU, AHU"),
        (
            ["RAD_B"],
            r"fed_by: expected feeders without a circle, found (VAV_A <- RAD_B <- VAV_A|RAD_B <- VAV_A <- RAD_B)",
        ),
        ("AHU", r"devices\[0\]\.fed_by: expected a list, found 'AHU'"),
        ([""], r"devices\[0\]\.fed_by\[0\]: "),
    ],
)
def test_feeders_that_cannot_be(plan_draft: Any, fed_by: object, message: str) -> None:
    plan_draft.content |= {"format": 3}
    vav_a, radiator, _ = plan_draft.content["devices"]
    radiator["fed_by"] = ["VAV_A"]
    vav_a["fed_by"] = fed_by
    refused(plan_draft, CaseError, message)


def test_two_devices_of_one_name(plan_draft: Any) -> None:
    plan_draft.content["devices"][2]["name"] = "VAV_A"
    refused(plan_draft, CaseError, r"devices\[2\]: .*'VAV_A', which devices\[0\] is named too")


def test_device_named_like_a_zone(plan_draft: Any) -> None:
    plan_draft.content["devices"][2]["name"] = "A"
    refused(plan_draft, CaseError, "'A', which zone 'A' is named too")


def test_weather_station_named_like_a_zone(plan_draft: Any) -> None:
    plan_draft.content["weather_station"] = "A"
    refused(plan_draft, CaseError, "weather_station")


def test_weather_station_may_be_a_device(plan_draft: Any) -> None:
    plan_draft.content["devices"].append({"name": "station", "type": "weather_station"})
    assert load_case(plan_draft.write()).boundary_temperatures()["outdoor"].notna().all()


def test_ragged_plan_names_its_file(plan_draft: Any) -> None:
    plan_draft.plans["plan_F1.csv"] += "#,#\n"
    refused(plan_draft, CaseError, r"plan_F1\.csv: row 5: expected 7 cells")


def test_split_zone_names_its_file(plan_draft: Any, spell_plan: Speller) -> None:
    plan_draft.plans["plan_F1.csv"] = spell_plan("#####", "#A+A#", "#+B+#", "#####")
    refused(plan_draft, CaseError, r"plan_F1\.csv: zone 'A'")


def test_zone_without_a_wall_names_its_file(plan_draft: Any, spell_plan: Speller) -> None:
    plan_draft.plans["plan_F1.csv"] = spell_plan("#######", "#AA+BB.", "#AA+BB#", "#######")
    refused(plan_draft, CaseError, r"plan_F1\.csv: row 2, column 6 \(zone 'B'\)")


def test_zone_on_two_floors(plan_draft: Any, spell_plan: Speller) -> None:
    plan_draft.content["floors"].append({"name": "F2", "height": 3.0, "plan": "plan_F2.csv"})
    plan_draft.plans["plan_F2.csv"] = spell_plan("####", "#BC#", "####")
    refused(plan_draft, CaseError, r"floor 'F2': expected a new zone, found 'B', as floor 'F1'")


def test_floors_of_one_name(plan_draft: Any, spell_plan: Speller) -> None:
    plan_draft.content["floors"].append({"name": "F1", "height": 3.0, "plan": "plan_F2.csv"})
    plan_draft.plans["plan_F2.csv"] = spell_plan("####", "#CD#", "####")
    refused(plan_draft, CaseError, r"floors\[1\]")


@pytest.mark.parametrize("name", ["outdoor", "ground"])
def test_zone_of_a_reserved_name(plan_draft: Any, name: str) -> None:
    plan_draft.plans["plan_F1.csv"] = plan_draft.plans["plan_F1.csv"].replace("B", name)
    refused(plan_draft, CaseError, f"found '{name}'; rename the zone")


def test_reserved_name_in_a_zone_table(table_draft: Any) -> None:
    table_draft.content["zones"].append({"name": "+", "volume": 1.0, "floor_area": 1.0})
    refused(table_draft, CaseError, r"zones\[2\]: .*'\+'")


def test_zone_twice_in_a_table(table_draft: Any) -> None:
    table_draft.content["zones"][1]["name"] = "room"
    refused(table_draft, CaseError, r"zones\[1\]: expected a new zone, found 'room', as zones\[0\]")


@pytest.mark.parametrize("plan", ["plan_F9.csv", "../plan_F1.csv", "/etc/passwd", "sub/../../x.csv", ".", ""])
def test_plan_files_that_are_missing_or_elsewhere(plan_draft: Any, plan: str) -> None:
    plan_draft.folder.parent.mkdir(exist_ok=True)
    (plan_draft.folder.parent / "plan_F1.csv").write_text("#\n")
    plan_draft.content["floors"][0]["plan"] = plan
    outside = plan.startswith(("..", "/", "sub"))
    expected = (
        "a file inside" if outside else "a file of the case folder" if plan else "String should have at least 1 char"
    )
    with pytest.raises(CaseError, match=rf"floors\[0\]\.plan: expected {expected}"):
        load_case(plan_draft.write())


@pytest.mark.parametrize("plan", ["a\0b.csv", "x" * 5000])
def test_plan_files_that_no_disk_can_hold(plan_draft: Any, plan: str) -> None:
    plan_draft.content["floors"][0]["plan"] = plan
    refused(plan_draft, CaseError, r"floors\[0\]\.plan: expected the name of a file")


def test_link_out_of_the_folder_is_outside(plan_draft: Any) -> None:
    folder = plan_draft.write()
    (folder / "plan_F1.csv").rename(folder.parent / "elsewhere.csv")
    (folder / "plan_F1.csv").symlink_to(folder.parent / "elsewhere.csv")
    with pytest.raises(CaseError, match="copy the file into the case"):
        load_case(folder)


def test_missing_telemetry_file(plan_draft: Any) -> None:
    folder = plan_draft.write()
    (folder / "telemetry.parquet").unlink()
    with pytest.raises(CaseError, match=r"building\.yaml: telemetry: .*'telemetry\.parquet'"):
        load_case(folder)


def test_telemetry_file_elsewhere(plan_draft: Any) -> None:
    folder = plan_draft.write()
    plan_draft.content["telemetry"] = "../plan_case/../telemetry.parquet"
    plan_draft.write()
    with pytest.raises(CaseError, match="telemetry"):
        load_case(folder)


def test_glazing_of_an_unknown_zone(plan_draft: Any) -> None:
    plan_draft.content["glazing"] = {"AA": {"south": 1.0}}
    refused(plan_draft, CaseError, r"glazing\.AA: .*the nearest valid one is 'A'")


def test_glazing_of_an_unknown_facade(plan_draft: Any) -> None:
    plan_draft.content["glazing"] = {"A": {"South": 1.0}}
    refused(plan_draft, CaseError, r"glazing\.A\.South: .*the nearest valid one is 'south'")


@pytest.mark.parametrize(("facade", "area"), [("south", 7.7), ("east", 0.1)])
def test_more_glazing_than_facade(plan_draft: Any, facade: str, area: float) -> None:
    plan_draft.content["glazing"] = {"A": {facade: area}}
    refused(plan_draft, CaseError, rf"glazing\.A\.{facade}: expected at most the zone's \d\.\d0 m2")


def test_facade_of_glass(plan_draft: Any) -> None:
    plan_draft.content["glazing"] = {"A": {"south": 7.5, "east": 0.0}}
    load_case(plan_draft.write())


@pytest.mark.parametrize("key", ["from", "to"])
def test_airflow_of_an_unknown_zone(plan_draft: Any, key: str) -> None:
    plan_draft.content["airflows"][0][key] = "C"
    refused(plan_draft, CaseError, rf"airflows\[0\]: {key}: expected a zone")


def test_airflow_of_an_unknown_device(plan_draft: Any) -> None:
    plan_draft.content["airflows"][0]["device"] = "VAV_B"
    refused(plan_draft, CaseError, r"airflows\[0\]: device: .*the nearest valid one is 'VAV_A'")


def test_airflow_to_where_it_comes_from(plan_draft: Any) -> None:
    plan_draft.content["airflows"][0]["to"] = "A"
    refused(plan_draft, CaseError, "another zone than 'from'")


def test_surface_of_an_unknown_zone(table_draft: Any) -> None:
    surface(table_draft, 0, zone="rooom")
    refused(table_draft, CaseError, r"surfaces\[0\] \(W1\): zone: .*the nearest valid one is 'room'")


def test_surface_of_an_unknown_construction(table_draft: Any) -> None:
    surface(table_draft, 0, construction="bricks")
    refused(table_draft, CaseError, r"surfaces\[0\] \(W1\): construction: .*nearest valid one is 'brick'")


@pytest.mark.parametrize("other", ["atic", "outdoors", "cellar"])
def test_boundary_that_nothing_measures(table_draft: Any, other: str) -> None:
    surface(table_draft, 2, other=other)
    del table_draft.frame["attic/zone_air_temperature_sensor"]
    refused(table_draft, CaseError, rf"\(C1\): other: .*'{other}/zone_air_temperature_sensor'.*'{other}'")


def test_surfaces_of_one_name(table_draft: Any) -> None:
    surface(table_draft, 1, name="W1")
    refused(table_draft, CaseError, r"surfaces\[1\]")


@pytest.mark.parametrize("index", [0, 1])
def test_wall_or_window_to_outdoor_without_azimuth(table_draft: Any, index: int) -> None:
    surface(table_draft, index, azimuth=None)
    refused(table_draft, CaseError, r"azimuth: expected a value, found none; give the degrees")


def test_azimuth_is_not_needed_elsewhere(table_draft: Any) -> None:
    surface(table_draft, 2, other="outdoor")
    surface(table_draft, 6, other="outdoor")
    del table_draft.frame["attic/zone_air_temperature_sensor"]
    assert load_case(table_draft.write()).building.measured_boundaries == ()


@pytest.mark.parametrize(
    ("index", "changes", "message"),
    [
        (0, {"construction": None}, "construction: expected a value, for a wall, found none"),
        (0, {"u_value": 1.0}, "u_value: expected no such key, found 1.0; of kind wall: construction"),
        (1, {"u_value": None}, "u_value: expected a value, for a window"),
        (1, {"solar_transmittance": None}, "solar_transmittance: expected a value, for a window"),
        (1, {"construction": "brick"}, "construction: expected no such key"),
        (2, {"construction": None}, "construction: expected a value, for a ceiling"),
        (3, {"u_value": None}, "u_value: expected a value, for a bridge"),
        (3, {"solar_transmittance": 0.5}, "solar_transmittance: expected no such key"),
        (4, {"u_value": 1.0}, "u_value: expected no such key, found 1.0; of kind opening: only an area"),
        (4, {"other": "outdoor"}, "other: expected a zone, for an opening"),
        (4, {"other": "room"}, "other: expected something else than the zone itself"),
        (1, {"other": "room"}, "other: expected something else than the zone itself"),
    ],
)
def test_properties_that_do_not_go_with_the_kind(
    table_draft: Any, index: int, changes: dict[str, object], message: str
) -> None:
    surface(table_draft, index, **changes)
    refused(table_draft, CaseError, message)


def test_construction_without_layers(table_draft: Any) -> None:
    table_draft.content["constructions"]["air"] = []
    refused(table_draft, CaseError, r"constructions\.air: expected at least one layer")


def test_column_of_nothing(plan_draft: Any) -> None:
    plan_draft.frame["VAV_B/heating_power_sensor"] = 1.0
    refused(plan_draft, CaseError, r"'VAV_B/heating_power_sensor': .*the nearest valid one is 'VAV_A'")


def test_attic_is_no_entity_when_no_surface_names_it(table_draft: Any) -> None:
    del table_draft.content["surfaces"][2]
    refused(table_draft, CaseError, "'attic'")


def test_unknown_device_types_are_not_refused(plan_draft: Any) -> None:
    plan_draft.content["devices"].append({"name": "X", "type": "heat_pump_of_the_future", "zone": "A"})
    assert load_case(plan_draft.write()).building.devices[-1].type == "heat_pump_of_the_future"


def test_one_zone_and_no_devices_are_valid(table_draft: Any) -> None:
    content = table_draft.content
    content["zones"], content["surfaces"] = content["zones"][:1], content["surfaces"][:2]
    del content["devices"]
    table_draft.frame = table_draft.frame[[c for c in table_draft.frame if c.startswith(("room", "station"))]]
    case = load_case(table_draft.write())
    assert case.building.zone_names == ("room",)
    assert (case.zone_heat() == 0.0).all().all()


def test_a_building_without_windows_is_said_to_have_none(plan_draft: Any, table_draft: Any) -> None:
    assert NO_WINDOWS not in load_case(plan_draft.write()).remarks
    plan_draft.content["glazing"] = {}
    assert load_case(plan_draft.write()).remarks[0] == NO_WINDOWS
    table_draft.content["surfaces"] = [s for s in table_draft.content["surfaces"] if s["kind"] != "window"]
    assert load_case(table_draft.write()).remarks[0] == NO_WINDOWS
