"""The pilot building whole: plans, devices and place."""

from __future__ import annotations

from thermal.case.building import Building
from thermal.pilot.layout import devices, generate_office
from thermal.pilot.weather import MOUNTAIN_VIEW


def pilot_building(
    seed: int = 0, *, floor_area: float = 6317.0, zones: int = 123, floors: int = 2, name: str = "pilot"
) -> Building:
    """Draw the pilot building: by default 6,317 m2, 123 zones and the paper's 127 devices.

    Parameters
    ----------
    seed : int
        Same seed, same building; 0 or more.
    floor_area : float
        Of all floors together [m2].
    zones, floors : int
        On all floors together; number of storeys.
    name : str
        Of the case.

    Returns
    -------
    Building
        With a terminal a zone, an air handler a floor, a boiler and a chiller.

    Examples
    --------
    >>> small = pilot_building(1, floor_area=600.0, zones=12)
    >>> len(small.zone_names), len(small.devices)
    (12, 16)
    """
    plans = generate_office(seed, floor_area=floor_area, zones=zones, floors=floors)
    return Building(name, MOUNTAIN_VIEW, 0.0, plans, devices(plans))
