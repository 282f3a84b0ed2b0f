"""Heat from and to what the baseline takes for adiabatic: other floors, ground, roof, the neighbour; more mass."""

from __future__ import annotations

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from thermal._types import FloatArray
from thermal.effects.effect import CONSTANT, Effect, Joining, paired, shape, strength, without_facades
from thermal.inputs.drivers import REFERENCE_TEMPERATURE, Drivers, Signal
from thermal.network.structure import RATED_OUTSIDE_FILM
from thermal.network.topology import UPWARD, Anatomy, OuterFaces, Outlook, Room


def _zero(drivers: Drivers) -> FloatArray:
    return np.zeros(len(drivers.stamps))


#: A temperature that stays at the reference; what differs from it acts as heat.
_STEADY = Signal("constant temperature", "K", _zero)


def _back(room: Room, slab: tuple[int, ...]) -> tuple[NDArray[np.int64], FloatArray]:
    """Back of one of a zone's slabs, or its air where it has none, with shares."""
    return (np.array([slab[-1]]), np.ones(1)) if slab else (room.air, room.share)


def _build_floors(join: Joining) -> None:
    value = join.parameter("interfloor_u_value")
    for (lower, upper), area in join.anatomy.stacked.items():
        below, above = join.anatomy.rooms[lower], join.anatomy.rooms[upper]
        near, far, share = paired(_back(below, below.ceiling), _back(above, above.floor))
        join.graph.face("interfloor_exchange", value, near, far, area * share)


def _build_roof(join: Joining) -> None:
    value = join.parameter("roof_u_value")
    for zone, area in join.anatomy.under_roof.items():
        room = join.anatomy.rooms[zone]
        node, share = _back(room, room.ceiling)
        join.graph.face("roof_exchange", value, node, join.graph.boundary("outdoor"), area * share)
        outlook = Outlook(0.0, UPWARD, RATED_OUTSIDE_FILM, glass=False)
        join.anatomy.outer.append(OuterFaces(value, node, area * share, outlook))


def _build_ground(join: Joining) -> None:
    value, ground = join.parameter("ground_u_value"), join.parameter("ground_temperature")

    def to_ground(key: str, conductance: ca.SX, parts: list[tuple[NDArray[np.int64], FloatArray]]) -> None:
        node, weight = (np.concatenate([p[k] for p in parts]) for k in (0, 1))
        join.graph.face(key, conductance, node, join.graph.signal(_STEADY), weight)
        join.graph.source(key, conductance * (ground - REFERENCE_TEMPERATURE), node, CONSTANT, weight)

    rooms = join.anatomy.rooms
    floors = [(*_back(rooms[zone], rooms[zone].floor), area) for zone, area in join.anatomy.on_ground.items()]
    if floors:
        to_ground(join.key("slabs"), value, [(node, area * share) for node, share, area in floors])
    for face in join.anatomy.ground_faces:
        # at no strength nothing flows; with it in series, nothing either
        in_series = value * face.value / (value + face.value)
        to_ground(join.key("layers"), in_series, [(np.array([face.node]), np.array([face.area]))])


def _party_sides(anatomy: Anatomy) -> set[float]:
    """Azimuths of the sides that may be party walls: those without windows, all where nothing tells of windows."""
    sides = {azimuth for _, azimuth in anatomy.facades}
    return sides - {pane.azimuth for pane in anatomy.panes} if anatomy.windows_told else sides


def _build_neighbour(join: Joining) -> None:
    other = join.parameter("neighbour_temperature")
    party = _party_sides(join.anatomy)
    for (zone, azimuth), area in join.anatomy.facades.items():
        if azimuth not in party:
            continue
        room, value = join.anatomy.rooms[zone], join.parameter("neighbour_u_value", facade=f"{azimuth:g} deg")
        join.air_to(room, value, join.graph.signal(_STEADY), area)
        join.heat_air(room, value * (other - REFERENCE_TEMPERATURE), CONSTANT, area)


def _build_mass(join: Joining) -> None:
    coupling = join.parameter("hidden_coupling")
    for room in join.rooms:
        node = join.graph.volumes("hidden_mass", room.number)
        mass = join.parameter("hidden_heat_capacity", zone=room.name)
        join.graph.capacity(f"hidden_mass {room.name}", mass, node, room.floor_area)
        if room.mean >= 0:  # at no capacity, a node that hangs on several volumes would mix these
            join.graph.face("hidden_mass", coupling, room.mean, node, room.floor_area)
        else:
            join.air_to(room, coupling, int(node[0]), room.floor_area)


def _no_party_side(anatomy: Anatomy) -> str | None:
    none = None if _party_sides(anatomy) else "every side has windows, so that none is a party wall"
    return without_facades(anatomy) or none


def _no_stack(anatomy: Anatomy) -> str | None:
    return None if anatomy.stacked else "no zone lies above another"


def _no_roof(anatomy: Anatomy) -> str | None:
    return None if anatomy.under_roof else "what lies above the zones is described by the case itself"


def _no_ground(anatomy: Anatomy) -> str | None:
    return None if anatomy.on_ground or anatomy.ground_faces else "no zone lies on the ground"


INTERFLOOR_EXCHANGE = Effect(
    id="interfloor_exchange",
    title="heat that flows between floors",
    equation="U A (T_other - T), between the backs of the slabs",
    source="ISO 6946:2017 (floor constructions)",
    acts_on="slabs of zones that lie on each other",
    confounders=("roof_exchange", "ground_exchange", "internal_gains"),
    separated_by="unequal set-backs of the floors",
    parameters=(strength("interfloor_u_value", "W/m^2/K", 3.0, "0.5 to 3: ISO 6946:2017", "interfloor_exchange"),),
    build=_build_floors,
    applies=_no_stack,
)

ROOF_EXCHANGE = Effect(
    id="roof_exchange",
    title="heat that flows through the roof",
    equation="U A (T_out - T), at the back of the slab",
    source="ISO 6946:2017; ASHRAE 90.1 (roofs)",
    acts_on="slabs of zones under the roof",
    confounders=("ground_exchange", "infiltration", "thermal_bridge"),
    separated_by="top floor against the others",
    parameters=(strength("roof_u_value", "W/m^2/K", 1.0, "0.1 to 1: ASHRAE 90.1-2019 tables 5.5", "roof_exchange"),),
    build=_build_roof,
    applies=_no_roof,
)

GROUND_EXCHANGE = Effect(
    id="ground_exchange",
    title="heat that flows to the ground",
    equation="U A (T_g - T), at the back of the slab",
    source="ISO 13370:2017",
    acts_on="slabs of zones on the ground",
    confounders=("internal_gains", "roof_exchange", "sensor_bias"),
    separated_by="two seasons; the lowest floor against the others",
    parameters=(
        strength("ground_u_value", "W/m^2/K", 1.0, "0.1 to 1: ISO 13370:2017", "ground_exchange"),
        shape("ground_temperature", "K", 287.15, 277.15, 297.15, "ISO 13370:2017 Annex H", "ground_exchange", "linear"),
    ),
    build=_build_ground,
    applies=_no_ground,
    level="ground_temperature",
)

NEIGHBOUR = Effect(
    id="neighbour",
    title="a heated neighbour behind a wall",
    equation="U A (T_n - T) on one facade",
    source="ISO 13789:2017 (adjacent buildings)",
    acts_on="air of the zones behind that facade",
    confounders=("internal_gains", "thermal_bridge"),
    separated_by="facades against each other; cold and mild days",
    parameters=(
        strength("neighbour_u_value", "W/m^2/K", 2.0, "party walls: ISO 6946:2017", "neighbour"),
        shape("neighbour_temperature", "K", 293.15, 278.15, 300.15, "unheated to warm", "neighbour", "linear"),
    ),
    build=_build_neighbour,
    applies=_no_party_side,
    level="neighbour_temperature",
)

HIDDEN_MASS = Effect(
    id="hidden_mass",
    title="mass that the model lacks",
    equation="C_m dT_m/dt = h A (T - T_m)",
    source="Johra and Heiselberg (2017), doi:10.1016/j.rser.2016.11.145",
    acts_on="a further node a zone",
    confounders=("flow_gain", "sensor_lag", "furniture_heat_capacity"),
    separated_by="steps and pseudo-random heat",
    parameters=(
        strength("hidden_heat_capacity", "J/m^2/K", 1e5, "10 to 100 kJ/m2/K: Johra, Heiselberg (2017)", "hidden_mass"),
        shape("hidden_coupling", "W/m^2/K", 3.5, 2.0, 6.0, "films of furniture", "hidden_mass"),
    ),
    build=_build_mass,
    zonal=True,
)
