"""Weather of a trial in steps of five minutes: what the station sees, and what reaches the building."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pvlib
from _sealed import EnergyPlusMissingError
from numpy.typing import NDArray
from scipy.signal import lfilter

from energyplus_trials.sites import GENERATED
from energyplus_trials.specification import Climate
from thermal.case.building import Location
from thermal.pilot.weather import generate_weather

Series = NDArray[np.float64]

STEP = pd.Timedelta(minutes=5)
STEPS_PER_DAY = 288
STEFAN_BOLTZMANN = 5.6697e-8  # [W/m2/K4], the value that EnergyPlus computes the sky with
FREEZING = 273.15  # [K]
YEAR = 2023  # stands for the typical years, which have none
POINTS = {
    "outside_air_temperature_sensor": "degC",
    "wind_speed_sensor": "m/s",
    "wind_direction_sensor": "deg",
    "horizontal_infrared_irradiance_sensor": "W/m^2",
    "direct_normal_irradiance_sensor": "W/m^2",
    "diffuse_horizontal_irradiance_sensor": "W/m^2",
}
_FIELDS = {"air": 6, "infrared": 12, "direct": 14, "diffuse": 15, "direction": 20, "speed": 21}
# Dew point of the air that EnergyPlus sees: as dry as its supply air, so that cp is the case format's everywhere.
_DEW_POINT = -23.0  # [degC]


def weather_folder() -> Path:
    """Return the folder of the weather files that come with EnergyPlus."""
    try:
        import pyenergyplus
    except ImportError as error:
        raise EnergyPlusMissingError("EnergyPlus is not installed: pip install -e .[energyplus]") from error
    return Path(pyenergyplus.__file__).parent / "data" / "weather"


def timezone(climate: Climate) -> str:
    """Return the IANA name of the site's standard time, whose sign is POSIX's.

    Parameters
    ----------
    climate : Climate
        Of a trial.
    """
    return f"Etc/GMT{-climate.utc_offset:+d}" if climate.utc_offset else "Etc/GMT"


def station_weather(climate: Climate, run_in: int, days: int) -> pd.DataFrame:
    """Return the weather that the station sees, in the case format's units; ends of intervals, standard time.

    Parameters
    ----------
    climate : Climate
        Of a trial.
    run_in, days : int
        Days before the telemetry, and of it.
    """
    first = pd.Timestamp(climate.start) - pd.Timedelta(days=run_in)
    index = pd.date_range(first + STEP, periods=(run_in + days) * STEPS_PER_DAY, freq=STEP, name="timestamp")
    if climate.source == GENERATED:
        weather = _generated(climate, index)
    else:
        weather = _from_file(climate, index)
    air = weather["outside_air_temperature_sensor"]
    warmed = air.mean() + climate.warmer + climate.swing * (air - air.mean())
    # The sky follows the air: the same emissivity.
    sky = ((warmed + FREEZING) / (air + FREEZING)) ** 4
    weather["horizontal_infrared_irradiance_sensor"] *= sky
    weather["outside_air_temperature_sensor"] = warmed
    return weather.round(4)


def _generated(climate: Climate, index: pd.DatetimeIndex) -> pd.DataFrame:
    location = Location(
        latitude=climate.latitude,
        longitude=climate.longitude,
        elevation=climate.elevation,
        timezone=timezone(climate),
    )
    days = len(index) / STEPS_PER_DAY
    weather = generate_weather(climate.seed, start=str(index[0] - STEP), days=days, location=location)
    weather.columns = [name.partition("/")[2] for name in weather.columns]
    weather.index = index
    weather["outside_air_temperature_sensor"] -= FREEZING
    return weather[list(POINTS)].copy()


def _from_file(climate: Climate, index: pd.DatetimeIndex) -> pd.DataFrame:
    """Interpolate hourly values; the sun by its clear-sky index, with single clouds, so that no hour is a plateau."""
    table = pd.read_csv(weather_folder() / climate.source, skiprows=8, header=None, encoding="latin-1")
    hours = pd.date_range(f"{YEAR}-01-01 01:00", periods=8760, freq="h")
    hourly = pd.DataFrame({name: table[column].to_numpy(float) for name, column in _FIELDS.items()}, index=hours)
    rng = np.random.default_rng([climate.seed, 1])
    near = hourly.loc[index[0] - pd.Timedelta(hours=2) : index[-1] + pd.Timedelta(hours=2)]

    def at(values: Series, shift: str = "0h") -> Series:
        times = near.index - pd.Timedelta(shift)
        return np.interp(index.asi8, times.asi8, values)

    angle = np.radians(near["direction"].to_numpy())
    gust = np.exp(0.15 * _noise(rng, len(index), 900.0) - 0.011)
    speed = at(near["speed"].to_numpy()) * gust
    east, north = at(np.sin(angle)), at(np.cos(angle))
    direction = np.degrees(np.arctan2(east, north)) + 10.0 * _noise(rng, len(index), 1800.0)
    direct, diffuse = _sun(climate, near, index, rng)
    return pd.DataFrame(
        {
            "outside_air_temperature_sensor": at(near["air"].to_numpy()) + 0.1 * _noise(rng, len(index), 1800.0),
            "wind_speed_sensor": speed,
            "wind_direction_sensor": np.mod(direction, 360.0),
            "horizontal_infrared_irradiance_sensor": at(near["infrared"].to_numpy()),
            "direct_normal_irradiance_sensor": direct,
            "diffuse_horizontal_irradiance_sensor": diffuse,
        },
        index=index,
    )


def _sun(
    climate: Climate, near: pd.DataFrame, index: pd.DatetimeIndex, rng: np.random.Generator
) -> tuple[Series, Series]:
    fine = pd.date_range(near.index[0] - pd.Timedelta(hours=1) + STEP, near.index[-1], freq=STEP)
    clear = clear_sky(climate, fine)
    hourly = clear.to_numpy().reshape(-1, 12, 2).mean(axis=1)
    measured = near[["direct", "diffuse"]].to_numpy()
    up = hourly[:, 0] > 20.0
    share = np.where(up[:, None], measured / np.maximum(hourly, 5.0), 0.0)
    share = np.clip(share, 0.0, [1.15, 8.0])
    middle = near.index - pd.Timedelta(minutes=30)
    known = middle[up].asi8  # through the night the last share of the day leads to the first of the next
    patches = np.clip(1.0 + 0.35 * _noise(rng, len(index), 900.0), 0.3, 1.5)
    smooth = [np.interp((index - STEP / 2).asi8, known, share[up, k]) if up.any() else 0.0 for k in (0, 1)]
    broken = np.clip(4.0 * smooth[0] * (1.0 - smooth[0]), 0.0, 1.0)  # neither clear nor overcast
    direct_share = np.clip(smooth[0] * (1.0 + broken * (patches - 1.0)), 0.0, 1.1)
    at = clear.reindex(index)
    return direct_share * at["dni"].to_numpy(), smooth[1] * at["dhi"].to_numpy()


def clear_sky(climate: Climate, ends: pd.DatetimeIndex) -> pd.DataFrame:
    """Return clear-sky direct normal and diffuse horizontal irradiance [W/m2] of intervals, taken at their middles.

    Parameters
    ----------
    climate : Climate
        Of a trial.
    ends : DatetimeIndex, shape (n_time,)
        Ends of the intervals, standard time without time zone.
    """
    middle = (ends - STEP / 2).tz_localize(timezone(climate))
    sun = pvlib.solarposition.get_solarposition(middle, climate.latitude, climate.longitude, climate.elevation)
    pressure = pvlib.atmosphere.alt2pres(climate.elevation)
    extra = pvlib.irradiance.get_extra_radiation(middle.day_of_year.to_numpy())
    clear = pvlib.clearsky.simplified_solis(sun["apparent_elevation"], 0.1, 1.4, pressure=pressure, dni_extra=extra)
    up = sun["apparent_elevation"].to_numpy() > 0.0
    return pd.DataFrame({name: np.where(up, clear[name].to_numpy(), 0.0) for name in ("dni", "dhi")}, index=ends)


def _noise(rng: np.random.Generator, n: int, time: float) -> Series:
    """First-order autoregressive noise of unit variance and of a time constant [s]."""
    keep = np.exp(-STEP.total_seconds() / time)
    drive = rng.standard_normal(n) * np.sqrt(1.0 - keep**2)
    return np.asarray(lfilter([1.0], [1.0, -keep], drive), dtype=float)


def building_weather(station: pd.DataFrame, *, sun: bool, sky: float) -> pd.DataFrame:
    """Return the weather that reaches the building.

    Parameters
    ----------
    station : DataFrame, shape (n_time, 6)
        As `station_weather` returns it.
    sun : bool
        Whether the sun does.
    sky : float
        Share of the difference between air and sky that does [-]; 0 is a sky at air temperature.
    """
    weather = station.copy()
    air = station["outside_air_temperature_sensor"] + FREEZING
    true = (station["horizontal_infrared_irradiance_sensor"] / STEFAN_BOLTZMANN) ** 0.25
    weather["horizontal_infrared_irradiance_sensor"] = STEFAN_BOLTZMANN * (air - sky * (air - true)) ** 4
    if not sun:
        weather[["direct_normal_irradiance_sensor", "diffuse_horizontal_irradiance_sensor"]] = 0.0
    return weather


def write_epw(path: Path, weather: pd.DataFrame, climate: Climate) -> None:
    """Write a weather file of twelve records an hour that holds just the days of the run.

    Parameters
    ----------
    path : Path
        File to be.
    weather : DataFrame, shape (n_time, 6)
        Ends of intervals, whole days.
    climate : Climate
        Where.
    """
    starts = weather.index - STEP
    first, last = starts[0], starts[-1]
    head = [
        f"LOCATION,site,-,-,trial,0,{climate.latitude},{climate.longitude},{climate.utc_offset},{climate.elevation}",
        "DESIGN CONDITIONS,0",
        "TYPICAL/EXTREME PERIODS,0",
        "GROUND TEMPERATURES,0",
        "HOLIDAYS/DAYLIGHT SAVINGS,No,0,0,0",
        "COMMENTS 1,-",
        "COMMENTS 2,-",
        f"DATA PERIODS,1,12,Data,{first.day_name()},{first.month}/{first.day},{last.month}/{last.day}",
    ]
    pressure = float(pvlib.atmosphere.alt2pres(climate.elevation))
    # With several records an hour EnergyPlus takes irradiance as it is, in W/m2, not as energy of the interval.
    columns = weather[list(POINTS)].to_numpy()
    rows = []
    for start, (air, speed, direction, infrared, direct, diffuse) in zip(starts, columns, strict=True):
        humidity = 100.0 * np.exp(17.27 * _DEW_POINT / (237.7 + _DEW_POINT) - 17.27 * air / (237.7 + air))
        rows.append(
            f"{start.year},{start.month},{start.day},{start.hour + 1},{start.minute + 5},-,{air:.4f},{_DEW_POINT},"
            f"{min(humidity, 100.0):.3f},{pressure:.0f},0,0,{infrared:.4f},0,{direct:.4f},{diffuse:.4f},"
            f"0,0,0,0,{direction:.2f},{speed:.4f},0,0,20,77777,9,999999999,0,0.1,0,88,0.2,0,0"
        )
    path.write_text("\n".join([*head, *rows]) + "\n", encoding="latin-1")
