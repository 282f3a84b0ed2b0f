"""What a trial is: the house, its fabric, heating, people, sensors and weather, and the effects that it holds."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace

from _worlds import Effect
from energyplus_trials.specification import Climate, Kind

#: Sides of the plan and the azimuth of their outer face before rotation [deg].
SIDES: Mapping[str, float] = {"north": 0.0, "east": 90.0, "south": 180.0, "west": 270.0}


@dataclass(frozen=True)
class Room:
    """A rectangle of one floor's plan.

    Parameters
    ----------
    name : str
        Name, which no other room of the house has.
    floor : int
        Floor, 0 for the lowest.
    west, east, south, north : float
        Middle planes of its walls, from the plan's south-west corner [m].
    """

    name: str
    floor: int
    west: float
    east: float
    south: float
    north: float

    @property
    def area(self) -> float:
        """Floor area [m2]."""
        return (self.east - self.west) * (self.north - self.south)


@dataclass(frozen=True)
class House:
    """Geometry.

    Parameters
    ----------
    rooms : tuple of Room
        Of all floors, which share one outline.
    floors : int
        Number of floors.
    height : float
        Clear height of each [m].
    orientation : float
        Clockwise from true north to the plan's up [deg].
    glazing : dict
        Glazed share of the rooms' walls by side [-]; 0 where a side has no window.
    top, bottom : str
        What lies above the top rooms, `outdoor` or `attic`, and below the lowest, `ground` or `cellar`. Attic and
        cellar are measured.
    doorway : tuple of str
        Two rooms between which there is no door; empty where there is none.
    """

    rooms: tuple[Room, ...]
    floors: int
    height: float
    orientation: float
    glazing: Mapping[str, float]
    top: str
    bottom: str
    doorway: tuple[str, ...]


@dataclass(frozen=True)
class Fabric:
    """Constructions.

    Parameters
    ----------
    wall : str
        Kind of exterior wall: `brick`, `cavity`, `block` or `timber`.
    partition, slab : str
        `brick` or `stud`; `concrete` or `joists` between floors.
    insulation, roof_insulation, floor_insulation : float
        Thickness [m].
    window_u_value : float
        Air to air [W/m2/K].
    furniture : float
        Furniture of 3 cm of wood, both faces of which see the room, per floor area [-].
    exterior_film : float
        Convection outside [W/m2/K].
    doorway_speed : float
        Air exchanged through a doorway without door, over its area [m/s].
    """

    wall: str
    partition: str
    slab: str
    insulation: float
    roof_insulation: float
    floor_insulation: float
    window_u_value: float
    furniture: float
    exterior_film: float
    doorway_speed: float


@dataclass(frozen=True)
class Heating:
    """Heaters, thermostats and the meter.

    Parameters
    ----------
    emitter : str
        `electric`, `radiator` or `floor`: heated floors in the lowest rooms, radiators in the others.
    radiant : float
        Share of the heat of electric heaters and radiators that surfaces get [-].
    lag : float
        Time constant of electric heaters and radiators [s].
    control : str
        `on_off` or `proportional`. Heated floors are on or off.
    band : float
        Hysteresis, or proportional band [K].
    oversize : float
        Power of the heaters over the heat that the rooms lose on a cold day [-].
    unheated : tuple of str
        Rooms without heater.
    meter : str
        `room`, or `house`: one meter and one temperature, the rooms' mean.
    setback : float
        How much lower set points are at night, and by day when everybody is out [K].
    seed : int
        Of set points and their changes.
    """

    emitter: str
    radiant: float
    lag: float
    control: str
    band: float
    oversize: float
    unheated: tuple[str, ...]
    meter: str
    setback: float
    seed: int


@dataclass(frozen=True)
class Sensors:
    """What the telemetry makes of the house.

    Parameters
    ----------
    minutes : int
        Step of the telemetry [min].
    temperature_noise, outdoor_noise : float
        [K]
    power_noise : float
        Share of the power [-].
    power_resolution : float
        [W]
    counted : bool
        Whether the people in the house are counted.
    quality : str
        Of the case's geometry: `surveyed`, `approximate` or `generic`.
    seed : int
        Of the drawing's errors.
    """

    minutes: int
    temperature_noise: float
    outdoor_noise: float
    power_noise: float
    power_resolution: float
    counted: bool
    quality: str
    seed: int


@dataclass(frozen=True)
class HouseSpec:
    """A trial, whole.

    Parameters
    ----------
    stream, seed : int
        Stream and number of the trial in it. All but effects depends on the two only.
    kind : str
        Which effects were drawn.
    days : int
        Length of the telemetry.
    house, fabric, heating, sensors, climate
        The building and its weather.
    people : int
        Seed of those who live there.
    effects : tuple of Effect
        What the house holds beside walls, windows, slabs, furniture and metered heat.
    known : tuple of Effect
        Further effects, which the diagnosis is told of and which twins have too.
    """

    stream: int
    seed: int
    kind: Kind
    days: int
    house: House
    fabric: Fabric
    heating: Heating
    sensors: Sensors
    climate: Climate
    people: int
    effects: tuple[Effect, ...]
    known: tuple[Effect, ...] = ()

    @property
    def name(self) -> str:
        """Name of the case folder, which says nothing about the effects."""
        text = f"house:{self.stream}:{self.seed}:{self.kind}:{self.days}"
        if self.known:
            text += f":{','.join(e.name for e in self.known)} known"
        if self.kind == "without":  # a trial of several effects has as many of them
            text += f":{','.join(e.name for e in self.effects)}"
        return "trial_" + hashlib.sha256(text.encode()).hexdigest()[:10]

    @property
    def zone_names(self) -> tuple[str, ...]:
        """Every room."""
        return tuple(room.name for room in self.house.rooms)

    def room(self, name: str) -> Room:
        """Return a room.

        Parameters
        ----------
        name : str
            Its name.
        """
        return next(room for room in self.house.rooms if room.name == name)

    def twin(self) -> HouseSpec:
        """Return the same trial without its effects: the null of the same seed."""
        return replace(self, kind="null", effects=())

    def has(self, name: str) -> bool:
        """Tell whether an effect of this name is on.

        Parameters
        ----------
        name : str
            Of the effect.
        """
        return any(effect.name == name for effect in (*self.known, *self.effects))

    def to_json(self) -> str:
        """Write the trial down, truth included."""
        return json.dumps(asdict(self) | {"name": self.name}, indent=1) + "\n"
