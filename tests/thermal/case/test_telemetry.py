"""Every way in which a telemetry file can be wrong, and the two file types beside each other."""

from datetime import timedelta
from decimal import Decimal
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from thermal.case.load import load_case
from thermal.case.telemetry import Telemetry
from thermal.errors import CaseError

TYPES = ("telemetry.parquet", "telemetry.csv")
FLOW = "VAV_A/supply_air_flowrate_sensor"


@pytest.fixture(params=TYPES)
def draft(request: pytest.FixtureRequest, plan_draft: Any) -> Any:
    plan_draft.content["telemetry"] = request.param
    return plan_draft


def refused(draft: Any, kind: type[CaseError], message: str) -> None:
    with pytest.raises(kind, match=message):
        load_case(draft.write())


def restamped(draft: Any, position: int, stamp: pd.Timestamp) -> None:
    stamps = list(draft.frame.index)
    stamps[position] = stamp
    draft.frame.index = pd.DatetimeIndex(stamps, name="timestamp")


def csv_lines(draft: Any) -> tuple[Path, list[str]]:
    draft.content["telemetry"] = "telemetry.csv"
    path = draft.write() / "telemetry.csv"
    return path, path.read_text().splitlines()


def test_loads_in_si_units(draft: Any) -> None:
    frame = load_case(draft.write()).telemetry.frame
    assert list(frame.columns) == list(draft.frame.columns)
    assert frame.index.name == "timestamp"
    assert str(frame.index.tz) == "Etc/GMT+6"
    assert set(frame.dtypes) == {np.dtype(float)}
    np.testing.assert_allclose(frame["VAV_A/discharge_air_temperature_sensor"], 303.15)
    np.testing.assert_allclose(frame[FLOW], 0.1)


def test_csv_and_parquet_are_identical(plan_draft: Any) -> None:
    plan_draft.frame.iloc[3, 2] = np.nan
    plan_draft.frame = plan_draft.frame.drop(plan_draft.frame.index[10:13])
    first = load_case(plan_draft.write())
    plan_draft.content["telemetry"] = "telemetry.csv"
    second = load_case(plan_draft.write())
    pd.testing.assert_frame_equal(first.telemetry.frame, second.telemetry.frame, check_exact=True)
    assert first.telemetry.step == second.telemetry.step
    assert first.telemetry.missing_rows == second.telemetry.missing_rows


def test_a_shared_case_as_csv_is_identical(plan_draft: Any, shared_cases: Path, tmp_path: Path) -> None:
    source = shared_cases / "practice_none_prbs"
    text = (source / "building.yaml").read_text().replace("telemetry.parquet", "telemetry.csv")
    (tmp_path / "building.yaml").write_text(text)
    for name in ("plan_F1.csv", "plan_F2.csv"):
        (tmp_path / name).write_bytes((source / name).read_bytes())
    pd.read_parquet(source / "telemetry.parquet").astype(float).to_csv(tmp_path / "telemetry.csv")
    expected = load_case(source).telemetry.frame
    pd.testing.assert_frame_equal(load_case(tmp_path).telemetry.frame, expected, check_exact=True)


def test_units_are_converted_at_the_edge(draft: Any) -> None:
    expected = load_case(draft.write()).zone_heat()
    temperatures = [c for c in draft.frame if c.endswith(("air_temperature_sensor",))]
    draft.frame[temperatures] = draft.frame[temperatures] * 1.8 + 32.0
    draft.frame[FLOW] = draft.frame[FLOW] * 3600.0 / 1.2041518757
    draft.frame["RAD_B/heating_power_sensor"] /= 1000.0
    units = draft.content["units"]
    units.update({p: "degF" for p in units if p.endswith("air_temperature_sensor")})
    units.update(supply_air_flowrate_sensor="m^3/h", heating_power_sensor="kW")
    np.testing.assert_allclose(load_case(draft.write()).zone_heat(), expected, rtol=1e-9)


def test_volume_flow_is_weighed_at_the_site(plan_draft: Any) -> None:
    plan_draft.content["units"]["supply_air_flowrate_sensor"] = "m^3/s"
    plan_draft.content["location"]["elevation"] = 1600.0
    flow = load_case(plan_draft.write()).telemetry.frame[FLOW]
    # 101325 (1 - 2.25577e-5 * 1600)^5.2559 = 83524 Pa; 83524 / (287.042 * 293.15) = 0.99260 kg/m3
    np.testing.assert_allclose(flow, 0.1 * 0.9926, rtol=1e-4)


def test_stamps_of_any_offset_come_out_local_to_the_building(draft: Any) -> None:
    draft.frame.index = draft.frame.index.tz_convert("UTC")
    index = load_case(draft.write()).telemetry.frame.index
    assert index[0].isoformat() == "2023-03-01T00:05:00-06:00"


def test_offsets_that_change_with_summer_time(plan_draft: Any) -> None:
    plan_draft.content["location"]["timezone"] = "Europe/Berlin"
    index = pd.date_range("2023-10-29T02:00", periods=48, freq="5min", tz="Europe/Berlin", ambiguous=True)
    plan_draft.frame.index = index.rename("timestamp")
    path, lines = csv_lines(plan_draft)
    assert "+02:00" in lines[1] and "+01:00" in lines[-1]
    case = load_case(path.parent)
    assert case.step == 300.0 and not case.telemetry.missing_rows


def test_parquet_with_the_stamps_as_a_column(plan_draft: Any) -> None:
    folder = plan_draft.write()
    plan_draft.frame.reset_index().to_parquet(folder / "telemetry.parquet")
    assert len(load_case(folder).stamps) == 48


def test_parquet_with_an_index_of_another_name(plan_draft: Any) -> None:
    plan_draft.frame.index.name = "time"
    refused(plan_draft, CaseError, r"telemetry\.parquet: expected an index 'timestamp'.*found an index 'time'")


def test_parquet_without_time_stamps(plan_draft: Any) -> None:
    plan_draft.frame = plan_draft.frame.reset_index(drop=True)
    refused(plan_draft, CaseError, "an index 'timestamp' of time stamps")


def test_csv_without_stamps(plan_draft: Any) -> None:
    plan_draft.content["telemetry"] = "telemetry.csv"
    plan_draft.frame.index.name = "time"
    refused(plan_draft, CaseError, r"telemetry\.csv: header: expected a column 'timestamp'")


def test_no_time_zone(draft: Any) -> None:
    draft.frame.index = draft.frame.index.tz_localize(None)
    refused(draft, CaseError, r"telemetry\.(parquet|csv): .*2023-03-01.00:05:00")


def test_one_stamp_of_a_csv_without_offset(plan_draft: Any) -> None:
    path, lines = csv_lines(plan_draft)
    lines[7] = lines[7].replace("-06:00", "", 1)
    path.write_text("\n".join(lines))
    with pytest.raises(CaseError, match=r"data row 7: expected a time stamp with offset"):
        load_case(path.parent)


@pytest.mark.parametrize("stamp", ["noon", "", "01/03/2023 00:35", "2023-02-30T00:35:00-06:00", "NaT", "1677657900"])
def test_stamps_of_a_csv_that_are_none(plan_draft: Any, stamp: str) -> None:
    path, lines = csv_lines(plan_draft)
    lines[7] = ",".join([stamp, *lines[7].split(",")[1:]])
    path.write_text("\n".join(lines))
    with pytest.raises(CaseError, match=r"telemetry\.csv"):
        load_case(path.parent)


def test_stamp_that_is_missing(plan_draft: Any) -> None:
    restamped(plan_draft, 5, pd.NaT)
    refused(plan_draft, CaseError, "data row 6: expected a time stamp, found nothing")


def test_duplicate_stamp(draft: Any) -> None:
    restamped(draft, 5, draft.frame.index[4])
    refused(draft, CaseError, r"data row 6: expected a new stamp, found 2023-03-01 00:25:00-06:00 again")


def test_duplicate_stamp_far_away(draft: Any) -> None:
    restamped(draft, 20, draft.frame.index[4])
    refused(draft, CaseError, "data row 21: expected a new stamp")


def test_unordered_stamps(draft: Any) -> None:
    draft.frame = draft.frame.iloc[[0, 1, 3, 2, *range(4, 48)]]
    refused(draft, CaseError, r"data row 4: .*found 2023-03-01 00:15:00-06:00 after 2023-03-01 00:20:00")


def test_stamps_that_run_backwards(draft: Any) -> None:
    draft.frame = draft.frame.iloc[::-1]
    refused(draft, CaseError, "data row 2: expected stamps that go forwards")


def test_irregular_step(draft: Any) -> None:
    restamped(draft, 9, draft.frame.index[9] + timedelta(seconds=7))
    refused(draft, CaseError, r"data row 10: expected a whole number of steps of 300 s, found .*307 s after")


def test_step_that_changes(plan_draft: Any) -> None:
    fine = pd.date_range(plan_draft.frame.index[0], periods=30, freq="5min")
    coarse = pd.date_range(fine[-1] + timedelta(minutes=1), periods=18, freq="1min")
    plan_draft.frame.index = fine.append(coarse).rename("timestamp")
    refused(plan_draft, CaseError, "data row 31: .*60 s after the row before")


def test_rows_left_out_come_in_as_gaps(draft: Any) -> None:
    full = load_case(draft.write())
    left_out = draft.frame.index[[7, 8, 20]]
    draft.frame = draft.frame.drop(left_out)
    case = load_case(draft.write())
    assert case.stamps.equals(full.stamps)
    assert case.telemetry.missing_rows == tuple(left_out)
    assert case.telemetry.frame.loc[left_out].isna().all().all()
    assert [(f.start, f.steps) for f in case.quality.missing_rows] == [(left_out[0], 2), (left_out[2], 1)]


def test_a_stamp_of_another_decade_is_no_gap(plan_draft: Any) -> None:
    restamped(plan_draft, 47, plan_draft.frame.index[47] + timedelta(days=3650))
    refused(plan_draft, CaseError, "data row 48: expected telemetry without years of gaps")


@pytest.mark.parametrize(("step", "seconds"), [("10min", 600.0), ("15min", 900.0), ("60min", 3600.0), ("2h", 7200.0)])
def test_steps_up_to_two_hours(plan_draft: Any, step: str, seconds: float) -> None:
    plan_draft.frame.index = pd.date_range(plan_draft.frame.index[0], periods=48, freq=step, name="timestamp")
    assert load_case(plan_draft.write()).step == seconds


def test_steps_above_two_hours(plan_draft: Any) -> None:
    plan_draft.frame.index = pd.date_range(plan_draft.frame.index[0], periods=48, freq="3h", name="timestamp")
    refused(plan_draft, CaseError, "expected steps of up to 7200 s, found 10800 s")


@pytest.mark.parametrize("n_time", [0, 1])
def test_empty_telemetry(draft: Any, n_time: int) -> None:
    draft.frame = draft.frame.iloc[:n_time]
    refused(draft, CaseError, f"at least two rows and one column, found {n_time} rows and 7 columns")


def test_telemetry_without_columns(draft: Any) -> None:
    draft.frame = draft.frame[[]]
    refused(draft, CaseError, "48 rows and 0 columns")


def test_empty_files(plan_draft: Any) -> None:
    for name in TYPES:
        plan_draft.content["telemetry"] = name
        folder = plan_draft.write()
        (folder / name).write_bytes(b"")
        with pytest.raises(CaseError, match=name):
            load_case(folder)


@pytest.mark.parametrize("name", ["telemetry.xlsx", "telemetry", "telemetry.parquet.gz"])
def test_telemetry_of_another_file_type(plan_draft: Any, name: str) -> None:
    folder = plan_draft.write()
    (folder / "telemetry.parquet").rename(folder / name)
    plan_draft.content["telemetry"] = name
    with pytest.raises(CaseError, match=rf"telemetry: expected a \.parquet or a \.csv file, found '{name}'"):
        load_case(plan_draft.write() if name.endswith("csv") else _rewrite(plan_draft, folder))


def _rewrite(draft: Any, folder: Path) -> Path:
    import yaml

    (folder / "building.yaml").write_text(yaml.safe_dump(draft.content))
    return folder


def test_csv_under_the_name_of_parquet(plan_draft: Any) -> None:
    folder = plan_draft.write()
    plan_draft.frame.to_csv(folder / "telemetry.parquet")
    with pytest.raises(CaseError, match=r"telemetry\.parquet: expected a Parquet file"):
        load_case(folder)


def test_csv_with_a_row_too_long(plan_draft: Any) -> None:
    path, lines = csv_lines(plan_draft)
    lines[1:] = [line + ",5" for line in lines[1:]]
    path.write_text("\n".join(lines))
    with pytest.raises(CaseError, match=r"telemetry\.csv"):
        load_case(path.parent)
    lines[1:] = [line.rpartition(",")[0] for line in lines[1:]]
    lines[9] += ",5"
    path.write_text("\n".join(lines))
    with pytest.raises(CaseError, match=r"telemetry\.csv"):
        load_case(path.parent)


def test_binary_under_the_name_of_csv(plan_draft: Any) -> None:
    plan_draft.content["telemetry"] = "telemetry.csv"
    folder = plan_draft.write()
    plan_draft.frame.to_parquet(folder / "telemetry.csv")
    with pytest.raises(CaseError, match=r"telemetry\.csv"):
        load_case(folder)


@pytest.mark.parametrize("value", ["20,5", "off", "20.5 degC", "--", "1.2.3"])
def test_csv_column_that_is_not_numeric(plan_draft: Any, value: str) -> None:
    path, lines = csv_lines(plan_draft)
    cells = lines[12].split(",")
    cells[4] = f'"{value}"'
    lines[12] = ",".join(cells)
    path.write_text("\n".join(lines))
    message = rf"column '{FLOW}', stamp 2023-03-01 .*: expected a number, found"
    with pytest.raises(CaseError, match=message):
        load_case(path.parent)


@pytest.mark.parametrize("values", [["off", "on"], ["20.5", "21.5"], [True, False], [b"1", b"2"], [[1.0, 2.0], [3.0]]])
def test_parquet_column_that_is_not_numeric(plan_draft: Any, values: list[object]) -> None:
    plan_draft.frame[FLOW] = values * 24
    refused(plan_draft, CaseError, f"column '{FLOW}', stamp 2023-03-01 .*expected a number, found")


def test_frame_that_is_not_numeric(plan_draft: Any) -> None:
    frame = plan_draft.frame.astype({FLOW: object})
    frame.loc[frame.index[3], FLOW] = "closed"
    with pytest.raises(CaseError, match=f"telemetry: column '{FLOW}': expected numbers, found .*closed"):
        Telemetry.from_frame(frame)


def test_column_of_time_stamps_is_not_numeric(plan_draft: Any) -> None:
    plan_draft.frame[FLOW] = plan_draft.frame.index
    refused(plan_draft, CaseError, "expected a number, found Timestamp")


@pytest.mark.parametrize(
    "values",
    [
        [1, 2],
        pd.array([1, None], dtype="Int64"),
        np.array([1, 2], dtype="float32"),
        [Decimal("1.5"), None],
        [None, None],
    ],
)
def test_columns_of_any_numbers_are_read(plan_draft: Any, values: Any) -> None:
    column = pd.concat([pd.Series(values)] * 24, ignore_index=True)
    plan_draft.frame[FLOW] = column.to_numpy() if column.dtype == object else column.array
    frame = load_case(plan_draft.write()).telemetry.frame
    expected = [np.nan if pd.isna(value) else float(value) for value in values] * 24
    np.testing.assert_array_equal(frame[FLOW], expected)


def test_blank_csv_column_is_all_missing(plan_draft: Any) -> None:
    plan_draft.content["telemetry"] = "telemetry.csv"
    plan_draft.frame[FLOW] = np.nan
    assert load_case(plan_draft.write()).telemetry.frame[FLOW].isna().all()


def test_duplicate_columns_of_a_csv(plan_draft: Any) -> None:
    path, lines = csv_lines(plan_draft)
    header = lines[0].split(",")
    header[5] = header[4]
    lines[0] = ",".join(header)
    path.write_text("\n".join(lines))
    with pytest.raises(CaseError, match=f"'{FLOW}' twice"):
        load_case(path.parent)


def test_duplicate_columns_of_a_frame(plan_draft: Any) -> None:
    frame = plan_draft.frame.iloc[:, [0, 1, 1]]
    with pytest.raises(CaseError, match=r"telemetry: columns: .* twice"):
        Telemetry.from_frame(frame)


@pytest.mark.parametrize("column", ["temperature", "/supply_air_flowrate_sensor", "VAV_A/", ""])
def test_columns_that_are_not_entity_and_point(draft: Any, column: str) -> None:
    draft.frame[column] = 1.0
    refused(draft, CaseError, r"expected a name ENTITY/POINT")


def test_unknown_point_type_of_a_column(draft: Any) -> None:
    draft.frame["VAV_A/zone_air_temperatur_sensor"] = 20.0
    refused(draft, CaseError, "the nearest valid one is 'zone_air_temperature_sensor'")


def test_unknown_point_type_among_the_units(plan_draft: Any) -> None:
    plan_draft.content["units"]["wind_sped_sensor"] = "m/s"
    refused(plan_draft, CaseError, r"units\.wind_sped_sensor: .*the nearest valid one is 'wind_speed_sensor'")


def test_point_without_a_unit(draft: Any) -> None:
    del draft.content["units"]["heating_power_sensor"]
    refused(draft, CaseError, r"building\.yaml: units: .*; add 'heating_power_sensor: <unit>'")


def test_entity_with_a_slash(plan_draft: Any) -> None:
    plan_draft.content["devices"].append({"name": "floor 1/VAV", "type": "vav", "zone": "A"})
    plan_draft.frame["floor 1/VAV/supply_air_flowrate_sensor"] = 0.0
    assert (load_case(plan_draft.write()).zone_heat()["A"] != 0.0).all()


@pytest.mark.parametrize("odd", ["9999-12-31T23:50:00", "2200-01-01T00:00:00", "1677-09-21T00:00:00", "0001-01-01T00:00:00"])
def test_stamps_of_years_that_no_stamp_can_lie_in(plan_draft: Any, odd: str) -> None:
    message = f"data row 48: expected time stamps of the years 1900 to 2199, found {odd}"
    path, lines = csv_lines(plan_draft)
    path.write_text("\n".join([*lines[:-1], f"{odd}+00:00," + lines[-1].partition(",")[2]]))
    with pytest.raises(CaseError, match=message):
        load_case(path.parent)
    stamps = np.append(plan_draft.frame.index.tz_localize(None).to_numpy("datetime64[us]")[:-1], np.datetime64(odd))
    plan_draft.content["telemetry"] = "telemetry.parquet"
    plan_draft.frame.index = pd.DatetimeIndex(stamps, name="timestamp").tz_localize("UTC")
    refused(plan_draft, CaseError, message)
