"""Structure of a network, material constants, and conductances that are joined."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, get_args

from thermal.case.emitters import Unknown
from thermal.errors import ModelError

#: Molecular conductivity of air at 20 degC [W/m/K] (Incropera, Fundamentals of Heat and Mass Transfer, Table A.4).
AIR_CONDUCTIVITY = 0.026

#: Resistance of the structural layer of an exterior wall [m2K/W], which carries its mass inside the insulation: 0.2 m
#: of concrete or brick at 1.4 W/m/K (ISO 10456:2007 Table 3).
STRUCTURE_RESISTANCE = 0.15

#: Nominal areal mass of an exterior wall's structure and of a partition [kg/m2]; only mass times heat capacity is
#: determined.
EXTERIOR_WALL_MASS = 150.0
INTERIOR_WALL_MASS = 60.0

#: Inside surface resistance towards a space that is not simulated [m2K/W] (ISO 6946:2017 Table 7).
BOUNDARY_FILM_RESISTANCE = 0.13

#: Inside film that the rated u-value of a window contains [W/m2/K] (EN 673:2011, h_i).
WINDOW_RATED_FILM = 7.7

#: Combined outside film that rated u-values contain [W/m2/K] (EN 673:2011, h_e).
RATED_OUTSIDE_FILM = 25.0

#: Resistance of a single pane [m2K/W], 4 mm of glass at 1 W/m/K (EN 673:2011): the least that rated u-values may leave.
LEAST_PANE_RESISTANCE = 0.004

#: Effects of the whole building in which rooms may differ, with what a room's share is called.
MAY_DIFFER = {
    "infiltration": "infiltration_room_share", "internal_gains": "internal_gain_room_share",
    "solar_gain": "solar_room_share",
}  # fmt: skip

#: Step of the paper's shuffle [s].
SHUFFLE_STEP = 300.0


def series(*conductances: Any) -> Any:
    """Conductance of conductances in series, ``1 / Σ 1/g``.

    Parameters
    ----------
    *conductances : float or casadi.SX
        Conductances per area [W/m2/K], positive.

    Returns
    -------
    float or casadi.SX
        Conductance per area [W/m2/K].
    """
    return 1.0 / sum(1.0 / g for g in conductances)


def surface_mesh(film: Any, radiant: Any, solid: Any) -> tuple[Any, Any, Any]:
    """Eliminate the massless surface where film, radiation and solid meet (star-mesh transform).

    A surface at ``T_s`` exchanges ``h_c (T_air - T_s)`` with the air, ``h_r (T_rad - T_s)`` with the zone's radiant
    node and
    ``g (T_solid - T_s)`` with the solid behind it. Without its own mass the three become three direct conductances,
    exactly
    (Kirchhoff; e.g. Desoer & Kuh, Basic Circuit Theory, 1969, ch. 2):
    ``g_ij = g_i g_j / (h_c + h_r + g)``.

    Parameters
    ----------
    film, radiant, solid : float or casadi.SX
        ``h_c``, ``h_r`` and ``g`` [W/m2/K], positive.

    Returns
    -------
    tuple
        Conductances air-solid, radiant-solid, air-radiant per area [W/m2/K].
    """
    total = film + radiant + solid
    return film * solid / total, radiant * solid / total, film * radiant / total


#: Most nodes of a chain: through 0.2 m of concrete 100 of them resolve seconds, more than any telemetry.
MOST_NODES = 100


@dataclass(frozen=True)
class Structure:
    """What a model of the baseline is made of, beside its geometry; equations (24) to (28) of the model's page.

    Parameters
    ----------
    furniture : bool
        Interior mass of furniture, one node a zone.
    slab_nodes : int
        Nodes of a plan's floor and ceiling slabs, 0 to 100; 0 leaves them out. The floors and ceilings of a zone
        table are surfaces that it declares, so they stay, with `wall_nodes`.
    wall_nodes : int or None
        Mass nodes through an exterior wall of a plan, at least, and through each layered surface of a zone table,
        exactly; 1 to 100. None is one in a plan's cell, and as many in a zone table as resolve half an hour.
    radiant : bool
        A radiant node a zone, with convection and radiation apart; else one combined film between air and surface.
    lumped : bool
        Air and one mass a zone, with a multiplier for every conductance and capacity of the drawing.
    sun : bool
        Of a lumped model: an aperture for the sun a zone and direction.
    recurring : bool
        Of a lumped model: a gain a zone that recurs from day to day, as people and their devices bring it.
    wind_films : bool
        Outside films that follow the wind, of a model that is not lumped.
    natural_films : bool
        Inside films that follow the heat of their zone, as natural convection does, of a model with a radiant node that
        is not lumped.
    light_contents : bool
        A multiplier of the air's heat capacity, for what follows the air within minutes, of a model that is not lumped,
        which has one a zone.
    turned : float
        By how much the building stands clockwise of its drawing, -180 to 180 [deg], as its sun may tell.
    uneven : tuple of str
        Effects of which each room has a share of its own, of `MAY_DIFFER`, where they are of the whole building.
    emitter : {"air", "radiator", "floor"}
        What plain heaters of which a case does not say it give their heat by: the air alone, surfaces too, or floors
        too, each zone's by a share that is fitted.

    Raises
    ------
    ModelError
        When a field is of another type or outside its range.

    Examples
    --------
    >>> paper = Structure.paper()
    >>> paper.furniture, paper.slab_nodes, paper.wall_nodes, paper.radiant
    (False, 0, 1, False)
    """

    furniture: bool = True
    slab_nodes: int = 2
    wall_nodes: int | None = None
    radiant: bool = True
    lumped: bool = False
    sun: bool = False
    recurring: bool = False
    wind_films: bool = False
    natural_films: bool = False
    light_contents: bool = False
    turned: float = 0.0
    uneven: tuple[str, ...] = ()
    emitter: Unknown = "air"

    @property
    def is_counted(self) -> bool:
        """Whether its films follow something that is counted by a `Normalisation`."""
        return self.wind_films or self.natural_films

    def __post_init__(self) -> None:
        films = "wind_films", "natural_films"
        for name in ("furniture", "radiant", "lumped", "sun", "recurring", *films, "light_contents"):
            if not isinstance(getattr(self, name), bool):
                raise ModelError(f"structure.{name}: expected true or false, got {getattr(self, name)!r}")
        if isinstance(self.turned, bool) or not isinstance(self.turned, int | float) or not abs(self.turned) <= 180.0:
            raise ModelError(f"structure.turned: expected -180 to 180 deg, got {self.turned!r}")
        listed = isinstance(self.uneven, list | tuple)
        if not listed or not all(isinstance(effect, str) and effect in MAY_DIFFER for effect in self.uneven):
            raise ModelError(f"structure.uneven: expected some of {tuple(MAY_DIFFER)}, got {self.uneven!r}")
        object.__setattr__(self, "uneven", tuple(self.uneven))  # a file has a list
        if self.emitter not in get_args(Unknown):
            raise ModelError(f"structure.emitter: expected one of {get_args(Unknown)}, got {self.emitter!r}")
        for name, least in (("slab_nodes", 0), ("wall_nodes", 1)):
            value = getattr(self, name)
            if name == "wall_nodes" and value is None:
                continue
            if isinstance(value, bool) or not isinstance(value, int) or not least <= value <= MOST_NODES:
                expected = f"a whole number from {least} to {MOST_NODES}"
                raise ModelError(f"structure.{name}: expected {expected}, got {value!r}")

    @classmethod
    def paper(cls) -> Structure:
        """Structure of the paper: air and walls only, one node through a wall, one film between the two."""
        return cls(furniture=False, slab_nodes=0, wall_nodes=1, radiant=False)


#: Structure of the baseline, unless another is asked for.
BASELINE = Structure()
