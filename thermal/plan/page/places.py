"""Places by name or coordinates, without a network: the cities of the time zone database, and pvlib's map of heights.

The database (IANA, in the package ``tzdata``, ``zone.tab``) has some 420 cities, one for each time zone of each
country. A place between them is found by its coordinates, as maps show them. Its time zone is then proposed as that of
the nearest city, which is wrong near borders; its height is that of the ground, of pvlib's map.
"""

import math
import re
from dataclasses import asdict, dataclass
from functools import cache
from importlib.resources import files
from typing import Any

from thermal.errors import LabelError

_MOST = 8  # places that are offered at once
_COORDINATES = re.compile(r"^\s*([+-]?\d+(?:\.\d+)?)\s*°?\s*([NnSs]?)[\s,;]+([+-]?\d+(?:\.\d+)?)\s*°?\s*([EeWw]?)\s*$")
_TABLE = re.compile(r"^([+-])(\d{2})(\d{2})(\d{2})?([+-])(\d{3})(\d{2})(\d{2})?$")


@dataclass(frozen=True)
class Place:
    """A place.

    Parameters
    ----------
    name : str
        City and country, or the coordinates.
    latitude, longitude : float
        North and east positive [deg].
    timezone : str
        IANA name.
    """

    name: str
    latitude: float
    longitude: float
    timezone: str


@cache
def _cities() -> tuple[Place, ...]:
    folder = files("tzdata.zoneinfo")
    rows = [line.split("\t") for line in _lines(folder.joinpath("iso3166.tab").read_text("utf-8"))]
    countries = {row[0]: row[1] for row in rows}
    found = []
    for line in _lines(folder.joinpath("zone.tab").read_text("utf-8")):
        code, coordinates, zone = line.split("\t")[:3]
        name = zone.rpartition("/")[2].replace("_", " ")
        found.append(Place(f"{name}, {countries.get(code, code)}", *_degrees(coordinates), zone))
    return tuple(found)


def _lines(text: str) -> list[str]:
    return [line for line in text.splitlines() if line and not line.startswith("#")]


def _degrees(text: str) -> tuple[float, float]:
    """Latitude and longitude of ISO 6709, such as ``+5230+01322`` [deg]."""
    match = _TABLE.match(text)
    if match is None:
        raise ValueError(f"zone.tab: expected coordinates of ISO 6709, got {text!r}")
    parts = (match.groups()[:4], match.groups()[4:])
    north, east = (
        (-1.0 if sign == "-" else 1.0) * (int(d) + int(m) / 60.0 + int(s or 0) / 3600.0) for sign, d, m, s in parts
    )
    return round(north, 3), round(east, 3)


def find_places(text: str) -> list[dict[str, Any]]:
    """Find places by a name, or by coordinates.

    Parameters
    ----------
    text : str
        Part of the name of a city or country; or latitude and longitude [deg], such as ``48.14, 11.58``.

    Returns
    -------
    list of dict
        Name, latitude, longitude [deg], elevation [m] and time zone of up to eight places; none where no city has that
        name.

    Raises
    ------
    LabelError
        There is nothing to look for, or the coordinates are on no globe.

    Examples
    --------
    >>> find_places("berlin")[0]["timezone"]
    'Europe/Berlin'
    """
    wanted = " ".join(text.split()).casefold()
    LabelError.unless(wanted, "place", "the name of a city, or latitude and longitude", "nothing")
    match = _COORDINATES.match(text)
    if match is not None:
        north, east = (
            float(number) * (-1.0 if side.lower() in ("s", "w") else 1.0)
            for number, side in (match.groups()[:2], match.groups()[2:])
        )
        whole = abs(north) <= 90.0 and abs(east) <= 180.0
        LabelError.unless(whole, "place", "a latitude within ±90° and a longitude within ±180°", f"{north:g}, {east:g}")
        near = min(_cities(), key=lambda city: _apart(city, north, east))
        return [_told(Place(f"{north:g}, {east:g} (time zone of {near.name})", north, east, near.timezone))]
    ranked = sorted(_cities(), key=lambda city: not city.name.casefold().startswith(wanted))
    return [_told(city) for city in ranked if wanted in city.name.casefold()][:_MOST]


def _apart(city: Place, north: float, east: float) -> float:
    """Angle between a city and a point: haversine [rad]."""
    a, b = math.radians(city.latitude), math.radians(north)
    across = math.radians(city.longitude - east)
    half = math.sin((a - b) / 2.0) ** 2 + math.cos(a) * math.cos(b) * math.sin(across / 2.0) ** 2
    return 2.0 * math.asin(math.sqrt(min(1.0, half)))


def _told(place: Place) -> dict[str, Any]:
    from pvlib.location import lookup_altitude

    return asdict(place) | {"elevation": round(float(lookup_altitude(place.latitude, place.longitude)))}
