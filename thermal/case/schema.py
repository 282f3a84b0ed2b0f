"""What `building.yaml` may hold: one model a mapping, as the case format has it."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

Text = Annotated[str, Field(strict=True, min_length=1)]
Number = Annotated[float, Field(strict=True, allow_inf_nan=False)]
Positive = Annotated[float, Field(strict=True, allow_inf_nan=False, gt=0)]
Azimuth = Annotated[float, Field(strict=True, allow_inf_nan=False, ge=-360, le=360)]
Share = Annotated[float, Field(strict=True, allow_inf_nan=False, gt=0, le=1)]
FACADES = ("north", "east", "south", "west")
DEVICE_TYPES = ("vav", "fan_coil", "electric_heater", "radiator", "supply_air_terminal", "ahu", "boiler", "chiller")


class _Entry(BaseModel):
    """Base of the models: what is not named is refused, and nothing changes afterwards."""

    model_config = ConfigDict(frozen=True, extra="forbid")


class Location(_Entry):
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


class Device(_Entry):
    """A device that serves one zone, or none.

    Parameters
    ----------
    name
        Unique in the building.
    type
        One of `DEVICE_TYPES`; others are reported.
    zone
        The zone it serves; None for an air handler, a boiler.
    """

    name: Text
    type: Text
    zone: Text | None = None


class Airflow(_Entry):
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


class Layer(_Entry):
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


class Surface(_Entry):
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


class ZoneEntry(_Entry):
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


class FloorEntry(_Entry):
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


class BuildingFile(_Entry):
    """All of `building.yaml`.

    Parameters
    ----------
    format
        Version of the case format; 2 has points of pressure beside those of 1, and nothing else is new.
    name
        Of the case.
    location
        Where the building stands.
    orientation
        Degrees clockwise from true north to the plan's "up"; 0 unless given.
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

    format: Literal[1, 2]
    name: Text
    location: Location
    orientation: Azimuth = 0.0
    telemetry: Text
    units: dict[Text, Annotated[str, Field(strict=True)]]
    devices: tuple[Device, ...] = ()
    airflows: tuple[Airflow, ...] = ()
    weather_station: Text = "weather_station"
    cell_size: Positive | None = None
    floors: tuple[FloorEntry, ...] | None = None
    glazing: dict[Text, dict[Text, Annotated[float, Field(strict=True, allow_inf_nan=False, ge=0)]]] | None = None
    zones: tuple[ZoneEntry, ...] | None = None
    surfaces: tuple[Surface, ...] | None = None
    constructions: dict[Text, tuple[Layer, ...]] | None = None
