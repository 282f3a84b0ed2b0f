"""Devices whose heat no meter tells: which they are, what tells it, and what is said of them."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from thermal.case.building import Building, Commanded, Device, Location, ZoneEntry, ZoneTable
from thermal.case.case import Case
from thermal.case.plausibility.examine import examine
from thermal.case.telemetry import Telemetry
from thermal.model.case_replay import replay_inputs
from thermal.network.build import build_network

SITE = Location(latitude=48.0, longitude=12.0, elevation=690.0, timezone="Europe/Berlin")
ZONES = tuple(ZoneEntry(name=name, volume=60.0, floor_area=20.0) for name in "AB")
PLANT = (
    Device(name="AHU", type="ahu"),
    Device(name="BOILER", type="boiler"),
)
TIMES = pd.date_range("2024-01-10", periods=48, freq="1h", tz="Europe/Berlin", name="timestamp")


def case_of(columns: dict[str, object], *devices: Device, plant: tuple[Device, ...] = PLANT) -> Case:
    frame = pd.DataFrame({"weather_station/outside_air_temperature_sensor": 273.15, **columns}, index=TIMES)
    for zone in "AB":
        frame[f"{zone}/zone_air_temperature_sensor"] = 293.15
    building = Building("office", SITE, 0.0, ZoneTable(ZONES), (*devices, *plant))
    return Case(building, Telemetry.from_frame(frame.astype(float)))


def vav(zone: str, *fed_by: str) -> Device:
    return Device(name=f"VAV_{zone}", type="vav", zone=zone, fed_by=fed_by)


def radiator(zone: str, *fed_by: str) -> Device:
    return Device(name=f"RAD_{zone}", type="radiator", zone=zone, fed_by=fed_by)


OPEN = "supply_air_damper_percentage_command"
VALVE = "heating_water_valve_percentage_command"


def test_a_damper_brings_its_handlers_air_and_the_valve_of_its_coil_the_rest() -> None:
    columns = {f"VAV_A/{OPEN}": 0.5, f"VAV_A/{VALVE}": 0.25, "AHU/supply_air_temperature_sensor": 285.15,
               "BOILER/supply_water_temperature_sensor": 333.15}  # fmt: skip
    case = case_of(columns, vav("A", "AHU", "BOILER"))
    assert case.building.commanded == (
        Commanded("VAV_A", "A", "damper", (f"VAV_A/{OPEN}", "AHU/supply_air_temperature_sensor")),
        Commanded("VAV_A", "A", "valve", (f"VAV_A/{VALVE}", "BOILER/supply_water_temperature_sensor")),
    )
    air, water = case.command_signals().iloc[0]
    assert air == pytest.approx(0.5 * 1006.0 * (285.15 - 293.15))
    assert water == pytest.approx(0.25 * 40.0 / 50.0)
    assert (case.zone_heat()["A"] == 0.0).all()  # none of it is metered


def test_with_its_own_air_temperature_the_coil_is_in_it() -> None:
    columns = {f"VAV_A/{OPEN}": 0.5, f"VAV_A/{VALVE}": 0.25, "VAV_A/discharge_air_temperature_sensor": 303.15}
    case = case_of(columns, vav("A", "AHU", "BOILER"))
    assert [own.kind for own in case.building.commanded] == ["damper"]
    assert case.command_signals().iloc[0, 0] == pytest.approx(0.5 * 1006.0 * 10.0)


def test_a_metered_device_is_left_alone() -> None:
    columns = {f"RAD_A/{VALVE}": 0.5, "RAD_A/heating_power_sensor": 500.0, "VAV_B/supply_air_flowrate_sensor": 0.1,
               "VAV_B/discharge_air_temperature_sensor": 300.0, f"VAV_B/{OPEN}": 0.4}  # fmt: skip
    case = case_of(columns, radiator("A", "BOILER"), vav("B", "AHU"))
    assert case.building.commanded == ()
    assert case.command_signals().shape == (48, 0)
    assert case.zone_heat().iloc[0].tolist() == pytest.approx([500.0, 0.1 * 1006.0 * 6.85])


def test_a_flow_without_discharge_temperature_takes_the_handlers_unless_a_coil_warms_it_unseen() -> None:
    columns = {"VAV_A/supply_air_flowrate_sensor": 0.1, "AHU/supply_air_temperature_sensor": 288.15}
    passing = case_of(columns, vav("A", "AHU"))
    assert passing.zone_heat()["A"].iloc[0] == pytest.approx(-0.1 * 1006.0 * 5.0)
    assert passing.estimated == ()
    unseen = case_of(columns, vav("A", "AHU", "BOILER"))
    assert unseen.zone_heat()["A"].isna().all()
    told = case_of({**columns, f"VAV_A/{VALVE}": 0.0}, vav("A", "AHU", "BOILER"))
    assert told.zone_heat()["A"].iloc[0] == pytest.approx(-0.1 * 1006.0 * 5.0)
    assert [own.kind for own in told.building.commanded] == ["valve"]


def test_a_counter_tells_of_what_it_feeds_if_nothing_else_does() -> None:
    columns = {"BOILER/gas_power_sensor": 9000.0}
    case = case_of(columns, radiator("A", "BOILER"), radiator("B", "BOILER"))
    assert [(own.zone, own.kind, own.columns) for own in case.building.commanded] == [
        ("A", "counter", ("BOILER/gas_power_sensor",)),
        ("B", "counter", ("BOILER/gas_power_sensor",)),
    ]
    assert not [remark for remark in case.remarks if "not counted" in remark]
    partly = case_of({**columns, "RAD_B/heating_power_sensor": 400.0}, radiator("A", "BOILER"), radiator("B", "BOILER"))
    assert partly.building.commanded == ()  # what is left for A no counter tells
    assert partly.zone_heat()["A"].isna().all()
    pump = (Device(name="PUMP", type="boiler", fed_by=("BOILER",)), PLANT[1])
    through = case_of(columns, radiator("A", "PUMP"), plant=pump)
    assert [own.kind for own in through.building.commanded] == ["counter"]


def test_remarks_and_check_say_what_is_fitted() -> None:
    case = case_of({f"RAD_A/{VALVE}": np.tile([0.0, 0.6], 24)}, radiator("A", "BOILER"))
    assert "heat that no meter tells is fitted to valves: RAD_A" in case.remarks
    assert not [remark for remark in case.remarks if "unknown" in remark]
    assert not [found for found in examine(case) if found.kind == "no heat"]
    shut = case_of({f"RAD_A/{VALVE}": 0.0}, radiator("A", "BOILER"))
    assert [found.severity for found in examine(shut) if found.kind == "no heat"] == ["error"]


def test_steps_without_the_command_are_incomplete() -> None:
    opening = np.full(48, 0.5)
    opening[20:24] = np.nan
    case = case_of({f"RAD_A/{VALVE}": opening}, radiator("A", "BOILER"))
    inputs = replay_inputs(case, build_network(case.building))
    assert np.flatnonzero(~inputs.complete).tolist() == [20, 21, 22, 23]
    assert inputs.boundary[0, 1] == pytest.approx(293.15 + 0.5)  # signals are counted from the reference


def test_a_case_knows_its_commands_whatever_its_building_said() -> None:
    case = case_of({f"RAD_A/{VALVE}": 0.5}, radiator("A", "BOILER"))
    bare = case.telemetry.frame.drop(columns=f"RAD_A/{VALVE}")
    again = replace(case, telemetry=replace(case.telemetry, frame=bare), judged=None)
    assert again.building.commanded == ()
    assert len(case.slice(TIMES[3], TIMES[30]).building.commanded) == 1
