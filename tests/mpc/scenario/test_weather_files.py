"""Weather files: an EPW written here, pvlib's own TMY3, CSV in other units, a case's telemetry, EnergyPlus' files."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import numpy as np
import pandas as pd
import pvlib
import pytest
from pvlib.iotools import read_epw as pvlib_epw
from pvlib.iotools import read_tmy3 as pvlib_tmy3

from mpc.errors import WeatherError
from mpc.scenario.grid import StepGrid
from mpc.scenario.weather_files import read_epw, read_tmy3, read_weather_csv, sky_radiation, weather_of_case
from thermal import Case, Telemetry, load_bundled_case
from thermal.case.building import Location
from thermal.inputs.provider import telemetry_inputs

BAY = Location(latitude=37.4, longitude=-122.1, elevation=20.0, timezone="America/Los_Angeles")
AIR, WIND, FROM = "outside_air_temperature_sensor", "wind_speed_sensor", "wind_direction_sensor"
BEAM, GLOBAL, SKY = (
    "direct_normal_irradiance_sensor",
    "global_horizontal_irradiance_sensor",
    "horizontal_infrared_irradiance_sensor",
)
TMY3 = Path(pvlib.__file__).parent / "data" / "723170TYA.CSV"


@pytest.fixture(scope="module")
def epw(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A year whose every field follows from the hour of the year."""
    stamps = pd.date_range("2023-01-01", periods=8760, freq="h")  # starts of the hours
    lines = ["LOCATION,Town,CA,USA,TMY3,724940,37.4,-122.1,-8.0,20.0"]
    lines += [f"HEADER {k}" for k in range(7)]
    for hour, stamp in enumerate(stamps):
        air = 99.9 if hour == 100 else round(10.0 + 0.001 * hour, 3)
        sun = [hour % 700, hour % 500, hour % 300]  # global, beam, diffuse
        fields = [stamp.year, stamp.month, stamp.day, stamp.hour + 1, 60, "x", air, 5.0, 50, 101325, 0, 0, 300]
        fields += [*sun, 0, 0, 0, 0, 180, 2.5, 5, 5, 10, 7777, 9, 999999999, 100, 0.1, 0, 88, 0.2, 0.0, 0.0]
        lines.append(",".join(map(str, fields)))
    path = tmp_path_factory.mktemp("epw") / "town.epw"
    path.write_text("\n".join(lines) + "\n")
    return path


def test_an_epw_ends_its_hours(epw: Path) -> None:
    weather = read_epw(epw)
    assert weather.location.timezone == "Etc/GMT+8" and weather.location.elevation == 20.0
    noon = pd.Timestamp("2023-01-02 13:00", tz="Etc/GMT+8")  # row 36 of the file: hour 13 of 2 January
    assert weather.frame.loc[noon, AIR] == pytest.approx(283.15 + 0.036)
    assert weather.frame.loc[noon, GLOBAL] == 36.0
    assert weather.frame[AIR].isna().sum() == 1 and np.isnan(weather.frame[AIR].iloc[100])
    hour = StepGrid(pd.Timestamp("2023-01-02 12:00", tz=BAY.timezone), 3600.0, 1)
    assert weather.on(hour).outdoor[0] == pytest.approx(283.15 + 0.0355)  # straight from noon's to one o'clock's
    assert weather.on(hour).values(GLOBAL)[0] == 36.0


def test_a_tmy3_is_as_pvlib_reads_it() -> None:
    if not TMY3.exists():
        pytest.skip("this pvlib brings no TMY3 file")
    weather = read_tmy3(TMY3)
    data, _ = pvlib_tmy3(str(TMY3), coerce_year=2023)
    assert weather.frame[AIR].to_numpy() == pytest.approx(data["temp_air"].to_numpy() + 273.15)
    assert weather.frame[GLOBAL].to_numpy() == pytest.approx(data["ghi"].to_numpy())
    assert weather.stamps[0] == pd.Timestamp("2023-01-01 01:00", tz="Etc/GMT+5")
    assert 150.0 < weather.frame[SKY].min() and weather.frame[SKY].max() < 500.0
    fine = weather.on(StepGrid(pd.Timestamp("2023-07-03", tz="Etc/GMT+5"), 300.0, 288))
    day = data.loc["2023-07-03 01:00":"2023-07-04 00:00", "ghi"].to_numpy()
    assert fine.values(GLOBAL).reshape(24, 12).mean(axis=1) == pytest.approx(day, abs=1e-6)


def test_the_sky_worked_by_hand() -> None:
    # 20 degC, dew point 10 degC, clear: 0.787 + 0.764 ln(283.15 / 273) = 0.81489; times σ T⁴ = 418.74
    assert sky_radiation(np.array([293.15]), np.array([283.15]), np.zeros(1))[0] == pytest.approx(341.2, abs=0.1)
    overcast = sky_radiation(np.array([293.15]), np.array([283.15]), np.full(1, 10.0))[0]
    assert overcast == pytest.approx(341.2 * (1 + 0.224 - 0.35 + 0.28), abs=0.2)


@pytest.mark.skipif(importlib.util.find_spec("pyenergyplus") is None, reason="needs the extra [energyplus]")
def test_energyplus_files_are_read() -> None:
    spec = importlib.util.find_spec("pyenergyplus")
    assert spec is not None and spec.origin is not None
    file = next((Path(spec.origin).parent / "data" / "weather").glob("*San.Francisco*.epw"))
    weather = read_epw(file)
    weather.require([AIR, WIND, FROM, GLOBAL, SKY])
    assert weather.frame[AIR].mean() == pytest.approx(273.15 + 13.8, abs=0.2)  # the site's known mean
    data, _ = pvlib_epw(str(file), coerce_year=2023)
    air, dew = (data[name].to_numpy(dtype=float) + 273.15 for name in ("temp_air", "temp_dew"))
    sky = sky_radiation(air, dew, data["opaque_sky_cover"].to_numpy(dtype=float))
    assert np.abs(sky - weather.frame[SKY].to_numpy()).mean() < 3.0  # the file's own, by the same model


def test_csv_in_units_of_its_own(tmp_path: Path) -> None:
    path = tmp_path / "weather.csv"
    path.write_text("time,T,v\n2023-07-03 00:05,50,1\n2023-07-03 00:10,59,2\n2023-07-03 00:15,,3\n")
    names, units = {"T": AIR, "v": WIND}, {AIR: "degF", WIND: "km/h"}
    weather = read_weather_csv(path, BAY, units, names, stamp="time")
    assert weather.frame[AIR].iloc[:2].tolist() == pytest.approx([283.15, 288.15])
    assert weather.frame[WIND].iloc[0] == pytest.approx(1 / 3.6)
    assert str(weather.stamps[0]) == "2023-07-03 00:05:00-07:00"
    with pytest.raises(WeatherError, match=r"for 1 of 3 steps \(first 2023-07-03 00:15"):
        weather.require([AIR])
    path.write_text(f"timestamp,{AIR}\n2023-07-03T07:05:00Z,10\n2023-07-03T07:10:00Z,15\n")
    assert str(read_weather_csv(path, BAY).stamps[0]) == "2023-07-03 00:05:00-07:00"


@pytest.mark.parametrize(
    ("text", "options", "message"),
    [
        ("timestamp,T\n2023-07-03 00:05,1\n2023-07-03 00:10,1\n", {}, "expected one of"),
        ("timestamp,T\n2023-07-03 00:05,1\n", {"columns": {"t": AIR}}, "nearest valid one is 'T'"),
        ("timestamp,T\n2023-07-03 00:05,1\n", {"columns": {"T": "air"}}, "a weather point"),
        (f"timestamp,{AIR}\n2023-07-03 00:05,x\n2023-07-03 00:10,1\n", {}, "could not convert"),
        (
            f"timestamp,{AIR}\n2023-07-03 00:05,1\n2023-07-03 00:10,1\n",
            {"units": {AIR: "kg"}},
            "a unit of a temperature",
        ),
        (f"timestamp,{AIR}\nyesterday,1\n2023-07-03 00:10,1\n", {}, "ISO 8601"),
        (f"timestamp,{AIR}\n2023-03-12 02:30,1\n2023-03-12 02:35,1\n", {}, "with their offset"),
    ],
)
def test_csv_that_is_wrong_is_refused(
    tmp_path: Path, text: str, options: dict[str, dict[str, str]], message: str
) -> None:
    path = tmp_path / "weather.csv"
    path.write_text(text)
    with pytest.raises(WeatherError, match=message):
        read_weather_csv(path, BAY, **options)


def test_files_that_are_none_are_refused(tmp_path: Path) -> None:
    (tmp_path / "bad.epw").write_text("hello\n")
    with pytest.raises(WeatherError, match=r"missing\.epw: expected a weather file"):
        read_epw(tmp_path / "missing.epw")
    for read in (read_epw, read_tmy3):
        with pytest.raises(WeatherError, match=r"bad\.epw: expected a file that pvlib's read_"):
            read(tmp_path / "bad.epw")
    with pytest.raises(WeatherError, match="a CSV file"):
        read_weather_csv(tmp_path / "none.csv", BAY)


def test_a_case_hands_its_telemetry_on_unchanged() -> None:
    case = load_bundled_case()
    weather = weather_of_case(case)
    day = StepGrid(case.stamps[99], 300.0, 288)
    on = weather.on(day)
    assert np.array_equal(on.outdoor, case.boundary_temperatures()["outdoor"].to_numpy()[100:388])
    beam = case.weather()[BEAM].to_numpy()[100:388]
    assert np.array_equal(on.frame[BEAM].to_numpy()[~np.isnan(beam)], beam[~np.isnan(beam)])


def test_irradiance_that_nobody_measures_is_that_of_the_model() -> None:
    """A window of a day is too short to estimate it from, so that plans and plants take what the telemetry gives."""
    case = load_bundled_case()
    frame = case.telemetry.frame
    frame = frame.drop(columns=frame.filter(regex="irradiance").columns)
    blind = Case(case.building, Telemetry(frame, case.step, case.telemetry.missing_rows))
    day = StepGrid(blind.stamps[99], 300.0, 288)
    assert weather_of_case(blind).estimated and not weather_of_case(case).estimated
    sun, model = weather_of_case(blind).on(day).sun, telemetry_inputs(blind).sun
    np.testing.assert_allclose(sun.normal, model.normal[100:388])
    np.testing.assert_allclose(sun.horizontal, model.horizontal[100:388], atol=1e-9)
    assert model.horizontal.max() > 100.0


def test_short_gaps_of_a_case_are_bridged_and_long_ones_are_not() -> None:
    case = load_bundled_case()
    frame = case.telemetry.frame.iloc[:288].copy()
    column = f"{case.building.weather_station}/{AIR}"
    frame.loc[frame.index[10:22], column] = np.nan  # an hour
    frame.loc[frame.index[50:63], column] = np.nan  # an hour and five minutes
    weather = weather_of_case(Case(case.building, Telemetry.from_frame(frame)))
    empty = weather.frame[AIR].isna().to_numpy()
    assert empty.sum() == 13 and empty[50:63].all()
