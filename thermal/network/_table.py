"""From a zone table to control volumes and faces: one air volume a zone, each surface a chain of layers."""

from __future__ import annotations

from collections.abc import Mapping

import casadi as ca
import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from thermal.case import Building, Layer, Surface, ZoneTable
from thermal.network._films import series
from thermal.network._graph import GraphBuilder, ThermalNetwork
from thermal.network._interior import Zone
from thermal.network._materials import (
    BOUNDARY_FILM_RESISTANCE,
    LEAST_PANE_RESISTANCE,
    RATED_OUTSIDE_FILM,
    WINDOW_RATED_FILM,
)
from thermal.parameters import Scope
from thermal.units import AIR_HEAT_CAPACITY, air_density

#: Time that a sublayer must resolve [s]: its thickness is at most sqrt(diffusivity x this), a Fourier number of one.
SUBLAYER_TIME = 1800.0


def table_network(building: Building, table: ZoneTable, scopes: Mapping[str, Scope] | None = None) -> ThermalNetwork:
    """Build the network of a building given by a zone table.

    Parameters
    ----------
    building : Building
        For its location, zones, boundaries and airflows.
    table : ZoneTable
        Its geometry.
    scopes : mapping of str to {"global", "zone"}, optional
        Parameters with one value a zone.

    Returns
    -------
    ThermalNetwork
        Boundaries ``outdoor`` and the measured ones. Surfaces to ``ground`` are adiabatic at their back
        (``ground_exchange`` is an effect of the catalogue).
    """
    graph = GraphBuilder(building.zone_names, ("outdoor", *building.measured_boundaries), scopes or {})
    density = air_density(building.location.elevation)
    zones: dict[str, Zone] = {}
    for entry in table.zones:
        air = graph.volumes("air", graph.zones.index(entry.name))
        graph.capacity("air", density * AIR_HEAT_CAPACITY, air, entry.volume)
        zones[entry.name] = Zone(graph, entry.name, air, np.ones(1))
        zones[entry.name].furniture(entry.floor_area)
    for surface in table.surfaces:
        _add_surface(graph, zones, surface, table, density)
    number = np.arange(len(zones))
    node = np.concatenate([zones[z].air for z in graph.zones])
    heating = sp.csr_matrix((np.ones(len(zones)), (node, number)), shape=(graph.size, len(zones)))
    flows = tuple((graph.zones.index(a.source), graph.zones.index(a.target)) for a in building.airflows)
    return graph.finish(heating.T.tocsr(), heating, flows)


def _add_surface(
    graph: GraphBuilder, zones: Mapping[str, Zone], surface: Surface, table: ZoneTable, density: float
) -> None:
    """Add one row of the surface table."""
    zone, other = zones[surface.zone], surface.other
    if other == "ground" and surface.kind in ("bridge", "window"):
        return  # adiabatic in the baseline, and without mass nothing is left of them
    if surface.kind == "opening":
        velocity = graph.parameter("opening_exchange_velocity")
        graph.face("opening", velocity * density * AIR_HEAT_CAPACITY, zone.air, zones[other].air, surface.area)
    elif surface.kind == "bridge":
        far = zones[other].air[0] if other in zones else graph.boundary(other)
        graph.face("bridge", ca.SX(1.0), zone.air, far, surface.area * float(surface.u_value or 0.0))
    elif surface.kind == "window":
        _add_window(graph, zones, surface)
    else:
        layers = table.constructions[str(surface.construction)]
        _add_layers(graph, zones, surface, layers)


def _add_window(graph: GraphBuilder, zones: Mapping[str, Zone], surface: Surface) -> None:
    """Glass: rated air-to-air u-value with its films replaced by the building's own."""
    zone, rated = zones[surface.zone], float(surface.u_value or 0.0)
    multiplier = graph.parameter("window_conductance_multiplier")
    if surface.other in zones:
        far = zones[surface.other]
        graph.face(f"window u={rated:g} between zones", rated * multiplier, zone.air, far.air, surface.area)
        return
    pane = multiplier / max(1.0 / rated - 1.0 / WINDOW_RATED_FILM - 1.0 / RATED_OUTSIDE_FILM, LEAST_PANE_RESISTANCE)
    if surface.other == "outdoor":
        value = series(pane, graph.parameter("exterior_convection_coefficient"))
    else:
        value = series(pane, 1.0 / BOUNDARY_FILM_RESISTANCE)
    kind = f"window u={rated:g} {'outdoor' if surface.other == 'outdoor' else 'boundary'}"
    zone.surface(kind, value, graph.boundary(surface.other), surface.area)


def _group(surface: Surface) -> str:
    """Which multipliers a surface's layers share."""
    if surface.kind in ("floor", "ceiling"):
        return "slab"
    return "exterior_wall" if surface.other == "outdoor" else "interior_wall"


def _sublayers(layers: tuple[Layer, ...]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Resistances [m2K/W] and areal capacities [J/m2/K] of sublayers thin enough for `SUBLAYER_TIME`."""
    resistance, capacity = [], []
    for layer in layers:
        heat = layer.density * layer.heat_capacity
        depth = np.sqrt(layer.conductivity / heat * SUBLAYER_TIME)
        n = int(np.clip(np.ceil(layer.thickness / depth), 1, 12))
        resistance += [layer.thickness / n / layer.conductivity] * n
        capacity += [layer.thickness / n * heat] * n
    return np.array(resistance), np.array(capacity)


def _add_layers(graph: GraphBuilder, zones: Mapping[str, Zone], surface: Surface, layers: tuple[Layer, ...]) -> None:
    """Add a chain of sublayers from the zone to what lies behind, scaled by its group's multipliers."""
    group = _group(surface)
    scale = graph.parameter(f"{group}_conductivity_multiplier")
    heat = graph.parameter(f"{group}_heat_capacity_multiplier")
    resistance, capacity = _sublayers(layers)
    zone = zones[surface.zone]
    nodes = graph.volumes(group, np.full(resistance.size, zone.number))
    graph.capacity(group, heat, nodes, capacity * surface.area)
    between = 1.0 / (0.5 * (resistance[:-1] + resistance[1:]))
    graph.face(f"{group}-{group}", scale, nodes[:-1], nodes[1:], surface.area * between)
    _room_side(zone, group, scale, resistance[0], int(nodes[0]), surface.area)
    last, r = int(nodes[-1]), float(resistance[-1])
    if surface.other in zones:
        _room_side(zones[surface.other], group, scale, r, last, surface.area)
    elif surface.other == "outdoor":
        value = series(graph.parameter("exterior_convection_coefficient"), 2.0 * scale / r)
        graph.face(f"{group}-outdoor r={r:.6g}", value, last, graph.boundary("outdoor"), surface.area)
    elif surface.other != "ground":
        value = series(1.0 / BOUNDARY_FILM_RESISTANCE, 2.0 * scale / r)
        graph.face(f"{group}-boundary r={r:.6g}", value, last, graph.boundary(surface.other), surface.area)


def _room_side(zone: Zone, group: str, scale: ca.SX, resistance: float, node: int, area: float) -> None:
    """Surface of a chain's first or last sublayer towards a zone; faces of equal half resistance share a class."""
    zone.surface(f"{group} r={resistance:.6g}", 2.0 * scale / resistance, node, area)
