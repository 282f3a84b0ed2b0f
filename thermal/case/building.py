"""What a building is: site, geometry, devices, as the rest of the library sees them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from thermal.case.schema import Airflow, Device, Layer, Location, Surface, ZoneEntry

OUTSIDE, EXTERIOR_WALL, INTERIOR_WALL = ".", "#", "+"
OUTDOOR, GROUND = "outdoor", "ground"


@dataclass(frozen=True, eq=False)
class FloorPlan:
    """The plan of one floor.

    Parameters
    ----------
    name
        Of the floor.
    height
        Clear height [m].
    tokens
        Shape (n_row, n_col), text; ``.`` outside, ``#`` exterior wall, ``+`` interior wall, else the zone's name. The
        first row is the plan's "up".
    """

    name: str
    height: float
    tokens: NDArray[np.str_]

    @cached_property
    def zone_names(self) -> tuple[str, ...]:
        """Zones of the floor, in the order of their first cell, row by row."""
        seen = dict.fromkeys(str(token) for token in self.tokens.ravel())
        return tuple(token for token in seen if token not in {OUTSIDE, EXTERIOR_WALL, INTERIOR_WALL})


@dataclass(frozen=True, eq=False)
class FloorPlans:
    """A building drawn as plans of square cells.

    Parameters
    ----------
    cell_size
        Side of a cell [m].
    floors
        Lowest first, all with the same origin.
    glazing
        Glazed area [m2] by zone and by facade of the plan (``north`` is the first row, before rotation).
    """

    cell_size: float
    floors: tuple[FloorPlan, ...]
    glazing: Mapping[str, Mapping[str, float]] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class ZoneTable:
    """A building given as a table of zones and surfaces.

    Parameters
    ----------
    zones
        One control volume each.
    surfaces
        What bounds them.
    constructions
        Layers by name, from a surface's `zone` to its `other`.
    """

    zones: tuple[ZoneEntry, ...]
    surfaces: tuple[Surface, ...] = ()
    constructions: Mapping[str, tuple[Layer, ...]] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Building:
    """A building: what stands where, and what serves it.

    Parameters
    ----------
    name
        Of the case.
    location
        Where it stands.
    orientation
        Clockwise from true north to the plan's "up" [deg].
    geometry
        Floor plans or a zone table.
    devices
        Devices, in the order of the file.
    airflows
        Where supply air goes on to.
    weather_station
        Entity whose points are the site's weather.
    """

    name: str
    location: Location
    orientation: float
    geometry: FloorPlans | ZoneTable
    devices: tuple[Device, ...] = ()
    airflows: tuple[Airflow, ...] = ()
    weather_station: str = "weather_station"

    @property
    def zone_names(self) -> tuple[str, ...]:
        """Zones: floor by floor in the order of their first cell, or in the order of the zone table."""
        if isinstance(self.geometry, ZoneTable):
            return tuple(zone.name for zone in self.geometry.zones)
        return tuple(name for floor in self.geometry.floors for name in floor.zone_names)

    @property
    def measured_boundaries(self) -> tuple[str, ...]:
        """Spaces that are not simulated but measured, in the order in which surfaces name them."""
        if not isinstance(self.geometry, ZoneTable):
            return ()
        known = {*self.zone_names, OUTDOOR, GROUND}
        return tuple(dict.fromkeys(s.other for s in self.geometry.surfaces if s.other not in known))

    def devices_of(self, zone: str) -> tuple[Device, ...]:
        """Devices that serve a zone.

        Parameters
        ----------
        zone
            Name of the zone.

        Returns
        -------
        tuple of Device
            In the order of the file; empty when there are none.
        """
        return tuple(device for device in self.devices if device.zone == zone)
