"""Synthetic weather: sun and sky that agree with themselves, and a clock that is the case format's."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
import pytest

from thermal.case.telemetry import Telemetry
from thermal.errors import ThermalError
from thermal.pilot.weather import MOUNTAIN_VIEW, generate_weather

STATION = "weather_station/"


@pytest.fixture(scope="module")
def month() -> pd.DataFrame:
    return generate_weather(4, start="2023-06-01", days=30).rename(columns=lambda name: name.removeprefix(STATION))


def test_clock(month: pd.DataFrame) -> None:
    assert str(month.index[0]) == "2023-06-01 00:05:00-08:00"
    assert str(month.index[-1]) == "2023-07-01 00:00:00-08:00"
    assert Telemetry.from_frame(month).step == 300.0


def test_values_are_weather(month: pd.DataFrame) -> None:
    assert not month.isna().any().any()
    air = month["outside_air_temperature_sensor"]
    assert 283.0 < air.mean() < 298.0
    assert 3.0 < air.groupby(air.index.date).agg(np.ptp).mean() < 15.0
    assert air.diff().abs().max() < 0.5
    assert (month["wind_speed_sensor"] >= 0.0).all()
    assert 1.0 < month["wind_speed_sensor"].mean() < 5.0
    assert month["wind_direction_sensor"].between(0.0, 360.0).all()
    assert (month.filter(like="irradiance") >= 0.0).all().all()
    assert month["direct_normal_irradiance_sensor"].max() < 1050.0


def test_the_days_are_warmest_in_the_afternoon(month: pd.DataFrame) -> None:
    by_hour = month["outside_air_temperature_sensor"].groupby(month.index.hour).mean()
    assert 13 <= by_hour.idxmax() <= 16
    assert 3 <= by_hour.idxmin() <= 6


def test_global_sun_is_direct_and_diffuse(month: pd.DataFrame) -> None:
    """Closure, with the sun's height by Spencer (1971) rather than by pvlib."""
    middle = month.index - pd.Timedelta(seconds=150)
    angle = 2.0 * np.pi * (middle.day_of_year.to_numpy() - 1.0) / 365.0
    hours = (middle.hour + middle.minute / 60.0 + middle.second / 3600.0).to_numpy()
    declination = (
        0.006918 - 0.399912 * np.cos(angle) + 0.070257 * np.sin(angle) - 0.006758 * np.cos(2 * angle)
        + 0.000907 * np.sin(2 * angle) - 0.002697 * np.cos(3 * angle) + 0.00148 * np.sin(3 * angle)
    )  # fmt: skip
    equation = 229.18 * (
        0.000075 + 0.001868 * np.cos(angle) - 0.032077 * np.sin(angle) - 0.014615 * np.cos(2 * angle)
        - 0.04089 * np.sin(2 * angle)
    )  # fmt: skip
    solar = hours + equation / 60.0 + (MOUNTAIN_VIEW.longitude + 120.0) / 15.0
    latitude = np.radians(MOUNTAIN_VIEW.latitude)
    height = np.sin(latitude) * np.sin(declination) + np.cos(latitude) * np.cos(declination) * np.cos(
        np.radians(15.0 * (solar - 12.0))
    )
    direct, diffuse, overall = (
        month[f"{kind}_irradiance_sensor"] for kind in ("direct_normal", "diffuse_horizontal", "global_horizontal")
    )
    up = height > 0.1
    assert np.allclose(overall[up], diffuse[up] + direct[up] * height[up], atol=8.0)
    assert (overall[height < -0.05] == 0.0).all()
    assert overall[height > 0.5].min() > 50.0


def test_the_sky_is_colder_than_the_air(month: pd.DataFrame) -> None:
    black = 5.670374e-8 * month["outside_air_temperature_sensor"] ** 4
    emissivity = month["horizontal_infrared_irradiance_sensor"] / black
    assert emissivity.between(0.7, 1.0).all()
    cloudy = month["direct_normal_irradiance_sensor"] < 100.0
    noon = month.index.hour == 12
    assert emissivity[noon & cloudy].mean() > emissivity[noon & ~cloudy].mean()


def test_same_seed_same_weather() -> None:
    pd.testing.assert_frame_equal(generate_weather(3, days=2), generate_weather(3, days=2))
    other = generate_weather(4, days=2)["weather_station/outside_air_temperature_sensor"]
    assert (generate_weather(3, days=2)["weather_station/outside_air_temperature_sensor"] != other).mean() > 0.9


def test_winter_is_colder_than_summer() -> None:
    means = [
        np.mean([generate_weather(seed, start=start, days=10).iloc[:, 0].mean() for seed in range(4)])
        for start in ("2023-01-10", "2023-07-10")
    ]
    assert means[1] - means[0] == pytest.approx(11.0, abs=3.0)


def test_other_steps_and_stations() -> None:
    hourly = generate_weather(1, days=3, step_seconds=3600.0, station="roof")
    assert len(hourly) == 72
    assert all(name.startswith("roof/") for name in hourly)


@pytest.mark.parametrize(
    "arguments",
    [{"seed": -1}, {"days": 0.0}, {"step_seconds": 0.0}, {"step_seconds": -300.0}, {"step_seconds": 7200.0}],
)
def test_what_is_no_stretch_of_time_is_refused(arguments: dict[str, Any]) -> None:
    with pytest.raises(ThermalError, match="expected a seed of 0 or more"):
        generate_weather(**arguments)
