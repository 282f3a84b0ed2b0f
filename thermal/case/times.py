"""Times as a user writes them: ISO 8601, local to the building unless they carry an offset."""

from __future__ import annotations

from datetime import datetime
from zoneinfo import ZoneInfo

import pandas as pd

from thermal.case.building import Building
from thermal.errors import CaseError, describe


def local_timestamp(time: str | datetime, building: Building) -> pd.Timestamp:
    """Read a time.

    Parameters
    ----------
    time
        ISO 8601 text, or a datetime; without an offset it is local to the building.
    building
        Building whose time zone counts.

    Returns
    -------
    Timestamp
        In the building's time zone.

    Raises
    ------
    CaseError
        It is not ISO 8601, or a local time that the clock skips or shows twice.

    Examples
    --------
    >>> from thermal.case.building import Building, ZoneTable
    >>> from thermal.case.schema import Location, ZoneEntry
    >>> site = Location(latitude=48, longitude=12, elevation=690, timezone="Europe/Berlin")
    >>> house = Building("house", site, 0.0, ZoneTable((ZoneEntry(name="room", volume=50, floor_area=20),)))
    >>> local_timestamp("2023-07-06T07:10", house).isoformat()
    '2023-07-06T07:10:00+02:00'
    """
    zone = building.location.timezone
    try:
        parsed = datetime.fromisoformat(time.strip()) if isinstance(time, str) else time
        stamp = pd.Timestamp(parsed)
        if pd.isna(stamp):
            raise ValueError("no time")
    except (TypeError, ValueError, OverflowError) as error:
        raise CaseError(describe("time", "ISO 8601, such as 2023-07-06T07:10", repr(time))) from error
    if stamp.tzinfo is not None:
        return stamp.tz_convert(zone)
    return _localised(stamp, zone)


def _localised(stamp: pd.Timestamp, zone: str) -> pd.Timestamp:
    naive = stamp.to_pydatetime()
    first, second = (naive.replace(tzinfo=ZoneInfo(zone), fold=fold).utcoffset() for fold in (0, 1))
    if first != second:
        advice = "give the time with its offset, such as +02:00"
        expected = f"a time that the clocks of {zone} show once"
        raise CaseError(describe("time", expected, stamp.isoformat(), advice))
    return stamp.tz_localize(zone)
