"""What a building's volumes and faces are part of: what the effects of the catalogue attach to."""

from __future__ import annotations

from collections.abc import Mapping
from copy import copy
from dataclasses import dataclass, field, fields, replace

import casadi as ca
import numpy as np

from thermal._types import FloatArray, IntArray
from thermal.case.building import FACADES, FloorPlan, FloorPlans
from thermal.inputs.provider import InputProvider
from thermal.inputs.signals import Signal, of_zone

#: Tilt of a vertical, an upward and a downward face [deg].
VERTICAL, UPWARD, DOWNWARD = 90.0, 0.0, 180.0

#: Share of a facade's wall that is taken for glass where a plan knows of no glazing at all [-]: with a solar heat gain
#: coefficient up to 0.8, gains of up to 0.4 of the facade.
UNKNOWN_GLAZING = 0.5

#: Azimuth of a plan's sides before the building is turned [deg].
_SIDES = {"north": 0.0, "east": 90.0, "south": 180.0, "west": 270.0}


def direction_of(azimuth: float) -> str:
    """Point of the compass that is nearest to an azimuth; half way between two the next one clockwise.

    Parameters
    ----------
    azimuth : float
        Clockwise from true north [deg].

    Examples
    --------
    >>> direction_of(44.9), direction_of(-45.0), direction_of(135.0)
    ('north', 'north', 'south')
    """
    return FACADES[int((azimuth + 45.0) % 360.0 // 90.0) % 4]


@dataclass(frozen=True)
class Outlook:
    """How a face looks outside.

    Parameters
    ----------
    azimuth : float
        Clockwise from true north [deg]; of no meaning where the face is horizontal.
    tilt : float
        Between its normal and the vertical [deg]: 90 for a wall, 0 for a roof, 180 for a floor over the open.
    film : casadi.SX or float
        Outside film [W/m2/K].
    glass : bool
        Whether it is a window.
    """

    azimuth: float
    tilt: float
    film: ca.SX | float
    glass: bool


@dataclass(frozen=True)
class OuterFaces:
    """Faces of one class towards the outdoor air: what sun, sky and wind act on.

    Parameters
    ----------
    value : casadi.SX
        Conductance κ from node to outdoor air [W/m2/K].
    node : ndarray of int, shape (n,)
        Nodes.
    area : ndarray, shape (n,)
        Areas [m2].
    outlook : Outlook
        Where they look.
    zone : str or None
        Zone of a window; None for walls, whose volumes belong to none.
    """

    value: ca.SX
    node: IntArray
    area: FloatArray
    outlook: Outlook
    zone: str | None = None


@dataclass(frozen=True)
class Pane:
    """A window that the sun may enter by.

    Parameters
    ----------
    zone : str
        Where to.
    azimuth, tilt : float
        As in `Outlook` [deg].
    area : float
        Of glass [m2].
    transmittance : float or None
        Solar transmittance where it is known [-].
    """

    zone: str
    azimuth: float
    tilt: float
    area: float
    transmittance: float | None = None


@dataclass(frozen=True)
class Emission:
    """Heat of devices of a zone that does not all go to its air.

    Parameters
    ----------
    devices : tuple of int
        Their positions in the building's devices.
    signal, rate : Signal
        Their heat [W], and its change [W/h].
    share_of_zone : float
        Their part of the zone's heat where that alone is known [-].
    parts : tuple of (casadi.SX, ndarray of int, ndarray)
        Share of it, nodes, and their weights in it [-]: what surfaces and layers get, and the air the less; sums to 0.
    """

    devices: tuple[int, ...]
    signal: Signal
    rate: Signal
    share_of_zone: float
    parts: tuple[tuple[ca.SX, IntArray, FloatArray], ...]


@dataclass(frozen=True)
class Heated:
    """A layer of a floor or a ceiling that emitters warm.

    Parameters
    ----------
    node : ndarray of int, shape (n,)
        Nodes about the pipes.
    share : ndarray, shape (n,)
        Their shares of the heat, which sum to 1 [-].
    area : float
        Area [m2].
    """

    node: IntArray
    share: FloatArray
    area: float


#: Power of the temperature difference by which natural convection at a wall takes heat, turbulent [-].
NATURAL = 4.0 / 3.0


@dataclass(frozen=True)
class NaturalConvection:
    """Heat of a zone that its surfaces take from the air at once, as natural convection grows with the heat.

    Parameters
    ----------
    zone : str
        Whose.
    own : float
        Heat of the zone for which the film coefficient is [W].
    """

    zone: str
    own: float

    @property
    def signal(self) -> Signal:
        """Its course [W]."""
        given = {"zone": self.zone, "own": self.own}
        return Signal.made(f"natural convection of {self.zone}", "W", _passed_on, "heat", given=given)

    def passed_on(self, heat: FloatArray) -> FloatArray:
        """Give what surfaces take beyond what a film of one coefficient lets pass [W].

        Parameters
        ----------
        heat : ndarray
            Of the zone's devices [W].

        Examples
        --------
        >>> NaturalConvection("A", 1000.0).passed_on(np.array([0.0, 500.0, 1000.0, 2000.0])).round(1).tolist()
        [0.0, -94.6, 0.0, 318.2]
        """
        return np.asarray(heat - np.sign(heat) * self.own ** (1.0 - 1.0 / NATURAL) * np.abs(heat) ** (1.0 / NATURAL))


def _passed_on(inputs: InputProvider, zone: str, own: float) -> FloatArray:
    return NaturalConvection(zone, own).passed_on(of_zone(inputs, "heat", zone))


@dataclass(frozen=True)
class Room:
    """A zone with what is in it.

    Parameters
    ----------
    name : str
        Of the zone.
    number : int
        Its number.
    air : ndarray of int, shape (n_air,)
        Its air volumes.
    share : ndarray, shape (n_air,)
        Share of its air in each [-].
    mean : int
        Node at the mean of its air: the star of the shuffle, or the one volume; -1 without.
    radiant : int
        Its radiant node; -1 without.
    floor, ceiling : tuple of int
        Nodes of its slabs, from the surface to the back; empty without.
    furniture : int
        Node of the furniture; -1 without.
    floor_area, volume : float
        [m2] and [m3].
    emitted : tuple of Emission
        Heat of its devices that does not all go to the air.
    convection : NaturalConvection, optional
        Where its inside films follow its heat.
    """

    name: str
    number: int
    air: IntArray
    share: FloatArray
    mean: int
    radiant: int
    floor: tuple[int, ...]
    ceiling: tuple[int, ...]
    furniture: int
    floor_area: float
    volume: float
    emitted: tuple[Emission, ...] = ()
    convection: NaturalConvection | None = None


@dataclass(frozen=True)
class GroundFace:
    """A face towards the ground of a zone table: adiabatic in the baseline.

    Parameters
    ----------
    zone : str
        Zone above.
    node : int
        Last node of the floor.
    area : float
        Area [m2].
    value : casadi.SX
        Conductance from that node to the face [W/m2/K].
    """

    zone: str
    node: int
    area: float
    value: ca.SX


@dataclass
class Anatomy:
    """All of them, collected while a network is built.

    Parameters
    ----------
    outer : list of OuterFaces
        Towards outdoor air.
    panes : list of Pane
        Windows to outdoor air.
    windows_told : bool
        Whether the case tells its windows; some are assumed on every side of a plan without.
    rooms : dict of str to Room
        By zone.
    served : frozenset of str
        Zones that a device heats, cools or ventilates; all of them where no device says which it serves.
    partitions : dict
        Area between two zones of one floor, by their names in order [m2].
    stacked : dict
        Area between two zones of which the first lies under the second [m2].
    under_roof, on_ground : dict of str to float
        Area of a zone with nothing above, or of one on the lowest floor [m2].
    ground_faces : list of GroundFace
        Of a zone table.
    heated : dict
        Layers that emitters warm, by zone and side (``floor`` or ``ceiling``).
    facades : dict
        Area of exterior wall, windows included, by zone and azimuth [m2].
    air_heat_capacity : float
        Volumetric heat capacity of the air [J/m3/K].
    airflows : tuple of (int, int)
        Directed airflows (number of the source zone, of the target zone), in the order of the building's.
    """

    outer: list[OuterFaces] = field(default_factory=list)
    panes: list[Pane] = field(default_factory=list)
    windows_told: bool = True
    rooms: dict[str, Room] = field(default_factory=dict)
    served: frozenset[str] = frozenset()
    partitions: dict[tuple[str, str], float] = field(default_factory=dict)
    stacked: dict[tuple[str, str], float] = field(default_factory=dict)
    under_roof: dict[str, float] = field(default_factory=dict)
    on_ground: dict[str, float] = field(default_factory=dict)
    ground_faces: list[GroundFace] = field(default_factory=list)
    heated: dict[tuple[str, str], list[Heated]] = field(default_factory=dict)
    facades: dict[tuple[str, float], float] = field(default_factory=dict)
    air_heat_capacity: float = 0.0
    airflows: tuple[tuple[int, int], ...] = ()

    def copy(self) -> Anatomy:
        """Another with the same parts, to which more can be added."""
        return replace(self, **{f.name: copy(getattr(self, f.name)) for f in fields(self)})


def azimuth_of(side: str, orientation: float) -> float:
    """Azimuth of a plan's side [deg].

    Parameters
    ----------
    side : str
        ``north`` is the plan's first row.
    orientation : float
        Clockwise from true north to the plan's "up" [deg].
    """
    return (_SIDES[side] + orientation) % 360.0


def partition_areas(plan: FloorPlan, cell_size: float) -> dict[tuple[str, str], float]:
    """Area of the partitions between zones of a floor, by their names in order [m2].

    Parameters
    ----------
    plan : FloorPlan
        The floor.
    cell_size : float
        Side of a cell [m].
    """
    tokens, zones = np.asarray(plan.tokens), set(plan.zone_names)
    found: dict[tuple[str, str], float] = {}
    for lines in (tokens, tokens.T):
        before, wall, after = lines[:, :-2], lines[:, 1:-1], lines[:, 2:]
        for a, b in zip(before[wall == "+"], after[wall == "+"], strict=True):
            if a != b and {str(a), str(b)} <= zones:
                pair = (min(str(a), str(b)), max(str(a), str(b)))
                found[pair] = found.get(pair, 0.0) + cell_size * plan.height
    return found


def stacked_areas(
    plans: FloorPlans, areas: Mapping[str, float]
) -> tuple[dict[tuple[str, str], float], dict[str, float], dict[str, float]]:
    """Areas between zones of floors that lie on each other, under the roof, and on the ground.

    What juts out over the floor below is not on the ground.

    Parameters
    ----------
    plans : FloorPlans
        Floors, the lowest first, with the same origin.
    areas : mapping of str to float
        Floor area of each zone [m2]; a zone's parts sum to it.

    Returns
    -------
    tuple
        Areas [m2] by (lower, upper) zone, and by zone under the roof and on the ground.
    """
    stacked: dict[tuple[str, str], float] = {}
    roof: dict[str, float] = {}
    ground: dict[str, float] = {}
    shape = tuple(max(f.tokens.shape[axis] for f in plans.floors) for axis in (0, 1))
    grids = [
        np.pad(f.tokens, [(0, n - m) for n, m in zip(shape, f.tokens.shape, strict=True)], constant_values=".")
        for f in plans.floors
    ]
    for level, floor in enumerate(plans.floors):
        for zone in floor.zone_names:
            mine = grids[level] == zone
            per_cell = areas[zone] / np.count_nonzero(mine)
            above = grids[level + 1][mine] if level + 1 < len(grids) else np.full(mine.sum(), ".")
            names, counts = np.unique(above, return_counts=True)
            number = dict(zip(names.tolist(), counts.tolist(), strict=True))
            walls = sum(number.pop(token, 0) for token in ("#", "+"))
            total = sum(number.values())  # none under nothing but walls
            for name, n in number.items():
                area = per_cell * n * (1.0 + walls / total)
                if name == ".":
                    roof[zone] = area
                else:
                    stacked[zone, name] = area
            if level == 0:
                ground[zone] = areas[zone]
    return stacked, roof, ground
