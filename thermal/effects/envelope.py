"""Heat through what bounds zones: other floors, ground, roof, neighbour; sky and wind on the outside; hidden mass."""

from operator import attrgetter

import casadi as ca
import numpy as np
import pandas as pd
from numpy.typing import NDArray

from thermal._types import FloatArray
from thermal.effects.effect import EffectBuilder, described, lacking, without_facades
from thermal.effects.weights import paired
from thermal.inputs.provider import InputProvider
from thermal.inputs.signals import CONSTANT, STEADY, Signal
from thermal.network.structure import RATED_OUTSIDE_FILM
from thermal.network.topology import UPWARD, Anatomy, OuterFaces, Outlook, Room
from thermal.units import REFERENCE_TEMPERATURE


def _back(room: Room, slab: tuple[int, ...]) -> tuple[NDArray[np.int64], FloatArray]:
    """Back of one of a zone's slabs, or its air where it has none, with shares."""
    return (np.array([slab[-1]]), np.ones(1)) if slab else (room.air, room.share)


def _build_floors(builder: EffectBuilder) -> None:
    value = builder.parameter("interfloor_u_value")
    for (lower, upper), area in builder.anatomy.stacked.items():
        below, above = builder.anatomy.rooms[lower], builder.anatomy.rooms[upper]
        near, far, share = paired(_back(below, below.ceiling), _back(above, above.floor))
        builder.graph.face("interfloor_exchange", value, near, far, area * share)


def _build_roof(builder: EffectBuilder) -> None:
    value = builder.parameter("roof_u_value")
    for zone, area in builder.anatomy.under_roof.items():
        room = builder.anatomy.rooms[zone]
        node, share = _back(room, room.ceiling)
        builder.graph.face("roof_exchange", value, node, builder.graph.boundary("outdoor"), area * share)
        outlook = Outlook(0.0, UPWARD, RATED_OUTSIDE_FILM, glass=False)
        builder.anatomy.outer.append(OuterFaces(value, node, area * share, outlook))


def _build_ground(builder: EffectBuilder) -> None:
    value, ground = builder.parameter("ground_u_value"), builder.parameter("ground_temperature")

    def to_ground(key: str, conductance: ca.SX, parts: list[tuple[NDArray[np.int64], FloatArray]]) -> None:
        node, weight = (np.concatenate([p[k] for p in parts]) for k in (0, 1))
        builder.graph.face(key, conductance, node, builder.graph.signal(STEADY), weight)
        builder.graph.source(key, conductance * (ground - REFERENCE_TEMPERATURE), node, CONSTANT, weight)

    rooms = builder.anatomy.rooms
    floors = [(*_back(rooms[zone], rooms[zone].floor), area) for zone, area in builder.anatomy.on_ground.items()]
    if floors:
        to_ground(builder.key("slabs"), value, [(node, area * share) for node, share, area in floors])
    for face in builder.anatomy.ground_faces:
        # at no strength nothing flows; with it in series, nothing either
        in_series = value * face.value / (value + face.value)
        to_ground(builder.key("layers"), in_series, [(np.array([face.node]), np.array([face.area]))])


def _party_sides(anatomy: Anatomy) -> set[float]:
    """Azimuths of the sides that may be party walls: those without windows, all where nothing tells of windows."""
    sides = {azimuth for _, azimuth in anatomy.facades}
    return sides - {pane.azimuth for pane in anatomy.panes} if anatomy.windows_told else sides


def _build_neighbour(builder: EffectBuilder) -> None:
    other = builder.parameter("neighbour_temperature")
    party = _party_sides(builder.anatomy)
    for (zone, azimuth), area in builder.anatomy.facades.items():
        if azimuth not in party:
            continue
        room, value = builder.anatomy.rooms[zone], builder.parameter("neighbour_u_value", facade=f"{azimuth:g} deg")
        builder.air_to(room, value, builder.graph.signal(STEADY), area)
        builder.heat_air(room, value * (other - REFERENCE_TEMPERATURE), CONSTANT, area)


def _build_mass(builder: EffectBuilder) -> None:
    coupling = builder.parameter("hidden_coupling")
    for room in builder.rooms:
        node = builder.graph.volumes("hidden_mass", room.number)
        mass = builder.parameter("hidden_heat_capacity", zone=room.name)
        builder.graph.capacity(f"hidden_mass {room.name}", mass, node, room.floor_area)
        if room.mean >= 0:  # at no capacity, a node that hangs on several volumes would mix these
            builder.graph.face("hidden_mass", coupling, room.mean, node, room.floor_area)
        else:
            builder.air_to(room, coupling, int(node[0]), room.floor_area)


def _wind(inputs: InputProvider, zone: str | None) -> FloatArray:
    inside = inputs.usual.mean(axis=1) if zone is None else inputs.usual[:, inputs.zones.index(zone)]
    return np.asarray((inputs.wind - (inputs.normalisation.wind or 0.0)) * (inputs.outdoor - inside))


def _build_sky(builder: EffectBuilder) -> None:
    emitted = builder.parameter("sky_exchange_factor")
    signal = Signal("sky deficit", "W/m^2", attrgetter("sky"), ("sky",))
    for faces in builder.anatomy.outer:
        view = (1.0 + np.cos(np.radians(faces.outlook.tilt))) / 2.0
        if view > 1e-9:
            value = emitted * faces.value / faces.outlook.film
            builder.graph.source(builder.key(), value, faces.node, signal, view * faces.area)


def _build_film(builder: EffectBuilder) -> None:
    slope = builder.parameter("wind_film_slope")
    for faces in builder.anatomy.outer:
        name = f"wind on films of {faces.zone or 'walls'}"
        signal = Signal.made(name, "K*m/s", _wind, "wind", "outdoor", "usual", given={"zone": faces.zone})
        value = slope * (faces.value / faces.outlook.film) ** 2
        builder.graph.source(builder.key(), value, faces.node, signal, faces.area)


def _swing(inputs: InputProvider) -> FloatArray:
    """Outdoor temperature about its mean over the day around each step [K]."""
    day = max(1, round(86400.0 / inputs.step))
    outdoor = pd.Series(inputs.outdoor)
    return np.asarray(outdoor - outdoor.rolling(day, center=True, min_periods=1).mean())


def _build_station(builder: EffectBuilder) -> None:
    offset, swing = builder.parameter("station_offset"), builder.parameter("station_swing")
    daily = Signal("outdoor temperature about its day's mean", "K", _swing, ("outdoor",))
    for value, _, node, weight in builder.graph.touching(np.array([builder.graph.boundary("outdoor")])):
        builder.graph.source(builder.key(), -offset * value, node, CONSTANT, weight)
        builder.graph.source(builder.key(), -swing * value, node, daily, weight)


def _no_party_side(anatomy: Anatomy) -> str | None:
    none = None if _party_sides(anatomy) else "every side has windows, so that none is a party wall"
    return without_facades(anatomy) or none


def _no_ground(anatomy: Anatomy) -> str | None:
    return None if anatomy.on_ground or anatomy.ground_faces else "no zone lies on the ground"


INTERFLOOR_EXCHANGE = described("interfloor_exchange", _build_floors, lacking("stacked", "no zone lies above another"))
_no_roof = lacking("under_roof", "what lies above the zones is described by the case itself")
ROOF_EXCHANGE = described("roof_exchange", _build_roof, _no_roof)
GROUND_EXCHANGE = described("ground_exchange", _build_ground, _no_ground)
NEIGHBOUR = described("neighbour", _build_neighbour, _no_party_side)
HIDDEN_MASS = described("hidden_mass", _build_mass)
_no_faces = lacking("outer", "the building has no surfaces to outdoor")
LONGWAVE_SKY = described("longwave_sky", _build_sky, _no_faces)
WIND_FILM = described("wind_film", _build_film, _no_faces)
WRONG_STATION = described("wrong_station", _build_station, _no_faces)
