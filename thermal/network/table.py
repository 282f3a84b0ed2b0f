"""Control volumes and faces of a zone table."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from thermal._types import FloatArray, IntArray
from thermal.case.building import Layer, Surface, ZoneTable
from thermal.errors import ModelError
from thermal.network.emitters import layer_parameter, pipes_at, shared_at
from thermal.network.floor import Zone
from thermal.network.graph import GraphBuilder
from thermal.network.structure import (
    BOUNDARY_FILM_RESISTANCE,
    LEAST_PANE_RESISTANCE,
    RATED_OUTSIDE_FILM,
    WINDOW_RATED_FILM,
    series,
)
from thermal.network.topology import (
    DOWNWARD,
    UPWARD,
    VERTICAL,
    GroundFace,
    Heated,
    OuterFaces,
    Outlook,
    Pane,
    direction_of,
)

#: Time that a sublayer must resolve [s]: its thickness is at most sqrt(diffusivity x this), a Fourier number of one.
SUBLAYER_TIME = 1800.0


@dataclass(frozen=True)
class Chain:
    """Nodes between the two faces of a layered wall, per area of it.

    Parameters
    ----------
    near, far : float
        Resistance from the first face to the first node, and from the last node to the last face [m2K/W].
    between : ndarray, shape (n - 1,)
        Resistances from node to node [m2K/W].
    capacity : ndarray, shape (n,)
        Heat capacities of the nodes [J/m2/K].
    """

    near: float
    far: float
    between: FloatArray
    capacity: FloatArray

    @classmethod
    def of(cls, layers: tuple[Layer, ...], nodes: int | None = None) -> Chain:
        """Nodes of a construction, of the resistance and the heat capacity of its layers.

        Parameters
        ----------
        layers : tuple of Layer
            From one face to the other.
        nodes : int, optional
            Their number; by default each layer is cut into sublayers thin enough for `SUBLAYER_TIME`, 12 at most.
        """
        return _fine(layers) if nodes is None else _lumped(layers, nodes)


def _fine(layers: tuple[Layer, ...]) -> Chain:
    """Sublayers with a node in the middle of each."""
    resistances: list[float] = []
    capacity: list[float] = []
    for layer in layers:
        heat = layer.density * layer.heat_capacity
        depth = np.sqrt(layer.conductivity / heat * SUBLAYER_TIME)
        n = int(np.clip(np.ceil(layer.thickness / depth), 1, 12))
        resistances += [layer.thickness / n / layer.conductivity] * n
        capacity += [layer.thickness / n * heat] * n
    resistance = np.array(resistances)
    between = 0.5 * (resistance[:-1] + resistance[1:])
    return Chain(0.5 * float(resistance[0]), 0.5 * float(resistance[-1]), between, np.array(capacity))


def _lumped(layers: tuple[Layer, ...], nodes: int) -> Chain:
    """Parts that heat takes equally long to cross, each lumped where every steady state keeps the heat it holds.

    The time is ``x**2 / diffusivity``, so its root adds up over layers. In a steady state temperature is linear in the
    resistance from a face, so the node lies at the mean resistance of its part, weighted by heat capacity.
    """
    thickness, conductivity = (np.array([getattr(p, k) for p in layers]) for k in ("thickness", "conductivity"))
    heat = np.array([p.density * p.heat_capacity for p in layers])
    edges = np.concatenate([[0.0], np.cumsum(thickness * np.sqrt(heat / conductivity))])
    cuts = np.linspace(0.0, edges[-1], nodes + 1)
    points = np.union1d(edges, cuts)
    middle = 0.5 * (points[:-1] + points[1:])
    layer = np.clip(np.searchsorted(edges, middle, side="right") - 1, 0, len(layers) - 1)
    part = np.clip(np.searchsorted(cuts, middle, side="right") - 1, 0, nodes - 1)
    length = np.diff(points) / np.sqrt(heat / conductivity)[layer]
    resistance = length / conductivity[layer]
    place = np.cumsum(resistance) - 0.5 * resistance
    stored = length * heat[layer]
    capacity = np.bincount(part, stored, minlength=nodes).astype(float)
    at = np.bincount(part, stored * place, minlength=nodes) / capacity
    return Chain(float(at[0]), float(resistance.sum() - at[-1]), np.diff(at), capacity)


#: Horizontal surfaces to outdoor by kind.
_HORIZONTAL = {"ceiling": "roof", "floor": "floor"}


def add_table(graph: GraphBuilder, table: ZoneTable) -> IntArray:
    """Add the baseline of a building given by a zone table; boundaries are ``outdoor`` and the measured ones.

    Surfaces to ``ground`` are adiabatic at their back (``ground_exchange`` is an effect of the catalogue).

    Parameters
    ----------
    graph : GraphBuilder
        Empty but for the building's zones, boundaries and airflows.
    table : ZoneTable
        The building's geometry.

    Returns
    -------
    ndarray of int, shape (n_zone,)
        Air volume of each zone [-].
    """
    zones: dict[str, Zone] = {}
    for entry in table.zones:
        air = graph.volumes("air", graph.zones.index(entry.name))
        graph.air_capacity(entry.name, air, entry.volume)
        zones[entry.name] = Zone(graph, entry.name, air, np.ones(1))
        zones[entry.name].furniture(entry.floor_area)
    for surface in table.surfaces:
        _add_surface(graph, zones, surface, table)
    for entry in table.zones:
        zones[entry.name].lay_heated(entry.floor_area)
        zones[entry.name].room(entry.floor_area, entry.volume)
    return np.concatenate([zones[z].air for z in graph.zones])


def _add_surface(graph: GraphBuilder, zones: Mapping[str, Zone], surface: Surface, table: ZoneTable) -> None:
    """Add one row of the surface table."""
    zone, other = zones[surface.zone], surface.other
    if other == "ground" and surface.kind in ("bridge", "window"):
        return  # adiabatic in the baseline, and without mass nothing is left of them
    if surface.kind in ("wall", "window") and other == "outdoor":
        side = (zone.name, _azimuth(surface))
        graph.anatomy.facades[side] = graph.anatomy.facades.get(side, 0.0) + surface.area
    if surface.kind == "opening":
        exchange = graph.parameter("opening_exchange_velocity") * graph.anatomy.air_heat_capacity
        graph.face("opening", exchange, zone.air, zones[other].air, surface.area)
    elif surface.kind == "bridge":
        far = zones[other].air[0] if other in zones else graph.boundary(other)
        graph.face("bridge", ca.SX(1.0), zone.air, far, surface.area * float(surface.u_value or 0.0))
    elif surface.kind == "window":
        _add_window(graph, zones, surface)
    else:
        _add_layers(graph, zones, surface, table.constructions[str(surface.construction)])


def _group(surface: Surface) -> str:
    """Group of surfaces whose layers have multipliers in common."""
    upright = "exterior_wall" if surface.other == "outdoor" else "interior_wall"
    return "slab" if surface.kind in _HORIZONTAL else upright


def _facade(graph: GraphBuilder, surface: Surface) -> str | None:
    """Facade of a surface where that matters."""
    return facade_of(surface) if graph.has_facades else None


def _add_window(graph: GraphBuilder, zones: Mapping[str, Zone], surface: Surface) -> None:
    """Glass: rated air-to-air u-value with its films replaced by the building's own."""
    zone, rated, facade = zones[surface.zone], float(surface.u_value or 0.0), _facade(graph, surface)
    inner = surface.other in zones  # of neither
    multiplier = graph.parameter("window_conductance_multiplier", None if inner else zone.name, facade=facade)
    if inner:
        behind = zones[surface.other].air
        graph.face(f"window u={rated:g} between zones", rated * multiplier, zone.air, behind, surface.area)
        return
    pane = multiplier / max(1.0 / rated - 1.0 / WINDOW_RATED_FILM - 1.0 / RATED_OUTSIDE_FILM, LEAST_PANE_RESISTANCE)
    side, value, outlook = "boundary", series(pane, 1.0 / BOUNDARY_FILM_RESISTANCE), None
    if surface.other == "outdoor":
        film = graph.parameter("exterior_convection_coefficient", facade=facade)
        azimuth, sun = _azimuth(surface), surface.solar_transmittance
        side, value, outlook = "outdoor", series(pane, film), Outlook(azimuth, VERTICAL, film, glass=True)
        graph.anatomy.panes.append(Pane(zone.name, azimuth, VERTICAL, surface.area, sun))
    kind = f"window u={rated:g} {side}"
    depends = ("window_conductance_multiplier", "exterior_convection_coefficient")
    far = graph.boundary(surface.other)
    zone.surface(kind, value, far, surface.area, depends=depends, facade=facade, outlook=outlook)


def _azimuth(surface: Surface) -> float:
    """Where the outer face looks to, from 0 to 360 deg."""
    return float(surface.azimuth or 0.0) % 360.0


@dataclass(frozen=True)
class _Part:
    """Nodes of a chain whose properties have a multiplier each for conduction and for heat capacity."""

    zone: str | None
    name: str
    conductivity: str
    heat_capacity: str
    scale: ca.SX
    heat: ca.SX


def _parts(
    graph: GraphBuilder, surface: Surface, layers: tuple[Layer, ...], wall: Chain, nodes: IntArray
) -> tuple[_Part, _Part, NDArray[np.bool_]]:
    """Give the parts of a chain, that between a room and the pipes in it second, and which nodes belong to that.

    Where both sides are heated, the layers before the pipes of the surface's own zone are the second part.
    """
    group, facade = _group(surface), _facade(graph, surface)
    names = f"{group}_conductivity_multiplier", f"{group}_heat_capacity_multiplier"
    owner = surface.zone if group == "exterior_wall" else None  # what lies between rooms is of neither
    plain = _Part(owner, group, *names, *(graph.parameter(name, owner, facade=facade) for name in names))
    place = wall.near + np.concatenate([[0.0], np.cumsum(wall.between)])
    seen: list[tuple[str, str, tuple[Layer, ...], IntArray, FloatArray]]
    seen = [(surface.zone, surface.kind, layers, nodes, place)]
    if surface.other in graph.zones and surface.kind in _HORIZONTAL:
        back = "floor" if surface.kind == "ceiling" else "ceiling"
        behind = (wall.near + wall.far + float(np.sum(wall.between)) - place)[::-1]
        seen.append((surface.other, back, layers[::-1], nodes[::-1], behind))
    warm, before = plain, np.zeros(nodes.size, dtype=bool)
    for zone, side, own, chain, at in seen:
        if (zone, side) not in graph.anatomy.heated:
            continue
        pipes = pipes_at(own)
        graph.anatomy.heated[zone, side].append(Heated(*shared_at(pipes, chain, at), surface.area))
        if warm is plain:
            names = "screed_conductivity_multiplier", "screed_heat_capacity_multiplier"
            warm = _Part(zone, "screed", *names, *(layer_parameter(graph, name, zone) for name in names))
            before = np.isin(nodes, chain[at <= pipes * (1.0 + 1e-9)])
    return plain, warm, before


def _add_layers(graph: GraphBuilder, zones: Mapping[str, Zone], surface: Surface, layers: tuple[Layer, ...]) -> None:
    """Add a chain of nodes from the zone to what lies behind, scaled by its group's multipliers."""
    facade, wall = _facade(graph, surface), Chain.of(layers, graph.structure.wall_nodes)
    group = _group(surface)
    nodes = graph.volumes(group, np.full(wall.capacity.size, graph.zones.index(surface.zone)))
    plain, warm, heated = _parts(graph, surface, layers, wall, nodes)
    both = heated[:-1] & heated[1:]
    for part, own, joined in ((plain, ~heated, ~both), (warm, heated, both)):
        if own.any():
            key = graph.key(part.name, part.zone, part.heat_capacity, facade=facade)
            graph.capacity(key, part.heat, nodes[own], wall.capacity[own] * surface.area)
        if joined.any():
            key = graph.key(f"{part.name}-{part.name}", part.zone, part.conductivity, facade=facade)
            weight = surface.area * (1.0 / wall.between[joined])
            graph.face(key, part.scale, nodes[:-1][joined], nodes[1:][joined], weight)
        if part is warm:
            break

    def room_side(zone: Zone, resistance: float, end: int) -> None:  # equal resistances share a class
        part = warm if heated[end] else plain
        kind, node = f"{part.name} r={2.0 * resistance:.6g}", int(nodes[end])
        zone.surface(kind, part.scale / resistance, node, surface.area, depends=(part.conductivity,), facade=facade)

    room_side(zones[surface.zone], wall.near, 0)
    if surface.other in zones:
        room_side(zones[surface.other], wall.far, -1)
        if surface.kind == "wall" and surface.other != surface.zone:
            pair = (min(surface.zone, surface.other), max(surface.zone, surface.other))
            graph.anatomy.partitions[pair] = graph.anatomy.partitions.get(pair, 0.0) + surface.area
    elif surface.other == "ground":
        face = GroundFace(surface.zone, int(nodes[-1]), surface.area, plain.scale / wall.far)
        graph.anatomy.ground_faces.append(face)
    else:
        _outer_side(graph, surface, plain, wall.far, nodes[-1:])


def _outer_side(graph: GraphBuilder, surface: Surface, part: _Part, resistance: float, node: IntArray) -> None:
    """Join the last node of a chain to outdoor, or to a measured space."""
    facade = _facade(graph, surface)
    place, film = "boundary", ca.SX(1.0 / BOUNDARY_FILM_RESISTANCE)
    if surface.other == "outdoor":
        place, film = "outdoor", graph.parameter("exterior_convection_coefficient", facade=facade)
    depends = (part.conductivity, "exterior_convection_coefficient")
    key = graph.key(f"{part.name}-{place} r={2.0 * resistance:.6g}", part.zone, *depends, facade=facade)
    value = series(film, part.scale / resistance)
    graph.face(key, value, int(node[0]), graph.boundary(surface.other), surface.area)
    if surface.other == "outdoor":
        tilt = {"wall": VERTICAL, "ceiling": UPWARD, "floor": DOWNWARD}[surface.kind]
        outlook = Outlook(_azimuth(surface), tilt, film, glass=False)
        graph.anatomy.outer.append(OuterFaces(value, node, np.array([float(surface.area)]), outlook))


def facade_of(surface: Surface) -> str | None:
    """Facade of a surface of a zone table: its direction, ``roof`` or ``floor``; None when it does not face outdoor.

    Parameters
    ----------
    surface : Surface
        Of azimuth α; the facade is that whose own azimuth is nearest, the next one clockwise half way between two.

    Raises
    ------
    ModelError
        When it is a wall or a window to outdoor without azimuth.
    """
    if surface.other != "outdoor":
        return None
    if surface.kind in _HORIZONTAL:
        return _HORIZONTAL[surface.kind]
    if surface.azimuth is None:
        expected = "an azimuth [deg], since a parameter has one value a facade"
        raise ModelError(f"surface {surface.name}", expected, "none")
    return direction_of(surface.azimuth)
