"""Tables of any kind become telemetry: what is in them is there afterwards, or is said not to be."""

from __future__ import annotations

import json
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import yaml
from typer.testing import CliRunner

from mpc.cli.app import app
from thermal.case.load import load_building, load_case
from thermal.errors import CaseError, PlanError
from thermal.intake.telemetry import ImportSettings, import_telemetry

HEATER, ROOM, OUTDOOR = (
    "HEATER/heating_power_sensor",
    "room/zone_air_temperature_sensor",
    "weather_station/outside_air_temperature_sensor",
)


@pytest.fixture
def house(tmp_path: Path) -> Path:
    """A house of one room with a heater: building.yaml alone, in a time zone with daylight-saving time."""
    location = {"latitude": 48.1, "longitude": 11.6, "elevation": 500.0, "timezone": "Europe/Berlin"}
    content = {
        "format": 3,
        "name": "house",
        "location": location,
        "zones": [{"name": "room", "volume": 100.0, "floor_area": 40.0}],
        "surfaces": [{"name": "W", "kind": "bridge", "zone": "room", "other": "outdoor", "area": 80.0, "u_value": 0.5}],
        "devices": [{"name": "HEATER", "type": "electric_heater", "zone": "room"}],
    }
    (tmp_path / "house").mkdir()
    (tmp_path / "house" / "building.yaml").write_text(yaml.safe_dump(content), encoding="utf-8")
    return tmp_path / "house" / "building.yaml"


def table(step: str = "15min", days: int = 2, start: str = "2023-01-09", tz: str | None = None) -> pd.DataFrame:
    """A wide table in degC and W that never repeats itself."""
    index = pd.date_range(start, periods=round(pd.Timedelta(days=days) / pd.Timedelta(step)), freq=step, tz=tz)
    hours = np.arange(len(index)) * pd.Timedelta(step).total_seconds() / 3600.0
    return pd.DataFrame({
        "time": index,
        "room temp": 20.0 + np.sin(hours),
        "HEATER heating power": 500.0 + 100.0 * np.cos(hours),
        "outdoor temp": 3.0 + 2.0 * np.sin(hours / 3.8),
    })  # fmt: skip


def run(*arguments: str | Path) -> Any:
    """Run the command in this process."""
    return CliRunner().invoke(app, [str(a) for a in arguments])


def test_building_alone_and_a_csv_without_offsets(house: Path, tmp_path: Path) -> None:
    frame = table()
    frame.assign(mystery="on").to_csv(tmp_path / "t.csv", index=False)
    answer = run("import-telemetry", house, tmp_path / "t.csv", "--out", tmp_path / "new")
    assert answer.exit_code == 2 and "--tz Europe/Berlin" in answer.stderr
    answer = run("import-telemetry", house, tmp_path / "t.csv", "--tz", "Europe/Berlin", "--out", tmp_path / "new")
    assert (answer.exit_code, answer.stderr) == (0, "")
    assert "Kept aside" in answer.stdout and "mystery" in answer.stdout
    case = load_case(tmp_path / "new")
    assert case.step == 900.0 and str(case.stamps[0]) == "2023-01-09 00:00:00+01:00"
    assert case.telemetry.frame[ROOM].to_numpy() == pytest.approx(frame["room temp"] + 273.15)
    assert case.telemetry.frame[HEATER].to_numpy() == pytest.approx(frame["HEATER heating power"])
    answer = run("check", tmp_path / "new")
    assert answer.exit_code == 0 and "The case is valid" in answer.stdout


def long(frame: pd.DataFrame) -> pd.DataFrame:
    return frame.melt("time", var_name="sensor", value_name="value")


@pytest.mark.parametrize("kind", ["parquet", "csv", "semicolons", "long", "long.parquet", "xlsx"])
def test_every_kind_of_table_gives_the_same(house: Path, tmp_path: Path, kind: str) -> None:
    frame = table(tz="Etc/GMT-1")
    file = tmp_path / f"t.{'parquet' if 'parquet' in kind else 'xlsx' if kind == 'xlsx' else 'csv'}"
    settings = ImportSettings()
    if kind == "parquet":
        frame.set_index("time").to_parquet(file)
    elif kind == "semicolons":
        frame.to_csv(file, sep=";", decimal=",", index=False)
    elif kind == "long":
        long(frame).sample(frac=1.0, random_state=0).to_csv(file, index=False)
    elif kind == "long.parquet":
        long(frame).to_parquet(file)
    elif kind == "xlsx":
        pytest.importorskip("openpyxl", reason="needs the extra [telemetry]")
        frame.assign(time=frame["time"].dt.tz_localize(None)).to_excel(file, index=False)
        settings = ImportSettings(timezone="Etc/GMT-1")
    else:
        frame.to_csv(file, index=False)
    found = import_telemetry(load_building(house), str(file), settings).telemetry
    assert {*found.frame} == {ROOM, HEATER, OUTDOOR} and found.step == 900.0
    for column, name, zero in ((ROOM, "room temp", 273.15), (HEATER, "HEATER heating power", 0.0)):
        assert found.frame[column].to_numpy() == pytest.approx(frame[name] + zero, abs=1e-6)


@pytest.mark.parametrize("minutes", [1, 5, 120])
def test_steps_of_a_minute_to_two_hours(house: Path, tmp_path: Path, minutes: int) -> None:
    table(f"{minutes}min", days=3, tz="UTC").to_parquet(tmp_path / "t.parquet")
    answer = run("import-telemetry", house, tmp_path / "t.parquet", "--out", tmp_path / "new", "--json")
    assert answer.exit_code == 0 and json.loads(answer.stdout)["step_seconds"] == 60.0 * minutes
    assert load_case(tmp_path / "new").step == 60.0 * minutes


def test_resampled_to_means_that_keep_energy(house: Path, tmp_path: Path) -> None:
    frame = table("5min", tz="UTC")
    frame.to_parquet(tmp_path / "t.parquet")
    found = import_telemetry(load_building(house), str(tmp_path / "t.parquet"), ImportSettings(step=1800.0))
    power = found.telemetry.frame[HEATER]
    expected = frame.set_index("time")["HEATER heating power"].resample("30min", closed="right", label="right").mean()
    inside = power.index.tz_convert("UTC").intersection(expected.index)[1:-1]
    assert power.tz_convert("UTC")[inside].to_numpy() == pytest.approx(expected[inside].to_numpy(), abs=1e-6)
    assert any("means over steps of 1800 s" in remark for remark in found.remarks)


def test_jitter_duplicates_and_text_are_handled_and_told(house: Path, tmp_path: Path) -> None:
    frame = table("5min", tz="UTC").astype({"room temp": object})
    exact = frame.set_index("time")["room temp"].astype(float) + 273.15
    rng = np.random.default_rng(0)
    frame["time"] += pd.to_timedelta(rng.integers(-7, 8, len(frame)), unit="s")
    frame.loc[40, "room temp"] = "Bad"
    frame = pd.concat([frame, frame.iloc[[10, 11]]])
    frame.to_csv(tmp_path / "t.csv", index=False)
    found = import_telemetry(load_building(house), str(tmp_path / "t.csv"))
    told = " ".join(found.remarks)
    for text in ("beside even times", "2 stamps stand there twice", "1 cells are no numbers, such as 'Bad'"):
        assert text in told
    error = (found.telemetry.frame[ROOM].tz_convert("UTC") - exact).reindex(exact.index)[1:-1]
    assert found.telemetry.step == 300.0
    assert error.abs().max() < 0.01 and error.notna().mean() > 0.99


def test_energy_counters_become_power_through_resets(house: Path, tmp_path: Path) -> None:
    frame = table("5min", tz="UTC").rename(columns={"HEATER heating power": "HEATER energy [kWh]"})
    power = np.full(len(frame), 1200.0)
    power[200:260] = 0.0
    counter = np.cumsum(power * 300.0) / 3.6e6 + 57.0
    counter[300:] -= counter[299]  # it began anew
    counter[100] = 0.0  # a glitch
    frame["HEATER energy [kWh]"] = counter
    frame.to_csv(tmp_path / "t.csv", index=False)
    found = import_telemetry(load_building(house), str(tmp_path / "t.csv"), ImportSettings(step=900.0))
    made = found.telemetry.frame[HEATER].tz_convert("UTC")[1:-1]
    expected = pd.Series(power, frame["time"]).resample("15min", closed="right", label="right").mean()
    assert made.to_numpy() == pytest.approx(expected[made.index].to_numpy(), abs=1e-3)
    told = " ".join(found.remarks)
    assert "readings of a counter, differenced" in told and "anew 1 times" in told and "1 readings fell back" in told


def test_amounts_of_each_interval_are_divided_by_it(house: Path, tmp_path: Path) -> None:
    frame = table("15min", tz="UTC")
    watts = frame.pop("HEATER heating power")
    frame["HEATER heating power [Wh]"] = watts / 4.0
    frame.to_csv(tmp_path / "t.csv", index=False)
    found = import_telemetry(load_building(house), str(tmp_path / "t.csv"))
    assert found.telemetry.frame[HEATER].to_numpy() == pytest.approx(watts.to_numpy(), abs=1e-3)
    assert any("amounts of each interval" in remark for remark in found.remarks)


def test_unmatched_heat_is_never_dropped_in_silence(house: Path, tmp_path: Path) -> None:
    frame = table(tz="UTC").rename(columns={"HEATER heating power": "Stove 7 output kW"})
    frame.to_csv(tmp_path / "t.csv", index=False)
    answer = run("import-telemetry", house, tmp_path / "t.csv", "--out", tmp_path / "new", "--json")
    assert json.loads(answer.stdout)["unmatched_heat"] == ["Stove 7 output kW"]
    aside = pd.read_parquet(tmp_path / "new" / "unmatched.parquet")
    assert {*aside["column"]} == {"Stove 7 output kW"} and len(aside) == len(frame)
    points = tmp_path / "points.csv"
    points.write_text(
        "column,entity,point,unit\nStove 7 output kW,HEATER,heating_power_sensor,W\n"
        "room temp,room,zone_air_temperature_sensor,\noutdoor temp,weather_station,outside_air_temperature_sensor,\n"
    )
    answer = run("import-telemetry", house, tmp_path / "t.csv", "--points", points, "--out", tmp_path / "given")
    assert answer.exit_code == 0 and "heat, it seems" not in answer.stdout
    assert load_case(tmp_path / "given").telemetry.frame[HEATER].mean() == pytest.approx(500.0, abs=20.0)


@pytest.mark.parametrize(("date", "hours"), [("2023-10-28", 49), ("2023-03-25", 47)])
def test_a_clock_that_is_put_forward_and_back(house: Path, tmp_path: Path, date: str, hours: int) -> None:
    index = pd.date_range(date, periods=4 * hours, freq="15min", tz="Europe/Berlin", name="time")
    values = np.arange(len(index), dtype=float) / 100.0 + 15.0
    frame = pd.DataFrame({"time": index.tz_localize(None), "room temp": values})
    frame.to_csv(tmp_path / "t.csv", index=False)
    found = import_telemetry(load_building(house), str(tmp_path / "t.csv"), ImportSettings(timezone="Europe/Berlin"))
    assert found.telemetry.step == 900.0 and found.telemetry.missing_rows == ()
    assert found.telemetry.frame[ROOM].to_numpy() == pytest.approx(values + 273.15)
    assert any("told apart" in remark for remark in found.remarks) == (hours == 49)


def test_a_logger_that_does_not_change_its_clock_is_named(house: Path, tmp_path: Path) -> None:
    frame = table("15min", start="2023-03-25")
    frame.to_csv(tmp_path / "t.csv", index=False)
    found = import_telemetry(load_building(house), str(tmp_path / "t.csv"), ImportSettings(timezone="Europe/Berlin"))
    told = " ".join(found.remarks)
    assert "Europe/Berlin does not have (first 2023-03-26 02:00:00)" in told and "4 values" in told
    frame = table("15min", start="2023-10-28")
    frame.to_csv(tmp_path / "t.csv", index=False)
    found = import_telemetry(load_building(house), str(tmp_path / "t.csv"), ImportSettings(timezone="Europe/Berlin"))
    assert "it stands there once" in " ".join(found.remarks)


@pytest.mark.parametrize("stamp", ["9999-12-31T23:50:00-05:00", "1600-01-01T00:00:00Z"])
def test_a_row_of_an_impossible_year_among_good_ones_is_left_out_and_told(
    house: Path, tmp_path: Path, stamp: str
) -> None:
    frame = table("5min", tz="UTC")
    frame.to_csv(tmp_path / "good.csv", index=False)
    frame["time"] = frame["time"].map(lambda time: time.isoformat())
    frame.loc[[40, 41], "time"] = stamp
    frame.loc[42, "time"] = None
    frame.to_csv(tmp_path / "t.csv", index=False)
    good, found = (import_telemetry(load_building(house), str(tmp_path / name)) for name in ("good.csv", "t.csv"))
    told = [remark for remark in found.remarks if "1900 to 2199" in remark]
    assert len(told) == 1 and told[0].startswith(f"2 rows are not time stamps of the years 1900 to 2199 (first {stamp})")
    assert "1 rows without a time stamp that can be read were left out" in found.remarks
    lost = good.telemetry.frame[ROOM].notna() & found.telemetry.frame[ROOM].isna()
    assert lost.sum() == 3 and found.telemetry.frame.index.equals(good.telemetry.frame.index)


@pytest.mark.parametrize("odd", ["20000-01-01", "-4400-03-15"])
def test_times_of_a_parquet_file_that_pandas_cannot_spell_are_told(house: Path, tmp_path: Path, odd: str) -> None:
    frame = table("5min", tz="UTC")
    times = frame["time"].to_numpy("datetime64[ms]")
    times[0] = np.datetime64(odd, "ms")
    frame.assign(time=times).to_parquet(tmp_path / "t.parquet")
    read = partial(import_telemetry, load_building(house), str(tmp_path / "t.parquet"))
    told = " ".join(read(ImportSettings(timezone="UTC")).remarks)
    assert f"1 rows are not time stamps of the years 1900 to 2199 (first {odd}" in told
    with pytest.raises(PlanError, match=f"'{odd}"):
        read(ImportSettings())


@pytest.mark.parametrize(
    ("change", "settings", "error", "text"),
    [
        ({"time": "yesterday"}, {}, PlanError, "time stamps"),
        ({"time": "1500-01-01T10:00:00Z"}, {}, PlanError, "the years 1900 to 2199"),
        ({"time": "9999-12-31T23:50:00-05:00"}, {}, PlanError, "the years 1900 to 2199"),
        ({"time": "03/04/2023 10:00"}, {"timezone": "UTC"}, PlanError, "read in one way"),
        ({}, {"step": 7.0}, CaseError, "divides a day"),
        ({}, {"step": 7 * 3600.0}, CaseError, "--resample"),
        ({}, {"units": {"heating_power_sensor": "degC"}}, CaseError, "counter counts"),
        ({"room temp": "x", "HEATER heating power": "x", "outdoor temp": "x"}, {}, PlanError, "matched"),
    ],
)
def test_bad_tables_are_refused_by_name(
    house: Path, tmp_path: Path, change: dict[str, str], settings: dict[str, Any], error: type[Exception], text: str
) -> None:
    table(tz="UTC").assign(**change).to_csv(tmp_path / "t.csv", index=False)
    with pytest.raises(error, match=text):
        import_telemetry(load_building(house), str(tmp_path / "t.csv"), ImportSettings(**settings))
