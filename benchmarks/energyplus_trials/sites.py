"""Places that trials stand in: the weather files that come with EnergyPlus, and towns of generated weather."""

from __future__ import annotations

from dataclasses import dataclass

GENERATED = "generated"


@dataclass(frozen=True)
class Site:
    """A place.

    Parameters
    ----------
    source : str
        Weather file, or `GENERATED`.
    latitude, longitude, elevation : float
        [degree], [m]
    utc_offset : int
        Standard time [h].
    mean, swing : float
        Of the source's monthly air temperatures: mean, and half of the range [degC], [K].
    """

    source: str
    latitude: float
    longitude: float
    elevation: float
    utc_offset: int
    mean: float
    swing: float


WEATHER_FILES = (
    Site("USA_AZ_Phoenix-Sky.Harbor.Intl.AP.722780_TMY3.epw", 33.45, -111.98, 337.0, -7, 23.8, 11.9),
    Site("USA_CA_Fresno.Air.Terminal.723890_TMY3.epw", 36.78, -119.72, 102.0, -8, 17.9, 10.5),
    Site("USA_CA_San.Francisco.Intl.AP.724940_TMY3.epw", 37.62, -122.4, 2.0, -8, 13.8, 3.6),
    Site("USA_CO_Boulder-Broomfield-Jefferson.County.AP.724699_TMY3.epw", 40.13, -105.24, 1689.0, -7, 10.2, 12.3),
    Site("USA_CO_Colorado.Springs-Peterson.Field.724660_TMY3.epw", 38.82, -104.72, 1872.0, -7, 9.6, 12.1),
    Site("USA_CO_Denver-Aurora-Buckley.AFB.724695_TMY3.epw", 39.72, -104.75, 1726.0, -7, 10.0, 11.9),
    Site("USA_CO_Golden-NREL.724666_TMY3.epw", 39.74, -105.18, 1829.0, -7, 9.7, 11.4),
    Site("USA_FL_Miami.Intl.AP.722020_TMY3.epw", 25.82, -80.3, 11.0, -5, 24.5, 4.4),
    Site("USA_FL_Orlando.Intl.AP.722050_TMY3.epw", 28.43, -81.33, 29.0, -5, 21.9, 6.2),
    Site("USA_FL_Tampa.Intl.AP.722110_TMY3.epw", 27.97, -82.53, 6.0, -5, 22.3, 6.5),
    Site("USA_IL_Chicago-OHare.Intl.AP.725300_TMY3.epw", 41.98, -87.92, 201.0, -6, 9.9, 14.4),
    Site("USA_IL_University.of.Illinois-Willard.AP.725315_TMY3.epw", 40.06, -88.37, 213.0, -6, 11.0, 14.9),
    Site("USA_NJ_Newark.Intl.AP.725020_TMY3.epw", 40.72, -74.18, 3.0, -5, 12.4, 13.9),
    Site("USA_NV_Las.Vegas-McCarran.Intl.AP.723860_TMY3.epw", 36.08, -115.15, 648.0, -8, 19.8, 12.7),
    Site("USA_OK_Oklahoma.City-Will.Rogers.World.AP.723530_TMY3.epw", 35.38, -97.6, 398.0, -6, 15.7, 13.5),
    Site("USA_VA_Sterling-Washington.Dulles.Intl.AP.724030_TMY3.epw", 38.98, -77.47, 82.0, -5, 12.6, 12.0),
)
# Air temperatures of the library's own generator of weather, which makes the sun of any place.
TOWNS = (
    Site(GENERATED, 59.3, 18.1, 30.0, 1, 15.0, 5.5),
    Site(GENERATED, 51.5, -0.1, 20.0, 0, 15.0, 5.5),
    Site(GENERATED, 45.5, 9.2, 120.0, 1, 15.0, 5.5),
    Site(GENERATED, 40.4, -3.7, 650.0, 1, 15.0, 5.5),
)


def site_of(source: str, latitude: float) -> Site:
    """Return a place by its source and latitude.

    Parameters
    ----------
    source : str
        Weather file, or `GENERATED`.
    latitude : float
        [degree]
    """
    return next(s for s in (*WEATHER_FILES, *TOWNS) if (s.source, s.latitude) == (source, latitude))
