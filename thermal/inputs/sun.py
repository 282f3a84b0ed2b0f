"""Sun's place and irradiance on tilted planes, by pvlib, at the middle of each step."""

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
import pandas as pd

from thermal._types import FloatArray
from thermal.case.building import Location
from thermal.errors import EffectError

#: Reflectance of the ground [-]: grass and worn concrete (ASHRAE Fundamentals 2017, ch. 14, table 5).
GROUND_REFLECTANCE = 0.2

#: Solar heat gain through double glazing of clear panes by angle of incidence [deg], and of diffuse light, relative to
#: normal incidence [-] (ASHRAE Fundamentals 2017, ch. 15, table 10, glazing 5a: 0.76 at normal incidence).
_ANGLES = (0.0, 40.0, 50.0, 60.0, 70.0, 80.0, 90.0)
_BY_ANGLE = (1.0, 0.74 / 0.76, 0.71 / 0.76, 0.64 / 0.76, 0.50 / 0.76, 0.26 / 0.76, 0.0)
GLASS_DIFFUSE = 0.86

#: Below this altitude the sun counts as set: beams divided by its sine are noise [deg].
_LOWEST = 3.0

#: Sun that reaches the ground, of that outside of the atmosphere, per root of the daily range of outdoor temperature
#: [K^-1/2]: 0.16 inland, 0.19 by the sea (Hargreaves; Allen et al. 1998, FAO Irrigation and Drainage Paper 56, eq. 50);
#: and its least and most, of a dark and of a clear day [-] (the same, eqs. 35 and 37).
_BY_RANGE, _DARK, _CLEAR = 0.175, 0.25, 0.75

_NORMAL = "direct_normal_irradiance_sensor"
_DIFFUSE = "diffuse_horizontal_irradiance_sensor"
_GLOBAL = "global_horizontal_irradiance_sensor"

#: A day, and what is no longer than a forecast: its days are kept, as it comes again a step later [ns].
_DAY = 86_400 * 10**9
_FORECAST = 2 * _DAY


def incidence_modifier(cosine: FloatArray) -> FloatArray:
    """Solar heat gain of double glazing at an angle of incidence relative to that at normal incidence [-].

    Parameters
    ----------
    cosine : ndarray
        Cosine of the angle of incidence [-]; 0 or less is behind the pane.
    """
    return np.interp(np.degrees(np.arccos(np.clip(cosine, 0.0, 1.0))), _ANGLES, _BY_ANGLE)


@dataclass(frozen=True)
class Sun:
    """Sun's place and irradiances, one value a step.

    Parameters
    ----------
    azimuth, altitude : ndarray, shape (n_time,)
        Of the sun, at the middle of the step [deg].
    normal, diffuse, horizontal : ndarray, shape (n_time,)
        Beam on a plane that faces the sun, diffuse and total on the horizontal [W/m2].
    above : ndarray, shape (n_time,)
        Beam outside of the atmosphere on a plane that faces the sun [W/m2].
    """

    azimuth: FloatArray
    altitude: FloatArray
    normal: FloatArray
    diffuse: FloatArray
    horizontal: FloatArray
    above: FloatArray

    @cached_property
    def airmass(self) -> FloatArray:
        """Way of the beam through the air over that from the zenith, shape (n_time,) [-]; NaN while the sun is set."""
        from pvlib.atmosphere import get_relative_airmass

        return np.asarray(get_relative_airmass(90.0 - self.altitude), dtype=float)

    def cosine(self, azimuth: float, tilt: float) -> FloatArray:
        """Cosine of the angle of incidence on a plane, negative behind it [-].

        Parameters
        ----------
        azimuth, tilt : float
            Of the plane's normal [deg]: clockwise from north, and from the vertical.
        """
        from pvlib.irradiance import aoi_projection  # here: pvlib takes a second to import

        return np.asarray(aoi_projection(tilt, azimuth, 90.0 - self.altitude, self.azimuth), dtype=float)

    def plane(self, azimuth: float, tilt: float) -> tuple[FloatArray, FloatArray]:
        """Beam and diffuse irradiance on a plane: sky that is brighter about the sun and at the horizon, and ground.

        The sky is that of Perez et al. (1990), doi:10.1016/0038-092X(90)90055-H, as in EnergyPlus: on a clear day a
        facade in the sun gets twice the diffuse light of an isotropic sky. Where the sun counts as set it is isotropic
        (Liu and Jordan 1963): light there is of a clock that is wrong, and would be thousands of W/m2 about the sun.

        Parameters
        ----------
        azimuth, tilt : float
            Of the plane's normal [deg].
        """
        from pvlib.irradiance import perez

        beam = self.normal * np.maximum(self.cosine(azimuth, tilt), 0.0)
        told = self.diffuse, self.normal, self.above, 90.0 - self.altitude, self.azimuth, self.airmass
        bright = np.nan_to_num(np.asarray(perez(tilt, azimuth, *told), dtype=float))  # without light it is 0 / 0
        up = np.cos(np.radians(tilt))
        sky = np.where(self.altitude > _LOWEST, bright, self.diffuse * (1.0 + up) / 2.0)
        ground = GROUND_REFLECTANCE * self.horizontal * (1.0 - up) / 2.0
        return beam, np.asarray(sky + ground)

    def through_glass(self, azimuth: float, tilt: float) -> FloatArray:
        """Irradiance that glass lets through relative to normal incidence, ``IAM I_b + 0.86 I_d`` [W/m2].

        Parameters
        ----------
        azimuth, tilt : float
            Of the pane's normal [deg].
        """
        beam, diffuse = self.plane(azimuth, tilt)
        return np.asarray(incidence_modifier(self.cosine(azimuth, tilt)) * beam + GLASS_DIFFUSE * diffuse)


def _irradiances(weather: pd.DataFrame) -> set[str]:
    """Irradiances of the sun that are measured."""
    return {n for n in (_NORMAL, _DIFFUSE, _GLOBAL) if n in weather.columns and weather[n].notna().any()}


def suffices(weather: pd.DataFrame) -> bool:
    """Whether beam and diffuse irradiance are measured or follow from what is.

    Parameters
    ----------
    weather : DataFrame
        Points of the weather station [W/m2].
    """
    seen = _irradiances(weather)
    return _GLOBAL in seen or {_NORMAL, _DIFFUSE} <= seen


def sun_of(location: Location, stamps: pd.DatetimeIndex, step: float, weather: pd.DataFrame) -> Sun:
    """Sun at the middle of each step, with irradiances as measured or derived from those that are.

    Beam, diffuse and global irradiance belong together as ``G = N sin h + D``: any two give the third, and the global
    one alone is split by Erbs, Klein and Duffie (1982), doi:10.1016/0038-092X(82)90302-4.

    Parameters
    ----------
    location : Location
        Of the building.
    stamps : DatetimeIndex
        Ends of the steps.
    step : float
        Their length [s].
    weather : DataFrame
        Points of the weather station [W/m2].

    Raises
    ------
    EffectError
        When what is measured does not tell beam and diffuse apart.
    """
    middle = stamps - pd.Timedelta(seconds=step / 2.0)
    azimuth, altitude = _place(location, middle)
    rise = np.sin(np.radians(altitude))
    known = _irradiances(weather)
    seen = {name: np.maximum(weather[name].fillna(0.0).to_numpy(dtype=float), 0.0) for name in known}
    up = altitude > _LOWEST
    normal, diffuse, total = seen.get(_NORMAL), seen.get(_DIFFUSE), seen.get(_GLOBAL)
    if normal is not None and diffuse is not None:
        total = normal * np.maximum(rise, 0.0) + diffuse if total is None else total
    elif total is None:
        raise EffectError("weather station", f"{_GLOBAL}, or {_NORMAL} and {_DIFFUSE}", f"{sorted(seen) or 'none'}")
    elif normal is not None:
        diffuse = np.maximum(total - normal * np.maximum(rise, 0.0), 0.0)
    elif diffuse is not None:
        normal = np.where(up, np.maximum(total - diffuse, 0.0) / np.maximum(rise, np.sin(np.radians(_LOWEST))), 0.0)
    else:
        normal, diffuse = _split(total, altitude, middle)
    return Sun(azimuth, altitude, np.asarray(normal), np.asarray(diffuse), np.asarray(total), _above(middle))


def estimated_sun(location: Location, stamps: pd.DatetimeIndex, step: float, outdoor: FloatArray) -> Sun:
    """Sun at the middle of each step where no irradiance is measured: days whose temperature swings far are clear.

    ``G = G_0 sin h k √(T_max - T_min)`` with the extremes of each local day (Hargreaves; Allen et al. 1998, FAO
    Irrigation and Drainage Paper 56, eq. 50): how bright a day is, not how clouds pass.

    Parameters
    ----------
    location : Location
        Of the building.
    stamps : DatetimeIndex
        Ends of the steps, in the building's time zone.
    step : float
        Their length [s].
    outdoor : ndarray, shape (n_time,)
        Outdoor temperature [K].
    """
    middle = stamps - pd.Timedelta(seconds=step / 2.0)
    azimuth, altitude = _place(location, middle)
    days = pd.Series(outdoor).groupby(np.asarray(middle.normalize().asi8))
    length, range_ = days.count(), days.max() - days.min()
    usual = float(range_[length == length.max()].median())  # of a day that is cut off the range is unknown
    spread = range_.where(length == length.max(), usual)[np.asarray(middle.normalize().asi8)].to_numpy(dtype=float)
    above = _above(middle)
    clear = np.clip(_BY_RANGE * np.sqrt(spread), _DARK, _CLEAR)
    total = np.where(altitude > 0.0, clear * above * np.sin(np.radians(altitude)), 0.0)
    return Sun(azimuth, altitude, *_split(total, altitude, middle), total, above)


def _above(middle: pd.DatetimeIndex) -> FloatArray:
    """Beam outside of the atmosphere [W/m2]."""
    from pvlib import irradiance

    return np.asarray(irradiance.get_extra_radiation(middle.day_of_year), dtype=float)


def _place(location: Location, middle: pd.DatetimeIndex) -> tuple[FloatArray, FloatArray]:
    """Azimuth and altitude of the sun [deg]."""
    stamps = middle.as_unit("ns").asi8
    steps = np.unique(np.diff(stamps))
    if len(steps) != 1 or steps[0] <= 0 or _DAY % steps[0] or stamps[-1] - stamps[0] > _FORECAST:
        return _positions(location, middle)
    step, first, last = int(steps[0]), int(stamps[0]), int(stamps[-1])
    days = [_of_day(location, day, first % step, step) for day in range(first // _DAY, last // _DAY + 1)]
    begin = (first - first // _DAY * _DAY) // step
    azimuth, altitude = np.hstack(days)[:, begin : begin + len(stamps)]
    return azimuth, altitude


@lru_cache(maxsize=1024)
def _of_day(location: Location, day: int, offset: int, step: int) -> FloatArray:
    """Azimuth and altitude along a day of UTC, at an offset and then every step [ns], shape (2, n) [deg]."""
    stamps = pd.to_datetime(np.arange(day * _DAY + offset, (day + 1) * _DAY, step), utc=True)
    found = np.stack(_positions(location, stamps))
    found.flags.writeable = False
    return found


def _positions(location: Location, stamps: pd.DatetimeIndex) -> tuple[FloatArray, FloatArray]:
    """Azimuth and altitude of the sun, without what is kept [deg]."""
    from pvlib import solarposition

    place = solarposition.get_solarposition(stamps, location.latitude, location.longitude, location.elevation)
    return place["azimuth"].to_numpy(dtype=float), place["elevation"].to_numpy(dtype=float)


def _split(total: FloatArray, altitude: FloatArray, middle: pd.DatetimeIndex) -> tuple[FloatArray, FloatArray]:
    """Split the global irradiance into beam and diffuse, by Erbs, Klein and Duffie (1982) [W/m2]."""
    from pvlib import irradiance

    split = irradiance.erbs(total, 90.0 - altitude, np.asarray(middle.day_of_year))
    normal, diffuse = (np.nan_to_num(np.asarray(split[k], dtype=float)) for k in ("dni", "dhi"))
    return normal, diffuse
