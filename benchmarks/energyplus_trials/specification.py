"""What a trial is: the building, its weather and use, and the effects that it holds. All of it is drawn from a seed."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from typing import Literal

import numpy as np
from _worlds import Effect

Kind = Literal["null", "single", "pair", "outside", "without"]
KINDS: tuple[Kind, ...] = ("null", "single", "pair", "outside")
DEVELOPMENT, CONFIRMATION = 0, 1  # first number of every seed: what one stream draws the other never does


@dataclass(frozen=True)
class Zone:
    """A rectangle of the floor plan, the same on every floor.

    Parameters
    ----------
    name : str
        Name without the floor.
    west, east, south, north : int
        Lines of cells that bound it: exterior or interior wall, counted from the plan's south-west corner.
    """

    name: str
    west: int
    east: int
    south: int
    north: int


@dataclass(frozen=True)
class Layout:
    """Geometry.

    Parameters
    ----------
    zones : tuple of Zone
        Of one floor; all floors are alike.
    floors : int
        Number of floors.
    height : float
        Clear height [m].
    orientation : float
        Clockwise from true north to the plan's up [degree].
    glazing : dict
        Glazed share of each facade [-], 0 where it has no window.
    pane_height : float
        [m]
    """

    zones: tuple[Zone, ...]
    floors: int
    height: float
    orientation: float
    glazing: Mapping[str, float]
    pane_height: float


@dataclass(frozen=True)
class Fabric:
    """Constructions.

    Parameters
    ----------
    wall : str
        Kind of exterior wall: `mass_inside`, `light` or `mass_outside`.
    wall_u_value : float
        [W/m2/K]
    structure : float
        Thickness of the exterior wall's structure [m].
    partition : str
        `brick` or `gypsum`.
    slab : float
        Thickness of concrete that a zone has below and above [m].
    furniture_area : float
        Furniture, per floor area [-].
    furniture_thickness : float
        [m] of wood; both faces see the zone.
    window_u_value : float
        [W/m2/K], air to air.
    exterior_film : float
        Convection outside [W/m2/K].
    interior_convection : str
        EnergyPlus's algorithm: `TARP` depends on the temperature difference, `Simple` on the direction of heat only.
    uneven : bool
        Whether films are as in other makers' offices and real ones, outside by DOE-2 with the wind and inside by TARP,
        and furniture differs from zone to zone by a factor of e^0.5.
    """

    wall: str
    wall_u_value: float
    structure: float
    partition: str
    slab: float
    furniture_area: float
    furniture_thickness: float
    window_u_value: float
    exterior_film: float
    interior_convection: str
    uneven: bool = False


@dataclass(frozen=True)
class Climate:
    """Weather.

    Parameters
    ----------
    source : str
        A weather file that comes with EnergyPlus, or `generated`.
    seed : int
        Of what the source leaves open.
    latitude, longitude, elevation : float
        [degree], [m]
    utc_offset : int
        Standard time [h].
    start : str
        First day of the telemetry, ISO 8601.
    warmer : float
        Added to the source's air temperature [K].
    swing : float
        Factor on the departures from its mean [-].
    """

    source: str
    seed: int
    latitude: float
    longitude: float
    elevation: float
    utc_offset: int
    start: str
    warmer: float
    swing: float


@dataclass(frozen=True)
class Use:
    """Thermostats, terminals and sensors.

    Parameters
    ----------
    excitation : str
        `schedule`, `prbs` or `float` (terminals are off for many hours at a time).
    seed : int
        Of set points.
    flow : float
        Largest supply air flow per floor area [m3/s/m2].
    temperature_noise, temperature_resolution, discharge_noise, outdoor_noise : float
        [K]
    flow_noise : float
        [-], share of the flow.
    idle_discharge : str
        What discharge sensors read while no air flows: the `room`'s air, or the `duct`'s.
    """

    excitation: str
    seed: int
    flow: float
    temperature_noise: float
    temperature_resolution: float
    discharge_noise: float
    outdoor_noise: float
    flow_noise: float
    idle_discharge: str


@dataclass(frozen=True)
class TrialSpec:
    """A trial, whole.

    Parameters
    ----------
    stream : int
        `DEVELOPMENT` or `CONFIRMATION`.
    seed : int
        Number of the trial in its stream. Building, weather, use and noise depend on stream and seed only.
    kind : str
        Which effects were drawn.
    days : int
        Length of the telemetry.
    layout, fabric, climate, use
        The building.
    effects : tuple of Effect
        What it holds beside walls, windows, slabs, furniture and heat; empty for a null.
    """

    stream: int
    seed: int
    kind: Kind
    days: int
    layout: Layout
    fabric: Fabric
    climate: Climate
    use: Use
    effects: tuple[Effect, ...]

    @property
    def name(self) -> str:
        """Name of the case folder, which says nothing about the effects."""
        text = f"{self.stream}:{self.seed}:{self.kind}:{self.days}"
        if self.fabric.uneven:
            text += ":uneven"
        if self.kind == "without":  # a trial of several effects has as many of them
            text += f":{','.join(e.name for e in self.effects)}"
        return "trial_" + hashlib.sha256(text.encode()).hexdigest()[:10]

    @property
    def zone_names(self) -> tuple[str, ...]:
        """Every zone of the building, floor by floor."""
        return tuple(f"F{floor + 1}_{z.name}" for floor in range(self.layout.floors) for z in self.layout.zones)

    def twin(self) -> TrialSpec:
        """Return the same trial without its effects: the null of the same seed."""
        return replace(self, kind="null", effects=())

    def has(self, name: str) -> bool:
        """Tell whether an effect of this name is on."""
        return any(effect.name == name for effect in self.effects)

    def to_json(self) -> str:
        """Write the trial down, truth included."""
        return json.dumps(asdict(self) | {"name": self.name}, indent=1) + "\n"


def stream_generator(stream: int, seed: int, *purpose: int) -> np.random.Generator:
    """Return the random numbers of one purpose of one trial.

    Parameters
    ----------
    stream : int
        `DEVELOPMENT` or `CONFIRMATION`.
    seed : int
        Number of the trial, at least 0.
    *purpose : int
        What they are for, so that no purpose disturbs another.
    """
    return np.random.default_rng(np.random.SeedSequence([stream, seed], spawn_key=purpose))
