import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from thermal.case.check import check_case, describe_case
from thermal.case.load import load_case
from thermal.errors import CaseError


def test_building_in_numbers(plan_draft: Any) -> None:
    check = check_case(plan_draft.write())
    assert (check.name, check.geometry, check.floors) == ("two rooms", "floor plans", ("F1",))
    assert [(zone.name, zone.floor, zone.floor_area, zone.volume) for zone in check.zones] == [
        ("A", "F1", 5.0, 15.0),
        ("B", "F1", 5.0, 15.0),
    ]
    assert (check.floor_area, check.volume) == (10.0, 30.0)
    assert check.zones[0].measured_by == ("VAV_A/zone_air_temperature_sensor",)
    assert check.zones[1].devices == ("RAD_B",)
    assert (check.step, check.n_time) == (300.0, 48)
    assert check.start.isoformat() == "2023-03-01T00:05:00-06:00"
    assert check.location.timezone == "Etc/GMT+6"


def test_zone_table_in_numbers(table_draft: Any) -> None:
    check = check_case(table_draft.write())
    assert (check.geometry, check.floors, check.measured_boundaries) == ("zone table", (), ("attic",))
    assert [(zone.name, zone.floor, zone.floor_area, zone.volume) for zone in check.zones] == [
        ("room", None, 20.0, 50.0),
        ("hall", None, 10.0, 25.0),
    ]


def test_what_each_measured_point_is(table_draft: Any) -> None:
    table_draft.frame.iloc[3, 2] = np.nan
    points = {point.column: point for point in check_case(table_draft.write()).points}
    kinds = {column: (point.entity_kind, point.zone) for column, point in points.items()}
    assert kinds == {
        "station/outside_air_temperature_sensor": ("weather station", None),
        "room/zone_air_temperature_sensor": ("zone", "room"),
        "hall/zone_air_temperature_sensor": ("zone", "hall"),
        "attic/zone_air_temperature_sensor": ("boundary", None),
        "HEATER/heating_power_sensor": ("device", "room"),
    }
    hall = points["hall/zone_air_temperature_sensor"]
    assert (hall.meaning, hall.unit) == ("air temperature of the zone", "degC")
    assert hall.usable_share == pytest.approx(47 / 48)
    assert hall.highest == pytest.approx(19.5, abs=0.01)
    heater = points["HEATER/heating_power_sensor"]
    assert (heater.lowest, heater.mean, heater.highest, heater.unit) == (500.0, 500.0, 500.0, "W")


def test_point_without_values(plan_draft: Any) -> None:
    plan_draft.frame["B/zone_air_temperature_sensor"] = np.nan
    check = check_case(plan_draft.write())
    silent = next(point for point in check.points if point.column == "B/zone_air_temperature_sensor")
    assert (silent.lowest, silent.mean, silent.highest, silent.usable_share) == (None, None, None, 0.0)
    assert "column 'B/zone_air_temperature_sensor' never reports a value" in check.remarks


def test_unknown_device_types_are_reported(plan_draft: Any) -> None:
    plan_draft.content["devices"].append({"name": "X", "type": "fan_coyl", "zone": "A"})
    check = check_case(plan_draft.write())
    assert check.unknown_device_types == {"X": "fan_coyl"}
    assert [device.known for device in check.devices] == [True, True, True, False]
    assert "device 'X' has the unknown type 'fan_coyl' (the nearest valid one is 'fan_coil')" in check.remarks


def test_devices_and_their_points(plan_draft: Any) -> None:
    devices = check_case(plan_draft.write()).devices
    assert devices[0].points == (
        "zone_air_temperature_sensor",
        "supply_air_flowrate_sensor",
        "discharge_air_temperature_sensor",
    )
    assert (devices[2].name, devices[2].zone, devices[2].points) == ("AHU", None, ())


@pytest.mark.parametrize(
    ("dropped", "remark"),
    [
        (["VAV_A/zone_air_temperature_sensor"], "nothing measures the temperature of zone 'A'"),
        (["RAD_B/heating_power_sensor"], "'RAD_B' reports neither flow nor power: the heat of zone 'B' is unknown"),
        (["RAD_B/heating_power_sensor"], "device 'RAD_B' has no telemetry"),
        (
            ["VAV_A/discharge_air_temperature_sensor"],
            "'VAV_A' reports a flow without a discharge temperature: the heat of zone 'A' is unknown while air flows",
        ),
        (["VAV_A/supply_air_flowrate_sensor"], "'VAV_A' reports neither flow nor power"),
        (["VAV_A/supply_air_flowrate_sensor"], "airflows: device 'VAV_A' reports no flow"),
        (["station/outside_air_temperature_sensor"], "nothing measures the outdoors"),
    ],
)
def test_remarks_on_what_is_not_measured(plan_draft: Any, dropped: list[str], remark: str) -> None:
    plan_draft.frame = plan_draft.frame.drop(columns=dropped)
    assert any(remark in text for text in check_case(plan_draft.write()).remarks)


def test_remarks_on_what_is_not_used(plan_draft: Any) -> None:
    plan_draft.frame["B/heating_power_sensor"] = 100.0
    plan_draft.frame["AHU/zone_air_temperature_sensor"] = plan_draft.frame["B/zone_air_temperature_sensor"]
    del plan_draft.content["devices"][1]["zone"]
    remarks = check_case(plan_draft.write()).remarks
    assert "column 'B/heating_power_sensor' is not of a device: it is not used" in remarks
    assert any("'AHU/zone_air_temperature_sensor' is of a device that serves no zone" in text for text in remarks)
    assert "device 'RAD_B' (radiator) serves no zone: its heat is not counted" in remarks


def test_remark_on_air_from_nowhere(plan_draft: Any) -> None:
    plan_draft.content["airflows"].append({"from": "B", "to": "A", "device": "VAV_A", "fraction": 0.7})
    remarks = check_case(plan_draft.write()).remarks
    assert "airflows: more of the air of 'VAV_A' leaves zone 'B' than enters it" in remarks


def test_remark_on_partitions_that_reach_the_outside(plan_draft: Any, spell_plan: Any) -> None:
    plan_draft.plans["plan_F1.csv"] = spell_plan("###+###", "#AA+BB#", "#AA+BB#", "###.###").replace(".", "#")
    remarks = check_case(plan_draft.write()).remarks
    assert "floor 'F1': 1 cells of interior wall ('+') touch the outside; draw '#' there" in remarks


def test_sound_case_has_no_remarks_but_on_what_is_silent(plan_draft: Any) -> None:
    assert check_case(plan_draft.write()).remarks == ("device 'AHU' has no telemetry",)


def test_check_is_plain_json(plan_draft: Any) -> None:
    plan_draft.frame["B/zone_air_temperature_sensor"] = np.nan
    plan_draft.frame.iloc[3, 2] = np.inf
    result = check_case(plan_draft.write()).to_dict()
    assert json.loads(json.dumps(result, allow_nan=False)) == result
    assert set(result) >= {"zones", "devices", "unknown_device_types", "telemetry", "quality", "remarks"}


def test_check_of_bad_input_is_the_named_error(plan_draft: Any) -> None:
    plan_draft.content["devices"][0]["zone"] = "C"
    with pytest.raises(CaseError):
        check_case(plan_draft.write())


def test_check_of_a_case_in_memory_is_the_same(plan_draft: Any) -> None:
    folder = plan_draft.write()
    assert describe_case(load_case(folder)).to_dict() == check_case(folder).to_dict()


def test_shared_cases(shared_cases: Path) -> None:
    check = check_case(shared_cases / "practice_none_prbs")
    assert (len(check.zones), len(check.devices), len(check.points)) == (12, 12, 42)
    assert check.volume == pytest.approx(2016.0)
    twin = check_case(shared_cases / "twinhouse_O5_exp1")
    assert twin.volume == pytest.approx(202.25)
    assert twin.floor_area == pytest.approx(81.12)
    assert {zone.name for zone in twin.zones if not zone.devices} == {"corridor"}
