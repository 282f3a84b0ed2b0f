"""Weather of a trial: what the station sees, and what reaches the building."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ideal_air_trials.specification import STEP, Climate
from mpc.adapters.energyplus.input import weather_path

Series = NDArray[np.float64]

STEFAN_BOLTZMANN = 5.670374e-8  # [W/m2/K4], CODATA 2018
FREEZING = 273.15  # [K]
POINTS = {
    "outside_air_temperature_sensor": "degC",
    "wind_speed_sensor": "m/s",
    "wind_direction_sensor": "deg",
    "horizontal_infrared_irradiance_sensor": "W/m^2",
    "direct_normal_irradiance_sensor": "W/m^2",
    "diffuse_horizontal_irradiance_sensor": "W/m^2",
}
_AIR, _WIND, _DIRECTION, _INFRARED, _DIRECT, _DIFFUSE = POINTS
_HEAD = 8  # lines of a weather file before its hours
#: Fields of an hour: EnergyPlus' Auxiliary Programs, "EnergyPlus Weather File (EPW) Data Dictionary".
_FIELDS = {_AIR: 6, "dew_point": 7, _INFRARED: 12, _DIRECT: 14, _DIFFUSE: 15, _DIRECTION: 20, _WIND: 21}
_SUN_FIELDS = range(13, 20)  # irradiance and illuminance
_SKY_PER_KELVIN = 5.2  # [W/m2/K], of infrared: what a black sky of 15 to 20 degC has more when it is warmer
_INFRARED_LIMITS = (120.0, 600.0)  # [W/m2]
_MISSING, _EMISSIVITY = 900.0, 0.85  # infrared above is missing; of the sky then [-]


@dataclass(frozen=True)
class Weather:
    """A year.

    Parameters
    ----------
    hourly : DataFrame, shape (8760, 7)
        `POINTS` and ``dew_point`` in the case format's units; ends of hours.
    latitude, longitude, elevation : float
        [degree], [degree], [m]
    utc_offset : int
        Standard time [h].
    lines : tuple of str
        The weather file without 29 February.
    """

    hourly: pd.DataFrame
    latitude: float
    longitude: float
    elevation: float
    utc_offset: int
    lines: tuple[str, ...]

    @property
    def timezone(self) -> str:
        """IANA name of the site's standard time, whose sign is POSIX's."""
        return f"Etc/GMT{-self.utc_offset:+d}"

    def at(self, point: str, start: pd.Timestamp, steps: int) -> Series:
        """Return values at the ends of steps, shape (steps,), between hours on straight lines.

        Parameters
        ----------
        point : str
            Column of `hourly`. Irradiance is that of the middle of its hour, all else of the end.
        start : Timestamp
            When the first step begins.
        steps : int
            Number of steps.
        """
        first = (start - pd.Timestamp(start.year, 1, 1)) / pd.Timedelta(hours=1)
        wanted = first + np.arange(1, steps + 1) * STEP.total_seconds() / 3600.0
        known = np.arange(len(self.hourly)) + (0.5 if point in (_DIRECT, _DIFFUSE) else 1.0)
        values = self.hourly[point].to_numpy()
        if point == _DIRECTION:
            return np.asarray(np.rad2deg(np.interp(wanted, known, np.unwrap(np.deg2rad(values)))) % 360.0)
        return np.asarray(np.interp(wanted, known, values))

    def station(self, start: pd.Timestamp, steps: int) -> pd.DataFrame:
        """Return what the weather station sees, shape (steps, 6).

        Parameters
        ----------
        start : Timestamp
            When the first step begins.
        steps : int
            Number of steps.
        """
        return pd.DataFrame({point: self.at(point, start, steps) for point in POINTS})


def read_weather(climate: Climate) -> Weather:
    """Read a weather file, made warmer or colder and more or less windy.

    The dew point moves with the air. Where infrared is missing, the sky is grey.

    Parameters
    ----------
    climate : Climate
        Of a trial.

    Raises
    ------
    EnergyPlusError
        When EnergyPlus, which brings the file, is not installed.
    """
    text = weather_path(climate.source).read_text(encoding="latin-1").splitlines()
    lines = [line for line in text[_HEAD:] if line.split(",")[1:3] != ["2", "29"]]
    rows = [line.split(",") for line in lines]
    hourly = pd.DataFrame({name: [float(row[k]) for row in rows] for name, k in _FIELDS.items()})
    missing = hourly[_INFRARED] > _MISSING
    hourly[[_AIR, "dew_point"]] += climate.warmer
    infrared = (hourly[_INFRARED] + _SKY_PER_KELVIN * climate.warmer).clip(*_INFRARED_LIMITS)
    grey = _EMISSIVITY * STEFAN_BOLTZMANN * (hourly[_AIR] + FREEZING) ** 4
    hourly[_INFRARED] = infrared.where(~missing, grey)
    hourly[_DIRECTION] %= 360.0
    hourly[_WIND] *= climate.wind_factor
    latitude, longitude, offset, elevation = (float(v) for v in text[0].split(",")[6:10])
    return Weather(hourly, latitude, longitude, elevation, int(offset), (*text[:_HEAD], *lines))


def write_weather(path: Path, weather: Weather, *, sun: bool, sky: float) -> None:
    """Write the weather file that EnergyPlus gets.

    Parameters
    ----------
    path : Path
        File to be.
    weather : Weather
        The year.
    sun : bool
        Whether the sun reaches the building.
    sky : float
        Share of the difference between air and sky that does [-]; 0 is a sky at air temperature.
    """
    hourly = weather.hourly
    air = hourly[_AIR] + FREEZING
    true = (hourly[_INFRARED] / STEFAN_BOLTZMANN) ** 0.25
    infrared = STEFAN_BOLTZMANN * (air + sky * (true - air)) ** 4
    dew_point = hourly["dew_point"].clip(upper=hourly[_AIR])
    columns = (hourly[_AIR], dew_point, infrared, hourly[_WIND])
    written = list(weather.lines[:_HEAD])
    for line, air_now, dew_now, infrared_now, wind_now in zip(weather.lines[_HEAD:], *columns, strict=True):
        row = line.split(",")
        row[_FIELDS[_AIR]], row[_FIELDS["dew_point"]] = f"{air_now:.2f}", f"{dew_now:.2f}"
        row[_FIELDS[_INFRARED]], row[_FIELDS[_WIND]] = f"{infrared_now:.3f}", f"{wind_now:.2f}"
        if not sun:
            for k in _SUN_FIELDS:
                row[k] = "0"
        written.append(",".join(row))
    path.write_text("\n".join(written) + "\n", encoding="latin-1")
