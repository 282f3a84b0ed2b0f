"""What a building is: the entries of its file, and the site, geometry and devices that the library sees."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

Text = Annotated[str, Field(strict=True, min_length=1)]
Number = Annotated[float, Field(strict=True, allow_inf_nan=False)]
Positive = Annotated[float, Field(strict=True, allow_inf_nan=False, gt=0)]
#: Side of a cell of plans [m]: larger than most rooms at most.
CellSize = Annotated[float, Field(strict=True, allow_inf_nan=False, gt=0, le=100)]
Azimuth = Annotated[float, Field(strict=True, allow_inf_nan=False, ge=-360, le=360)]
Share = Annotated[float, Field(strict=True, allow_inf_nan=False, gt=0, le=1)]
GeometryQuality = Literal["surveyed", "approximate", "generic"]
FACADES = ("north", "east", "south", "west")
DEVICE_TYPES = ("vav", "fan_coil", "electric_heater", "radiator", "supply_air_terminal", "ahu", "boiler", "chiller")

#: What a device gives its heat by.
Emitting = Literal["air", "radiator", "baseboard", "floor", "ceiling"]


class Entry(BaseModel):
    """Base of the models: what is not named is refused, and nothing changes afterwards."""

    model_config = ConfigDict(frozen=True, extra="forbid")


class Location(Entry):
    """Where the building stands.

    Parameters
    ----------
    latitude, longitude
        North and east positive [deg].
    elevation
        Height above the sea [m].
    timezone
        IANA name.
    """

    latitude: Annotated[Number, Field(ge=-90, le=90)]
    longitude: Annotated[Number, Field(ge=-180, le=180)]
    elevation: Annotated[Number, Field(ge=-500, le=9000)]
    timezone: Text


class Device(Entry):
    """A device that serves one zone, or none.

    Parameters
    ----------
    name
        Unique in the building.
    type
        One of `DEVICE_TYPES`; others are reported.
    zone
        The zone it serves; None for an air handler, a boiler.
    fed_by
        Devices that it gets air, water or steam from, such as the air handler and the boiler of a VAV terminal.
    emitter
        What it gives its heat by; None where that is not known.
    """

    name: Text
    type: Text
    zone: Text | None = None
    fed_by: tuple[Text, ...] = ()
    emitter: Emitting | None = None


class Airflow(Entry):
    """Air of a device that goes on from one zone to another.

    Parameters
    ----------
    source
        Zone it leaves (``from`` in the file).
    target
        Zone it enters (``to`` in the file).
    device
        Device whose supply air it is.
    fraction
        Share of that device's flow, above 0, up to 1 [-].
    """

    model_config = ConfigDict(frozen=True, extra="forbid", populate_by_name=True)

    source: Text = Field(alias="from")
    target: Text = Field(alias="to")
    device: Text
    fraction: Share


class Layer(Entry):
    """One layer of a construction.

    Parameters
    ----------
    thickness
        [m].
    conductivity
        [W/m/K].
    density
        [kg/m3].
    heat_capacity
        [J/kg/K].
    """

    thickness: Positive
    conductivity: Positive
    density: Positive
    heat_capacity: Positive


class Surface(Entry):
    """A surface of a zone table.

    Parameters
    ----------
    name
        Unique in the building.
    kind
        ``wall``, ``floor``, ``ceiling``, ``window``, ``bridge`` or ``opening``.
    zone
        The zone it bounds.
    other
        What is behind it: a zone, ``outdoor``, ``ground``, the zone itself, or a measured boundary.
    area
        [m2].
    azimuth
        Clockwise from north, where the outer face looks to [deg].
    construction
        Name of its layers, from `zone` to `other`.
    u_value
        Air to air [W/m2/K].
    solar_transmittance
        Share of the sun that a window lets through, 0 to 1 [-].
    """

    name: Text
    kind: Literal["wall", "floor", "ceiling", "window", "bridge", "opening"]
    zone: Text
    other: Text
    area: Positive
    azimuth: Azimuth | None = None
    construction: Text | None = None
    u_value: Positive | None = None
    solar_transmittance: Annotated[float, Field(strict=True, allow_inf_nan=False, ge=0, le=1)] | None = None


class ZoneEntry(Entry):
    """A zone of a zone table.

    Parameters
    ----------
    name
        Unique in the building.
    volume
        [m3].
    floor_area
        [m2].
    """

    name: Text
    volume: Positive
    floor_area: Positive


class FloorEntry(Entry):
    """A floor of a building with plans.

    Parameters
    ----------
    name
        Unique in the building.
    height
        Clear height of the storey [m].
    plan
        File name inside the case folder.
    """

    name: Text
    height: Positive
    plan: Text


class BuildingFile(Entry):
    """All of `building.yaml`.

    Parameters
    ----------
    format
        Number of the case format; 1 and 2 are migrated when read (`thermal.case.load`).
    name
        Of the case.
    location
        Where the building stands.
    orientation
        Clockwise from true north to the plan's "up" [deg]; 0 unless given.
    geometry_quality
        How the geometry was come by: ``surveyed``, ``approximate`` or ``generic``.
    telemetry
        File name inside the case folder.
    units
        Unit of each measured point type.
    devices
        Devices of the building.
    airflows
        Where supply air goes on to.
    weather_station
        Entity whose points are the site's weather.
    cell_size
        Side of a plan cell [m].
    floors
        Floors with plans, lowest first.
    glazing
        Glazed area [m2] by zone and facade.
    zones, surfaces, constructions
        The zone table.
    """

    format: Literal[3]
    name: Text
    location: Location
    orientation: Azimuth = 0.0
    geometry_quality: GeometryQuality = "approximate"
    telemetry: Text
    units: dict[Text, Annotated[str, Field(strict=True)]]
    devices: tuple[Device, ...] = ()
    airflows: tuple[Airflow, ...] = ()
    weather_station: Text = "weather_station"
    cell_size: CellSize | None = None
    floors: tuple[FloorEntry, ...] | None = None
    glazing: dict[Text, dict[Text, Annotated[float, Field(strict=True, allow_inf_nan=False, ge=0)]]] | None = None
    zones: tuple[ZoneEntry, ...] | None = None
    surfaces: tuple[Surface, ...] | None = None
    constructions: dict[Text, tuple[Layer, ...]] | None = None


#: Tokens of a plan that are no zone.
PLAN_TOKENS = OUTSIDE, EXTERIOR_WALL, INTERIOR_WALL = ".", "#", "+"
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
        return tuple(token for token in seen if token not in PLAN_TOKENS)


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


@dataclass(frozen=True)
class Commanded:
    """A device whose heat no meter tells, so that it is fitted: a signal times a parameter of the device's own.

    Parameters
    ----------
    device, zone
        Which, and where its heat goes.
    kind
        ``damper``: air in proportion to its opening; ``valve``: heat in proportion to its opening; ``counter``: a share
        of what a feeder is metered to give.
    columns
        Telemetry that the signal is made of, `thermal.case.commands.command_signals`.
    """

    device: str
    zone: str
    kind: Literal["damper", "valve", "counter"]
    columns: tuple[str, ...]


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
    geometry_quality
        How the geometry was come by: ``surveyed`` (measured on site or taken from a checked drawing), ``approximate``,
        or ``generic`` (that of a typical building).
    commanded
        Devices whose heat no meter tells, as the telemetry of a case has it.
    """

    name: str
    location: Location
    orientation: float
    geometry: FloorPlans | ZoneTable
    devices: tuple[Device, ...] = ()
    airflows: tuple[Airflow, ...] = ()
    weather_station: str = "weather_station"
    geometry_quality: GeometryQuality = "approximate"
    commanded: tuple[Commanded, ...] = ()

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
