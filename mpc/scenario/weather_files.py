"""Weather from files of the trade (EPW, TMY3), from CSV, and from a case's telemetry."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from mpc.errors import WeatherError
from mpc.scenario.weather import DIRECTION, SKY, SUN_POINTS, WEATHER_POINTS, Weather
from thermal._types import FloatArray
from thermal.case.building import Location
from thermal.case.case import Case
from thermal.case.points import OUTDOOR_TEMPERATURE, POINT_TYPES
from thermal.errors import CaseError, nearest
from thermal.inputs.provider import IRRADIANCE, telemetry_inputs
from thermal.units import QUANTITIES, to_si

_STEFAN_BOLTZMANN = 5.670374419e-8  # W/m2/K4, CODATA 2018
_YEAR = 2023  # of a typical year's stamps: any year that is not a leap year

# pvlib's column, the point, offset to the library's unit, and the value from which on EPW means "missing" (EnergyPlus,
# Auxiliary Programs, EPW data dictionary). TMY3 leaves no field empty.
_COLUMNS = (
    ("temp_air", OUTDOOR_TEMPERATURE, 273.15, 99.9),
    ("wind_speed", "wind_speed_sensor", 0.0, 999.0),
    ("wind_direction", DIRECTION, 0.0, 999.0),
    ("dni", SUN_POINTS[0], 0.0, 9999.0),
    ("dhi", SUN_POINTS[1], 0.0, 9999.0),
    ("ghi", SUN_POINTS[2], 0.0, 9999.0),
    ("ghi_infrared", SKY, 0.0, 9999.0),
)


def read_epw(path: str | Path) -> Weather:
    """Read a typical year in EnergyPlus' format.

    Stamps of the file end their hour: temperature and wind are readings at the stamp, irradiances are means over the
    hour before. (pvlib labels the start of the hour; that is put right here.)

    Parameters
    ----------
    path : str or Path
        An ``.epw`` file.

    Returns
    -------
    Weather
        A typical year in the file's standard time.

    Raises
    ------
    WeatherError
        When the file cannot be read.
    """
    from pvlib.iotools import read_epw as read

    return _typical(read, path, lambda data: data.shift(freq="h"))


def read_tmy3(path: str | Path) -> Weather:
    """Read a typical year in NREL's format TMY3 (Wilcox and Marion 2008, NREL/TP-581-43156).

    Stamps end their hour, as in `read_epw`. The format has no longwave from the sky, which follows from dew point and
    opaque cloud (Clark and Allen 1978; Walton 1983), as in EnergyPlus.

    Parameters
    ----------
    path : str or Path
        A ``.csv`` file of the format.

    Returns
    -------
    Weather
        A typical year in the file's standard time.

    Raises
    ------
    WeatherError
        When the file cannot be read.
    """
    from pvlib.iotools import read_tmy3 as read

    def with_sky(data: pd.DataFrame) -> pd.DataFrame:
        air, dew, cloud = (data[name].to_numpy(dtype=float) for name in ("temp_air", "temp_dew", "OpqCld (tenths)"))
        return data.assign(ghi_infrared=sky_radiation(air + 273.15, dew + 273.15, cloud))

    return _typical(read, path, with_sky)


def sky_radiation(air: FloatArray, dew_point: FloatArray, cloud: FloatArray) -> FloatArray:
    """Longwave radiation of the sky on the horizontal [W/m2].

    ``σ T⁴ (0.787 + 0.764 ln(T_dew / 273)) (1 + 0.0224 n - 0.0035 n² + 0.00028 n³)``.

    Parameters
    ----------
    air, dew_point : ndarray, shape (n_time,)
        Temperatures [K].
    cloud : ndarray, shape (n_time,)
        Opaque cover in tenths, 0 to 10 [-].
    """
    covered = 1.0 + 0.0224 * cloud - 0.0035 * cloud**2 + 0.00028 * cloud**3
    return np.asarray((0.787 + 0.764 * np.log(dew_point / 273.0)) * covered * _STEFAN_BOLTZMANN * air**4)


def _typical(read: Any, path: str | Path, complete: Callable[[pd.DataFrame], pd.DataFrame]) -> Weather:
    WeatherError.unless(Path(path).is_file(), str(path), "a weather file", "none")
    try:
        raw, meta = read(str(path), coerce_year=_YEAR)
        data = complete(raw)
    except Exception as error:  # pvlib lets whatever its parser stumbles on through
        found = " ".join(str(error).split()) or type(error).__name__
        raise WeatherError(str(path), f"a file that pvlib's {read.__name__} reads", found) from error
    hours = float(meta["TZ"])
    place = {"latitude": meta["latitude"], "longitude": meta["longitude"], "elevation": meta["altitude"]}
    # Etc/GMT+8 is 8 hours behind UTC; zones off the full hour have no such name and keep UTC's.
    zone = f"Etc/GMT{-int(hours):+d}" if hours.is_integer() and hours else "UTC"
    location = Location(**{k: float(v) for k, v in place.items()}, timezone=zone)
    known = {point: data[name].astype(float) for name, point, _, _ in _COLUMNS}
    columns = {point: known[point].where(known[point] < missing) + offset for _, point, offset, missing in _COLUMNS}
    try:
        return Weather(pd.DataFrame(columns).rename_axis("timestamp"), location, readings=True, typical=True)
    except WeatherError as error:
        raise WeatherError(f"{path}: {error}") from error


def read_weather_csv(
    path: str | Path,
    location: Location,
    units: Mapping[str, str] | None = None,
    columns: Mapping[str, str] | None = None,
    *,
    stamp: str = "timestamp",
    readings: bool = False,
) -> Weather:
    """Read weather from a CSV file with named columns.

    Parameters
    ----------
    path : str or Path
        File; other columns than those named are left alone.
    location : Location
        Where the weather is; stamps without offset are in its time zone.
    units : mapping of str to str
        Unit of each point, any that pint knows; default the case format's (degC, m/s, deg, W/m^2).
    columns : mapping of str to str
        Point of each column of the file; default: columns are named as the points are.
    stamp : str
        Column of the stamps, which end the steps.
    readings : bool
        Whether temperature and wind are readings at the stamps rather than means over the steps.

    Returns
    -------
    Weather
        In the library's units.

    Raises
    ------
    WeatherError
        When the file, a column, a stamp or a unit is not as it should be.
    """
    WeatherError.unless(Path(path).is_file(), str(path), "a CSV file", "none")
    raw = pd.read_csv(path)
    named = dict(columns) if columns is not None else {point: point for point in WEATHER_POINTS if point in raw}
    for name in (stamp, *named):
        WeatherError.unless(name in raw, f"{path}: columns", repr(name), str(list(raw)), nearest(name, raw))
    for point in (*named.values(), *(units or {})):
        WeatherError.unless_known(point, WEATHER_POINTS, f"{path}: column", "a weather point")
    WeatherError.unless(named, f"{path}: columns", f"one of {', '.join(WEATHER_POINTS)}", str(list(raw)))
    frame = pd.DataFrame(index=_stamps(raw[stamp], location, path))
    for name, point in named.items():
        quantity = POINT_TYPES[point].quantity
        unit = (units or {}).get(point, QUANTITIES[quantity].file_unit)
        try:
            frame[point] = to_si(raw[name].astype(float), unit, quantity, where=f"{path}: column {name!r}")
        except (TypeError, ValueError, CaseError) as error:
            raise WeatherError(f"{path}: column {name!r}: {error}") from error
    return Weather(frame, location, readings)


def _stamps(column: pd.Series, location: Location, path: str | Path) -> pd.DatetimeIndex:
    try:
        with_offset = column.astype(str).str.contains(r"(?:Z|[+-]\d\d:?\d\d)$").all()
        times = pd.DatetimeIndex(pd.to_datetime(column, utc=bool(with_offset)))
        local = times.tz_convert(location.timezone) if with_offset else times.tz_localize(location.timezone)
    except Exception as error:  # pandas and zoneinfo raise a dozen kinds for times that do not exist
        advice = "write stamps with their offset"
        raise WeatherError(f"{path}: stamps", "ISO 8601", " ".join(str(error).split()), advice) from error
    return pd.DatetimeIndex(local.as_unit("us"), name="timestamp")


def weather_of_case(case: Case, longest_gap: float = 3600.0) -> Weather:
    """Take the weather that a case's telemetry holds; irradiance is estimated where none is measured.

    Parameters
    ----------
    case : Case
        With a weather station, or air handlers that report the outdoor temperature.
    longest_gap : float
        Gaps of up to this length are bridged by straight lines [s]; longer ones stay missing.

    Returns
    -------
    Weather
        Means over the telemetry's steps.

    Raises
    ------
    WeatherError
        When nothing reports the outdoor temperature.
    """
    frame = case.weather()
    frame = frame[[point for point in WEATHER_POINTS if point in frame]].copy()
    frame[OUTDOOR_TEMPERATURE] = case.boundary_temperatures()["outdoor"]
    if frame[OUTDOOR_TEMPERATURE].isna().all():
        raise WeatherError("telemetry", f"a column of {OUTDOOR_TEMPERATURE}", "none")
    steps = int(longest_gap // case.step)
    filled = frame.interpolate(limit_area="inside")
    for point in frame:
        empty = frame[point].isna()
        length = empty.groupby((~empty).cumsum()).transform("sum")
        frame[point] = filled[point].where(~empty | (length <= steps))
    inputs = telemetry_inputs(case)
    # models have the sun that way, and a forecast is too short to estimate it from
    if estimated := inputs.estimates(IRRADIANCE):
        frame[SUN_POINTS[0]], frame[SUN_POINTS[1]] = inputs.sun.normal, inputs.sun.diffuse
    return Weather(frame, case.building.location, estimated=estimated)
