"""Weather on a grid: hours kept, straight lines, the sun's shape, typical years, wind across north, gaps by name."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from pvlib.clearsky import simplified_solis
from pvlib.solarposition import get_solarposition

from mpc.errors import WeatherError
from mpc.scenario.grid import StepGrid
from mpc.scenario.weather import Weather
from thermal.case.building import Location

BAY = Location(latitude=37.4, longitude=-122.1, elevation=20.0, timezone="America/Los_Angeles")
AIR, WIND, FROM = "outside_air_temperature_sensor", "wind_speed_sensor", "wind_direction_sensor"
NORMAL, DIFFUSE, GLOBAL = (
    f"{name}_irradiance_sensor" for name in ("direct_normal", "diffuse_horizontal", "global_horizontal")
)
SKY = "horizontal_infrared_irradiance_sensor"


def hours(start: str, n_time: int, columns: dict[str, np.ndarray], **options: bool) -> Weather:
    index = pd.date_range(pd.Timestamp(start, tz=BAY.timezone) + pd.Timedelta("1h"), periods=n_time, freq="h")
    return Weather(pd.DataFrame(columns, index=index), BAY, **options)


def grid(start: str, step: float, n_steps: int) -> StepGrid:
    return StepGrid(pd.Timestamp(start, tz=BAY.timezone), step, n_steps)


def clear_day(day: str) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Clear sky of pvlib as means over minutes and hours."""
    start = pd.Timestamp(day, tz=BAY.timezone)
    minutes = pd.date_range(start + pd.Timedelta("30s"), periods=1440, freq="min")
    place = get_solarposition(minutes, BAY.latitude, BAY.longitude, BAY.elevation)
    clear = simplified_solis(place["apparent_elevation"], 0.1, 1.4)
    up = place["elevation"] > 0.0
    sky = pd.DataFrame({GLOBAL: clear["ghi"], NORMAL: clear["dni"], DIFFUSE: clear["dhi"]}).where(up, 0.0)
    sky.index = pd.date_range(start + pd.Timedelta("1min"), periods=1440, freq="min")
    return sky, sky.resample("h", closed="right", label="right").mean()


def test_readings_lie_on_straight_lines_between_their_stamps() -> None:
    weather = hours("2023-07-03", 6, {AIR: 280.0 + np.arange(6.0) ** 2}, readings=True)
    fine = weather.on(grid("2023-07-03 02:00", 300.0, 36)).outdoor
    at = 2.0 + (np.arange(36) + 0.5) / 12.0  # hours; the value at the middle is the mean over the step
    assert fine == pytest.approx(np.interp(at, np.arange(1.0, 7.0), 280.0 + np.arange(6.0) ** 2), abs=1e-9)
    first = weather.on(grid("2023-07-03", 1800.0, 2)).outdoor
    assert first.tolist() == [280.0, 280.0]  # nothing was read before the first stamp


@pytest.mark.parametrize("step", [60.0, 300.0, 600.0, 900.0, 1800.0])
def test_radiation_keeps_the_mean_of_every_hour(step: float) -> None:
    rng = np.random.default_rng(3)
    up = np.r_[np.zeros(6), rng.uniform(50, 900, 13), np.zeros(5)]
    columns = {NORMAL: up, DIFFUSE: 0.3 * up, GLOBAL: 0.8 * up, SKY: rng.uniform(250, 400, 24)}
    weather = hours("2023-07-03", 24, columns)
    fine = weather.on(grid("2023-07-03", step, int(86400 / step))).frame
    for point, values in columns.items():
        assert fine[point].to_numpy().reshape(24, -1).mean(axis=1) == pytest.approx(values, abs=1e-7), point
        assert fine[point].min() >= 0.0


def test_radiation_follows_the_sun_within_the_hour() -> None:
    # by hand: half of the sun's altitude gives half of the irradiance
    minute, hour = clear_day("2023-07-03")
    weather = Weather(hour, BAY)
    fine = weather.on(grid("2023-07-03", 300.0, 288)).frame
    truth = minute.resample("5min", closed="right", label="right").mean()
    middles = fine.index - pd.Timedelta("150s")
    rise = np.sin(np.radians(get_solarposition(middles, BAY.latitude, BAY.longitude, BAY.elevation)["elevation"]))
    noon = slice(150, 156)
    ratio = fine[GLOBAL].to_numpy()[noon] / rise.to_numpy()[noon]
    assert ratio == pytest.approx(np.full(6, ratio[0]), rel=1e-9)  # one hour: in proportion to the sine
    steps = hour[GLOBAL].to_numpy().repeat(12)
    error = np.sqrt(np.mean((fine[GLOBAL].to_numpy() - truth[GLOBAL].to_numpy()) ** 2))
    assert error < 0.25 * np.sqrt(np.mean((steps - truth[GLOBAL].to_numpy()) ** 2)) and error < 8.0
    assert (fine[GLOBAL].to_numpy()[rise.to_numpy() < 0.0] == 0.0).all()


def test_beam_and_diffuse_add_up_as_in_the_hour() -> None:
    _, hour = clear_day("2023-03-20")
    fine = Weather(hour, BAY).on(grid("2023-03-20", 300.0, 288))
    place = get_solarposition(
        fine.stamps - pd.Timedelta("150s"), BAY.latitude, BAY.longitude, BAY.elevation
    )  # fmt: skip
    rise = np.maximum(np.sin(np.radians(place["elevation"].to_numpy())), 0.0)
    whole = fine.frame[NORMAL].to_numpy() * rise + fine.frame[DIFFUSE].to_numpy()
    day = slice(96, 204)  # 8 to 17
    assert whole[day] == pytest.approx(fine.frame[GLOBAL].to_numpy()[day], rel=0.03)  # the beam is even over an hour


def test_a_typical_year_repeats_and_has_leap_days() -> None:
    index = pd.date_range("2023-01-01 01:00", periods=8760, freq="h", tz="Etc/GMT+8")
    year = Weather(pd.DataFrame({AIR: 280.0 + np.arange(8760.0) / 100}, index=index), BAY, True, True)
    for start, hour in (
        ("2023-12-31 12:00", 364 * 24 + 12),
        ("2024-02-29 06:00", 58 * 24 + 6),
        ("2031-07-03 13:00", 183 * 24 + 12),
    ):
        value = year.on(grid(start, 3600.0, 1)).outdoor[0]
        assert value == pytest.approx(280.0 + (hour - 0.5) / 100, abs=0.3 if hour == 58 * 24 + 6 else 1e-9), start
    across = year.on(grid("2023-12-31", 3600.0, 48)).outdoor
    assert across[24] == pytest.approx((280.0 + 8759 / 100 + 280.0) / 2)  # from the year's last to its first reading
    assert across[25] == pytest.approx(280.005)


def test_steps_of_daylight_saving_time_are_an_hour_from_standard_time() -> None:
    index = pd.date_range("2023-01-01 01:00", periods=8760, freq="h", tz="Etc/GMT+8")
    year = Weather(pd.DataFrame({AIR: 280.0 + np.arange(8760.0)}, index=index), BAY, True, True)
    # 1 pm in July is noon of the file's standard time
    assert year.on(grid("2023-07-03 13:00", 3600.0, 1)).outdoor[0] == pytest.approx(280 + 183 * 24 + 12 - 0.5)


def test_wind_turns_across_north() -> None:
    weather = hours("2023-07-03", 3, {AIR: np.full(3, 280.0), FROM: np.array([350.0, 10.0, 10.0])}, readings=True)
    turning = weather.on(grid("2023-07-03 01:00", 900.0, 4)).values(FROM)
    assert all(value > 340.0 or value < 20.0 for value in turning)
    assert turning[0] > 350.0 and turning[-1] < 10.0


def test_the_same_clock_passes_values_unchanged() -> None:
    rng = np.random.default_rng(0)
    columns = {AIR: rng.normal(285, 5, 24), GLOBAL: rng.uniform(0, 500, 24), SKY: rng.uniform(200, 400, 24)}
    same = hours("2023-07-03", 24, columns).on(grid("2023-07-03 03:00", 3600.0, 5)).frame
    for point, values in columns.items():
        assert np.array_equal(same[point].to_numpy(), values[3:8])


def test_a_gap_is_named_with_its_first_time() -> None:
    values = np.full(24, 285.0)
    values[5:7] = np.nan
    weather = hours("2023-07-03", 24, {AIR: values, WIND: np.ones(24)})
    on = weather.on(grid("2023-07-03", 1800.0, 48))
    with pytest.raises(
        WeatherError, match=r"lacks 'outside_air_temperature_sensor' for 4 of 48 steps \(first 2023-07-03 05:30"
    ):
        on.outdoor  # noqa: B018
    assert on.values(WIND).tolist() == [1.0] * 48
    with pytest.raises(WeatherError, match="lacks 'horizontal_infrared_irradiance_sensor' for 24 of 24"):
        weather.require([SKY])
    with pytest.raises(WeatherError, match="nearest valid one is 'wind_speed_sensor'"):
        weather.require(["wind_sped_sensor"])


def test_what_is_no_weather_is_refused() -> None:
    index = pd.date_range("2023-07-03", periods=4, freq="h", tz="UTC")
    for frame, options, message in (
        (pd.DataFrame({AIR: [1.0] * 4}, index=index.tz_localize(None)), {}, "time zone"),
        (pd.DataFrame({AIR: [1.0] * 3}, index=index[[0, 1, 3]]), {}, "03:00:00.* after"),
        (pd.DataFrame({"air": [1.0] * 4}, index=index), {}, "a weather point"),
        (pd.DataFrame({AIR: [1.0] * 4}, index=index), {"step": 600.0}, "one step of up to"),
        (pd.DataFrame({AIR: [1.0]}, index=index[:1]), {}, "at least two stamps"),
        (pd.DataFrame({AIR: [1.0] * 4}, index=index), {"typical": True}, "8760 hours"),
    ):
        with pytest.raises(WeatherError, match=message):
            Weather(frame, BAY, **options)
    with pytest.raises(WeatherError, match="expected weather from 2023-07-03 22:00"):
        hours("2023-07-03", 24, {AIR: np.ones(24)}).on(grid("2023-07-03 22:00", 3600.0, 3))
    with pytest.raises(WeatherError, match="whole minutes"):
        hours("2023-07-03", 24, {GLOBAL: np.ones(24)}).on(grid("2023-07-03 22:00:07", 300.0, 3))


def test_the_sun_is_derived_from_what_is_known() -> None:
    _, hour = clear_day("2023-07-03")
    known = Weather(hour[[GLOBAL]], BAY).on(grid("2023-07-03", 300.0, 288))
    sun = known.sun
    assert sun.normal.max() > 500.0
    rise = np.sin(np.radians(sun.altitude))
    day = slice(120, 180)
    assert (sun.normal * rise + sun.diffuse)[day] == pytest.approx(sun.horizontal[day], rel=1e-6)
