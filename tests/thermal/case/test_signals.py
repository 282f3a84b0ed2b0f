"""What the model takes from a case: temperatures, heat, boundaries, air, weather."""

import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from thermal.case.load import load_case

STAMP = pd.Timestamp("2023-03-01T00:20:00-06:00")


def test_heat_of_two_rooms(plan_draft: Any) -> None:
    plan_draft.frame["VAV_A/zone_air_temperature_sensor"] = 20.0
    heat = load_case(plan_draft.write()).zone_heat()
    assert list(heat.columns) == ["A", "B"]
    # 0.1 kg/s * 1006 J/kg/K * (30 - 20) K, and 250 W of the radiator
    np.testing.assert_allclose(heat["A"], 1006.0, rtol=1e-12)
    np.testing.assert_allclose(heat["B"], 250.0, rtol=1e-12)


def test_cooling_is_negative(plan_draft: Any) -> None:
    plan_draft.frame["VAV_A/zone_air_temperature_sensor"] = 24.0
    plan_draft.frame["VAV_A/discharge_air_temperature_sensor"] = 13.0
    np.testing.assert_allclose(load_case(plan_draft.write()).zone_heat()["A"], -0.1 * 1006.0 * 11.0)


def test_devices_of_a_zone_add_up(plan_draft: Any) -> None:
    plan_draft.content["devices"][1]["zone"] = "A"
    plan_draft.frame["VAV_A/zone_air_temperature_sensor"] = 20.0
    heat = load_case(plan_draft.write()).zone_heat()
    np.testing.assert_allclose(heat["A"], 1256.0)
    np.testing.assert_array_equal(heat["B"], 0.0)


def test_device_of_an_unknown_type_counts_with_what_it_reports(plan_draft: Any) -> None:
    plan_draft.content["devices"][1]["type"] = "heat_lamp"
    np.testing.assert_allclose(load_case(plan_draft.write()).zone_heat()["B"], 250.0)


@pytest.mark.parametrize("point", ["supply_air_flowrate_sensor", "discharge_air_temperature_sensor"])
def test_missing_input_makes_heat_unknown(plan_draft: Any, point: str) -> None:
    plan_draft.frame.loc[STAMP, f"VAV_A/{point}"] = np.nan
    heat = load_case(plan_draft.write()).zone_heat()
    assert heat["A"].isna().sum() == 1 and np.isnan(heat.loc[STAMP, "A"])
    assert heat["B"].notna().all()


def test_missing_zone_temperature_makes_heat_of_air_unknown_and_of_power_not(plan_draft: Any) -> None:
    plan_draft.frame.loc[STAMP, ["VAV_A/zone_air_temperature_sensor", "B/zone_air_temperature_sensor"]] = np.nan
    heat = load_case(plan_draft.write()).zone_heat()
    assert np.isnan(heat.loc[STAMP, "A"]) and heat.loc[STAMP, "B"] == 250.0


def test_no_flow_brings_no_heat_whatever_the_discharge_sensor_says(plan_draft: Any) -> None:
    plan_draft.frame.loc[STAMP, ["VAV_A/supply_air_flowrate_sensor", "VAV_A/discharge_air_temperature_sensor"]] = [
        0.0,
        np.nan,
    ]
    assert load_case(plan_draft.write()).zone_heat().loc[STAMP, "A"] == 0.0


def test_no_flow_brings_no_heat_even_without_a_discharge_sensor(plan_draft: Any) -> None:
    del plan_draft.frame["VAV_A/discharge_air_temperature_sensor"]
    plan_draft.frame.loc[STAMP, "VAV_A/supply_air_flowrate_sensor"] = 0.0
    heat = load_case(plan_draft.write()).zone_heat()["A"]
    assert heat[STAMP] == 0.0 and heat.isna().sum() == len(heat) - 1


def test_terminal_that_reports_nothing_makes_heat_unknown(plan_draft: Any) -> None:
    plan_draft.frame = plan_draft.frame.drop(columns=["RAD_B/heating_power_sensor"])
    assert load_case(plan_draft.write()).zone_heat()["B"].isna().all()


def test_impossible_input_makes_heat_unknown(plan_draft: Any) -> None:
    plan_draft.frame.loc[STAMP, "VAV_A/discharge_air_temperature_sensor"] = 6553.5
    assert np.isnan(load_case(plan_draft.write()).zone_heat().loc[STAMP, "A"])


def test_zone_temperatures_in_the_order_of_the_building(plan_draft: Any) -> None:
    temperatures = load_case(plan_draft.write()).zone_temperatures()
    assert list(temperatures.columns) == ["A", "B"]
    np.testing.assert_allclose(temperatures["A"], plan_draft.frame["VAV_A/zone_air_temperature_sensor"] + 273.15)
    np.testing.assert_allclose(temperatures["B"], plan_draft.frame["B/zone_air_temperature_sensor"] + 273.15)


def test_unmeasured_zone_is_all_missing(plan_draft: Any) -> None:
    del plan_draft.frame["B/zone_air_temperature_sensor"]
    temperatures = load_case(plan_draft.write()).zone_temperatures()
    assert list(temperatures.columns) == ["A", "B"]
    assert temperatures["B"].isna().all() and temperatures["B"].dtype == float


def test_several_sensors_of_a_zone_are_averaged_as_far_as_they_work(plan_draft: Any) -> None:
    plan_draft.frame["RAD_B/zone_air_temperature_sensor"] = plan_draft.frame["B/zone_air_temperature_sensor"] + 1.0
    plan_draft.frame.loc[STAMP, "RAD_B/zone_air_temperature_sensor"] = np.nan
    temperatures = load_case(plan_draft.write()).zone_temperatures()["B"] - 273.15
    expected = plan_draft.frame["B/zone_air_temperature_sensor"] + 0.5
    expected[STAMP] -= 0.5
    np.testing.assert_allclose(temperatures, expected)


def test_boundaries_are_outdoor_and_what_surfaces_name(table_draft: Any) -> None:
    boundaries = load_case(table_draft.write()).boundary_temperatures()
    assert list(boundaries.columns) == ["outdoor", "attic"]
    np.testing.assert_allclose(boundaries["attic"], table_draft.frame["attic/zone_air_temperature_sensor"] + 273.15)


def test_outdoors_from_an_air_handler_when_the_station_is_silent(plan_draft: Any) -> None:
    column = "station/outside_air_temperature_sensor"
    plan_draft.frame = plan_draft.frame.rename(columns={column: "AHU/outside_air_temperature_sensor"})
    case = load_case(plan_draft.write())
    expected = plan_draft.frame["AHU/outside_air_temperature_sensor"] + 273.15
    np.testing.assert_allclose(case.boundary_temperatures()["outdoor"], expected)
    assert any("stands in" in remark for remark in case.remarks)


def test_the_station_goes_before_the_air_handler(plan_draft: Any) -> None:
    plan_draft.frame["AHU/outside_air_temperature_sensor"] = 40.0
    outdoor = load_case(plan_draft.write()).boundary_temperatures()["outdoor"]
    np.testing.assert_allclose(outdoor, plan_draft.frame["station/outside_air_temperature_sensor"] + 273.15)


def test_no_outdoor_sensor_at_all(plan_draft: Any) -> None:
    del plan_draft.frame["station/outside_air_temperature_sensor"]
    case = load_case(plan_draft.write())
    assert case.boundary_temperatures()["outdoor"].isna().all()
    assert any("nothing measures the outdoors" in remark for remark in case.remarks)


def test_airflows_are_shares_of_the_devices_flow(plan_draft: Any) -> None:
    plan_draft.frame.loc[STAMP, "VAV_A/supply_air_flowrate_sensor"] = np.nan
    plan_draft.content["airflows"].append({"from": "B", "to": "A", "device": "AHU", "fraction": 1.0})
    rates = load_case(plan_draft.write()).airflow_rates()
    assert list(rates.columns) == [0, 1]
    np.testing.assert_allclose(rates[0].dropna(), 0.04)
    assert np.isnan(rates.loc[STAMP, 0]) and rates[1].isna().all()


def test_without_airflows_there_are_no_columns(table_draft: Any) -> None:
    assert load_case(table_draft.write()).airflow_rates().shape == (48, 0)


def test_weather_in_si_units(plan_draft: Any) -> None:
    weather = load_case(plan_draft.write()).weather()
    assert list(weather.columns) == ["outside_air_temperature_sensor", "direct_normal_irradiance_sensor"]
    expected = plan_draft.frame["station/outside_air_temperature_sensor"] + 273.15
    np.testing.assert_allclose(weather["outside_air_temperature_sensor"], expected)


def test_signals_are_new_frames(plan_draft: Any) -> None:
    case = load_case(plan_draft.write())
    for frame in (case.zone_temperatures(), case.weather(), case.boundary_temperatures()):
        frame.iloc[:] = 0.0
    assert (case.zone_temperatures() > 280.0).all().all()
    assert (case.boundary_temperatures() > 270.0).all().all()


def test_a_case_can_be_pickled(plan_draft: Any) -> None:
    case = load_case(plan_draft.write())
    again = pickle.loads(pickle.dumps(case))
    pd.testing.assert_frame_equal(again.zone_heat(), case.zone_heat())


def test_practice_case_by_hand(shared_cases: Path) -> None:
    case = load_case(shared_cases / "practice_none_prbs")
    assert case.building.zone_names[:3] == ("F1_N1", "F1_N2", "F1_C")
    stamp = pd.Timestamp("2023-04-05T08:00:00-06:00")
    assert case.zone_temperatures().loc[stamp, "F2_C"] == pytest.approx(21.54 + 273.15, abs=1e-5)
    # 0.0720576 kg/s * 1006 J/kg/K * (35.0144 - 21.5400) K = 976.76 W; F1_S1 has no flow
    assert case.zone_heat().loc[stamp, "F2_C"] == pytest.approx(976.76, abs=0.01)
    assert case.zone_heat().loc[stamp, "F1_S1"] == 0.0
    assert case.boundary_temperatures().loc[stamp, "outdoor"] == pytest.approx(273.15 - 0.0542, abs=1e-4)


def test_twin_house_by_hand(shared_cases: Path) -> None:
    case = load_case(shared_cases / "twinhouse_O5_exp1")
    stamp = pd.Timestamp("2013-09-10T12:00:00+01:00")
    # 0.0401303 kg/s * 1006 J/kg/K * (19.7911 - 24.9696) K + 2.9018 W = -209.06 + 2.90 W
    assert case.zone_heat().loc[stamp, "living"] == pytest.approx(-206.16, abs=0.01)
    assert case.zone_heat().loc[stamp, "corridor"] == 0.0
    np.testing.assert_allclose(case.airflow_rates().loc[stamp], [0.0401303, 0.0200652, 0.0200652], atol=1e-7)
    expected = [273.15 + 15.8526, 273.15 + 20.4251, 273.15 + 21.8247]
    np.testing.assert_allclose(case.boundary_temperatures().loc[stamp], expected, atol=1e-4)
    assert list(case.boundary_temperatures().columns) == ["outdoor", "cellar", "attic"]


@pytest.mark.parametrize("name", ["practice_everything", "twinhouse_N2_exp1", "twinhouse_O5_exp1"])
def test_shared_cases_agree_with_plain_pandas(shared_cases: Path, name: str) -> None:
    case = load_case(shared_cases / name)
    raw = pd.read_parquet(shared_cases / name / "telemetry.parquet").astype(float)
    expected = pd.DataFrame(0.0, index=raw.index, columns=list(case.building.zone_names))
    for device in case.building.devices:
        flow = raw.get(f"{device.name}/supply_air_flowrate_sensor")
        if device.zone and flow is not None:
            own = f"{device.name}/zone_air_temperature_sensor"
            zone = raw[own if own in raw else f"{device.zone}/zone_air_temperature_sensor"]
            expected[device.zone] += flow * 1006.0 * (raw[f"{device.name}/discharge_air_temperature_sensor"] - zone)
        if f"{device.name}/heating_power_sensor" in raw:
            expected[device.zone] += raw[f"{device.name}/heating_power_sensor"]
    np.testing.assert_allclose(case.zone_heat(), expected, rtol=1e-9, atol=1e-8)


def test_every_shared_case_loads(shared_cases: Path) -> None:
    folders = sorted(path.parent for path in shared_cases.glob("*/building.yaml"))
    assert len(folders) >= 19
    for folder in folders:
        case = load_case(folder)
        assert case.building.name == folder.name
        assert case.remarks == ()
        assert case.zone_temperatures().shape == (len(case.stamps), len(case.building.zone_names))
