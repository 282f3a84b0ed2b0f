"""Weather and disturbances of a generated office: random processes drawn from a seed."""

from dataclasses import dataclass

import numpy as np
import pandas as pd
from scipy.signal import lfilter

from thermal._types import FloatArray
from thermal.case.building import Location
from thermal.errors import ThermalError

_STREAM = 4  # of random numbers of a seed


def draw_disturbance(
    seed: int, n_time: int, deviation: FloatArray, time_constant: float, step_seconds: float = 300.0
) -> FloatArray:
    """Draw the unmeasured heat of zones: an Ornstein-Uhlenbeck process each, sampled exactly, stationary at once.

    ``d_{k+1} = φ d_k + σ sqrt(1 − φ²) w_k`` with ``φ = exp(−Δt / τ)`` and ``d_0 ~ N(0, σ²)``, so that the
    autocovariance is ``σ² exp(−|t| / τ)`` at any step (Gillespie 1996, doi:10.1103/PhysRevE.54.2084).

    Parameters
    ----------
    seed : int
        Same seed, same heat; 0 or more.
    n_time : int
        Number of steps, at least 1.
    deviation : numpy.ndarray, shape (n_zone,)
        Stationary standard deviation σ of each zone [W], 0 or more.
    time_constant : float
        Correlation time τ [s], positive.
    step_seconds : float
        Length of a step Δt [s], positive.

    Returns
    -------
    numpy.ndarray, shape (n_time, n_zone)
        Heat during each step [W], independent between zones.

    Examples
    --------
    >>> draw_disturbance(0, 288, np.array([100.0, 50.0]), 3600.0).shape
    (288, 2)
    """
    if seed < 0 or n_time < 1 or not np.all(np.asarray(deviation) >= 0.0) or min(time_constant, step_seconds) <= 0.0:
        expected = "a seed of 0 or more, a step, deviations of 0 or more and positive times"
        found = f"{seed}, {n_time} steps, {np.min(deviation)} W, {time_constant} s and {step_seconds} s"
        raise ThermalError("disturbance", expected, found)
    keep = np.exp(-step_seconds / time_constant)
    drive = np.random.default_rng([seed, _STREAM]).standard_normal((n_time, len(deviation)))
    drive[1:] *= np.sqrt(1.0 - keep**2)
    return np.asarray(deviation * lfilter([1.0], [1.0, -keep], drive, axis=0), dtype=float)


#: The town of the paper's pilot building [degrees, m], without daylight saving.
MOUNTAIN_VIEW = Location(latitude=37.4, longitude=-122.1, elevation=20.0, timezone="Etc/GMT+8")
_STEFAN_BOLTZMANN = 5.670374419e-8  # W/m2/K4, CODATA 2018
_DAY = 86400.0  # s
# About the climate south of San Francisco Bay: 9.5 degC in January, 20.5 degC in July, 11 K from night to afternoon.
_YEAR_MEAN, _YEAR_SWING, _COLDEST_DAY = 288.15, 5.5, 15.0  # K, K, day of the year
_DAY_SWING, _WARMEST_HOUR = 5.5, 15.0  # K under a clear sky, h
_FRONT_DEVIATION, _FRONT_TIME = 2.0, 2.0 * _DAY  # K, s: passing air masses
_CLOUD_TIME, _CLOUDIER = 0.3 * _DAY, -0.6  # s, -: half of the time less than a third of the sky is covered
_PATCH_TIME, _PATCHES = 1200.0, 0.3  # s, -: single clouds before the sun
_WIND_TIME, _BREEZE, _WIND_MEAN = 3.0 * 3600.0, 0.6, 2.5  # s, -, m/s: a sea breeze in the afternoon
_WIND_FROM, _WIND_VEER = 300.0, 50.0  # deg, the north-westerly of the bay; deg, standard deviation
_TURBIDITY, _VAPOUR = 0.10, 1.4  # aerosol optical depth at 700 nm [-], precipitable water [cm]: clean coastal air
_DECIMALS = 3  # of every value that is reported


@dataclass(frozen=True)
class Period:
    """A stretch of generated telemetry, and what is simulated before it.

    Parameters
    ----------
    start : str
        Local time at which the first reported interval begins, ISO 8601 without offset.
    days : float
        Length of the telemetry [d], positive.
    spin_up_days : float
        Length that is simulated before it, so that walls and mass forget how they started [d], 0 or more.
    step_seconds : float
        Length of an interval [s], positive, up to 3600. The default is the paper's 5 minutes.
    """

    start: str = "2023-10-02"
    days: float = 14.0
    spin_up_days: float = 2.0
    step_seconds: float = 300.0

    def weather(self, seed: int, location: Location, station: str) -> pd.DataFrame:
        """Weather of the period and of the spin-up before it, as `generate_weather` gives it.

        Parameters
        ----------
        seed : int
            Same seed, same weather [-]; 0 or more.
        location : Location
            Where it is.
        station : str
            Entity that reports it.
        """
        start = str(pd.Timestamp(self.start) - pd.Timedelta(days=self.spin_up_days))
        days, step = self.days + self.spin_up_days, self.step_seconds
        return generate_weather(seed, start=start, days=days, step_seconds=step, location=location, station=station)


def generate_weather(
    seed: int = 0,
    *,
    start: str = "2023-10-02",
    days: float = 14.0,
    step_seconds: float = 300.0,
    location: Location = MOUNTAIN_VIEW,
    station: str = "weather_station",
) -> pd.DataFrame:
    """Make the weather of a stretch of time at a place with a mild, dry climate.

    Outdoor air follows the season, a daily cycle that clouds dampen, and fronts (an autoregressive process); clouds and
    wind are such processes too. Direct sun is the clear sky's (`pvlib.clearsky.simplified_solis`) times the uncovered
    share of the sky; global sun is the clear sky's times ``1 - 0.75 N^3.4`` (Kasten and Czeplak 1980,
    doi:10.1016/0038-092X(80)90391-6); diffuse sun is the difference, so that the three agree. The sky radiates as in
    Walton (1983) and Clark and Allen (1978), from temperature, dew point and cloud.

    Parameters
    ----------
    seed : int
        Same seed, same weather; 0 or more.
    start : str
        Local time at which the first interval begins, ISO 8601 without offset. Default as in the shared cases.
    days : float
        Length [d], positive; at least two steps.
    step_seconds : float
        Length of an interval [s], positive, up to 3600.
    location : Location
        Where; the default is the paper's pilot building's town.
    station : str
        Entity that reports the weather.

    Returns
    -------
    pandas.DataFrame
        Shape (n_time, 7), index ``timestamp`` at the end of each interval, columns ``<station>/<point>`` in SI units:
        outside air temperature [K], wind speed [m/s] and direction [deg from north], direct normal, diffuse horizontal
        and global horizontal irradiance [W/m2], horizontal infrared irradiance [W/m2].

    Raises
    ------
    ThermalError
        When seed, length or step is out of range.

    Examples
    --------
    >>> weather = generate_weather(1, days=1)
    >>> weather.shape, str(weather.index[0])
    ((288, 7), '2023-10-02 00:05:00-08:00')
    """
    n_time = round(days * _DAY / step_seconds) if step_seconds > 0.0 else 0
    if seed < 0 or n_time < 2 or step_seconds > 3600.0:
        found = f"seed {seed}, {days} days in steps of {step_seconds} s"
        raise ThermalError("weather", "a seed of 0 or more and at least two steps of up to 3600 s", found)
    step = pd.Timedelta(seconds=step_seconds)
    index = pd.date_range(pd.Timestamp(start, tz=location.timezone) + step, periods=n_time, freq=step, name="timestamp")
    middle = index - step / 2
    rng = np.random.default_rng(seed)
    cloud = _cloud(rng, n_time, step_seconds)
    air = _air_temperature(rng, middle, step_seconds, cloud)
    points = {
        "outside_air_temperature_sensor": air,
        **_wind(rng, middle, step_seconds),
        **_sun(middle, location, cloud),
        "horizontal_infrared_irradiance_sensor": _sky_radiation(air, cloud, step_seconds),
    }
    reported = {f"{station}/{point}": np.round(values, _DECIMALS) for point, values in points.items()}
    return pd.DataFrame(reported, index=index)


def _process(rng: np.random.Generator, n_time: int, step: float, time_constant: float) -> FloatArray:
    """Stationary second-order autoregressive process of unit variance: smooth from step to step."""
    keep = np.exp(-step / time_constant)
    start = int(np.ceil(8.0 * time_constant / step))
    noise = rng.standard_normal(start + n_time)
    twice = lfilter([1.0], [1.0, -2.0 * keep, keep**2], noise)
    # Variance of an AR(2) with the double root `keep`.
    variance = (1.0 + keep**2) / (1.0 - keep**2) ** 3
    return np.asarray(twice[start:] / np.sqrt(variance), dtype=float)


def _cloud(rng: np.random.Generator, n_time: int, step: float) -> FloatArray:
    """Share of the sky that is covered [-]."""
    systems = _process(rng, n_time, step, _CLOUD_TIME) + _CLOUDIER
    patches = _PATCHES * _process(rng, n_time, step, _PATCH_TIME)
    return np.asarray(1.0 / (1.0 + np.exp(-1.8 * (systems + patches))), dtype=float)


def _air_temperature(rng: np.random.Generator, middle: pd.DatetimeIndex, step: float, cloud: FloatArray) -> FloatArray:
    """Temperature of the outdoor air [K]: season, day, fronts."""
    day, hour = _clock(middle)
    season = _YEAR_MEAN - _YEAR_SWING * np.cos(2.0 * np.pi * (day - _COLDEST_DAY) / 365.25)
    turn = 2.0 * np.pi * (hour - _WARMEST_HOUR) / 24.0
    # The second harmonic makes the morning's rise faster than the evening's fall.
    daily = _DAY_SWING * (np.cos(turn) + 0.2 * np.cos(2.0 * turn + 0.9))
    damping = 1.0 - 0.5 * _smooth(cloud, step)
    fronts = _FRONT_DEVIATION * _process(rng, len(middle), step, _FRONT_TIME)
    return np.asarray(season + daily * damping + fronts, dtype=float)


def _smooth(cloud: FloatArray, step: float, time_constant: float = 3.0 * 3600.0) -> FloatArray:
    """Low-pass a series: the air answers to clouds with a delay."""
    keep = np.exp(-step / time_constant)
    return np.asarray(lfilter([1.0 - keep], [1.0, -keep], cloud, zi=[keep * cloud[0]])[0], dtype=float)


def _wind(rng: np.random.Generator, middle: pd.DatetimeIndex, step: float) -> dict[str, FloatArray]:
    """Wind speed [m/s] and direction [deg from north]."""
    _, hour = _clock(middle)
    breeze = 1.0 + _BREEZE * np.cos(2.0 * np.pi * (hour - _WARMEST_HOUR - 1.0) / 24.0)
    speed = _WIND_MEAN * breeze * np.exp(0.5 * _process(rng, len(middle), step, _WIND_TIME) - 0.125)
    direction = _WIND_FROM + _WIND_VEER * _process(rng, len(middle), step, _WIND_TIME)
    return {"wind_speed_sensor": speed, "wind_direction_sensor": np.mod(direction, 360.0)}


def _sun(middle: pd.DatetimeIndex, location: Location, cloud: FloatArray) -> dict[str, FloatArray]:
    """Direct normal, diffuse horizontal and global horizontal irradiance [W/m2] in the middle of each interval."""
    import pvlib  # here: it takes a second to import

    place = (location.latitude, location.longitude, location.elevation)
    position = pvlib.solarposition.get_solarposition(middle, *place)
    pressure = pvlib.atmosphere.alt2pres(location.elevation)
    extra = pvlib.irradiance.get_extra_radiation(middle.day_of_year.to_numpy())
    elevation = position["apparent_elevation"]
    clear = pvlib.clearsky.simplified_solis(elevation, _TURBIDITY, _VAPOUR, pressure=pressure, dni_extra=extra)
    up = elevation.to_numpy() > 0.0
    height = np.where(up, np.sin(np.radians(elevation.to_numpy())), 0.0)
    direct_clear, diffuse_clear = (np.where(up, clear[name].to_numpy(), 0.0) for name in ("dni", "dhi"))
    overall = (direct_clear * height + diffuse_clear) * (1.0 - 0.75 * cloud**3.4)
    direct = direct_clear * (1.0 - cloud)
    return {
        "direct_normal_irradiance_sensor": direct,
        "diffuse_horizontal_irradiance_sensor": overall - direct * height,
        "global_horizontal_irradiance_sensor": overall,
    }


def _sky_radiation(air: FloatArray, cloud: FloatArray, step: float) -> FloatArray:
    """Longwave radiation of the sky on the horizontal [W/m2].

    ``ε = (0.787 + 0.764 ln(T_dew / 273)) (1 + 0.0224 n - 0.0035 n² + 0.00028 n³)``, n in tenths (Clark and Allen 1978;
    Walton 1983). The dew point follows the air of the last day, lower below a clear sky, and is never above the air.
    """
    depression = 2.0 + 6.0 * (1.0 - _smooth(cloud, step, _DAY))
    dew_point = np.minimum(_smooth(air, step, _DAY) - depression, air)
    tenths = 10.0 * cloud
    covered = 1.0 + 0.0224 * tenths - 0.0035 * tenths**2 + 0.00028 * tenths**3
    emissivity = (0.787 + 0.764 * np.log(dew_point / 273.0)) * covered
    return np.asarray(np.minimum(emissivity, 1.0) * _STEFAN_BOLTZMANN * air**4, dtype=float)


def _clock(times: pd.DatetimeIndex) -> tuple[FloatArray, FloatArray]:
    """Day of the year and local hour, both with fractions."""
    hour = times.hour + times.minute / 60.0 + times.second / 3600.0
    return np.asarray(times.day_of_year + hour / 24.0, dtype=float), np.asarray(hour, dtype=float)
